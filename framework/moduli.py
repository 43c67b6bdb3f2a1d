"""Elastic constants and work, from curves of load and displacement or stress and strain."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from grainlaw.columns import LATERAL_STRAIN, STAGE, STRAIN, STRESS
from grainlaw.material import Material, Plane
from grainlaw.specimen import Specimen
from grainlaw.strength import FALL, borne, noise_of, stage_begins

LOW, HIGH = 0.2, 0.5  #: of the strength: between them moduli are found


def slope(x: np.ndarray, y: np.ndarray) -> float:
    """Slope of the regression of y on x; nan for fewer than two points or where x does not change."""
    return float(np.polyfit(x, y, 1)[0]) if len(x) > 1 and np.ptp(x) > 0 else float("nan")


def work(load: np.ndarray, displacement: np.ndarray) -> float:
    """Work of a load on its displacement, by the trapezoidal rule; of a stress on its strain, it is in J/m3."""
    return float(np.sum((load[1:] + load[:-1]) / 2 * np.diff(displacement)))


def on_path(load: np.ndarray, strain: np.ndarray, stage: np.ndarray, peak: int) -> tuple[int, np.ndarray]:
    """The first sample of the stage that leads to the peak, and the samples of the path from there to it.

    They have a higher load than all before them from that sample on, and are not of a stage that unloads.
    """
    first = int(np.argmax(stage == stage[np.argmax(load >= 0.5 * load[peak])]))
    highest = np.maximum.accumulate(load[first : peak + 1])
    unloads = _unloads(load[first:], strain[first:], stage[first:])
    return first, first + np.flatnonzero(np.r_[True, highest[1:] > highest[:-1]] & ~unloads[: len(highest)])


def _unloads(load: np.ndarray, strain: np.ndarray, stage: np.ndarray) -> np.ndarray:
    """(t,) whether a sample is of a stage in which the load has not grown, and falls with the strain."""
    way, found = np.abs(strain - strain[0]), []
    for part in np.split(np.arange(len(stage)), stage_begins(stage)):
        top = part[np.argmax(load[part])]
        falls = load[part[0]] > (1 - FALL) * load[top] and way[part[-1]] < way[top]
        found.append(np.full(len(part), falls))
    return np.concatenate(found)


def in_plane_strain(specimen: Specimen | None) -> bool:
    """Whether its grains are; a measured curve has no specimen of ours."""
    if specimen is None:
        return False
    rock = specimen.material_of(int(specimen.grains.phase[0]))
    return not isinstance(rock, Material) or rock.plane is Plane.STRAIN


def converted(young: float, poisson: float, specimen: Specimen | None) -> tuple[float, float]:
    """E and nu of the material from E* and nu* of its plane problem: nu = nu*/(1 + nu*), E = E* (1 - nu^2).

    Equal to E* and nu* where the material is in plane stress, and of a measured curve, which has no specimen of ours.
    """
    if not in_plane_strain(specimen):
        return young, poisson
    true = poisson / (1 + poisson)
    return young * (1 - true**2), true


def elastic_moduli(
    curves: Mapping[str, np.ndarray], specimen: Specimen | None, sign: float, load: str = STRESS, axial: str = STRAIN
) -> dict[str, float]:
    """Moduli by regression between 20 and 50 % of the strength in the column ``load`` (Pa), on the path to it.

    Over the strain in the column ``axial``. ``sign`` is 1 where strains count tension positive, -1 where they count
    compression. ``apparent_modulus`` (Pa) and ``apparent_poisson`` are those of the plane problem; ``modulus`` and
    ``poisson`` are converted from plane strain, nu = nu*/(1 + nu*), E = E* (1 - nu^2), or equal to them in plane
    stress and without a specimen.
    """
    stress, found = curves[load], borne(curves[load], curves[STRAIN], curves[STAGE], noise_of(curves))
    chosen = np.array([], dtype=int)
    if found is not None:
        _, path = on_path(stress, curves[STRAIN], curves[STAGE], found.at)
        share = stress[path] / stress[found.at]
        chosen = path[(share >= LOW) & (share <= HIGH)]
    if len(chosen) < 2:
        return dict.fromkeys(("apparent_modulus", "apparent_poisson", "modulus", "poisson"), float("nan"))
    strain = curves[axial][chosen]
    young = slope(strain, stress[chosen])
    poisson = -slope(strain, curves[LATERAL_STRAIN][chosen]) * sign
    modulus, true = converted(young, poisson, specimen)
    return {"apparent_modulus": young, "apparent_poisson": poisson, "modulus": modulus, "poisson": true}
