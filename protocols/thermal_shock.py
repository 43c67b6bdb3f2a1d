"""A hot specimen that is quenched: cracks grow inwards from what is cooled."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import attrs
import numpy as np

from grainlaw.columns import COLDEST, HEAT_TIME, HOTTEST, SHEAR_CRACKS, STAGE, TENSILE_CRACKS, Panel, cracks
from grainlaw.conditions import Curves
from grainlaw.engine.state import State
from grainlaw.fields import ParameterError, checked_field, optional, parameter, part, whole_number
from grainlaw.integration import CentralDifference, Integrator
from grainlaw.loading import Adaptive, Constant, Loading
from grainlaw.loads import Conduction, Convection, FixedTemperature, Heat
from grainlaw.material import ABSOLUTE_ZERO
from grainlaw.memory import ROOM
from grainlaw.messages import refusal
from grainlaw.protocol import LoadingProtocol
from grainlaw.protocols.measures import vibration_share
from grainlaw.quantity import Quantity
from grainlaw.specimen import Specimen
from grainlaw.stage import Load, Stage

WARMING = 20  #: samples until a specimen is hot


def _names(where: str, value: Any) -> tuple[str, ...]:
    names = tuple(value) if isinstance(value, Sequence) and not isinstance(value, str) else value
    if not isinstance(names, tuple) or not all(isinstance(name, str) for name in names) or len(set(names)) < len(names):
        raise refusal(where, value, "a list of names of boundaries, each once, or empty for all")
    return names


@attrs.frozen(kw_only=True)
class ThermalShock(LoadingProtocol):
    """Bring a free specimen to one temperature, then its boundaries, or some, to another at once, or into a bath.

    Heat is conducted from then on (:class:`~grainlaw.loads.Conduction`): what cools shrinks first, and is torn by what
    is still hot. ``speedup`` is time of heat over time of the motion: slow enough where half of it gives the same
    cracks, and ``shock_kinetic_ratio`` is small.
    """

    hot: float = parameter("degC", at_least=ABSOLUTE_ZERO)  #: temperature of all of it at first
    bath: float = parameter("degC", default=ROOM, at_least=ABSOLUTE_ZERO)  #: to which boundaries come
    duration: float = parameter("s")  #: of heat, from the shock on
    #: of heat transfer to the bath; without it boundaries have its temperature at once
    coefficient: float | None = optional("W/m2/K", above=0)
    boundaries: tuple[str, ...] = checked_field(_names, default=())  #: names of those that are cooled; all, if none
    speedup: float = parameter("1", default=2e4)  #: time of heat over time of the motion
    filling: float = parameter("W/m/K", default=0.026)  #: conductivity of what fills cracks; that of air
    smallest_aperture: float = parameter("m", default=1e-6)  #: across which closed cracks conduct
    loading: Loading = part(Loading, Adaptive(), without=Constant)  #: how fast the temperature changes before the shock
    samples: int = whole_number(default=200, at_least=10)  #: from the shock on
    integrator: Integrator = part(Integrator, CentralDifference())  #: the time integration, with its damping

    quantities = (
        Quantity("shock_cracks", form=".0f", is_main=True, meaning="contact points that have broken since the shock"),
        Quantity("first_crack_time", "s", meaning="time of heat from the shock to the first of them, nan without any"),
        Quantity("shock_kinetic_ratio", form=".1e", meaning="largest vibration over stored and kinetic energy"),
    )

    panels = (
        Panel(HEAT_TIME, [COLDEST, HOTTEST], "temperature of nodes"),
        Panel(HEAT_TIME, [TENSILE_CRACKS, SHEAR_CRACKS], "broken contact points"),
    )

    def __attrs_post_init__(self) -> None:
        if self.hot == self.bath:
            raise ParameterError(f"ThermalShock: bath = {self.bath:g} °C is not allowed, it must differ from hot")

    def stages(self, specimen: Specimen) -> Sequence[Stage]:
        specimen.mesh.require_boundaries("ThermalShock", *self.boundaries)
        names = self.boundaries or tuple(specimen.mesh.boundaries)
        specimen.check_temperature("ThermalShock: hot", self.hot)
        flow = Conduction(
            duration=self.duration, speedup=self.speedup, filling=self.filling,
            smallest_aperture=self.smallest_aperture,
        )  # fmt: skip
        shock = Stage(
            name="shock", loads=[flow, *map(self._cooling, names)], integrator=self.integrator,
            interval=self.duration / self.speedup / self.samples, expected=self.samples,
            sample_limit=2 * self.samples + 10,
        )  # fmt: skip
        if self.hot == ROOM:
            return [shock]
        change = abs(self.hot - ROOM)
        warm = Stage(
            name="warm", loads=[Heat(to=self.hot)], loading=self.loading, interval=change / WARMING, expected=WARMING,
            sample_limit=100 * WARMING, integrator=self.integrator,
        )  # fmt: skip
        return [warm, shock]

    def _cooling(self, boundary: str) -> Load:
        if self.coefficient is None:
            return FixedTemperature(boundary=boundary, temperature=self.bath)
        return Convection(boundary=boundary, coefficient=self.coefficient, temperature=self.bath)

    def measure(self, state: State) -> dict[str, float]:
        """Nothing beside what every run with conduction records: time of heat, temperatures, heat."""
        return {}

    def summary(self, curves: Curves, specimen: Specimen) -> dict[str, Any]:
        """Cracks since the shock, when the first of them came, and the kinetic ratio since it.

        The ratio is the largest of vibration over stored and kinetic energy, where their sum is more than a hundredth
        of its largest. In plane strain the stored energy has that
        of the free strain that is held across the plane: smaller ratios mean as much there (docs/temperature.md).
        """
        shocked = curves[STAGE] == (self.hot != ROOM)
        if not shocked.any() or COLDEST not in curves:
            return {"shock_cracks": 0, "first_crack_time": np.nan, "shock_kinetic_ratio": np.nan}
        broken = cracks(curves)
        before = float(broken[~shocked][-1]) if not shocked.all() else 0.0
        first = np.flatnonzero(shocked & (broken > before))
        return {
            "shock_cracks": int(broken[-1] - before),
            "first_crack_time": float(curves[HEAT_TIME][first[0]]) if len(first) else np.nan,
            "shock_kinetic_ratio": vibration_share(curves, shocked),
        }
