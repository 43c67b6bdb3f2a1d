"""A rock under stress that a fluid breaks, pumped into an opening."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import attrs
import numpy as np

from grainlaw.columns import DAMAGED, SHARED, TIME, WET, Panel
from grainlaw.conditions import AtRest, Curves, FailsTo, Reaches
from grainlaw.engine.state import State
from grainlaw.fields import IN_SITU, parameter, part, whole_number
from grainlaw.integration import CentralDifference, Integrator
from grainlaw.loads import Injection, Traction, require_hole
from grainlaw.protocol import LoadingProtocol
from grainlaw.quantity import Quantity
from grainlaw.specimen import Specimen
from grainlaw.stage import Stage
from grainlaw.units import MPa

FLUID = ("crack_room", "crack_fluid", "outflow")
RAMP = 0.05  #: of the time in which all of it would be pumped in: the rate rises in it
MOST, PASSAGES = 5, 10  #: the rock rests under its stress within so many times that, or so many passages of a wave


@attrs.frozen(kw_only=True)
class HydraulicFracturing(LoadingProtocol):
    """A rock comes under a stress, with an empty opening; then a fluid is pumped into this at a rate, until it breaks.

    The specimen's region has the opening as a hole, such as :func:`~grainlaw.geometry.plate_with_hole` makes. The fluid
    fills what cracks it reaches, at once unless it has a ``viscosity``: :class:`~grainlaw.loads.Injection`. The test
    ends when contacts have broken and the pressure has fallen to ``stop_fraction`` of its largest, or with
    ``largest_volume``. Pump so slowly that waves cross the specimen many times: with half of the rate the pressures
    should be the same without viscosity.
    """

    #: stress of the rock along x, tension positive
    xx: float = parameter("Pa", default=-5 * MPa, above=-np.inf, usual=IN_SITU)
    yy: float = parameter("Pa", default=-5 * MPa, above=-np.inf, usual=IN_SITU)  #: along y
    xy: float = parameter("Pa", default=0.0, above=-np.inf)  #: shear stress
    opening: str = "hole"  #: name of the boundary into which is pumped
    rate: float = parameter("m2/s", default=4e-3)  #: volume over time and thickness
    bulk_modulus: float = parameter("Pa", default=2.2e9, usual=(1e4, 1e12))  #: of the fluid
    viscosity: float = parameter("Pa s", default=0.0, at_least=0)  #: of the fluid; that of water is 1e-3
    #: of closed cracks, where it is viscous
    residual_aperture: float = parameter("m", default=0.0, at_least=0, usual=(1e-9, 0.01))
    largest_volume: float = parameter("m2", default=2e-5)  #: of fluid that is pumped in, over thickness
    stop_fraction: float = parameter("1", default=0.5, at_least=0, at_most=1)  #: of the largest pressure
    rest: float = parameter("1", default=1e-4)  #: ratio at which the rock counts as at rest under its stress
    samples: int = whole_number(default=1000, at_least=10)  #: until the largest volume
    integrator: Integrator = part(Integrator, CentralDifference())  #: the time integration, with its damping

    quantities = (
        Quantity(
            "breakdown_pressure", "MPa", is_main=True, meaning="largest pressure of a fluid that damaged the rock"
        ),
        Quantity("largest_pressure", "MPa", meaning="of the fluid"),
        Quantity("initiation_pressure", "MPa", is_main=True, meaning="at which the first contact was damaged by it"),
        *(attrs.evolve(SHARED[name], unit="mm2", factor=1e6) for name in ("injected", "room", *FLUID)),
        attrs.evolve(SHARED[WET], words="contact points that the fluid presses"),
        Quantity(TIME, "ms", meaning="since the start"),
    )
    panels = (
        Panel("injected", ["injection_pressure"]), Panel("injected", FLUID, "volume over thickness"),
        Panel("injected", [WET]),
    )  # fmt: skip

    def stages(self, specimen: Specimen) -> Sequence[Stage]:
        require_hole("HydraulicFracturing", specimen, self.opening)
        sides = [name for name in specimen.mesh.boundaries if name != self.opening]
        time = self.largest_volume / self.rate
        far = [Traction(boundary=name, stress=(self.xx, self.yy, self.xy)) for name in sides]
        rising = [attrs.evolve(load, ramp=time) for load in far]
        pump = Injection(
            boundary=self.opening, rate=self.rate, ramp=RAMP * time, bulk_modulus=self.bulk_modulus,
            viscosity=self.viscosity, residual_aperture=self.residual_aperture,
        )  # fmt: skip
        until = [FailsTo("injection_pressure", self.stop_fraction), Reaches("injected", self.largest_volume)]
        interval, slowly = time / self.samples, PASSAGES * specimen.longest_passage
        return [
            Stage(
                name="stress", loads=rising, until=[AtRest(self.rest)], interval=interval, integrator=self.integrator,
                static=True, sample_limit=MOST * math.ceil(self.samples * max(1.0, slowly / time)),
            ),
            Stage(
                name="pump", loads=[*far, pump], until=until, interval=interval, integrator=self.integrator,
                expected=self.samples,
            ),
        ]  # fmt: skip

    def measure(self, state: State) -> dict[str, float]:
        """What :attr:`State.pumped` has, and ``wet``: contact points whose faces the fluid presses."""
        return {**state.pumped, WET: int((state.fluid_pressure > 0).sum())}

    def summary(self, curves: Curves, specimen: Specimen) -> dict[str, Any]:
        """Pressures (Pa): the largest, at breakdown and at the first damage since the pump began, nan without any."""
        pumping = curves["stage"] == 1
        pressure, damaged = curves["injection_pressure"], curves[DAMAGED]
        before = damaged[~pumping][-1] if (~pumping).any() else 0.0
        more = np.flatnonzero(pumping & (damaged > before))
        return {
            "breakdown_pressure": float(pressure.max()) if len(more) else float("nan"),
            "largest_pressure": float(pressure.max()),
            "initiation_pressure": float(pressure[more[0]]) if len(more) else float("nan"),
            "injected": float(curves["injected"][-1]),
        }
