"""Uniaxial compression and tension between two platens."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import attrs

from grainlaw.condition import Curves
from grainlaw.engine.state import State
from grainlaw.fields import parameter, part, whole_number
from grainlaw.gauges import Gauges, WholeSpecimen
from grainlaw.integration import CentralDifference, Integrator
from grainlaw.loading import Adaptive, HeatingRate, Loading
from grainlaw.protocol import LoadingProtocol
from grainlaw.protocols.between_platens import (
    QUANTITIES,
    Moving,
    Platens,
    measure_between_platens,
    uniaxial_stage,
    uniaxial_summary,
)
from grainlaw.specimen import Specimen
from grainlaw.stage import Stage
from grainlaw.strength import Until


@attrs.frozen(kw_only=True)
class UniaxialCompression(LoadingProtocol):
    """Press a specimen until it has lost part of its strength; stress and strain count compression positive.

    It ends at ``stop_fraction`` of the peak stress or at ``maximum_strain``.
    """

    loading: Loading = part(Loading, Adaptive(), without=HeatingRate)  #: how fast the platens approach each other
    platens: Platens = part(Platens, Platens.SMOOTH)  #: whether the ends may slide along the platens
    moving: Moving = part(Moving, Moving.TOP)  #: which platen moves, or both
    #: axial strain at which the test ends, if it has not failed
    maximum_strain: float = parameter("1", default=0.01, above=0, below=0.5)
    until: Until = part(Until, Until.FALL)  #: whether the test ends at the first failure
    #: share of the peak stress at which the test ends
    stop_fraction: float = parameter("1", default=0.5, at_least=0, below=1)
    samples: int = whole_number(default=1000, at_least=10)  #: wanted until the test ends at its limit
    gauges: Gauges = part(Gauges, WholeSpecimen())  #: where lateral and axial strain are measured
    integrator: Integrator = part(Integrator, CentralDifference())  #: the time integration, with its damping

    quantities = QUANTITIES

    def stages(self, specimen: Specimen) -> Sequence[Stage]:
        return [uniaxial_stage(self, specimen, "compression", -1.0)]

    def measure(self, state: State) -> dict[str, float]:
        return measure_between_platens(state, -1.0, self.gauges)

    def summary(self, curves: Curves, specimen: Specimen) -> dict[str, Any]:
        return uniaxial_summary(curves, specimen, -1.0)


@attrs.frozen(kw_only=True)
class UniaxialTension(LoadingProtocol):
    """Pull a specimen by its glued ends until it parts; stress and strain count tension positive.

    It ends at ``stop_fraction`` of the peak stress or at ``maximum_strain``.
    """

    loading: Loading = part(Loading, Adaptive(), without=HeatingRate)  #: how fast the platens part
    platens: Platens = part(Platens, Platens.SMOOTH)  #: whether the ends may slide along the platens
    moving: Moving = part(Moving, Moving.BOTH)  #: which platen moves, or both
    #: axial strain at which the test ends, if it has not failed
    maximum_strain: float = parameter("1", default=0.001, above=0, below=0.5)
    until: Until = part(Until, Until.FALL)  #: whether the test ends at the first failure
    #: share of the peak stress at which the test ends
    stop_fraction: float = parameter("1", default=0.1, at_least=0, below=1)
    samples: int = whole_number(default=1000, at_least=10)  #: wanted until the test ends at its limit
    gauges: Gauges = part(Gauges, WholeSpecimen())  #: where lateral and axial strain are measured
    integrator: Integrator = part(Integrator, CentralDifference())  #: the time integration, with its damping

    quantities = QUANTITIES

    def stages(self, specimen: Specimen) -> Sequence[Stage]:
        return [uniaxial_stage(self, specimen, "tension", 1.0)]

    def measure(self, state: State) -> dict[str, float]:
        return measure_between_platens(state, 1.0, self.gauges)

    def summary(self, curves: Curves, specimen: Specimen) -> dict[str, Any]:
        return uniaxial_summary(curves, specimen, 1.0)
