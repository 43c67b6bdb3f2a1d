"""The stage of a test: what is imposed on a specimen, and until when."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import attrs
import numpy as np

from grainlaw.arguments import Checked, fits
from grainlaw.boundary_conditions import Drive, FluidPressure, Hold, Pressure, Quiet, Traction, is_roller
from grainlaw.columns import ENERGY, MOTION, SUPPLIED, TEMPERATURE, UNBALANCED
from grainlaw.condition import ComesTo, Condition, Curves
from grainlaw.integration import CentralDifference, Integrator
from grainlaw.loading import Constant, HeatingRate, Loading
from grainlaw.material import ABSOLUTE_ZERO
from grainlaw.messages import refusal
from grainlaw.parameter import (
    ParameterError,
    checked_number,
    checked_vector,
    grain_numbers,
    parameter,
    part,
    whole_number,
)
from grainlaw.time_series import Imposed

RESTS = 2  #: successive samples at rest before time passes in a jump
STILL = 0.01  #: of the ratio: work of the loads in a sample, over that so far, of a specimen whose pieces fly


def _ends(stage: Stage, attribute: attrs.Attribute, value: Sequence[Condition]) -> None:
    if not fits(value, Sequence[Condition]) or not (len(value) or stage.temperature is not None):
        raise refusal("Stage: until", value, "a list of at least one Condition")


def _vector(value: Any) -> tuple[float, float]:
    x, y = checked_vector("Stage: gravity", value, "m/s2").tolist()
    return x, y


def _temperature() -> Any:
    def convert(value: Any) -> float | None:
        return None if value is None else checked_number("Stage: temperature", value, "°C", at_least=ABSOLUTE_ZERO)

    return attrs.field(default=None, converter=convert)


@attrs.frozen(kw_only=True)
class Ageing(metaclass=Checked):
    """Time that passes in jumps while a specimen is at rest under the loads of a stage.

    Whenever two successive samples are at rest, to the ``ratio`` of :class:`AtRest` and but for pieces that fly free
    (then the loads do no work), bonds whose law has a ``fatigue``
    in its memory age under the displacements that they have: by as much time as lets the fatigue of no bond grow by
    more than ``largest_growth``, and no farther than ``duration`` in the stage. Then the specimen goes to the next
    equilibrium by its motion.
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


@attrs.frozen(kw_only=True)
class Stage(metaclass=Checked):
    """What is imposed, and until when. Boundaries and axes on which nothing is imposed are free."""

    name: str  #: shown while it runs
    drives: Sequence[Drive | Hold] = ()  #: boundaries that are moved or held
    loading: Loading | None = None  #: multiplies the speeds of all drives; they are then written for 1 m/s
    temperature: float | None = _temperature()  #: °C, to which the loading heats or cools, for 1 K/s; None: it stays
    pressures: Sequence[Pressure] = ()  #: pressures on boundaries
    tractions: Sequence[Traction] = ()  #: of stresses beyond boundaries
    quiet: Sequence[Quiet] = ()  #: boundaries that absorb waves
    fluids: Sequence[FluidPressure] = ()  #: fluids at boundaries and in the cracks that are connected with them
    #: the stage ends when one of them is fulfilled, or when it has come to its temperature
    until: Sequence[Condition] = attrs.field(default=(), validator=_ends)
    interval: float = parameter("s")  #: time between samples; with a loading that at 1 m/s or 1 K/s, so m or K
    #: into which a sample is divided in which contacts are damaged, so that a strength does not depend on ``interval``
    pieces: int = whole_number(default=1, at_least=1)
    integrator: Integrator = part(Integrator, CentralDifference())  #: the time integration, with its damping
    initial_velocity: np.ndarray | None = attrs.field(default=None, eq=False)  #: (i, 2) m/s added to the nodes
    gravity: tuple[float, float] = attrs.field(default=(0.0, 0.0), converter=_vector)  #: m/s2
    fixed: Sequence[int] = grain_numbers()  #: grains that neither move nor turn
    sample_limit: int = whole_number(default=100_000, at_least=1)  #: the run stops with an error after so many samples
    static: bool = False  #: bring the specimen under its loads by static solutions, in motion where they do not exist
    ageing: Ageing | None = None  #: time that passes in jumps, beside that of the steps
    expected: int | None = whole_number(default=None, at_least=1)  #: samples to its end, if known; a loading needs it

    def __attrs_post_init__(self) -> None:
        moves = any(isinstance(drive, Drive) and drive.speed != 0 for drive in self.drives)
        self._check_functions()
        if self.static and (moves or self.initial_velocity is not None):
            loads = "gravity, platens under a force, pressures and tractions"
            raise ParameterError(f"Stage '{self.name}': static is for {loads}")
        if self.static and self.quiet:
            raise ParameterError(f"Stage '{self.name}': a static stage has no waves; let a stage after it be quiet")
        self._check_fluids()
        self._check_quiet()
        if self.temperature is not None:
            self._check_heating(moves)
            moves = True
        if self.loading is None:
            return
        if self.expected is None:
            raise ParameterError(f"Stage '{self.name}': a loading needs expected, the number of samples to its end")
        if not moves:
            raise ParameterError(f"Stage '{self.name}': a loading needs a drive whose speed is not 0")
        if self.temperature is None and isinstance(self.loading, HeatingRate):
            raise ParameterError(
                f"Stage '{self.name}': loading = {self.loading!r} is not allowed without a temperature to go to"
            )
        for drive in self.drives:
            if isinstance(drive, Drive) and not isinstance(drive.speed, float):
                raise ParameterError(
                    f"Stage '{self.name}': a loading multiplies speeds that are numbers; that of the boundary "
                    f"{drive.boundary} changes with time by itself"
                )

    def _check_functions(self) -> None:
        """Refuse to wait for the end of a load that is a function of time, of which it is not known."""
        endless = next((one for one in self.loads if math.isinf(one.lasts)), None)
        if endless is not None and (self.static or any(end.waits_for_rest for end in self.until)):
            what = "static" if self.static else "AtRest"
            raise ParameterError(
                f"Stage '{self.name}': {what} needs loads of which it is known when they no longer change, that of the "
                f"boundary {endless.boundary} is a function of time: give it as a TimeSeries"
            )

    def _check_fluids(self) -> None:
        held = {one.boundary: "a drive" for one in self.drives if not is_roller(one)}
        held |= {one.boundary: "a pressure behind a membrane" for one in self.pressures}
        known: set[str] = set()
        for one in self.fluids:
            where = f"Stage '{self.name}': boundary = {one.boundary!r}"
            if one.boundary in known:
                raise ParameterError(f"{where} has two fluids, it can have one")
            if one.boundary in held and not one.cracks_only:
                raise ParameterError(
                    f"{where} has {held[one.boundary]}, so that a fluid can only be in the cracks behind it: give it "
                    "cracks_only=True"
                )
            known.add(one.boundary)

    def _check_quiet(self) -> None:
        driven = {one.boundary for one in self.drives if isinstance(one, Hold)}
        names = [one.boundary for one in self.quiet]
        for name in names:
            where = f"Stage '{self.name}': boundary = {name!r}"
            if names.count(name) > 1:
                raise ParameterError(f"{where} is quiet twice, it can be so once")
            if name in driven:
                raise ParameterError(f"{where} is quiet and has a platen under a force: let a Traction give the force")

    def _check_heating(self, moves: bool) -> None:
        if self.loading is None or self.loading.ramp or isinstance(self.loading, Constant):
            wanted = "one in K/s without a ramp, such as Adaptive() or HeatingRate(rate=...)"
            raise ParameterError(
                f"Stage '{self.name}': loading = {self.loading!r} is not allowed for temperature = "
                f"{self.temperature:g} °C, it must be {wanted}"
            )
        if moves or self.static:
            raise ParameterError(
                f"Stage '{self.name}': a stage with a temperature holds its boundaries, or loads them by stresses; "
                "move them in a stage of its own"
            )

    @property
    def loads(self) -> list[Imposed]:
        """All that is imposed on boundaries at a level."""
        return [*self.drives, *self.pressures, *self.tractions, *self.fluids]

    @property
    def moved_by(self) -> Integrator:
        """The integrator, in its form for a stage that waits for rest where this one does."""
        waits = self.ageing is not None or any(end.waits_for_rest for end in self.until)
        return self.integrator.seeking_rest() if waits and self.loading is None else self.integrator

    @property
    def ends(self) -> list[Condition]:
        """All conditions that end it."""
        return [*self.until, *([] if self.temperature is None else [ComesTo(TEMPERATURE, self.temperature)])]

    @property
    def imposed(self) -> list[Drive | Hold]:
        """The drives, with the ramp of the loading."""
        ramp = 0.0 if self.loading is None else self.loading.ramp
        return [attrs.evolve(drive, ramp=ramp) if ramp and isinstance(drive, Drive) else drive for drive in self.drives]
