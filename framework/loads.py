"""What a stage may impose: motions, forces, pressures, tractions, fluids, quiet boundaries, gravity, heat."""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence
from numbers import Integral
from typing import Any

import attrs
import numpy as np

from grainlaw.arguments import floats_or_nan, is_number
from grainlaw.columns import HEAT_TIME, TEMPERATURE
from grainlaw.conditions import ComesTo, Condition, Reaches
from grainlaw.fields import ParameterError, grain_numbers, optional, parameter, part, vector
from grainlaw.loading import Constant, HeatingRate
from grainlaw.material import ABSOLUTE_ZERO
from grainlaw.memory import ROOM
from grainlaw.mesh import Mesh
from grainlaw.messages import refusal, short
from grainlaw.specimen import Specimen
from grainlaw.stage import Load, Stage
from grainlaw.time_series import GAUSS, TimeSeries, Varying, rise, rise_integral, value_of, varying

__all__ = [
    "BarEnd",
    "Conduction",
    "Convection",
    "Drive",
    "Fixed",
    "FixedTemperature",
    "FluidPressure",
    "Gravity",
    "Heat",
    "HeatFlux",
    "HeatSource",
    "Hold",
    "InitialVelocity",
    "Injection",
    "Load",
    "Pressure",
    "Quiet",
    "Traction",
]


def _is_axis(drive: Driven, attribute: attrs.Attribute, value: int) -> None:
    if not is_number(value, Integral) or value not in (0, 1):
        raise refusal(f"{type(drive).__name__}: axis", value, "0 (along x) or 1 (along y)")


def _velocities(value: Any) -> np.ndarray:
    found = floats_or_nan(value)
    if found.ndim != 2 or found.shape[1] != 2 or not np.isfinite(found).all():
        raise refusal("InitialVelocity: velocity", value, "velocities (x, y) in m/s of all nodes, finite")
    return found


class Levelled(Load):
    """A load with a level that may change with time.

    The level is the field that is declared by ``varying``. One that is a number rises from ``start`` in the time
    ``ramp``, smoothly.
    """

    start: float
    ramp: float

    def __attrs_post_init__(self) -> None:
        kind: Any = type(self)
        given = self.start != attrs.fields_dict(kind)["start"].default or self.ramp
        if given and not isinstance(self.level, float):
            raise ParameterError(
                f"{type(self).__name__}: start = {self.start:g} and ramp = {self.ramp:g} s are not allowed beside "
                f"{short(self.level)}, which says itself how it changes with time"
            )

    @property
    def level(self) -> Varying:
        """The number, the points in time or the function."""
        return getattr(self, _field(type(self)).name)

    def course(self, begin: np.ndarray, end: np.ndarray) -> np.ndarray:
        """(n,) levels of steps from ``begin`` to ``end`` (n,) s since the stage began.

        What changes with time counts by its mean over the step: so a boundary moves by the integral of its speed, and a
        force gives the integral of itself as momentum, of a ``TimeSeries`` exactly. A ramp counts by its end.
        """
        level = self.level
        if isinstance(level, TimeSeries):
            return (level.integral(end) - level.integral(begin)) / (end - begin)
        if not callable(level):
            return rise(end, self.ramp, self.start, level)
        field = _field(type(self))
        boundary = getattr(self, "boundary", "")
        place = f" of {boundary}" if boundary else ""
        where, bounds = f"{type(self).__name__}{place}: {field.name}", field.metadata["varies"]
        at = [(begin + share * (end - begin)).tolist() for share in GAUSS]
        return np.array([[value_of(where, level, time, bounds) for time in times] for times in at]).mean(axis=0)

    def at(self, time: float) -> float:
        """The level at a time (s) since the stage began."""
        level = self.level
        return float(level(time) if callable(level) else rise(np.array(time), self.ramp, self.start, level))

    def at_start(self) -> Load | None:
        return attrs.evolve(self, **{_field(type(self)).name: self.at(0.0)}, start=0.0, ramp=0.0)  # type: ignore[misc]

    @property
    def lasts(self) -> float:
        if isinstance(self.level, TimeSeries):
            return max(float(self.level.times[-1]), 0.0)
        return math.inf if callable(self.level) else self.ramp

    @property
    def largest(self) -> float:
        """The largest size of the level; 0 for a function, of which that is not known."""
        if isinstance(self.level, TimeSeries):
            return float(np.abs(self.level.values).max())
        return 0.0 if callable(self.level) else abs(self.level)


class BoundaryLoad(Levelled):
    """What a stage imposes on a boundary: a level that may change with time."""

    boundary: str

    def check(self, stage: Stage) -> None:
        if math.isinf(self.lasts) and (stage.static or any(end.waits_for_rest for end in stage.until)):
            what = "static" if stage.static else "AtRest"
            raise ParameterError(
                f"Stage '{stage.name}': {what} needs loads of which it is known when they no longer change, that of "
                f"the boundary {self.boundary} is a function of time: give it as a TimeSeries"
            )

    def check_specimen(self, specimen: Specimen) -> None:
        specimen.mesh.require_boundaries(type(self).__name__, self.boundary)

    def schedule(self, begin: np.ndarray, end: np.ndarray, pace: float, length: float) -> np.ndarray:
        """(n,) of steps from ``begin`` to ``end`` (n,) s since the stage began: what the part imposes, by step.

        ``pace`` is that of the loading, ``length`` (m) that of the boundary.
        """
        return self.course(begin, end)


@functools.cache
def _field(kind: type) -> attrs.Attribute[Any]:
    """The field of a load that is declared by ``varying``."""
    return next(field for field in attrs.fields(kind) if "varies" in field.metadata)


class Driven(BoundaryLoad):
    """A boundary whose nodes move by the same amount along one axis: at a given speed, or under a force."""

    axis: int
    roller: bool = False  #: whether only its middle is driven

    def check(self, stage: Stage) -> None:
        super().check(stage)
        same = [one for one in stage.of(Driven) if (one.boundary, one.axis) == (self.boundary, self.axis)]
        if len(same) > 1:
            kinds = " and a ".join(type(one).__name__ for one in same)
            raise ParameterError(
                f"Stage '{stage.name}': boundary = {self.boundary!r} has a {kinds} along the axis {self.axis}, it can "
                "have one of them"
            )


@attrs.frozen(kw_only=True)
class Drive(Driven):
    """A boundary that is moved: the velocity of all its nodes along one axis, or of its middle alone (a ``roller``).

    A roller lets the boundary turn: it drives only the node nearest to the middle; if several grains meet there, the
    node of each.
    """

    boundary: str  #: name of the boundary
    axis: int = attrs.field(validator=_is_axis)  #: 0 along x, 1 along y
    speed: Varying = varying("m/s")  #: with its sign; a number, or one that changes with time
    start: float = parameter("m/s", default=0.0, above=-math.inf)  #: at first; ``speed`` after the time ``ramp``
    ramp: float = parameter("s", default=0.0, at_least=0)  #: time in which the speed changes
    roller: bool = part(bool, False)  #: whether only the middle is driven, so that the boundary can turn

    @property
    def moves(self) -> bool:
        return self.speed != 0

    def check(self, stage: Stage) -> None:
        super().check(stage)
        if stage.static and self.moves:
            raise _not_static(stage)
        if self.moves and isinstance(stage.loading, HeatingRate):
            raise ParameterError(
                f"Stage '{stage.name}': loading = {stage.loading!r} is not allowed without a temperature to go to"
            )
        if stage.loading is not None and not isinstance(self.speed, float):
            raise ParameterError(
                f"Stage '{stage.name}': a loading multiplies speeds that are numbers; that of the boundary "
                f"{self.boundary} changes with time by itself"
            )

    def schedule(self, begin: np.ndarray, end: np.ndarray, pace: float, length: float) -> np.ndarray:
        return self.course(begin, end) * pace

    def with_ramp(self, ramp: float) -> Load:
        return attrs.evolve(self, ramp=ramp)

    def reversed(self) -> Drive:
        """The same at the opposite speed. Raises :class:`ParameterError` for a speed that changes with time."""
        if not isinstance(self.speed, float):
            raise ParameterError(f"Drive: speed = {short(self.speed)} is not allowed here, it must be a number (m/s)")
        return attrs.evolve(self, speed=-self.speed)


def _not_static(stage: Stage) -> ParameterError:
    loads = "gravity, platens under a force, pressures and tractions"
    return ParameterError(f"Stage '{stage.name}': static is for {loads}")


class Forced(Driven):
    """A boundary that moves along an axis as one body, under a force; a spring and a dashpot may hold it back."""

    def spring(self, length: float) -> float:
        """N/m, of a boundary of a length (m): what pulls it back to its place at the start of the stage."""
        return 0.0

    def dashpot(self, length: float) -> float:
        """N s/m, of a boundary of a length (m): what resists its velocity."""
        return 0.0


@attrs.frozen(kw_only=True)
class Hold(Forced):
    """A boundary under a force: a platen whose nodes all move by the same amount along one axis.

    ``stress`` is the force over the undeformed length of the boundary, positive along the axis. A spring of
    ``stiffness`` (constant normal stiffness) pulls the platen back to its place at the start of the stage, or of the
    first of the stages one after the other that hold this boundary by such a spring.
    """

    boundary: str  #: name of the boundary
    axis: int = attrs.field(validator=_is_axis)  #: 0 along x, 1 along y
    stress: Varying = varying("Pa")  #: force over undeformed length, positive along the axis
    start: float = parameter("Pa", default=0.0, above=-math.inf)  #: at first; ``stress`` after the time ``ramp``
    ramp: float = parameter("s", default=0.0, at_least=0)  #: time in which the stress changes
    #: of a spring that pulls the platen back to its place
    stiffness: float = parameter("Pa/m", default=0.0, at_least=0)

    def schedule(self, begin: np.ndarray, end: np.ndarray, pace: float, length: float) -> np.ndarray:
        return self.course(begin, end) * length

    def spring(self, length: float) -> float:
        return self.stiffness * length


@attrs.frozen(kw_only=True)
class BarEnd(Forced):
    """A boundary on the end of a long elastic bar, along which a wave may come: Eq. (27) of docs/theory.md.

    The bar is not meshed. It is straight and thin, its end stays flat, and no wave comes back from its other end. The
    force on the boundary is width times (twice ``stress`` less impedance times velocity): exactly that of such a bar
    (Kolsky 1949, doi:10.1088/0370-1301/62/11/302). Without a wave it is a dashpot, the end of a transmission bar.
    """

    boundary: str  #: name of the boundary
    axis: int = attrs.field(validator=_is_axis)  #: of the bar: 0 along x, 1 along y
    #: density times speed of waves in the bar, the root of Young's modulus times density; 4e7 of steel
    impedance: float = parameter("Pa s/m", usual=(1e5, 2e8))
    #: of the wave that comes along the bar, as the force on the boundary over the width: positive along the axis
    stress: Varying = varying("Pa", 0.0)
    start: float = parameter("Pa", default=0.0, above=-math.inf)  #: at first; ``stress`` after the time ``ramp``
    ramp: float = parameter("s", default=0.0, at_least=0)  #: time in which the stress changes
    #: of the bar, its section over the thickness of the specimen; that of the boundary unless given
    width: float | None = optional("m", above=0)
    roller: bool = part(bool, False)  #: whether only the middle is driven, so that the boundary can turn

    def check(self, stage: Stage) -> None:
        super().check(stage)
        if stage.static:
            raise ParameterError(
                f"Stage '{stage.name}': a static stage has no waves; let a stage after it have a BarEnd"
            )

    def schedule(self, begin: np.ndarray, end: np.ndarray, pace: float, length: float) -> np.ndarray:
        return 2 * self.course(begin, end) * (self.width or length)

    def dashpot(self, length: float) -> float:
        return self.impedance * (self.width or length)

    def at_start(self) -> Load | None:
        return Hold(boundary=self.boundary, axis=self.axis, stress=0.0)


@attrs.frozen(kw_only=True)
class Pressure(BoundaryLoad):
    """A pressure on a boundary, normal to it also when it deforms, like that of a fluid behind a thin membrane."""

    boundary: str  #: name of the boundary
    pressure: Varying = varying("Pa")  #: pressing inwards
    start: float = parameter("Pa", default=0.0, above=-math.inf)  #: at first; ``pressure`` after ``ramp``
    ramp: float = parameter("s", default=0.0, at_least=0)  #: time in which the pressure changes


@attrs.frozen(kw_only=True)
class Traction(BoundaryLoad):
    """The forces on a boundary of a uniform stress beyond it: times its normal and length, as it lies at that moment.

    The stress keeps its direction where the boundary turns, so that all round a specimen it has neither resultant nor
    moment. (Forces of fixed direction would have a moment: those of a compression turn a specimen over that nothing
    holds.) ``stress=(0, 0, sxy)`` shears a boundary along x or y; on the rim of an opening it is what the rock held
    that was there. ``factor`` multiplies it, as a pulse does.
    """

    boundary: str  #: name of the boundary
    #: xx, yy, xy, tension positive
    stress: tuple[float, float, float] = vector("Pa", ("xx", "yy", "xy"))
    factor: Varying = varying("1", 1.0)  #: by which it is multiplied
    start: float = parameter("1", default=0.0, above=-math.inf)  #: at first; ``factor`` after the time ``ramp``
    ramp: float = parameter("s", default=0.0, at_least=0)  #: time in which the factor changes


@attrs.frozen(kw_only=True)
class Quiet(Load):
    """A boundary that waves leave as if the rock went on: dashpots (Lysmer and Kuhlemeyer 1969).

    They resist with density times speed of P waves along the normal and of S waves across it, so that what meets the
    boundary head on does not come back. The speeds are those of the boundary's grains unless they are given: of many
    grains with soft contacts waves are slower, see ``gl.elastic_properties``.
    """

    boundary: str  #: name of the boundary
    p_speed: float | None = optional("m/s", above=0)  #: of P waves in the rock as a whole
    s_speed: float | None = optional("m/s", above=0)  #: of S waves

    def __attrs_post_init__(self) -> None:
        if (self.p_speed is None) != (self.s_speed is None):
            raise ParameterError("Quiet: p_speed and s_speed must be given together, or neither of them")

    def check(self, stage: Stage) -> None:
        if stage.static:
            raise ParameterError(f"Stage '{stage.name}': a static stage has no waves; let a stage after it be quiet")
        where = f"Stage '{stage.name}': boundary = {self.boundary!r}"
        if sum(one.boundary == self.boundary for one in stage.of(Quiet)) > 1:
            raise ParameterError(f"{where} is quiet twice, it can be so once")
        if any(one.boundary == self.boundary for one in stage.of(Forced)):
            raise ParameterError(f"{where} is quiet and has a platen under a force: let a Traction give the force")

    def check_specimen(self, specimen: Specimen) -> None:
        specimen.mesh.require_boundaries(type(self).__name__, self.boundary)
        if specimen.is_rigid:
            raise ParameterError(f"Quiet: boundary = {self.boundary!r} is of rigid grains, which carry no waves")


class Fluid(BoundaryLoad):
    """A fluid at a boundary, which also fills the cracks that are connected with it."""

    cracks_only: bool  #: whether the boundary itself bears none of it, as under a membrane or a platen

    def check(self, stage: Stage) -> None:
        super().check(stage)
        where = f"Stage '{stage.name}': boundary = {self.boundary!r}"
        if sum(one.boundary == self.boundary for one in stage.of(Fluid)) > 1:
            raise ParameterError(f"{where} has two fluids, it can have one")
        held = {one.boundary: "a drive" for one in stage.of(Driven) if not one.roller}
        held |= {one.boundary: "a pressure behind a membrane" for one in stage.of(Pressure)}
        if self.boundary in held and not self.cracks_only:
            raise ParameterError(
                f"{where} has {held[self.boundary]}, so that a fluid can only be in the cracks behind it: give it "
                "cracks_only=True"
            )


@attrs.frozen(kw_only=True)
class FluidPressure(Fluid):
    """The pressure of a fluid at a boundary, which also fills the cracks that are connected with it.

    It presses on the boundary and on both faces of every broken contact point, open or closed, that others connect with
    it: the same pressure everywhere, at once, as in slow loading of drained rock. Points without tensile strength count
    as broken. Where a crack joins two fluids, the higher pressure fills it.

    Below a ``water_table`` it grows with depth, from 0 there to ``pressure`` at the lowest place of the specimen.
    """

    boundary: str  #: name of the boundary at which the fluid is
    pressure: Varying = varying("Pa", at_least=0)  #: in the fluid
    start: float = parameter("Pa", default=0.0, at_least=0)  #: at first; ``pressure`` after ``ramp``
    ramp: float = parameter("s", default=0.0, at_least=0)  #: time in which the pressure changes
    water_table: float | None = optional("m")  #: y at which there is no pressure, and above
    cracks_only: bool = False  #: whether the boundary itself bears none of it, as under a membrane or a platen

    def check(self, stage: Stage) -> None:
        super().check(stage)
        if self.water_table is not None and any(one.viscosity for one in stage.of(Injection)):
            raise ParameterError(
                f"Stage '{stage.name}': water_table = {self.water_table:g} m is not allowed beside a viscous "
                "injection, which flows to boundaries of one pressure"
            )

    def check_specimen(self, specimen: Specimen) -> None:
        super().check_specimen(specimen)
        if self.water_table is not None and not self.share(specimen.mesh, specimen.mesh.nodes[:, 1]).any():
            lowest = float(specimen.mesh.nodes[:, 1].min())
            raise refusal(
                "FluidPressure: water_table", self.water_table, f"above the lowest place of the specimen, {lowest:g} m"
            )

    def share(self, mesh: Mesh, height: np.ndarray) -> np.ndarray:
        """(n,) of the pressure at a height (n,) m."""
        if self.water_table is None:
            return np.ones(len(height))
        lowest = float(mesh.nodes[:, 1].min())
        return np.maximum(self.water_table - height, 0.0) / max(self.water_table - lowest, 1e-300)


@attrs.frozen(kw_only=True)
class Injection(Fluid):
    """A fluid that is pumped through a boundary at a rate: the room behind it, and the cracks it reaches, take it up.

    What is pumped in stays. Pressures are those at which what is there, by its bulk modulus, fills the room that it
    has; 0 where there is less. All broken contact points that others connect with the boundary belong to it, as for
    :class:`FluidPressure`. Without ``viscosity`` there is one pressure, everywhere at once. With it each contact point
    has its own, and fluid flows along cracks by the cubic law, for an aperture of the opening, where it is above 0, and
    the ``residual_aperture``, or, where they close under stress, of an ``unstressed_aperture`` and the opening, but no
    less than the residual one; it leaves at boundaries that have a :class:`FluidPressure`. The same fluid of a stage
    before goes on, with ``rate`` alone: a shut well has a rate of 0.
    """

    boundary: str  #: name of the boundary through which it is pumped
    rate: Varying = varying("m2/s")  #: volume without pressure over time and thickness; below 0 it is pumped out
    start: float = parameter("m2/s", default=0.0, above=-math.inf)  #: at first; ``rate`` after the time ``ramp``
    ramp: float = parameter("s", default=0.0, at_least=0)  #: time in which the rate changes
    bulk_modulus: float = parameter("Pa", default=2.2e9, usual=(1e4, 1e12))  #: of the fluid; that of water unless given
    pressure: float = parameter("Pa", default=0.0, at_least=0)  #: at first
    viscosity: float = parameter("Pa s", default=0.0, at_least=0)  #: of the fluid; that of water is 1e-3
    #: of closed cracks, where it is viscous
    residual_aperture: float = parameter("m", default=0.0, at_least=0, usual=(1e-9, 0.01))
    #: of closed cracks without stress: their closure takes of it, down to ``residual_aperture``, which it is by default
    unstressed_aperture: float | None = optional("m", above=0)
    #: damage from which contact points let it in; below 1 it is in the cohesive zone of a crack too
    entry_damage: float = parameter("1", default=1.0, above=0, at_most=1)
    #: of the room behind the boundary, with lines and pump, over thickness; what it encloses, unless given
    volume: float | None = optional("m2", above=0)
    cracks_only: bool = False  #: whether the boundary itself bears none of it, as under a membrane or a platen

    def __attrs_post_init__(self) -> None:
        super().__attrs_post_init__()
        if self.viscosity and not self.residual_aperture:
            raise ParameterError(
                f"Injection: residual_aperture = 0 m is not allowed with viscosity = {self.viscosity:g} Pa s, it must "
                "be above 0: closed cracks conduct by it"
            )
        if self.unstressed_aperture is not None and self.unstressed_aperture < self.residual_aperture:
            raise refusal(
                "Injection: unstressed_aperture", self.unstressed_aperture,
                f"at least the residual_aperture, {self.residual_aperture:g} m",
            )  # fmt: skip
        if self.unstressed_aperture is not None and not self.viscosity:
            raise ParameterError("Injection: unstressed_aperture is not allowed without a viscosity")
        if self.residual_aperture and not self.viscosity:
            raise ParameterError(
                f"Injection: residual_aperture = {self.residual_aperture:g} m is not allowed without a viscosity, it "
                "must be 0: there is one pressure everywhere"
            )

    @property
    def aperture(self) -> float:
        """m, of cracks that are closed and bear nothing."""
        return self.residual_aperture if self.unstressed_aperture is None else self.unstressed_aperture

    def goes_on(self, before: Injection) -> bool:
        """Whether the fluid is that of an injection ``before``."""
        one, other = ((each.boundary, each.viscosity, each.residual_aperture, each.aperture) for each in (self, before))
        return one == other

    def check(self, stage: Stage) -> None:
        super().check(stage)
        if stage.static:
            raise _not_static(stage)
        if len(stage.of(Injection)) > 1:
            raise ParameterError(f"Stage '{stage.name}': it has {len(stage.of(Injection))} injections, it can have one")

    def check_specimen(self, specimen: Specimen) -> None:
        super().check_specimen(specimen)
        if specimen.is_rigid:
            raise ParameterError(f"Injection: boundary = {self.boundary!r} is of rigid grains, it must be of others")
        if self.volume is None and not enclosed_area(specimen.mesh.nodes, specimen.mesh.boundary_edges[self.boundary]):
            raise ParameterError(
                f"Injection: boundary = {self.boundary!r} encloses no room; give the volume of what is behind it (m2)"
            )

    def at_start(self) -> Load | None:
        return None


def enclosed_area(nodes: np.ndarray, edges: np.ndarray, displacement: np.ndarray | float = 0.0) -> float:
    """m2 that the edges (e, 2) of a boundary enclose, the grains on their left; 0 for one that is not closed.

    Nodes (i, 2) m are displaced by as much; grains of a rim part by little.
    """
    along = nodes[edges[:, 1]] - nodes[edges[:, 0]]
    if not len(edges) or np.abs(along.sum(axis=0)).max() > 1e-6 * np.abs(along).sum():
        return 0.0
    place = nodes + displacement
    place = place - place[edges[:, 0]].mean(axis=0)
    first, second = place[edges[:, 0]], place[edges[:, 1]]
    around = first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]
    return max(0.0, -float(around.sum()) / 2)


def require_hole(where: str, specimen: Specimen, opening: str) -> None:
    """Raise :class:`ParameterError` unless the boundary is the rim of one hole."""
    specimen.mesh.require_boundaries(where, opening)
    if not enclosed_area(specimen.mesh.nodes, specimen.mesh.boundary_edges[opening]):
        raise refusal(f"{where}: opening", opening, "the rim of a hole in the specimen")
    rims = [hole for region in specimen.grains.regions for hole in region.hole_sides if opening in hole]
    if len(rims) > 1:
        raise refusal(f"{where}: opening", opening, f"the rim of one hole; {len(rims)} have this name")


@attrs.frozen(kw_only=True)
class Gravity(Load):
    """The weight of all grains."""

    acceleration: tuple[float, float] = vector("m/s2", default=(0.0, -9.81))  #: m/s2, along x and y


@attrs.frozen(kw_only=True)
class Fixed(Load):
    """Grains that neither move nor turn."""

    grains: Sequence[int] = grain_numbers()  #: their numbers

    def check_specimen(self, specimen: Specimen) -> None:
        specimen.check_grain_numbers("Fixed: grains", self.grains)


@attrs.frozen(kw_only=True)
class InitialVelocity(Load):
    """A velocity that is added to the nodes when the stage begins; rigid grains take its mean and spin.

    Fixed grains and boundaries that are moved keep theirs.
    """

    velocity: np.ndarray = attrs.field(eq=False, converter=_velocities, metadata={"unit": "m/s"})  #: (i, 2), by node

    def check(self, stage: Stage) -> None:
        if stage.static:
            raise _not_static(stage)

    def check_specimen(self, specimen: Specimen) -> None:
        given, nodes = len(self.velocity), len(specimen.mesh.nodes)
        if given != nodes:
            raise ParameterError(f"InitialVelocity: velocity is of {given} nodes, the specimen has {nodes}")

    def at_start(self) -> Load | None:
        return None


@attrs.frozen(kw_only=True)
class Heat(Load):
    """A temperature, the same everywhere, to which the loading of the stage heats or cools; its speed is 1 K/s.

    The stage ends when it has come to it. Boundaries are held meanwhile, or loaded by stresses.
    """

    to: float = parameter("degC", at_least=ABSOLUTE_ZERO)  #: temperature at the end of the stage

    def check(self, stage: Stage) -> None:
        where = f"Stage '{stage.name}'"
        if len(stage.of(Heat)) > 1:
            raise ParameterError(f"{where}: it has {len(stage.of(Heat))} temperatures to come to, it can have one")
        if stage.loading is None or stage.loading.ramp or isinstance(stage.loading, Constant):
            wanted = "one in K/s without a ramp, such as Adaptive() or HeatingRate(rate=...)"
            raise ParameterError(
                f"{where}: loading = {stage.loading!r} is not allowed for a temperature of {self.to:g} °C, it must be "
                f"{wanted}"
            )
        if stage.static or any(one.moves for one in stage.loads if one is not self):
            raise ParameterError(
                f"{where}: a stage with a temperature holds its boundaries, or loads them by stresses; move them in a "
                "stage of its own"
            )

    def check_specimen(self, specimen: Specimen) -> None:
        specimen.check_temperature("Heat: to", self.to)

    @property
    def moves(self) -> bool:
        return True

    @property
    def ends(self) -> Sequence[Condition]:
        return [ComesTo(TEMPERATURE, self.to)]

    def at_start(self) -> Load | None:
        return None


@attrs.frozen(kw_only=True)
class Conduction(Load):
    """Heat flows through grains and across their contacts, by Fourier's law, while the stage lasts.

    In and out it flows by :class:`FixedTemperature`, :class:`HeatFlux`, :class:`Convection` and :class:`HeatSource`;
    other boundaries are insulated. Their times, ``duration`` and ``step`` are of heat, which passes ``speedup`` times
    as fast as the motion: so slow a motion follows heat as in nature while its inertia stays small. The step is
    implicit: it does not depend on that of the motion, and temperatures between two steps go evenly. A bonded contact
    point conducts by ``bonded``; one that is broken by what ``filling`` conducts across its opening, or across
    ``smallest_aperture`` where that is more, as where it is closed.
    """

    duration: float = parameter("s")  #: of heat, after which the stage ends, at the first sample from then on
    speedup: float = parameter("1", default=1.0)  #: time of heat over time of the motion
    #: of heat, in one implicit step; unless given that in which heat crosses a zone, its area over the diffusivity
    step: float | None = optional("s", above=0)
    bonded: float = parameter("W/m2/K", default=1e7)  #: conductance of bonded contacts; that given is of no account
    filling: float = parameter("W/m/K", default=0.026)  #: conductivity of what fills broken ones; that of air
    smallest_aperture: float = parameter("m", default=1e-6)  #: across which closed broken contacts conduct

    def __attrs_post_init__(self) -> None:
        if self.step is not None and self.step > self.duration:
            raise ParameterError(
                f"Conduction: step = {self.step:g} s is not allowed, it must be at most duration = {self.duration:g} s"
            )

    def check(self, stage: Stage) -> None:
        where = f"Stage '{stage.name}'"
        if (sample := stage.interval * self.speedup) > self.duration:
            raise ParameterError(
                f"{where}: interval = {stage.interval:g} s, in which {sample:g} s of heat pass, is more than the "
                f"Conduction's duration = {self.duration:g} s, after which the stage ends: give a shorter one"
            )
        if len(stage.of(Conduction)) > 1:
            raise ParameterError(f"{where}: it has {len(stage.of(Conduction))} conductions, it can have one")
        if stage.of(Heat):
            raise ParameterError(f"{where}: Heat is the same everywhere, it is not allowed where heat is conducted")
        if stage.static or stage.ageing is not None or any(end.waits_for_rest for end in stage.until):
            what = "static" if stage.static else "AtRest" if stage.ageing is None else "ageing"
            raise ParameterError(f"{where}: {what} is not allowed while heat flows, which strains the specimen")
        if stage.loading is not None:
            raise ParameterError(
                f"{where}: loading = {short(stage.loading)} is not allowed where heat is conducted, which goes by its "
                "own time: let it be None"
            )

    def check_specimen(self, specimen: Specimen) -> None:
        for material, _ in specimen.materials:
            if not getattr(material, "conductivity", None):
                raise ParameterError(
                    f"Conduction: {short(material)} does not conduct; every material of the specimen must have a "
                    "conductivity and a heat_capacity, as grainlaw.materials.Thermal takes them"
                )

    @property
    def lasts(self) -> float:
        return math.inf

    @property
    def ends(self) -> Sequence[Condition]:
        return [Reaches(HEAT_TIME, self.duration)]

    def at_start(self) -> Load | None:
        return None


class HeatLoad(Levelled):
    """What brings heat into a specimen that conducts, or takes it out; its times are of heat."""

    def check(self, stage: Stage) -> None:
        if not stage.of(Conduction):
            raise ParameterError(f"Stage '{stage.name}': {type(self).__name__} needs a Conduction beside it")

    @property
    def lasts(self) -> float:
        return 0.0  # the conduction lasts

    def course(self, begin: np.ndarray, end: np.ndarray) -> np.ndarray:
        """Means over each step, which may be long, also of a ramp."""
        level = self.level
        if not self.ramp or not isinstance(level, float):
            return super().course(begin, end)
        until, since = (rise_integral(time, self.ramp, self.start, level) for time in (end, begin))
        return (until - since) / (end - begin)

    def at_start(self) -> Load | None:
        return None


class HeatBoundary(HeatLoad):
    """That at a boundary."""

    boundary: str

    def check(self, stage: Stage) -> None:
        super().check(stage)
        fixed = sum(one.boundary == self.boundary for one in stage.of(FixedTemperature))
        if fixed > isinstance(self, FixedTemperature):
            raise ParameterError(
                f"Stage '{stage.name}': boundary = {self.boundary!r} has a temperature that is fixed, so that nothing "
                "else can bring heat there"
            )

    def check_specimen(self, specimen: Specimen) -> None:
        specimen.mesh.require_boundaries(type(self).__name__, self.boundary)


class TemperatureBoundary(HeatBoundary):
    """One that is given a temperature, of the rock or of what is beside it."""

    def check_specimen(self, specimen: Specimen) -> None:
        """Also refuse a temperature that a material does not know; functions say it later."""
        super().check_specimen(specimen)
        level = self.level
        known = level.values.tolist() if isinstance(level, TimeSeries) else [] if callable(level) else [level]
        for temperature in [*known, *([self.start] if self.ramp else [])]:
            specimen.check_temperature(f"{type(self).__name__}: temperature", temperature)


@attrs.frozen(kw_only=True)
class FixedTemperature(TemperatureBoundary):
    """A boundary that is kept at a temperature. Where two meet the later of them counts."""

    boundary: str  #: name of the boundary
    temperature: Varying = varying("degC", at_least=ABSOLUTE_ZERO)  #: of the rock there
    start: float = parameter("degC", default=ROOM, at_least=ABSOLUTE_ZERO)  #: at first, where there is a ramp
    ramp: float = parameter("s", default=0.0, at_least=0)  #: time of heat in which it changes


@attrs.frozen(kw_only=True)
class HeatFlux(HeatBoundary):
    """Heat that flows in through a boundary, per area of it."""

    boundary: str  #: name of the boundary
    flux: Varying = varying("W/m2")  #: into the specimen
    start: float = parameter("W/m2", default=0.0, above=-math.inf)  #: at first; ``flux`` after ``ramp``
    ramp: float = parameter("s", default=0.0, at_least=0)  #: time of heat in which it changes


@attrs.frozen(kw_only=True)
class Convection(TemperatureBoundary):
    """A fluid beyond a boundary, such as air or water, that takes heat in proportion to the difference (Newton)."""

    boundary: str  #: name of the boundary
    coefficient: float = parameter("W/m2/K")  #: of heat transfer
    temperature: Varying = varying("degC", at_least=ABSOLUTE_ZERO)  #: of the fluid
    start: float = parameter("degC", default=ROOM, at_least=ABSOLUTE_ZERO)  #: at first, where there is a ramp
    ramp: float = parameter("s", default=0.0, at_least=0)  #: time of heat in which it changes


@attrs.frozen(kw_only=True)
class HeatSource(HeatLoad):
    """Heat that arises in grains, as by radioactive waste."""

    power: Varying = varying("W/m3")  #: per volume
    grains: Sequence[int] | None = grain_numbers(default=None)  #: their numbers; all grains, unless some are given
    start: float = parameter("W/m3", default=0.0, above=-math.inf)  #: at first; ``power`` after ``ramp``
    ramp: float = parameter("s", default=0.0, at_least=0)  #: time of heat in which it changes

    def check_specimen(self, specimen: Specimen) -> None:
        specimen.check_grain_numbers("HeatSource: grains", self.grains or ())


def __dir__() -> list[str]:  # a notebook offers what is public
    return [*__all__]
