"""Observers: what is recorded or shown during a run."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping

import numpy as np

from grainlaw.arguments import Checked
from grainlaw.engine.state import State
from grainlaw.stage import Stage


class Observer(metaclass=Checked):
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
        """Called after each sample with the curves so far and the share of the stage that is done."""

    def save(self) -> dict[str, np.ndarray]:
        """What a checkpoint must keep of this observer, as arrays by name; nothing by default."""
        return {}

    def restore(self, state: State, saved: Mapping[str, np.ndarray]) -> None:
        """Go on from what :meth:`save` returned, in a run that is restarted at this ``state``."""
