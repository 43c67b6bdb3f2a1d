"""The stage of a test: the loads that are imposed on a specimen, and until when."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TypeVar

import attrs
import numpy as np

from grainlaw.arguments import Checked, fits
from grainlaw.columns import AGED, ENERGY, JUMPS, MOTION, SUPPLIED, UNBALANCED
from grainlaw.conditions import Condition, Curves, Lasts
from grainlaw.fields import ParameterError, parameter, part, whole_number
from grainlaw.integration import CentralDifference, Integrator
from grainlaw.loading import Loading
from grainlaw.messages import refusal
from grainlaw.specimen import Specimen

LATE, MOST = 20, 100_000  #: times the samples that are expected, and samples where none are: then a stage does not end
NEARLY = 0.99  #: progress of a stage of which the time has passed, until the specimen rests
RESTS = 2  #: successive samples at rest before time passes in a jump
STILL = 0.01  #: of the ratio: work of the loads in a sample, over that so far, of a specimen whose pieces fly


def _ends(stage: Stage, attribute: attrs.Attribute, value: Sequence[Condition]) -> None:
    if not fits(value, Sequence[Condition]):
        raise stage.refuse_until()


class Load(metaclass=Checked):
    """What a stage imposes on a specimen: a motion, a force, a temperature.

    A load checks itself against its stage and its specimen, and says until when it changes. What it does to a running
    specimen is the business of the part of the engine that ``takes`` loads of its class; one that no part takes is
    refused. A load of a new kind needs such a part (docs/engine.md).
    """

    def check(self, stage: Stage) -> None:
        """Raise :class:`ParameterError` where it does not go with its stage, or with another load there."""

    def check_specimen(self, specimen: Specimen) -> None:
        """Raise :class:`ParameterError` where a specimen cannot bear it."""

    @property
    def lasts(self) -> float:
        """s since its stage began, until when it changes; infinite where that is not known."""
        return 0.0

    @property
    def moves(self) -> bool:
        """Whether it goes on at a speed, which the loading of its stage multiplies."""
        return False

    @property
    def ends(self) -> Sequence[Condition]:
        """Conditions that end its stage, beside those of the stage."""
        return ()

    def with_ramp(self, ramp: float) -> Load:
        """The same with the ramp (s) of the loading of its stage, where it goes on at a speed."""
        return self

    def at_start(self) -> Load | None:
        """The same as it is when its stage begins, for a stage before that; None where there is none of it then."""
        return self


L = TypeVar("L", bound=Load)


def loads_of(loads: Sequence[Load], *kinds: type[L]) -> list[L]:
    """Those of some classes, in their order."""
    return [load for load in loads if isinstance(load, kinds)]


@attrs.frozen(kw_only=True)
class Ageing(metaclass=Checked):
    """Time that passes in jumps while a specimen is at rest under the loads of a stage.

    Whenever two successive samples are at rest, to the ``ratio`` of :class:`AtRest` and but for pieces that fly free
    (then the loads do no work), bonds whose law has a ``fatigue``
    in its memory age under the displacements that they have: by as much time as lets the fatigue of no bond grow by
    more than ``largest_growth``, and no farther than ``duration`` in the stage. Then the specimen goes to the next
    equilibrium by its motion. The stage ends, if not before, when the duration has passed and the specimen rests.
    Columns ``aged`` (s since the start of the run) and ``jumps`` are recorded.
    """

    duration: float = parameter("s")  #: that passes in the stage
    largest_growth: float = parameter("1", default=0.02, above=0, at_most=0.5)  #: of fatigue in a jump
    ratio: float = parameter("1", default=1e-4)  #: at which the specimen counts as at rest

    def rests(self, curves: Curves) -> bool:
        """Whether a specimen was at rest in the last samples, but for pieces that fly free.

        Where forces balance and the loads do no work any more, what motion there is, is that of pieces that nothing
        slows.
        """
        unbalanced, motion = (curves[name][-RESTS:] for name in (UNBALANCED, MOTION))
        work = curves[ENERGY + SUPPLIED][-RESTS - 1 :]
        still = len(work) > 1 and np.abs(np.diff(work)).max() <= STILL * self.ratio * np.abs(work).max()
        return bool(unbalanced.max() <= self.ratio and (motion.max() <= self.ratio or still))

    def rests_after_jump(self, curves: Curves) -> bool:
        """Whether a specimen was at rest in the last samples, with no jump between them."""
        return bool(curves[JUMPS][-RESTS:].min() == curves[JUMPS][-1] and self.rests(curves))


@attrs.frozen
class Outlasts(Condition):
    """A time has passed in jumps since the stage began, and the specimen rests after the last of them."""

    ageing: Ageing

    def progress(self, curves: Curves) -> float:
        aged = curves[AGED]
        if aged[-1] < aged[0] + self.ageing.duration:
            return float((aged[-1] - aged[0]) / self.ageing.duration)
        return 1.0 if self.ageing.rests_after_jump(curves) else NEARLY


@attrs.frozen(kw_only=True)
class Stage(metaclass=Checked):
    """What is imposed, and until when. Boundaries and axes on which nothing is imposed are free."""

    name: str  #: shown while it runs
    loads: Sequence[Load] = ()  #: what is imposed; of two drives of a node the later counts
    loading: Loading | None = None  #: multiplies the speeds of all drives; they are then written for 1 m/s
    #: the stage ends when one of them is fulfilled, or one of its loads
    until: Sequence[Condition] = attrs.field(default=(), validator=_ends)
    #: the whole test ends here when one of them is fulfilled, as where a specimen fails before it should
    ends_test: Sequence[Condition] = ()
    interval: float = parameter("s")  #: time between samples; with a loading that at 1 m/s or 1 K/s, so m or K
    #: into which a sample is divided at most in which contacts are damaged, so that a strength does not depend on
    #: ``interval``; less where a loading has come so far that a piece is a small share of its way
    pieces: int = whole_number(default=1, at_least=1)
    integrator: Integrator = part(Integrator, CentralDifference())  #: the time integration, with its damping
    #: the run stops with an error after so many samples; unless given, 20 times those expected, or 100,000
    sample_limit: int | None = whole_number(default=None, at_least=1)
    static: bool = False  #: bring the specimen under its loads by static solutions, in motion where they do not exist
    ageing: Ageing | None = None  #: time that passes in jumps, beside that of the steps
    expected: int | None = whole_number(default=None, at_least=1)  #: samples to its end, if known; a loading needs it

    def __attrs_post_init__(self) -> None:
        if not self.ends:
            raise self.refuse_until()
        for load in self.loads:
            load.check(self)
        if self.loading is None:
            shortest = min((end.duration for end in self.until if isinstance(end, Lasts)), default=math.inf)
            if self.interval > shortest:
                where, wanted = f"Stage '{self.name}': interval", f"at most the {shortest:g} s that the stage lasts"
                raise refusal(where, self.interval, wanted)
            return
        if self.expected is None:
            raise ParameterError(f"Stage '{self.name}': a loading needs expected, the number of samples to its end")
        if not any(load.moves for load in self.loads):
            raise ParameterError(f"Stage '{self.name}': a loading needs a drive whose speed is not 0")

    def refuse_until(self) -> ParameterError:
        """What to raise for a stage that nothing ends."""
        wanted = "a list of at least one Condition, as [gl.conditions.Reaches('strain', 0.01)]"
        return refusal(f"Stage '{self.name}': until", self.until, wanted)

    def of(self, *kinds: type[L]) -> list[L]:
        """Its loads of some classes, in their order."""
        return loads_of(self.loads, *kinds)

    def check_specimen(self, specimen: Specimen) -> None:
        """Raise :class:`ParameterError` where a specimen cannot bear its loads."""
        for load in self.loads:
            load.check_specimen(specimen)

    @property
    def moved_by(self) -> Integrator:
        """The integrator, in its form for a stage that waits for rest where this one does."""
        waits = self.ageing is not None or any(end.waits_for_rest for end in self.until)
        return self.integrator.seeking_rest() if waits and self.loading is None else self.integrator

    @property
    def ends(self) -> list[Condition]:
        """All conditions that end it."""
        passed = [] if self.ageing is None else [Outlasts(self.ageing)]
        return [*self.until, *(end for load in self.loads for end in load.ends), *self.ends_test, *passed]

    @property
    def most_samples(self) -> int:
        """After which the run stops with an error."""
        return self.sample_limit or (LATE * self.pieces * self.expected if self.expected else MOST)

    @property
    def imposed(self) -> list[Load]:
        """The loads, with the ramp of the loading."""
        ramp = 0.0 if self.loading is None else self.loading.ramp
        return [load.with_ramp(ramp) for load in self.loads] if ramp else list(self.loads)
