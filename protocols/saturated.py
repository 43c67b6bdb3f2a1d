"""Any test on a specimen in a fluid."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import attrs
import numpy as np

from grainlaw.columns import SATURATES, STAGE, TIME, WET, Panel
from grainlaw.conditions import AtRest, Curves
from grainlaw.engine.state import State
from grainlaw.fields import ParameterError, checked_field, parameter, part
from grainlaw.integration import CentralDifference, Integrator, Undamped
from grainlaw.loads import BoundaryLoad, Drive, Driven, FluidPressure, Hold, Pressure, Quiet
from grainlaw.messages import enumeration, refusal
from grainlaw.protocol import LoadingProtocol
from grainlaw.protocols.preliminary import after_stages, begins_after, counted_after
from grainlaw.protocols.uniaxial import UniaxialCompression
from grainlaw.quantity import Quantity
from grainlaw.specimen import Specimen
from grainlaw.stage import Load, Stage

SATURATE = "saturate"  #: name of the stage before a test
SAMPLES = 20  #: in its ramp
ROUNDING = 1e-6  #: of the pressed length: less is no push
MOST = 10_000  #: samples until the specimen rests in the fluid


def _names(where: str, value: Any) -> tuple[str, ...]:
    names = (value,) if isinstance(value, str) else tuple(value) if isinstance(value, Sequence) else value
    if not isinstance(names, tuple) or not names or not all(isinstance(name, str) for name in names):
        raise refusal(where, names, "a list of names of boundaries")
    if len(set(names)) < len(names):
        raise ParameterError(f"{where} = {names} is not allowed, each can be named once")
    return names


@attrs.frozen(kw_only=True)
class Saturated(LoadingProtocol):
    """Another test on a specimen in a fluid, which fills the cracks that it reaches.

    It is a :class:`~grainlaw.loads.FluidPressure`, which rises together with the confinement, or the normal stress, of
    a test that begins with one, else before the test, which goes on when the specimen rests, and counts strains and
    cracks from its own beginning. On boundaries that the test moves, or presses by a membrane, the fluid is in the
    cracks behind them alone; others it presses.
    """

    test: LoadingProtocol = part(LoadingProtocol, UniaxialCompression())  #: what the specimen is put through
    pressure: float = parameter("Pa")  #: of the fluid
    #: names of those at which the fluid is
    boundaries: tuple[str, ...] = checked_field(_names, default=("left", "right"))
    ramp: float = parameter("s", default=2e-4)  #: time in which the pressure rises, if the test has none of its own

    def __attrs_post_init__(self) -> None:
        if isinstance(self.test, Saturated):
            raise refusal("Saturated: test", self.test, "another test such as UniaxialCompression()")

    @property
    def quantities(self) -> Sequence[Quantity]:
        """Those of the test."""
        return self.test.quantities

    @property
    def panels(self) -> Sequence[Panel]:
        """Those of the test, and how many contact points the fluid has reached."""
        return (*self.test.panels, Panel(TIME, [WET]))

    def stages(self, specimen: Specimen) -> Sequence[Stage]:
        specimen.mesh.require_boundaries("Saturated", *self.boundaries)
        stages = list(self.test.stages(specimen))
        pressed = self._pressed(stages)
        moves = any(drive.moves for stage in stages for drive in stage.of(Drive))
        first = stages.pop(0) if moves and _loads(stages[0]) else self._saturate(stages[0])
        ramp = max(_ramps(first), default=0.0) or self.ramp
        rising, steady = (
            [
                FluidPressure(boundary=name, pressure=self.pressure, ramp=time, cracks_only=name not in pressed)
                for name in self.boundaries
            ]
            for time in (ramp, 0.0)
        )
        _check_held(specimen, first, pressed)
        return [_with(first, rising), *(_with(stage, steady) for stage in stages)]

    def _pressed(self, stages: Sequence[Stage]) -> list[str]:
        """Boundaries that the fluid presses: those that the test neither moves nor presses."""
        covered = {one.boundary for stage in stages for one in stage.of(Pressure)}
        covered |= {one.boundary for stage in stages for one in stage.of(Driven) if not one.roller}
        return [name for name in self.boundaries if name not in covered]

    def _saturate(self, stage: Stage) -> Stage:
        """What is imposed by ``stage`` before it, until the specimen rests: its drives rest, or hold no force."""
        return attrs.evolve(
            stage, name=SATURATE, loads=[load for load in map(_at_start, stage.loads) if load is not None],
            loading=None, ageing=None, pieces=1, expected=None, static=not stage.of(Quiet), until=[AtRest(1e-4)],
            interval=self.ramp / SAMPLES, sample_limit=MOST, integrator=_comes_to_rest(stage.integrator),
        )  # fmt: skip

    def measure(self, state: State) -> dict[str, float]:
        """As the test; ``wet``, the number of contact points that the fluid has reached; ``saturates`` before it."""
        wet = int((state.fluid_pressure > 0).sum())
        return {**self.test.measure(state), WET: wet, SATURATES: int(state.stage == SATURATE)}

    def begins(self, curves: Curves) -> int:
        """When the specimen rests in the fluid, where a stage of its own brings that about."""
        return begins_after(self.test, curves, _stages_before(curves))

    def counted(self, curves: Curves, first: int) -> Curves:
        """As the test; strains and cracks count from its beginning, as in its summary."""
        return counted_after(self.test.counted, curves, first, _stages_before(curves), self.quantities)

    def summary(self, curves: Curves, specimen: Specimen) -> dict[str, Any]:
        """Of the test, with the pressure of the fluid and the contact points that it has reached.

        Where it presses both sides, it is the ``confinement`` under which strengths are.
        """
        found = {"fluid_pressure": self.pressure, "wet": int(curves[WET][-1])}
        if {"left", "right"} <= set(self._pressed(self.test.stages(specimen))):
            found["confinement"] = self.pressure
        after = after_stages(curves, _stages_before(curves), self.quantities)
        return {**found, **self.test.summary(after, specimen)} if len(after[STAGE]) else found


def _with(stage: Stage, fluids: Sequence[FluidPressure]) -> Stage:
    return attrs.evolve(stage, loads=[*stage.loads, *fluids])


def _check_held(specimen: Specimen, stage: Stage, pressed: Sequence[str]) -> None:
    """Raise ParameterError where the fluid pushes the whole specimen along an axis on which nothing holds it."""
    mesh = specimen.mesh
    for axis, name in enumerate("xy"):
        sides = [np.diff(mesh.nodes[mesh.boundary_edges[one]], axis=1)[:, 0, 1 - axis] for one in pressed]
        push, whole = (abs(sum(map(np.sum, sides))), sum(np.sum(np.abs(side)) for side in sides))
        if push > ROUNDING * whole and not any(one.axis == axis for one in stage.of(Driven)):
            raise ParameterError(
                f"Saturated: boundaries: the fluid on {enumeration(pressed)} pushes the specimen along {name}, where "
                "the test holds nothing; name the boundary on the other side, too"
            )


def _stages_before(curves: Curves) -> int:
    return int(curves[SATURATES][0])


def _loads(stage: Stage) -> bool:
    """Whether a stage brings stresses on a specimen and nothing else."""
    return any(_ramps(stage)) and not any(load.moves for load in stage.loads)


def _ramps(stage: Stage) -> list[float]:
    return [load.ramp for load in stage.of(BoundaryLoad)]


def _comes_to_rest(integrator: Integrator) -> Integrator:
    """One for waves, which nothing damps, would never."""
    undamped = isinstance(integrator, CentralDifference) and isinstance(integrator.damping, Undamped)
    return CentralDifference() if undamped else integrator


def _at_start(load: Load) -> Load | None:
    if not isinstance(load, Drive):
        return load.at_start()
    if load.moves and not load.roller:
        return Hold(boundary=load.boundary, axis=load.axis, stress=0.0)
    return attrs.evolve(load, speed=0.0, start=0.0, ramp=0.0)
