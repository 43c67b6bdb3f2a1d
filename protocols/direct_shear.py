"""Direct shear under constant normal load or constant normal stiffness."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import attrs
import numpy as np

from grainlaw.columns import STAGE
from grainlaw.condition import AtRest, Condition, Curves, FallsTo, Reaches
from grainlaw.engine.state import State
from grainlaw.fields import parameter, part
from grainlaw.gauges import ends
from grainlaw.integration import CentralDifference, Integrator
from grainlaw.loading import Adaptive, HeatingRate, Loading
from grainlaw.loads import Drive, Hold
from grainlaw.protocol import LoadingProtocol
from grainlaw.protocols.between_platens import require_platens
from grainlaw.protocols.joint import joint_means, require_joint
from grainlaw.protocols.measures import end_share, failure_summary, size
from grainlaw.quantity import Quantity
from grainlaw.specimen import Specimen
from grainlaw.stage import Stage

SHEARS = 1  #: number of the stage that shears, after that which presses


@attrs.frozen(kw_only=True)
class DirectShear(LoadingProtocol):
    """Press, shear to ``maximum_slip``, and shear back to ``reverse_to`` times it.

    Either two blocks along their horizontal joint, or a specimen in a shear box, whose upper and lower halves also hold
    its sides (see :func:`~grainlaw.geometry.shear_box`). The upper end is a platen that does not turn: it moves to the
    right under the normal stress, free to rise and sink. With a ``normal_stiffness`` (constant normal stiffness) the
    normal stress grows as the specimen dilates. Platens that are separate bodies (see
    :func:`~grainlaw.geometry.between_platens`) move the blocks by friction alone.
    """

    normal_stress: float = parameter("Pa", at_least=0)  #: compression
    #: of a spring behind the upper platen; 0 keeps the normal stress constant
    normal_stiffness: float = parameter("Pa/m", default=0.0, at_least=0)
    loading: Loading = part(Loading, Adaptive(), without=HeatingRate)  #: how fast the upper half moves
    ramp: float = parameter("s", default=5e-5)  #: time in which the normal stress rises
    maximum_slip: float = parameter("m", default=50e-6)  #: of the platens against each other
    reverse_to: float = parameter("1", default=1.0, at_least=-1, at_most=1)  #: 1 does not reverse
    resolution: float = parameter("m", default=4e-8)  #: displacement of the upper block between samples
    integrator: Integrator = part(Integrator, CentralDifference())  #: the time integration, with its damping

    quantities = (
        *(Quantity(name, "MPa", form=".2f") for name in ("shear_stress", "shear_stress_top", "shear_stress_bottom")),
        Quantity("normal_stress", "MPa", form=".2f", meaning="compression positive"),
        Quantity("dilation", "µm", meaning="of the specimen without platens"),
        Quantity("failure_slip", "µm"),
        Quantity("residual_stress", "MPa", form=".2f", is_main=True),
    )

    def stages(self, specimen: Specimen) -> Sequence[Stage]:
        require_platens(specimen, type(self).__name__)
        if not _boxed(specimen, "upper"):
            require_joint(specimen, type(self).__name__)
        stress = -self.normal_stress * end_share(specimen)
        press = Hold(boundary="top", axis=1, stress=stress, ramp=self.ramp)
        stages = [
            Stage(
                name="press",
                loads=[press, *self._across(specimen, 0.0)],
                until=[AtRest(1e-4) if self.normal_stress > 0 else Reaches("time", self.ramp)],
                interval=self.ramp,
                integrator=self.integrator,
            ),
            self._shear(specimen, "shear", 1.0, Reaches("displacement", self.maximum_slip), 1.0),
        ]
        if self.reverse_to < 1:
            back = FallsTo("displacement", self.reverse_to)
            stages.append(self._shear(specimen, "reverse", -1.0, back, 1 - self.reverse_to))
        return stages

    def _shear(self, specimen: Specimen, name: str, sign: float, until: Condition, share: float) -> Stage:
        stress, stiffness = (value * end_share(specimen) for value in (-self.normal_stress, self.normal_stiffness))
        press = Hold(boundary="top", axis=1, stress=stress, ramp=0.0, stiffness=stiffness)
        return Stage(
            name=name,
            loads=[press, *self._across(specimen, sign)],
            until=[until],
            loading=self.loading,
            interval=self.resolution,
            expected=max(1, round(share * self.maximum_slip / self.resolution)) + self.loading.delay(self.resolution),
            integrator=self.integrator,
        )

    def _across(self, specimen: Specimen, speed: float) -> list[Drive]:
        moved, held = ("top", *_boxed(specimen, "upper")), ("bottom", *_boxed(specimen, "lower"))
        return [
            *(Drive(boundary=name, axis=0, speed=speed) for name in moved),
            *(Drive(boundary=name, axis=0, speed=0.0) for name in held),
            Drive(boundary="bottom", axis=1, speed=0.0),
        ]

    def measure(self, state: State) -> dict[str, float]:
        """Of the platens ``displacement``, ``dilation`` (m), ``shear_stress`` and ``normal_stress``; means of a joint.

        Dilation is that of the specimen without platens. Stresses are reactions over the width at the start;
        ``normal_stress`` counts compression positive, ``shear_stress`` is the mean of both ends.
        """
        width, _ = size(state.specimen)
        x, force_y = state.moved("top")[0], state.reaction("top")[1]
        upper, lower = (state.moved(end)[1] for end in ends(state.specimen))
        top, bottom = (
            float(sum(state.reaction(name)[0] for name in (end, *_boxed(state.specimen, half)))) / width
            for end, half in (("top", "upper"), ("bottom", "lower"))
        )
        return {
            **({} if _boxed(state.specimen, "upper") else joint_means(state)),
            "displacement": float(x),
            "dilation": float(upper - lower),
            "shear_stress": (top - bottom) / 2,
            "shear_stress_top": top,
            "shear_stress_bottom": -bottom,
            "normal_stress": -float(force_y) / width,
        }

    def summary(self, curves: Curves, specimen: Specimen) -> dict[str, Any]:
        """Strength, slip there (displacement in a box), largest stress and that at the end of shearing, certificate."""
        end = int(np.flatnonzero(curves[STAGE] == SHEARS)[-1]) if SHEARS in curves[STAGE] else -1
        slip = {"failure_slip": "slip" if "slip" in curves else "displacement"}
        residual = float(curves["shear_stress"][end])
        return failure_summary(curves, "shear_stress", "displacement", slip, residual_stress=residual)


def _boxed(specimen: Specimen, half: str) -> list[str]:
    """Sides that a half of the shear box holds."""
    return [name for name in (f"left_{half}", f"right_{half}") if name in specimen.mesh.boundaries]
