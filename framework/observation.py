"""Observers: what is kept or shown of a run while it goes on."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import TYPE_CHECKING

import attrs
import numpy as np

from grainlaw.parameter import whole_number

if TYPE_CHECKING:
    from grainlaw.loading import Stage
    from grainlaw.state import State


class Observer(ABC):
    """Sees the state after every sample.

    A whole observer, the highest speed of any node::

        @attrs.define
        class TopSpeed(gl.Observer):
            speed: float = 0.0

            def observe(self, state, curves, stage, progress):
                self.speed = max(self.speed, float(np.hypot(*state.velocity.T).max()))
    """

    @abstractmethod
    def observe(self, state: State, curves: Mapping[str, np.ndarray], stage: Stage, progress: float) -> None:
        """Called after each sample with what was recorded so far and the share of the stage that is done."""


@attrs.frozen(eq=False)
class Frame:
    """What a picture of one moment needs, copied out of the state."""

    time: float  #: s
    displacement: np.ndarray  #: (i, 2) m
    velocity: np.ndarray  #: (i, 2) m/s
    stress: np.ndarray  #: (g, 3) Pa, xx, yy, xy
    contacts: dict[str, np.ndarray]  #: (p,) damage, mode, opening, slip, normal, shear, broken_time


def take_frame(state: State) -> Frame:
    """Copy the present moment."""
    names = ("opening", "slip", "normal", "shear", "mode", "broken_time")
    contacts = {name: np.array(getattr(state, name)) for name in names}
    contacts["damage"] = state.memory("damage")
    return Frame(state.time, state.displacement.copy(), state.velocity.copy(), state.grain_stress(), contacts)


@attrs.define
class FrameRecorder(Observer):
    """Keeps about ``count`` frames spread over the progress of the last stage, and the moment of the highest stress.

    Frames at every ``1 / count`` of progress; where progress is not known ahead (a stage that ends by a drop), the
    spacing is by the limit that is known.
    """

    count: int = whole_number(default=30, at_least=1)
    frames: list[Frame] = attrs.field(factory=list)
    _due: float = 0.0
    _stage: str = ""

    def observe(self, state: State, curves: Mapping[str, np.ndarray], stage: Stage, progress: float) -> None:
        if stage.name != self._stage:
            self._stage, self._due = stage.name, 0.0
        if progress >= self._due:
            self.frames.append(take_frame(state))
            self._due = (np.floor(progress * self.count) + 1) / self.count
