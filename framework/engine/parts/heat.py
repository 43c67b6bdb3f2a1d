"""The temperature of a specimen: the same everywhere, and changed by a stage at an even rate."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from grainlaw.engine.parts.imposed import Imposed
from grainlaw.engine.parts.material_zones import MaterialZones
from grainlaw.engine.parts.part import Changing, Moment, Part
from grainlaw.loads import Heat
from grainlaw.memory import ROOM


class HeatBooks(NamedTuple):
    """Temperature now, and the line along which it changes."""

    temperature: Changing  #: (1,) °C, at the last forces
    base: Changing  #: (1,) °C, at the time ``since``
    since: Changing  #: (1,) s, from when on it changes at a rate
    rate: Changing  #: (1,) K/s


class EvenTemperature(Part):
    """Temperature. That of a step is the same to the last digit, however many steps are done in one call."""

    takes = (Heat,)

    def __init__(self, materials: MaterialZones) -> None:
        self._materials = materials
        self.books = HeatBooks(np.array([ROOM]), np.array([ROOM]), np.zeros(1), np.zeros(1))
        self.target: float | None = None  #: °C, to which the present stage brings it

    @property
    def temperature(self) -> float:
        """°C, at the last forces."""
        return float(self.books.temperature[0])

    @property
    def sign(self) -> int:
        """1 where the stage heats, -1 where it cools, 0 where the temperature stays."""
        return 0 if self.target is None else int(np.sign(self.target - self.temperature))

    def begin(self, imposed: Imposed, at: Moment) -> None:
        self.target = next((heat.to for heat in imposed.of(Heat)), None)
        self.books.rate[0] = 0.0

    def course(self, times: np.ndarray, now: float, pace: float) -> np.ndarray:
        """(t, 2) °C: the temperatures before and at steps that end at times (s), from the time ``now`` on."""
        books = self.books
        rate = self.sign * pace
        if rate != books.rate[0]:
            books.base[0], books.since[0], books.rate[0] = self.temperature, now, rate
        found = np.full(len(times), self.temperature)
        if rate and self.target is not None:
            found = books.base[0] + rate * (times - books.since[0])
            found = np.minimum(found, self.target) if rate > 0 else np.maximum(found, self.target)
        return np.stack([np.append(self.temperature, found)[:-1], found], axis=1)

    def reach(self, temperature: float) -> None:
        """Record the temperature (°C) of the last step; materials are asked at it until the next."""
        self.books.temperature[0] = temperature
        self._materials.take_temperature(temperature)

    def restore(self, saved: dict[str, np.ndarray]) -> None:
        super().restore(saved)
        self.reach(self.temperature)
