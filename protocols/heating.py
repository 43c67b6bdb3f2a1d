"""Heating and cooling, by themselves or before any other test."""

from __future__ import annotations

import enum
from collections.abc import Sequence
from typing import Any

import attrs
import numpy as np

from grainlaw import gauges
from grainlaw.columns import SHEAR_CRACKS, STAGE, TEMPERATURE, TENSILE_CRACKS, Panel, cracks
from grainlaw.conditions import AtRest, Curves, Lasts
from grainlaw.engine.state import State
from grainlaw.fields import ParameterError, checked_number, part, whole_number
from grainlaw.integration import CentralDifference, Integrator
from grainlaw.loading import Adaptive, Constant, Loading
from grainlaw.loads import Drive, Heat
from grainlaw.memory import ROOM
from grainlaw.messages import refusal
from grainlaw.protocol import LoadingProtocol
from grainlaw.protocols.measures import vibration_share
from grainlaw.protocols.preliminary import after_stages, begins_after, counted_after, samples_before
from grainlaw.quantity import Quantity
from grainlaw.specimen import Specimen
from grainlaw.stage import Stage


class Held(enum.Enum):
    """What is held while a specimen is heated."""

    BOTTOM = enum.auto()  #: it stands on its lower end, free to slide there
    ENDS = enum.auto()  #: top and bottom along y
    ALL = enum.auto()  #: these, and the sides along x


RESTS = 1e-4  #: of unbalanced over contact forces, and of motion, before the test
SAMPLES = 5  #: of the rest, while a shear wave passes the specimen
PASSAGES = 20  #: of such waves, after which it counts as at rest: without stress no ratio says so
MOST = 2 * PASSAGES * SAMPLES  #: samples until then
QUANTITIES = (
    *(Quantity(name, "%", form=".4f", meaning="change over the whole") for name in ("expansion_x", "expansion_y")),
    *(Quantity(name, "MPa", form=".2f", meaning="mean, tension positive") for name in ("stress_x", "stress_y")),
    Quantity("highest_temperature", "°C"),
    Quantity("heating_kinetic_ratio", form=".1e"),
)


def _temperatures(value: Any) -> tuple[float, ...]:
    listed = value if isinstance(value, Sequence) and not isinstance(value, str) else np.atleast_1d(value).tolist()
    found = tuple(checked_number("Heating: to", entry, "°C") for entry in listed)
    if not found:
        raise refusal("Heating: to", value, "a temperature (°C), or several one after the other")
    if not all(np.diff([ROOM, *found])):
        raise ParameterError(
            f"Heating: to = {found} is not allowed: from {ROOM:g} °C on each must differ from the last"
        )
    return found


def _is_test(heating: Heating, attribute: Any, value: Any) -> None:
    if value is not None and (not isinstance(value, LoadingProtocol) or isinstance(value, Heating)):
        raise refusal("Heating: test", value, "another test such as UniaxialCompression(), or None")


@attrs.frozen(kw_only=True)
class Heating(LoadingProtocol):
    """Bring a specimen from 20 °C to one temperature after another, then put it through a test, if one is given.

    It is the same temperature everywhere, as after slow heating. ``Heating(to=(600, 20), test=UniaxialCompression())``
    heats, cools and crushes. The test begins when the specimen is at rest; its strains and cracks count from there.
    """

    #: one temperature, or several one after the other
    to: tuple[float, ...] = attrs.field(converter=_temperatures, metadata={"unit": "degC", "bounds": ""})
    test: LoadingProtocol | None = attrs.field(default=None, validator=_is_test)  #: what comes after it
    held: Held = part(Held, Held.BOTTOM)  #: what is held meanwhile
    loading: Loading = part(Loading, Adaptive(), without=Constant)  #: how fast the temperature changes
    samples: int = whole_number(default=100, at_least=10)  #: from one temperature to the next
    integrator: Integrator = part(Integrator, CentralDifference())  #: the time integration, with its damping

    @property
    def quantities(self) -> Sequence[Quantity]:
        """Its own, and those of the test."""
        return (*QUANTITIES, *(self.test.quantities if self.test is not None else ()))

    @property
    def panels(self) -> Sequence[Panel]:
        """Those of the test, and what has broken at which temperature; without one expansion and stress."""
        broken = Panel(TEMPERATURE, [TENSILE_CRACKS, SHEAR_CRACKS], "broken contact points")
        if self.test is not None:
            return (*self.test.panels, broken)
        return (
            Panel(TEMPERATURE, ["expansion_x", "expansion_y"], "expansion"),
            Panel(TEMPERATURE, ["stress_x", "stress_y"], "mean stress, tension positive"),
            broken,
        )

    def stages(self, specimen: Specimen) -> Sequence[Stage]:
        sides = () if self.test is not None and self.held is not Held.ALL else ("left", "right")
        specimen.mesh.require_boundaries("Heating", "top", "bottom", *sides)
        drives = self._drives()
        heating, before = [], ROOM
        for temperature in self.to:
            specimen.check_temperature("Heating: to", temperature)
            name = f"{'heat' if temperature > before else 'cool'} to {temperature:g} °C"
            interval = abs(temperature - before) / self.samples
            heating.append(
                Stage(
                    name=name, loads=[*drives, Heat(to=temperature)], loading=self.loading, interval=interval,
                    expected=self.samples, sample_limit=100 * self.samples, integrator=self.integrator,
                )
            )  # fmt: skip
            before = temperature
        if self.test is None:
            return heating
        passage = specimen.longest_passage
        rest = Stage(
            name="rest", loads=drives, until=[AtRest(RESTS), Lasts(PASSAGES * passage)], interval=passage / SAMPLES,
            sample_limit=MOST, integrator=self.integrator,
        )  # fmt: skip
        return [*heating, rest, *self.test.stages(specimen)]

    @property
    def _before(self) -> int:
        """Stages before the test, or all."""
        return len(self.to) + (self.test is not None)

    def _drives(self) -> list[Drive]:
        ends = ("bottom", "top") if self.held is not Held.BOTTOM else ("bottom",)
        drives = [Drive(boundary=end, axis=1, speed=0.0) for end in ends]
        if self.held is Held.ALL:
            return [*drives, *(Drive(boundary=side, axis=0, speed=0.0) for side in ("left", "right"))]
        middle = Drive(boundary="bottom", axis=0, speed=0.0, roller=True)  # so that the specimen cannot drift
        return [*drives, middle]

    def measure(self, state: State) -> dict[str, float]:
        """What the test measures.

        Without one: ``expansion_x`` and ``expansion_y``, change of width and height over them, and the mean stress of
        the specimen ``stress_x`` and ``stress_y`` (Pa, tension positive).
        """
        if self.test is not None:
            return self.test.measure(state)
        stress = np.average(state.grain_stress(), axis=0, weights=state.specimen.grains.areas)
        return {
            "expansion_x": gauges.lateral_strain(state.specimen, state.displacement),
            "expansion_y": gauges.axial_strain_of_points(state.specimen, state.displacement),
            "stress_x": float(stress[0]),
            "stress_y": float(stress[1]),
        }

    def summary(self, curves: Curves, specimen: Specimen) -> dict[str, Any]:
        """Highest temperature, contact points broken by it, and ``heating_kinetic_ratio``; properties by the test.

        The ratio is :func:`~grainlaw.protocols.measures.vibration_share`.
        """
        hot = slice(samples_before(curves, len(self.to)))  # without its rest
        found = {
            "highest_temperature": max(ROOM, float(curves[TEMPERATURE].max())),
            "thermal_cracks": int(cracks(curves)[: samples_before(curves, self._before)][-1]),
            "heating_kinetic_ratio": vibration_share(curves, hot),
        }
        if self.test is None:
            return {
                **found,
                "expansion_x": float(curves["expansion_x"][-1]),
                "expansion_y": float(curves["expansion_y"][-1]),
            }
        after = after_stages(curves, self._before, self.quantities)
        return {**found, **self.test.summary(after, specimen)} if len(after[STAGE]) else found

    def begins(self, curves: Curves) -> int:
        """After the heating."""
        return begins_after(self.test, curves, self._before) if self.test is not None else 0

    def counted(self, curves: Curves, first: int) -> Curves:
        """As of any test; strains and cracks count from the beginning of the test, as in its summary."""
        return (
            counted_after(self.test.counted, curves, first, self._before, self.quantities)
            if self.test
            else super().counted(curves, first)
        )
