"""Tests of a joint between two blocks: pulled, and sheared, as is a specimen in a shear box."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import attrs
import numpy as np

from grainlaw.columns import SHARED, STAGE, STRAIN, STRESS, STRESS_BOTTOM, STRESS_TOP, Panel
from grainlaw.conditions import AtRest, Condition, Curves, FallsTo, Reaches
from grainlaw.engine.state import State
from grainlaw.fields import ParameterError, parameter, part
from grainlaw.gauges import ends
from grainlaw.integration import CentralDifference, Integrator
from grainlaw.loading import Adaptive, HeatingRate, Loading
from grainlaw.loads import Drive, Hold
from grainlaw.protocol import LoadingProtocol
from grainlaw.protocols.between_platens import NO_TENSION, refuse_platens, require_platens
from grainlaw.protocols.measures import end_share, failure_summary, is_rock, size
from grainlaw.quantity import Quantity
from grainlaw.specimen import Specimen
from grainlaw.stage import Load, Stage

#: samples, and passages of a shear wave, after which a specimen without rest under its normal stress is given up
PRESSED, PASSAGES = 200, 120


def require_joint(specimen: Specimen, test: str) -> None:
    """Raise ParameterError unless the specimen is two blocks, one upon the other, with or without platens."""
    require_platens(specimen, test)
    rock = is_rock(specimen)
    count, heights = int(rock.sum()), specimen.grains.centroids[rock, 1]
    if count != 2 or np.ptp(heights) == 0 or not _in_joint(specimen).any():
        raise ParameterError(
            f"{test}: the specimen has {count} grains, it must have two, one on the other, such as Bricks(rows=2) makes"
        )


def _in_joint(specimen: Specimen) -> np.ndarray:
    """(c,) whether an interface belongs to the joint; the others lie inside the platens."""
    return is_rock(specimen)[specimen.mesh.interface_grains].all(axis=1)


def joint_means(state: State) -> dict[str, float]:
    """Means over the joint: ``opening``, ``slip`` (m, of the upper block to the right), ``normal`` and ``shear`` (Pa).

    ``broken`` is the share of the joint that has broken.
    """
    lengths = state.contact_lengths * np.tile(_in_joint(state.specimen)[state.bonds.order], 2)
    share = lengths / lengths.sum()
    return {
        "opening": float(share @ state.opening),
        "slip": -float(share @ state.slip),  # the tangent runs counter-clockwise round the first block
        "normal": float(share @ state.normal),
        "shear": -float(share @ state.shear),
        "broken": float(share @ (state.memory("damage") >= 1)),
    }


def _moved(
    test: JointTension | DirectShear, name: str, loads: Sequence[Load], until: Sequence[Condition], way: float
) -> Stage:
    """A stage whose drives move by about so much (m), sampled by the resolution of the test."""
    return Stage(
        name=name, loads=loads, until=until, loading=test.loading, interval=test.resolution,
        expected=max(1, round(way / test.resolution)) + test.loading.delay(test.resolution),
        integrator=test.integrator,
    )  # fmt: skip


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
        attrs.evolve(SHARED[STRESS], words="mean stress of both ends", meaning="tension positive"),
        attrs.evolve(SHARED[STRAIN], words="strain of both blocks", meaning="change of their height over it"),
    )
    panels = (Panel("opening", ["normal"]), Panel(STRAIN, [STRESS]))

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
        loads = [pull, Drive(boundary="bottom", axis=1, speed=0.0), *held]
        return _moved(self, name, loads, until, self.unload_at)

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
        attrs.evolve(SHARED["displacement"], counts=True),
        Quantity("dilation", "µm", meaning="of the specimen without platens", counts=True),
        Quantity("failure_slip", "µm"),
        Quantity("residual_stress", "MPa", form=".2f", is_main=True),
    )
    panels = tuple(Panel("displacement", [name]) for name in ("shear_stress", "dilation", "normal_stress"))

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
                sample_limit=max(PRESSED, math.ceil(PASSAGES * specimen.longest_passage / self.ramp)),
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
        return _moved(self, name, [press, *self._across(specimen, sign)], [until], share * self.maximum_slip)

    def _across(self, specimen: Specimen, speed: float) -> list[Drive]:
        moved, held = ("top", *_boxed(specimen, "upper")), ("bottom", *_boxed(specimen, "lower"))
        return [
            *(Drive(boundary=name, axis=0, speed=speed) for name in moved),
            *(Drive(boundary=name, axis=0, speed=0.0) for name in held),
            Drive(boundary="bottom", axis=1, speed=0.0),
        ]

    def measure(self, state: State) -> dict[str, float]:
        """Of the platens ``displacement``, ``dilation`` (m), ``shear_stress`` and ``normal_stress``; means of a joint.

        Dilation is that of the specimen without platens, from before it is pressed. Stresses are reactions over the
        width at the start; ``normal_stress`` counts compression positive, ``shear_stress`` is the mean of both ends.
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
        """Strength, slip there (displacement in a box), largest stress, certificate; the residual one after a failure.

        It is that at the end of shearing: of the last stage that has moved the upper half forwards.
        """
        stage, way = curves[STAGE], curves["displacement"]
        each = [np.flatnonzero(stage == number) for number in np.unique(stage)]
        end = next((of[-1] for of in reversed(each) if way[of[-1]] > way[of[0]]), -1)
        slip = {"failure_slip": "slip" if "slip" in curves else "displacement"}
        found = failure_summary(curves, "shear_stress", "displacement", slip, residual_stress=math.nan)
        residual = math.nan if math.isnan(found["strength"]) else float(curves["shear_stress"][end])
        return found | {"residual_stress": residual}


def _boxed(specimen: Specimen, half: str) -> list[str]:
    """Sides that a half of the shear box holds."""
    return [name for name in (f"left_{half}", f"right_{half}") if name in specimen.mesh.boundaries]
