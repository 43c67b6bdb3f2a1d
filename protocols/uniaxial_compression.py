"""Uniaxial compression between two platens."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import attrs
import numpy as np

from grainlaw.integration import CentralDifference, Integrator
from grainlaw.loading import Curves, FallsTo, LoadingProtocol, Reaches, Stage
from grainlaw.parameter import parameter
from grainlaw.protocols.measures import certificate, elastic_moduli, size
from grainlaw.protocols.platens import (
    Moving, Platens, homogeneous_velocity, measure_between_platens, platen_drives, require_ends,
)  # fmt: skip
from grainlaw.specimen import Specimen
from grainlaw.state import State


@attrs.frozen(kw_only=True)
class UniaxialCompression(LoadingProtocol):
    """Press a specimen until it has lost part of its strength; stress and strain count compression positive.

    It starts with the velocity field of homogeneous compression, or, with a ``ramp``, at rest. Ends at
    ``stop_fraction`` of the peak stress or at ``maximum_strain``.
    """

    speed: float = parameter("m/s", default=0.05)  #: at which the platens approach each other
    ramp: float = parameter("s", default=0.0, at_least=0)  #: time in which the speed rises from zero
    platens: Platens = attrs.field(default=Platens.SMOOTH, validator=attrs.validators.instance_of(Platens))
    moving: Moving = attrs.field(default=Moving.TOP, validator=attrs.validators.instance_of(Moving))
    maximum_strain: float = parameter("1", default=0.01, above=0, below=0.5)
    stop_fraction: float = parameter("1", default=0.5, at_least=0, below=1)
    samples: int = attrs.field(default=1000, validator=[attrs.validators.instance_of(int), attrs.validators.ge(10)])
    integrator: Integrator = attrs.field(
        factory=CentralDifference, validator=attrs.validators.instance_of(Integrator)
    )

    def stages(self, specimen: Specimen) -> Sequence[Stage]:
        require_ends(specimen, type(self).__name__)
        duration = self.maximum_strain * size(specimen)[1] / self.speed
        start = homogeneous_velocity(specimen, -self.speed, self.platens, self.moving) if self.ramp == 0 else None
        return [
            Stage(
                name="compression",
                drives=platen_drives(-self.speed, self.ramp, self.platens, self.moving),
                until=[Reaches("strain", self.maximum_strain), FallsTo("stress", self.stop_fraction)],
                interval=duration / self.samples,
                integrator=self.integrator,
                initial_velocity=start,
                sample_limit=self.samples + int(np.ceil(self.ramp / duration * self.samples)) + 10,
            )
        ]

    def measure(self, state: State) -> dict[str, float]:
        return measure_between_platens(state, -1.0)

    def summary(self, curves: Curves, specimen: Specimen) -> dict[str, Any]:
        peak = int(np.argmax(curves["stress"]))
        return {
            "peak_stress": float(curves["stress"][peak]),
            "peak_strain": float(curves["strain"][peak]),
            **elastic_moduli(curves, specimen),
            **certificate(curves),
        }
