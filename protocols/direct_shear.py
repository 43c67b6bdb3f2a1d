"""Direct shear under constant normal load or constant normal stiffness."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import attrs

from grainlaw.integration import CentralDifference, Integrator
from grainlaw.loading import AtRest, Condition, Curves, Drive, FallsTo, Hold, LoadingProtocol, Reaches, Stage
from grainlaw.parameter import parameter, part
from grainlaw.protocols.joint import joint_means, require_joint
from grainlaw.protocols.measures import size
from grainlaw.specimen import Specimen
from grainlaw.state import State


@attrs.frozen(kw_only=True)
class DirectShear(LoadingProtocol):
    """Two blocks with one horizontal joint: press, shear to ``maximum_slip``, and back to ``reverse_to`` of it.

    The upper end is a platen that does not turn: it is held at the normal stress, free to rise and sink, while it moves
    to the right. With a ``normal_stiffness`` (constant normal stiffness) the stress grows as the joint dilates.
    """

    normal_stress: float = parameter("Pa", at_least=0)  #: compression
    normal_stiffness: float = parameter("Pa/m", default=0.0, at_least=0)
    speed: float = parameter("m/s", default=0.01)
    ramp: float = parameter("s", default=5e-5)  #: time in which the normal stress comes up
    turn: float = parameter("s", default=1e-5, at_least=0)  #: time in which the speed changes from stage to stage
    maximum_slip: float = parameter("m", default=50e-6)  #: of the platens against each other
    reverse_to: float = parameter("1", default=1.0, at_least=-1, at_most=1)  #: 1 does not reverse
    resolution: float = parameter("m", default=4e-8)  #: way of the upper block between samples
    integrator: Integrator = part(Integrator, CentralDifference())

    def stages(self, specimen: Specimen) -> Sequence[Stage]:
        require_joint(specimen, type(self).__name__)
        press = Hold(boundary="top", axis=1, stress=-self.normal_stress, ramp=self.ramp)
        stages = [
            Stage(
                name="press",
                drives=[press, *self._across(0.0, 0.0)],
                until=[AtRest(1e-4) if self.normal_stress > 0 else Reaches("time", self.ramp)],
                interval=self.ramp,
                integrator=self.integrator,
            ),
            self._shear("shear", 0.0, self.speed, Reaches("displacement", self.maximum_slip)),
        ]
        if self.reverse_to < 1:
            stages.append(self._shear("reverse", self.speed, -self.speed, FallsTo("displacement", self.reverse_to)))
        return stages

    def _shear(self, name: str, before: float, speed: float, until: Condition) -> Stage:
        press = Hold(boundary="top", axis=1, stress=-self.normal_stress, ramp=0.0, stiffness=self.normal_stiffness)
        return Stage(
            name=name,
            drives=[press, *self._across(before, speed)],
            until=[until],
            interval=self.resolution / self.speed,
            integrator=self.integrator,
        )

    def _across(self, before: float, speed: float) -> list[Drive]:
        return [
            Drive(boundary="top", axis=0, start=before, speed=speed, ramp=self.turn),
            *(Drive(boundary="bottom", axis=axis, speed=0.0) for axis in (0, 1)),
        ]

    def measure(self, state: State) -> dict[str, float]:
        """The joint's means; from the platens ``displacement``, ``dilation`` (m), ``shear_stress``, ``normal_stress``.

        Stresses are reactions over the width at the start, compression positive.
        """
        width, _ = size(state.specimen)
        (x, y), (force_x, force_y) = state.moved("top"), state.reaction("top")
        return {
            **joint_means(state),
            "displacement": float(x),
            "dilation": float(y),
            "shear_stress": float(force_x) / width,
            "normal_stress": -float(force_y) / width,
        }

    def summary(self, curves: Curves, specimen: Specimen) -> dict[str, Any]:
        """Largest shear stress, the slip at it, and the shear stress at the end of the way out."""
        peak, end = int(curves["shear_stress"].argmax()), int(curves["displacement"].argmax())
        return {
            "peak_stress": float(curves["shear_stress"][peak]),
            "peak_slip": float(curves["slip"][peak]),
            "residual_stress": float(curves["shear_stress"][end]),
        }
