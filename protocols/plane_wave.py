"""A plane wave that runs along a specimen, past gauges."""

from __future__ import annotations

import enum
import warnings
from collections.abc import Sequence
from typing import Any

import attrs
import numpy as np

from grainlaw.columns import TIME, Panel
from grainlaw.conditions import Curves, Reaches
from grainlaw.engine.state import State
from grainlaw.fields import ParameterError, UnitWarning, checked_number, parameter, part, whole_number
from grainlaw.integration import CentralDifference, Integrator, Undamped
from grainlaw.loads import Drive, Quiet, Traction
from grainlaw.messages import refusal, users_line
from grainlaw.protocol import LoadingProtocol
from grainlaw.quantity import Quantity
from grainlaw.specimen import Specimen
from grainlaw.stage import Stage
from grainlaw.time_series import TimeSeries, Varying, varying

ENDS = ("left", "right")  #: between which a wave runs
PULSE = TimeSeries(np.array([0.0, 5e-6, 10e-6]), np.array([0.0, -1e6, 0.0]))


class Wave(enum.Enum):
    """How the specimen moves as the wave passes, and how its upper and lower sides are held."""

    P = enum.auto()  #: along the wave; the sides are held across it
    S = enum.auto()  #: across the wave; the sides are held along it
    BAR = enum.auto()  #: along the wave; the sides are free


def _places(value: Any) -> tuple[float, ...] | None:
    if value is None:
        return None
    try:
        if len(value) == 0:
            raise TypeError
        return tuple(checked_number("PlaneWave: gauges", place, "m") for place in value)
    except TypeError:
        raise refusal("PlaneWave: gauges", value, "a list of places along x (m)") from None


@attrs.frozen(kw_only=True)
class PlaneWave(LoadingProtocol):
    """A pulse enters at the left end, as the stress there or as its velocity, and runs to the right, past gauges.

    Ends that are ``quiet`` absorb it; another is free, or moved. Through a quiet end on the left half of the stress
    goes in. A gauge reads the means over a grain size to both sides of it.
    """

    duration: float = parameter("s", default=60e-6)  #: of the test
    #: normal stress at the left end, shear stress of an S wave; tension is positive
    stress: Varying = varying("Pa", PULSE)
    #: of the left end along x, of an S wave along y; the stress is then what the specimen answers
    velocity: Varying | None = varying("m/s", None)
    #: places along x; without them at a quarter and three quarters of the specimen
    gauges: tuple[float, ...] | None = attrs.field(default=None, converter=_places, metadata={"unit": "m"})
    wave: Wave = part(Wave, Wave.P)  #: how the specimen moves
    quiet: Sequence[str] = ("right",)  #: ends that absorb waves, "left" or "right"
    samples: int = whole_number(default=400, at_least=2)  #: in the duration
    integrator: Integrator = part(Integrator, CentralDifference(damping=Undamped()))  #: the time integration

    def __attrs_post_init__(self) -> None:
        for name in self.quiet:
            if name not in ENDS:
                raise refusal(
                    "PlaneWave: quiet", name, f"one of the ends {' and '.join(ENDS)}: the sides guide the wave"
                )
        if self.velocity is not None and self.stress != PULSE:
            raise ParameterError(
                "PlaneWave: stress and velocity are both given, the left end can have only one of them"
            )
        if self.velocity is not None and "left" in self.quiet:
            raise ParameterError("PlaneWave: quiet: the left end moves by the velocity, it cannot absorb waves as well")
        self._warn_of_units()

    def _warn_of_units(self) -> None:
        """Warn of a wave whose largest value comes after the test, as one in ms."""
        moved = self.velocity is not None
        name, unit, wave = ("velocity", "m/s", self.velocity) if moved else ("stress", "Pa", self.stress)
        if isinstance(wave, TimeSeries) and (late := wave.times[np.abs(wave.values).argmax()]) > self.duration:
            words = f"PlaneWave: {name} = {wave.in_words(unit)} is largest at {late:g} s, after the duration of"
            warnings.warn(UnitWarning(f"{words} {self.duration:g} s: is the unit right?"), stacklevel=users_line())

    quantities = (
        Quantity("peak_stress", "MPa", form=".2f"), Quantity("peak_time", "µs"), Quantity("peak_velocity", "m/s"),
        Quantity("stress", "MPa", words="stress at gauge", meaning="tension positive"),
        Quantity("velocity", "m/s", words="velocity at gauge"), Quantity(TIME, "µs", meaning="since the start"),
    )  # fmt: skip

    @property
    def panels(self) -> Sequence[Panel]:
        """Stress and velocity at all gauges over time."""
        count = 2 if self.gauges is None else len(self.gauges)
        stress = "shear stress" if self.wave is Wave.S else "normal stress, tension positive"
        return [
            Panel(TIME, [f"{name}_{k}" for k in range(count)], words)
            for name, words in (("stress", stress), ("velocity", "velocity"))
        ]

    @property
    def _axis(self) -> int:
        return int(self.wave is Wave.S)

    def stages(self, specimen: Specimen) -> Sequence[Stage]:
        specimen.mesh.require_boundaries("PlaneWave", "left", "right", "top", "bottom", *self.quiet)
        if specimen.is_rigid:
            raise ParameterError("PlaneWave: grains that are Rigid carry no waves, it needs another material")
        low, high = specimen.grains.region.bounds[:, 0].tolist()
        for place, near in zip(self._gauges(specimen), self._zones(specimen), strict=True):
            if not low <= place <= high:
                raise ParameterError(f"PlaneWave: gauges = {place:g} m is not in the specimen, {low:g} to {high:g} m")
            if not near.any():
                raise ParameterError(f"PlaneWave: gauges = {place:g} m has no zone whose middle is within a grain size")
        drives, tractions = [], []
        if self.wave is not Wave.BAR:
            drives = [Drive(boundary=side, axis=1 - self._axis, speed=0.0) for side in ("top", "bottom")]
        if self.velocity is not None:
            drives.append(Drive(boundary="left", axis=self._axis, speed=self.velocity))
        else:
            unit = (0.0, 0.0, 1.0) if self._axis else (1.0, 0.0, 0.0)
            tractions = [Traction(boundary="left", stress=unit, factor=self.stress)]
        quiet = [Quiet(boundary=name) for name in self.quiet]
        return [
            Stage(
                name="wave", loads=[*drives, *tractions, *quiet], until=[Reaches("time", self.duration)],
                interval=self.duration / self.samples, expected=self.samples, integrator=self.integrator,
            )
        ]  # fmt: skip

    def _gauges(self, specimen: Specimen) -> tuple[float, ...]:
        if self.gauges is not None:
            return self.gauges
        low, high = specimen.grains.region.bounds[:, 0].tolist()
        return 0.75 * low + 0.25 * high, 0.25 * low + 0.75 * high

    def _zones(self, specimen: Specimen) -> np.ndarray:
        """(k, z) whether a gauge reads a zone: its middle is within a grain size of the gauge along x."""
        middle = specimen.mesh.nodes[specimen.mesh.zones, 0].mean(axis=1)
        return np.abs(middle - np.reshape(self._gauges(specimen), (-1, 1))) <= specimen.grains.grain_size

    def measure(self, state: State) -> dict[str, float]:
        """``stress_k`` (Pa) and ``velocity_k`` (m/s) of each gauge k, from 0."""
        mesh, row = state.mesh, {}
        stress = state.zone_state()[0][:, 2 * self._axis]
        velocity = state.velocity[mesh.zones, self._axis].mean(axis=1)
        for k, near in enumerate(self._zones(state.specimen)):
            weights = mesh.zone_areas[near]
            row[f"stress_{k}"] = float(np.average(stress[near], weights=weights))
            row[f"velocity_{k}"] = float(np.average(velocity[near], weights=weights))
        return row

    def summary(self, curves: Curves, specimen: Specimen) -> dict[str, Any]:
        """Stress (Pa) and velocity (m/s) of largest size at each gauge k, with signs, and when (s) the stress was."""
        found: dict[str, float] = {}
        for k in range(len(self._gauges(specimen))):
            stress, velocity = curves[f"stress_{k}"], curves[f"velocity_{k}"]
            at = int(np.argmax(np.abs(stress)))
            found |= {
                f"peak_stress_{k}": float(stress[at]), f"peak_time_{k}": float(curves["time"][at]),
                f"peak_velocity_{k}": float(velocity[np.argmax(np.abs(velocity))]),
            }  # fmt: skip
        return found
