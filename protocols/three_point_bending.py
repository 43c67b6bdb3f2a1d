"""Bending of a beam between three points."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import attrs

from grainlaw.condition import Curves
from grainlaw.engine.state import State
from grainlaw.fields import parameter, part, whole_number
from grainlaw.integration import CentralDifference, Integrator
from grainlaw.loading import Adaptive, HeatingRate, Loading
from grainlaw.protocol import LoadingProtocol
from grainlaw.protocols.bending import QUANTITIES, bending_stage, bending_summary, ligament, measure_bending, span
from grainlaw.specimen import Specimen
from grainlaw.stage import Stage
from grainlaw.strength import Until


@attrs.frozen(kw_only=True)
class ThreePointBending(LoadingProtocol):
    """Bend a beam, notched or not, until it has parted (see :func:`~grainlaw.geometry.notched_beam`).

    The specimen needs the boundaries load, support_left and support_right; the load does not move sideways. Gives the
    flexural strength of the ligament, 3 P S/(2 h^2), and its fracture energy by the work of fracture.
    """

    loading: Loading = part(Loading, Adaptive(), without=HeatingRate)  #: how fast the load moves
    maximum_deflection: float = parameter("m", default=2e-4)  #: the test ends there if the load has not fallen
    until: Until = part(Until, Until.FALL)  #: whether the test ends at the first failure
    stop_fraction: float = parameter("1", default=0.05, at_least=0, below=1)  #: of the peak load
    samples: int = whole_number(default=1000, at_least=10)  #: wanted until the test ends at its limit
    integrator: Integrator = part(Integrator, CentralDifference())  #: the time integration, with its damping

    quantities = QUANTITIES

    def stages(self, specimen: Specimen) -> Sequence[Stage]:
        return [bending_stage(self, specimen)]

    def measure(self, state: State) -> dict[str, float]:
        return measure_bending(state)

    def summary(self, curves: Curves, specimen: Specimen) -> dict[str, Any]:
        """Peak load (N/m), deflection there, flexural strength (Pa), work of fracture (J/m2), certificate."""
        return bending_summary(curves, specimen, "flexural_strength", flexural_strength)


def flexural_strength(force: float, specimen: Specimen) -> float:
    """Pa, 3 P S/(2 h^2): stress in an elastic beam of the height of the ligament, under the load P (N/m)."""
    return 1.5 * force * span(specimen) / ligament(specimen) ** 2
