"""What laboratory tests measure, each defined once."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from grainlaw.arguments import checked
from grainlaw.columns import IMBALANCE, KINETIC, STABILITY, STAGE, STORED, STRAIN, STRESS, VIBRATION, energy, require
from grainlaw.conditions import Curves
from grainlaw.engine.state import State
from grainlaw.gauges import ends, has_platens
from grainlaw.once import once_each
from grainlaw.specimen import Specimen
from grainlaw.strength import Borne, borne, strength_of
from grainlaw.window import within_rectangle

CERTIFIED = (VIBRATION, IMBALANCE, STABILITY)  #: columns that the certificate reads, beside energies
FEWEST = 3  #: samples of a rising load by which a certificate can be judged


def vibration_share(curves: Curves, chosen: Any) -> float:
    """Largest ratio of vibration to stored and kinetic energy in the chosen samples.

    Only where their sum is more than a hundredth of its largest: the kinetic energy counts where grains are free to
    expand and nothing else is stored.
    """
    whole, vibration = energy(curves, KINETIC, *STORED)[chosen], curves[VIBRATION][chosen]
    counts = whole >= 0.01 * whole.max()
    return float(np.max(vibration[counts] / np.maximum(whole[counts], 1e-300)))


def size(specimen: Specimen) -> tuple[float, float]:
    """Width and height (m) of the region."""
    low, high = specimen.grains.region.bounds
    return float(high[0] - low[0]), float(high[1] - low[1])


@once_each
def is_rock(specimen: Specimen) -> np.ndarray:
    """(g,) whether a grain is of the specimen; platens are the bodies with the boundaries top and bottom."""
    grains, mesh = specimen.grains, specimen.mesh
    if not has_platens(specimen):
        return np.ones(grains.count, dtype=bool)
    driven = np.concatenate([mesh.boundaries["top"], mesh.boundaries["bottom"]])
    return ~np.isin(grains.body, grains.body[mesh.node_grain[driven]])


def end_share(specimen: Specimen) -> float:
    """Width of the specimen over the length of the boundary top, through which platens load it; 1 without platens."""
    return size(specimen)[0] / specimen.mesh.boundary_lengths["top"] if has_platens(specimen) else 1.0


def axial_strain(state: State) -> float:
    """Change of height over height from the ends of the specimen, averaged over the same steps as the reactions.

    It does not include the deformation of platens, nor of the contacts with them.
    """
    top, bottom = (state.moved(end)[1] for end in ends(state.specimen))
    return float(top - bottom) / size(state.specimen)[1]


def window_stress(state: State) -> np.ndarray:
    """(3,) Pa, xx, yy, xy: area mean over the grains whose centroid lies in the middle half of both sides.

    If there is none, the mean over all grains of the specimen.
    """
    chosen = _middle(state.specimen)
    return np.average(state.grain_stress()[chosen], axis=0, weights=state.specimen.grains.areas[chosen])


@once_each
def _middle(specimen: Specimen) -> np.ndarray:
    """(g,) whether the centroid of a grain lies in the middle half of both sides; if none does, those of rock."""
    low, high = specimen.grains.region.bounds
    middle, half = (low + high) / 2, (high - low) / 4
    inside = within_rectangle(middle - half, middle + half)(specimen.grains.centroids)
    return inside if inside.any() else is_rock(specimen)


def failure_of(curves: Curves, load: str = STRESS, deformation: str = STRAIN) -> Borne | None:
    """The first failure by two columns, see :func:`grainlaw.strength.borne`; None where there is no load."""
    return borne(curves[load], curves[deformation], curves[STAGE])


@checked
def failure_summary(
    curves: Curves, load: str, deformation: str, at_failure: Mapping[str, str], *, stage: int | None = None, **more: Any
) -> dict[str, Any]:
    """Strength by the column ``load`` (Pa), columns at the failure by their names there, largest stress, certificate.

    For the ``summary`` of a test: ``failure_summary(curves, "stress", "strain", {"failure_strain": "strain"})``.
    Of the whole run, or of the ``stage`` with this number, from 0, as it stands in the curves. ``more`` stands before
    the certificate, which knows an imbalance only in stages with a ``loading``. The strength is
    nan where nothing has failed (docs/strength.md). Raises :class:`ParameterError` for columns that are not there.
    """
    require("failure_summary", curves, load, deformation, *at_failure.values(), STAGE, *CERTIFIED)
    if stage is not None:
        curves = {name: column[curves[STAGE] == stage] for name, column in curves.items()}
    found = failure_of(curves, load, deformation)
    strength, largest = strength_of(found, curves[load])
    return {
        "strength": strength,
        **{name: strength_of(found, curves[column])[0] for name, column in at_failure.items()},
        "largest_stress": largest,
        **more,
        **certificate(curves, found, load),
    }


def certificate(curves: Curves, found: Borne | None, load: str = STRESS) -> dict[str, float]:
    """How quasi-static a test was, from a tenth of the load in the column ``load`` at its first failure up to it.

    ``kinetic_ratio``: largest ratio of the kinetic energy of vibration to the energy in zones and contacts.
    ``imbalance``: largest sum of the forces on the specimen, mean over a period of its steady motion, over the load.
    ``unstable_rise``: by how much of it the load has grown while the specimen was unstable. nan without a load, and
    where fewer than ``FEWEST`` samples show how it rose.
    """
    loads, at = curves[load], 0 if found is None else found.at
    first = int(np.argmax(loads >= 0.1 * loads[at])) if found is not None else 0
    if at - first < FEWEST:
        return dict.fromkeys(("kinetic_ratio", "imbalance", "unstable_rise"), math.nan)
    rise = np.arange(first, at)  # at the end of the sample of the failure it has begun
    kinetic, stored = curves[VIBRATION][rise], energy(curves, *STORED)[rise]
    grown = np.diff(np.maximum.accumulate(loads[: at + 1]))
    unstable = curves[STABILITY][: at + 1] < 0  # not where it is not known
    with np.errstate(over="ignore"):  # before anything is stored
        ratio = float(np.max(kinetic / np.maximum(stored, 1e-300)))
    return {
        "kinetic_ratio": ratio,
        "imbalance": float(np.max(curves[IMBALANCE][rise])),
        "unstable_rise": float(grown[unstable[1:] & unstable[:-1]].sum() / loads[at]),
    }
