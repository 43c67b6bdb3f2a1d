"""Conditions under which a stage ends, asked of what has been recorded in it."""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Mapping
from typing import Any, ClassVar

import attrs
import numpy as np

from grainlaw.arguments import Checked
from grainlaw.columns import DAMAGED, MOTION, STAGE, STAGE_TIME, TIME, UNBALANCED, cracks, require
from grainlaw.fields import parameter
from grainlaw.strength import LEAST, borne

__all__ = ["AtRest", "ComesTo", "Condition", "Fails", "FailsTo", "FallsTo", "Lasts", "Reaches"]

Curves = Mapping[str, np.ndarray]  #: what has been recorded so far, by column name, one entry per sample


class StageError(RuntimeError):
    """A stage that did not end as it should; ``result`` holds what was recorded."""

    result: Any


class Condition(metaclass=Checked):
    """When a stage ends."""

    #: whether it waits for the specimen to come to rest, so that only the end of the way there counts
    waits_for_rest: ClassVar[bool] = False

    @property
    def columns(self) -> tuple[str, ...]:
        """What it goes by of what the test measures: texts in its fields ``column``, ``load`` and ``deformation``."""
        fields = (getattr(self, name, None) for name in ("column", "load", "deformation"))
        return tuple(name for name in fields if isinstance(name, str))

    @abstractmethod
    def progress(self, curves: Curves) -> float:
        """Share of the stage that is done, from the curves of this stage; 1 ends the stage.

        They have, beside what is recorded, ``stage_time`` (s) since the stage began, before its first sample.
        Raises :class:`StageError` where the test cannot go on.
        """


@attrs.frozen
class Reaches(Condition):
    """A recorded quantity has reached a positive limit."""

    column: str  #: of the curves
    limit: float = parameter("its own", above=0)  #: value at which the stage ends

    def progress(self, curves: Curves) -> float:
        require("Reaches", curves, *self.columns)
        return float(curves[self.column][-1] / self.limit)


@attrs.frozen
class ComesTo(Condition):
    """A recorded quantity has come to a value, from either side."""

    column: str  #: of the curves
    value: float = parameter("its own", above=-math.inf)  #: value at which the stage ends

    def progress(self, curves: Curves) -> float:
        require("ComesTo", curves, *self.columns)
        first, now = (float(curves[self.column][k]) for k in (0, -1))
        way = self.value - first
        return 1.0 if way == 0 or now == self.value else (now - first) / way


@attrs.frozen
class FallsTo(Condition):
    """A recorded quantity has fallen to a fraction of its highest value so far."""

    column: str  #: of the curves
    fraction: float = parameter("1", above=-math.inf, below=1)  #: of the highest value so far

    def progress(self, curves: Curves) -> float:
        require("FallsTo", curves, *self.columns)
        values = curves[self.column]
        return float(values[-1] <= self.fraction * values.max() and values.max() > 0)


@attrs.frozen
class FailsTo(Condition):
    """As :class:`FallsTo`, but only after a contact has broken: vibration at the start of a test is no failure.

    What broke in stages before does not count.
    """

    column: str  #: of the curves
    fraction: float = parameter("1", above=-math.inf, below=1)  #: of the highest value so far

    def progress(self, curves: Curves) -> float:
        require("FailsTo", curves, *self.columns)
        broken = cracks(curves)
        if broken[-1] == _left_before(curves, broken):
            return 0.0
        return FallsTo(self.column, self.fraction).progress(curves)


@attrs.frozen
class Fails(Condition):
    """A specimen has failed, see docs/strength.md, and a contact has been damaged in this stage.

    The deformation counts from the beginning of this stage, or where that is under load already from its own zero.
    """

    load: str  #: column of the curves
    deformation: str  #: column of the curves

    def progress(self, curves: Curves) -> float:
        require("Fails", curves, *self.columns)
        if curves[DAMAGED][-1] <= _left_before(curves, curves[DAMAGED]):
            return 0.0
        load, way = curves[self.load], curves[self.deformation]
        before = 0.0 if load[0] >= LEAST * load.max() else _left_before(curves, way)
        found = borne(load, way - before, curves[STAGE])
        return float(found is not None and found.failed)


@attrs.frozen
class Lasts(Condition):
    """The stage has gone on for a time; it ends at the first sample from then on, up to one interval later."""

    duration: float = parameter("s", above=0)  #: of this stage

    def progress(self, curves: Curves) -> float:
        return float(curves[STAGE_TIME][-1] / self.duration)


def _left_before(curves: Curves, values: np.ndarray) -> float:
    """What a column (t,) had when this stage began: zero in the first."""
    return float(values[0]) if curves[STAGE][0] > 0 else 0.0


@attrs.frozen
class AtRest(Condition):
    """Loads no longer change, and ``unbalanced`` and ``motion`` are below a ratio in three successive samples.

    ``unbalanced`` is the mean unbalanced force over the mean contact force, ``motion`` the root of kinetic over stored
    energy. Both are needed: a slow motion of many nodes needs only small forces, and a vibration has no velocity at the
    moment of its reversal.
    """

    waits_for_rest: ClassVar[bool] = True
    ratio: float = parameter("1", default=1e-5)  #: of both measures

    def progress(self, curves: Curves) -> float:
        if len(curves[TIME]) < 3:
            return 0.0
        largest = max(float(curves[name][-3:].max()) for name in (UNBALANCED, MOTION))
        return min(1.0, self.ratio / max(largest, 1e-300))


def __dir__() -> list[str]:  # a notebook offers what is public
    return [*__all__]
