"""Bending of a notched half disc, for the toughness of rock."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import attrs

from grainlaw.condition import Curves
from grainlaw.engine.state import State
from grainlaw.fields import parameter, part, whole_number
from grainlaw.integration import CentralDifference, Integrator
from grainlaw.loading import Adaptive, HeatingRate, Loading
from grainlaw.protocol import LoadingProtocol
from grainlaw.protocols.bending import QUANTITIES, bending_stage, bending_summary, measure_bending, notch_depth, span
from grainlaw.protocols.measures import size
from grainlaw.specimen import Specimen
from grainlaw.stage import Stage
from grainlaw.strength import Until


@attrs.frozen(kw_only=True)
class SemiCircularBend(LoadingProtocol):
    """Bend a notched half disc until it has parted (see :func:`~grainlaw.geometry.semi_disc`).

    The ISRM suggested method of Kuruppu, Obara, Ayatollahi, Chong and Funatsu 2014, doi:10.1007/s00603-013-0422-7:
    toughness from the peak load, fracture energy from the work of fracture. The specimen needs the boundaries load,
    support_left, support_right and notch.
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
        """Peak load (N/m), deflection there, toughness K_IC (Pa sqrt(m)), work of fracture (J/m2), certificate."""
        return bending_summary(curves, specimen, "toughness", toughness)


def toughness(force: float, specimen: Specimen) -> float:
    """K_IC (Pa sqrt(m)), Y' P sqrt(pi a)/(2 R), of the peak load P (N/m)."""
    depth, radius = notch_depth(specimen), size(specimen)[0] / 2
    shape = shape_factor(depth / radius, span(specimen) / (2 * radius))
    return shape * force * math.sqrt(math.pi * depth) / (2 * radius)


def shape_factor(depth: float, span: float) -> float:
    """Y' in plane strain, from the depth of the notch over the radius and the span over the diameter.

    Kuruppu and others 2014; fitted for depths from 0.4 to 0.6 and spans from 0.5 to 0.8.
    """
    linear = (-0.47 - 16.457 * span) * depth
    return -1.297 + 9.516 * span + linear + (1.071 + 34.401 * span) * depth**2
