"""Frames: moments of a run that are kept for pictures, and when one is taken."""

from __future__ import annotations

from collections.abc import Mapping

import attrs
import numpy as np

from grainlaw.arguments import Checked
from grainlaw.engine.dissipation import balance
from grainlaw.engine.state import State
from grainlaw.observation import Observer
from grainlaw.parameter import whole_number
from grainlaw.stage import Stage


@attrs.frozen(eq=False)
class Frame(metaclass=Checked):
    """One moment, copied out of the state."""

    time: float  #: s
    displacement: np.ndarray  #: (i, 2) m
    velocity: np.ndarray  #: (i, 2) m/s
    stress: np.ndarray  #: (g, 3) Pa, xx, yy, xy
    bonds: dict[str, np.ndarray]  #: (p,) damage, mode, opening, slip, normal, shear, broken_time, lost_*, made
    contacts: dict[str, np.ndarray]  #: (k,) those that are closed, see :meth:`Contacts.closed`; empty without detection


def take_frame(state: State) -> Frame:
    """Copy the present moment; energies lost and made (J/m2) are those of :mod:`~grainlaw.engine.dissipation`."""
    names = ("opening", "slip", "normal", "shear", "broken_time")
    bonds = {name: np.array(getattr(state, name)) for name in names}
    bonds["mode"] = np.where(np.isnan(state.broken_time), state.mode, state.broken_mode)
    bonds["damage"] = state.memory("damage")
    (bonds["lost_opening"], bonds["lost_slip"]), bonds["made"] = balance(state)
    closed = {} if state.contacts.detection is None else state.contacts.closed()
    return Frame(state.time, state.displacement.copy(), state.velocity.copy(), state.grain_stress(), bonds, closed)


@attrs.define
class FrameClock:
    """Decides when a frame is taken: at every ``1 / count`` of the progress of a stage, and as cracks grow.

    Failure may happen within a small part of the progress, such as a strain; so a frame is also taken each time that
    another 2 % of the contact points has broken.
    """

    count: int = whole_number(default=30, at_least=1)
    _stage: str = ""
    _next: float = 0.0
    _broken: int = 0

    def due(self, state: State, stage: Stage, progress: float) -> bool:
        """Whether a frame is taken at this sample."""
        if stage.name != self._stage:
            self._stage, self._next = stage.name, 0.0
        broken = int(np.count_nonzero(~np.isnan(state.broken_time)))
        if progress < self._next and 50 * (broken - self._broken) < len(state.broken_time):
            return False
        self._next, self._broken = (np.floor(progress * self.count) + 1) / self.count, broken
        return True


@attrs.define
class FrameRecorder(Observer):
    """Keeps frames in memory."""

    clock: FrameClock = attrs.field(factory=FrameClock)
    frames: list[Frame] = attrs.field(factory=list)

    def observe(self, state: State, curves: Mapping[str, np.ndarray], stage: Stage, progress: float) -> None:
        if self.clock.due(state, stage, progress):
            self.frames.append(take_frame(state))
