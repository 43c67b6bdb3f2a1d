"""Bending: of a beam between three points, and of a notched half disc, for the toughness of rock."""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Sequence
from typing import Any

import attrs
import numpy as np

from grainlaw.columns import Panel
from grainlaw.conditions import Curves, Reaches
from grainlaw.engine.state import State
from grainlaw.fields import parameter, part, whole_number
from grainlaw.integration import CentralDifference, Integrator
from grainlaw.loading import Adaptive, HeatingRate, Loading
from grainlaw.loads import Drive
from grainlaw.mesh import Mesh
from grainlaw.messages import users_line
from grainlaw.moduli import work
from grainlaw.protocols.between_platens import UntilFailure, refuse_platens
from grainlaw.protocols.measures import certificate, failure_of, size
from grainlaw.quantity import Quantity
from grainlaw.specimen import Specimen
from grainlaw.stage import Stage
from grainlaw.strength import Until, strength_of

FINE = 20_000  #: samples of the whole way where contacts are damaged: a beam fails long before it has parted
DEPTHS, SPANS = (0.4, 0.6), (0.5, 0.8)  #: of the published shape factor of a half disc
SUPPORTS = ("support_left", "support_right")
QUANTITIES = (
    Quantity("deflection", "µm", meaning="of the load against the supports", counts=True),
    Quantity("mouth", "µm", words="mouth opening", meaning="of the notch", counts=True),
    Quantity("force_top", "kN/m", meaning="of the load"),
    Quantity("force_bottom", "kN/m", meaning="of both supports"),
    Quantity("failure_force", "kN/m"),
    Quantity("failure_deflection", "µm"),
    Quantity("flexural_strength", "MPa", form=".2f", is_main=True),
    Quantity("largest_force", "kN/m"),
    Quantity("largest_flexural_strength", "MPa", form=".2f"),
    Quantity("largest_toughness", "MPa √m", form=".3f", factor=1e-6),
    Quantity("work_of_fracture", "J/m2", is_main=True),
)


@attrs.frozen(kw_only=True)
class _Bending(UntilFailure):
    """A load that moves down between two supports, all on rollers, to a deflection or until the force has fallen."""

    loading: Loading = part(Loading, Adaptive(), without=HeatingRate)  #: how fast the load moves
    maximum_deflection: float = parameter("m", default=2e-4)  #: the test ends there if the load has not fallen
    until: Until = part(Until, Until.FALL)  #: whether the test ends at the first failure
    stop_fraction: float = parameter("1", default=0.05, at_least=0, below=1)  #: of the peak load
    samples: int = whole_number(default=1000, at_least=10)  #: wanted until the test ends at its limit
    integrator: Integrator = part(Integrator, CentralDifference())  #: the time integration, with its damping

    quantities = QUANTITIES
    panels = (Panel("deflection", ["force"]), Panel("mouth", ["force"]))

    def stages(self, specimen: Specimen) -> Sequence[Stage]:
        name = type(self).__name__
        specimen.mesh.require_boundaries(name, "load", *SUPPORTS)
        refuse_platens(specimen, name, "it is loaded at its own boundaries load and support, without platens")
        fallen = self.failing("force", "deflection", after_break=True)
        return [
            Stage(
                name="bend",
                loads=[
                    Drive(boundary="load", axis=1, speed=-1.0, roller=True),
                    Drive(boundary="load", axis=0, speed=0.0, roller=True),
                    *(Drive(boundary=support, axis=1, speed=0.0, roller=True) for support in SUPPORTS),
                ],
                until=[Reaches("deflection", self.maximum_deflection), *fallen],
                **self.sampling(self.maximum_deflection, finest=FINE),
            )
        ]

    def measure(self, state: State) -> dict[str, float]:
        """``deflection`` of the load against the supports, ``mouth`` opening of the notch (m), and forces (N/m).

        ``force_top`` is the load, ``force_bottom`` the reaction of both supports, ``force`` the mean of the two. There
        is no column ``stress``: a force over its small bearing face is not the stress in the beam.
        """
        moved = state.mean_displacement
        load, *supports = (float(moved[state.mesh.middle(name), 1].mean()) for name in ("load", *SUPPORTS))
        top = -float(state.reaction("load")[1])
        bottom = sum(float(state.reaction(support)[1]) for support in SUPPORTS)
        row = {
            "deflection": sum(supports) / 2 - load,
            "force": (top + bottom) / 2,
            "force_top": top,
            "force_bottom": bottom,
        }
        if "notch" in state.mesh.boundaries:
            row["mouth"] = mouth_opening(state.mesh, moved)
        return row

    def _summary(
        self, curves: Curves, specimen: Specimen, name: str, strength: Callable[[float, Specimen], float]
    ) -> dict[str, Any]:
        """Load (N/m) at the first failure, its deflection, the strength computed from it under ``name``, and the rest.

        The rest is the largest load and what would be computed from it, the work of fracture and the certificate.
        """
        found = failure_of(curves, "force", "deflection")
        force, largest = strength_of(found, curves["force"])
        return {
            "failure_force": force,
            "failure_deflection": strength_of(found, curves["deflection"])[0],
            name: strength(force, specimen),
            "largest_force": largest,
            f"largest_{name}": strength(largest, specimen),
            "work_of_fracture": work_of_fracture(curves, specimen),
            **certificate(curves, found, "force"),
        }


@attrs.frozen(kw_only=True)
class ThreePointBending(_Bending):
    """Bend a beam, notched or not, until it has parted (see :func:`~grainlaw.geometry.notched_beam`).

    The specimen needs the boundaries load, support_left and support_right; the load does not move sideways. Gives the
    flexural strength of the ligament, 3 P S/(2 h^2), its fracture energy by the work of fracture, and of a notched beam
    the toughness from the peak load.
    """

    def summary(self, curves: Curves, specimen: Specimen) -> dict[str, Any]:
        """Peak load (N/m), deflection there, flexural strength (Pa), work of fracture (J/m2), certificate.

        With a notch also the toughness K_IC (Pa sqrt(m)).
        """
        found = self._summary(curves, specimen, "flexural_strength", flexural_strength)
        if "notch" not in specimen.mesh.boundaries:
            return found
        loads = {"toughness": found["failure_force"], "largest_toughness": found["largest_force"]}
        return {**found, **{name: beam_toughness(load, specimen) for name, load in loads.items()}}


def beam_toughness(force: float, specimen: Specimen) -> float:
    """K_IC (Pa sqrt(m)) of a notched beam, s sqrt(h) Y, from the peak load P (N/m); s = 3 P S/(2 h^2), h its height."""
    height, far = size(specimen)[1], span(specimen)
    shape = beam_shape_factor(notch_depth(specimen) / height, far / height)
    return 1.5 * force * far / height**2 * math.sqrt(height) * shape


def beam_shape_factor(depth: float, span: float) -> float:
    """Y = K/(s sqrt(h)), from the depth of the notch and the span, both over the height h.

    That of a span of 4 (Srawley 1976, Int. J. Fracture 12, 475; ASTM E399) and of pure bending (Tada, Paris and Irwin
    2000), each to 0.5 % at any depth, and between them by the inverse of the span (Guinea and others 1998, Int. J.
    Fracture 89, 103).
    """
    left, angle = 1 - depth, math.pi * depth / 2
    inner = 1.99 - depth * left * (2.15 - 3.93 * depth + 2.7 * depth**2)
    four = math.sqrt(depth) * inner / ((1 + 2 * depth) * left**1.5)
    rounded = math.sqrt(math.tan(angle) / angle) * (0.923 + 0.199 * (1 - math.sin(angle)) ** 4) / math.cos(angle)
    pure = math.sqrt(math.pi * depth) * rounded
    return pure + 4 / span * (four - pure)


def flexural_strength(force: float, specimen: Specimen) -> float:
    """Pa, 3 P S/(2 h^2): stress in an elastic beam of the height of the ligament, under the load P (N/m)."""
    return 1.5 * force * span(specimen) / ligament(specimen) ** 2


@attrs.frozen(kw_only=True)
class SemiCircularBend(_Bending):
    """Bend a notched half disc until it has parted (see :func:`~grainlaw.geometry.semi_disc`).

    The ISRM suggested method of Kuruppu, Obara, Ayatollahi, Chong and Funatsu 2014, doi:10.1007/s00603-013-0422-7:
    toughness from the peak load, fracture energy from the work of fracture. The specimen needs the boundaries load,
    support_left, support_right and notch.
    """

    def stages(self, specimen: Specimen) -> Sequence[Stage]:
        found = super().stages(specimen)
        specimen.mesh.require_boundaries(type(self).__name__, "notch")
        depth, width = _notch_share(specimen), _span_share(specimen)
        if not (DEPTHS[0] <= round(depth, 3) <= DEPTHS[1] and SPANS[0] <= round(width, 3) <= SPANS[1]):
            words = (
                f"SemiCircularBend: the formula of the toughness is fitted to notches of {DEPTHS[0]} to {DEPTHS[1]} of "
                f"the radius and spans of {SPANS[0]} to {SPANS[1]} of the diameter, here {depth:.3g} and {width:.3g}: "
                "take gl.stress_intensity for it"
            )
            warnings.warn(words, stacklevel=users_line())
        return found

    def summary(self, curves: Curves, specimen: Specimen) -> dict[str, Any]:
        """Peak load (N/m), deflection there, toughness K_IC (Pa sqrt(m)), work of fracture (J/m2), certificate."""
        return self._summary(curves, specimen, "toughness", toughness)


def toughness(force: float, specimen: Specimen) -> float:
    """K_IC (Pa sqrt(m)), Y' P sqrt(pi a)/(2 R), of the peak load P (N/m)."""
    shape = shape_factor(_notch_share(specimen), _span_share(specimen))
    return shape * force * math.sqrt(math.pi * notch_depth(specimen)) / size(specimen)[0]


def _notch_share(specimen: Specimen) -> float:
    return 2 * notch_depth(specimen) / size(specimen)[0]  # of the radius


def _span_share(specimen: Specimen) -> float:
    return span(specimen) / size(specimen)[0]  # of the diameter


def shape_factor(depth: float, span: float) -> float:
    """Y' in plane strain, from the depth of the notch over the radius and the span over the diameter.

    Kuruppu and others 2014; fitted for ``DEPTHS`` and ``SPANS``.
    """
    linear = (-0.47 - 16.457 * span) * depth
    return -1.297 + 9.516 * span + linear + (1.071 + 34.401 * span) * depth**2


def mouth_opening(mesh: Mesh, displacement: np.ndarray) -> float:
    """m, change of the distance between the two lowest corners of the notch; ``displacement`` is (i, 2) m."""
    nodes = mesh.boundaries["notch"]
    place = mesh.nodes[nodes]
    lowest = np.flatnonzero(place[:, 1] <= place[:, 1].min() + 1e-9 * np.ptp(place[:, 1]))
    left, right = lowest[np.argmin(place[lowest, 0])], lowest[np.argmax(place[lowest, 0])]
    return float(displacement[nodes[right], 0] - displacement[nodes[left], 0])


def ligament(specimen: Specimen) -> float:
    """Height (m) above the notch, or of the whole specimen if it has none."""
    if "notch" not in specimen.mesh.boundaries:
        return size(specimen)[1]
    top = specimen.grains.region.bounds[1][1]
    return float(top - specimen.mesh.nodes[specimen.mesh.boundaries["notch"], 1].max())


def notch_depth(specimen: Specimen) -> float:
    """m; 0 without a notch."""
    return size(specimen)[1] - ligament(specimen)


def span(specimen: Specimen) -> float:
    """Distance (m) of the middles of the supports."""
    left, right = (specimen.mesh.nodes[specimen.mesh.boundaries[support], 0] for support in SUPPORTS)
    return float((right.min() + right.max()) / 2 - (left.min() + left.max()) / 2)


def work_of_fracture(curves: Curves, specimen: Specimen) -> float:
    """J/m2: work of the load over the ligament, without weight (RILEM TC 50-FMC 1985, doi:10.1007/BF02472918).

    It is the fracture energy only if the specimen has parted, for it includes the energy still stored at the end.
    """
    return work(curves["force"], curves["deflection"]) / ligament(specimen)
