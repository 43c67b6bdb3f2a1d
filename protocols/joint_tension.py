"""A joint pulled, unloaded, reloaded, broken, closed and pulled again."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import attrs

from grainlaw.columns import STRAIN, STRESS, STRESS_BOTTOM, STRESS_TOP
from grainlaw.condition import Condition, Curves, FallsTo, Reaches
from grainlaw.engine.state import State
from grainlaw.fields import ParameterError, parameter, part
from grainlaw.integration import CentralDifference, Integrator
from grainlaw.loading import Adaptive, HeatingRate, Loading
from grainlaw.loads import Drive
from grainlaw.protocol import LoadingProtocol
from grainlaw.protocols.between_platens import NO_TENSION, refuse_platens
from grainlaw.protocols.joint import joint_means, require_joint
from grainlaw.protocols.measures import failure_summary, size
from grainlaw.quantity import Quantity
from grainlaw.specimen import Specimen
from grainlaw.stage import Stage


@attrs.frozen(kw_only=True)
class JointTension(LoadingProtocol):
    """Two blocks with one horizontal joint: pull, unload, reload until it breaks, close, pull again.

    The upper block moves, the lower one is held. Blocks taller than E' over the steepest slope of the softening (83 mm
    for 60 GPa and the cohesive crack of the paper) snap back: the joint softens faster than the platen moves.
    """

    loading: Loading = part(Loading, Adaptive(), without=HeatingRate)  #: how fast the upper block moves
    unload_at: float = parameter("m", default=5e-6)  #: opening of the joint
    maximum_opening: float = parameter("m", default=50e-6)  #: where pulling ends if the joint has not broken
    closing_pressure: float = parameter("Pa", default=10e6)  #: up to which the broken joint is pressed
    resolution: float = parameter("m", default=2e-8)  #: displacement of the upper block between samples
    integrator: Integrator = part(Integrator, CentralDifference())  #: the time integration, with its damping

    quantities = (
        Quantity("pressure", "MPa", form=".2f", meaning="on the joint"),
        Quantity("failure_opening", "µm", is_main=True),
        Quantity("breaking_opening", "µm", meaning="when the whole joint had broken"),
    )

    def __attrs_post_init__(self) -> None:
        if self.unload_at >= self.maximum_opening:
            raise ParameterError(
                f"JointTension: unload_at = {self.unload_at:g} is not allowed, it must be below maximum_opening = "
                f"{self.maximum_opening:g}"
            )

    def stages(self, specimen: Specimen) -> Sequence[Stage]:
        require_joint(specimen, type(self).__name__)
        refuse_platens(specimen, type(self).__name__, NO_TENSION)
        open_wide = Reaches("opening", self.maximum_opening)
        return [
            self._stage("pull", 1, Reaches("opening", self.unload_at), Reaches("broken", 1.0)),
            self._stage("unload", -1, FallsTo("normal", 0.0), FallsTo("opening", 0.0)),
            self._stage("reload", 1, Reaches("broken", 1.0), open_wide),
            self._stage("close", -1, Reaches("pressure", self.closing_pressure)),
            self._stage("pull again", 1, Reaches("opening", self.unload_at)),
        ]

    def _stage(self, name: str, direction: float, *until: Condition) -> Stage:
        pull = Drive(boundary="top", axis=1, speed=direction)
        held = [Drive(boundary=side, axis=0, speed=0.0) for side in ("bottom", "top")]
        return Stage(
            name=name,
            loads=[pull, Drive(boundary="bottom", axis=1, speed=0.0), *held],
            until=until,
            loading=self.loading,
            interval=self.resolution,
            expected=max(1, round(self.unload_at / self.resolution)) + self.loading.delay(self.resolution),
            integrator=self.integrator,
        )

    def measure(self, state: State) -> dict[str, float]:
        """Means over the joint; ``strain`` is that of the height of both blocks, ``stress`` the mean reaction."""
        width, height = size(state.specimen)
        joint = joint_means(state)
        top, bottom = float(state.reaction("top")[1]) / width, -float(state.reaction("bottom")[1]) / width
        return {
            **joint,
            "pressure": -joint["normal"],
            STRAIN: float(state.moved("top")[1]) / height,
            STRESS: (top + bottom) / 2,
            STRESS_TOP: top,
            STRESS_BOTTOM: bottom,
        }

    def summary(self, curves: Curves, specimen: Specimen) -> dict[str, Any]:
        """Tensile strength, opening there, opening when the whole joint had broken (nan if it has not), certificate."""
        broken = curves["opening"][curves["broken"] >= 1]
        opening = float(broken[0]) if len(broken) else float("nan")
        return failure_summary(
            curves, "normal", "opening", {"failure_opening": "opening"}, breaking_opening=opening
        )  # fmt: skip
