"""What a stage imposes on boundaries: motions, forces, pressures, tractions, fluids; and boundaries that are quiet."""

from __future__ import annotations

import math
from typing import Any

import attrs

from grainlaw.arguments import Checked, is_number
from grainlaw.messages import short
from grainlaw.parameter import ParameterError, checked_number, checked_vector, parameter, part
from grainlaw.time_series import Imposed, Varying, varying


def _is_axis(drive: Drive | Hold, attribute: attrs.Attribute, value: int) -> None:
    if not is_number(value, int) or value not in (0, 1):
        raise ParameterError(
            f"{type(drive).__name__}: axis = {short(value)} is not allowed, it must be 0 (along x) or 1 (along y)"
        )


def _stress(value: Any) -> tuple[float, float, float]:
    xx, yy, xy = checked_vector("Traction: stress", value, "Pa", ("xx", "yy", "xy")).tolist()
    return xx, yy, xy


def _speed() -> Any:
    def convert(value: Any, component: Any, attribute: Any) -> float | None:
        return None if value is None else checked_number(f"Quiet: {attribute.name}", value, "m/s", above=0)

    converter = attrs.Converter(convert, takes_self=True, takes_field=True)
    return attrs.field(default=None, converter=converter, metadata={"unit": "m/s"})


@attrs.frozen(kw_only=True)
class Drive(Imposed):
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
    def level(self) -> Varying:
        return self.speed

    def reversed(self) -> Drive:
        """The same at the opposite speed. Raises :class:`ParameterError` for a speed that changes with time."""
        if not isinstance(self.speed, float):
            raise ParameterError(f"Drive: speed = {short(self.speed)} is not allowed here, it must be a number (m/s)")
        return attrs.evolve(self, speed=-self.speed)


def is_roller(one: Drive | Hold) -> bool:
    """Whether it drives only the middle of its boundary."""
    return isinstance(one, Drive) and one.roller


@attrs.frozen(kw_only=True)
class Hold(Imposed):
    """A boundary under a force: a platen whose nodes all move by the same amount along one axis.

    ``stress`` is the force over the undeformed length of the boundary, positive along the axis. A spring of
    ``stiffness`` (constant normal stiffness) pulls the platen back to its place at the start of the stage.
    """

    boundary: str  #: name of the boundary
    axis: int = attrs.field(validator=_is_axis)  #: 0 along x, 1 along y
    stress: Varying = varying("Pa")  #: force over undeformed length, positive along the axis
    start: float = parameter("Pa", default=0.0, above=-math.inf)  #: at first; ``stress`` after the time ``ramp``
    ramp: float = parameter("s", default=0.0, at_least=0)  #: time in which the stress changes
    #: of a spring that pulls the platen back to its place
    stiffness: float = parameter("Pa/m", default=0.0, at_least=0)

    @property
    def level(self) -> Varying:
        return self.stress


@attrs.frozen(kw_only=True)
class Pressure(Imposed):
    """A pressure on a boundary, normal to it also when it deforms, like that of a fluid behind a thin membrane."""

    boundary: str  #: name of the boundary
    pressure: Varying = varying("Pa")  #: pressing inwards
    start: float = parameter("Pa", default=0.0, above=-math.inf)  #: at first; ``pressure`` after ``ramp``
    ramp: float = parameter("s", default=0.0, at_least=0)  #: time in which the pressure changes

    @property
    def level(self) -> Varying:
        return self.pressure


@attrs.frozen(kw_only=True)
class Traction(Imposed):
    """The forces on a boundary of a uniform stress beyond it: times its normal, per undeformed length.

    They keep their direction, also where the boundary turns. ``stress=(0, 0, sxy)`` shears a boundary along x or y;
    on the rim of an opening it is what the rock held that was there. ``factor`` multiplies it, as a pulse does.
    """

    boundary: str  #: name of the boundary
    #: xx, yy, xy, tension positive
    stress: tuple[float, float, float] = attrs.field(converter=_stress, metadata={"unit": "Pa"})
    factor: Varying = varying("1", 1.0)  #: by which it is multiplied
    start: float = parameter("1", default=0.0, above=-math.inf)  #: at first; ``factor`` after the time ``ramp``
    ramp: float = parameter("s", default=0.0, at_least=0)  #: time in which the factor changes

    @property
    def level(self) -> Varying:
        return self.factor


@attrs.frozen(kw_only=True)
class Quiet(metaclass=Checked):
    """A boundary that waves leave as if the rock went on: dashpots (Lysmer and Kuhlemeyer 1969).

    They resist with density times speed of P waves along the normal and of S waves across it, so that what meets the
    boundary head on does not come back. The speeds are those of the boundary's grains unless they are given: of many
    grains with soft contacts waves are slower, see ``gl.elastic_properties``.
    """

    boundary: str  #: name of the boundary
    p_speed: float | None = _speed()  #: of P waves in the rock as a whole
    s_speed: float | None = _speed()  #: of S waves

    def __attrs_post_init__(self) -> None:
        if (self.p_speed is None) != (self.s_speed is None):
            raise ParameterError("Quiet: p_speed and s_speed must be given together, or neither of them")


@attrs.frozen(kw_only=True)
class FluidPressure(Imposed):
    """The pressure of a fluid at a boundary, which also fills the cracks that are connected with it.

    It presses on the boundary and on both faces of every broken contact point, open or closed, that others connect with
    it: the same pressure everywhere, at once, as in slow loading of drained rock. Points without tensile strength count
    as broken. Where a crack joins two fluids, the higher pressure fills it.
    """

    boundary: str  #: name of the boundary at which the fluid is
    pressure: Varying = varying("Pa", at_least=0)  #: in the fluid
    start: float = parameter("Pa", default=0.0, at_least=0)  #: at first; ``pressure`` after ``ramp``
    ramp: float = parameter("s", default=0.0, at_least=0)  #: time in which the pressure changes
    cracks_only: bool = False  #: whether the boundary itself bears none of it, as under a membrane or a platen

    @property
    def level(self) -> Varying:
        return self.pressure
