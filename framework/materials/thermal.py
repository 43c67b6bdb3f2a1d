"""Thermal expansion around any material."""

from __future__ import annotations

import math
from typing import Any

import attrs
import numpy as np

from grainlaw.fields import ParameterError, optional, parameter
from grainlaw.material import ABSOLUTE_ZERO, Material, Rows, material_arguments
from grainlaw.materials.expansion import Expansion, as_expansion
from grainlaw.memory import ROOM
from grainlaw.messages import refusal, short


def _is_material(thermal: Thermal, attribute: Any, value: Any) -> None:
    if not isinstance(value, Material):
        raise refusal("Thermal: material", value, "a material of grains that deform")
    name = type(value).__name__
    for method in ("stress", "energy"):
        if material_arguments(value, method)[:1] != ("ezz",):
            raise ParameterError(
                f"Thermal: material = {short(value)} is not allowed: {name}.{method} must take ezz, the strain "
                "across the plane, after exx, eyy and exy; without it "
                "the stress of an expansion that is held there is not known"
            )


def _is_expansion(thermal: Thermal, attribute: Any, value: Any) -> None:
    if not (isinstance(value, Expansion) or (value is None and attribute.name == "expansion_along")):
        wanted = "a number (1/K) or an Expansion such as ExpansionTable"
        raise refusal(f"Thermal: {attribute.name}", value, wanted)


def _expansion(default: Any) -> Any:
    return attrs.field(
        default=default, converter=as_expansion, validator=_is_expansion, metadata={"unit": "1/K", "bounds": ""}
    )


@attrs.frozen(kw_only=True)
class Thermal(Material):
    """A material that expands by itself: asked for the stress of the strain less its free thermal strain.

    The free strain is zero at the temperature ``reference``. Nothing moves across the plane, so that the free strain
    there is held: where the plane is free too, an isotropic material expands in it by (1 + nu) times as much, and where
    it is held the stress is -E expansion (T - reference) / (1 - 2 nu) along every axis (Boley and Weiner 1960, Theory
    of thermal stresses). In plane stress the third direction is free.

    A crystal with another expansion along one axis, such as the c axis of quartz, takes it as ``expansion_along``; the
    axis lies in the plane at ``axis_angle``, counter-clockwise from x, which may be an array, one angle for each grain.

    With ``conductivity`` and ``heat_capacity`` heat flows through its grains in a stage with a
    :class:`~grainlaw.loads.Conduction`.
    """

    material: Material = attrs.field(validator=_is_material)  #: what bears the rest of the strain
    expansion: Expansion = _expansion(attrs.NOTHING)  #: 1/K, or a table
    expansion_along: Expansion | None = _expansion(None)  #: along an axis; the same without it
    axis_angle: float = parameter("deg", default=0.0, above=-math.inf)  #: of that axis, counter-clockwise from x
    reference: float = parameter("degC", default=ROOM, at_least=ABSOLUTE_ZERO)  #: where there is no free strain
    conductivity: float | None = optional("W/m/K", above=0, usual=(0.01, 500))  #: of heat, alike in all directions
    heat_capacity: float | None = optional("J/kg/K", above=0, usual=(50, 5000))  #: per mass

    plane = property(lambda self: self.material.plane)

    def __attrs_post_init__(self) -> None:
        if (self.conductivity is None) != (self.heat_capacity is None):
            raise ParameterError("Thermal: conductivity and heat_capacity must be given together, or neither of them")
        low, high = self.temperatures
        if not np.all((low <= self.reference) & (self.reference <= high)):
            raise ParameterError(
                f"Thermal: reference = {short(self.reference)} °C is not allowed, the expansion is known from "
                f"{low:g} to {high:g} °C"
            )

    density = property(lambda self: self.material.density)
    axial = property(lambda self: self.expansion if self.expansion_along is None else self.expansion_along)
    start = property(lambda self: self.expansion.strain(self.reference))
    start_along = property(lambda self: self.axial.strain(self.reference))
    along_x = property(lambda self: math.cos(math.radians(self.axis_angle)) ** 2)
    along_y = property(lambda self: math.sin(math.radians(self.axis_angle)) ** 2)
    along_xy = property(lambda self: math.sin(2 * math.radians(self.axis_angle)) / 2)

    @property
    def temperatures(self) -> tuple[float, float]:  # type: ignore[override]
        known = self.expansion.temperatures, self.axial.temperatures, self.material.temperatures
        return max(low for low, _ in known), min(high for _, high in known)

    @property
    def stiffness(self) -> Rows:
        return self.material.stiffness

    @property
    def exceptions(self) -> dict[str, str]:
        return self.material.exceptions

    def stress(self, exx: Any, eyy: Any, exy: Any, temperature: Any, *material: Any) -> tuple[Any, ...]:
        xx, yy, xy, zz = self.borne(exx, eyy, exy, temperature)
        return self.material.stress(xx, yy, xy, zz, *material[1:])

    def energy(self, exx: Any, eyy: Any, exy: Any, temperature: Any, *material: Any) -> Any:
        xx, yy, xy, zz = self.borne(exx, eyy, exy, temperature)
        return self.material.energy(xx, yy, xy, zz, *material[1:])

    def borne(self, exx: Any, eyy: Any, exy: Any, temperature: Any) -> tuple[Any, ...]:
        """The strain that the material bears: xx, yy, xy and zz, less the free thermal strain."""
        across = self.expansion.strain(temperature) - self.start
        more = self.axial.strain(temperature) - self.start_along - across
        xx, yy, xy = across + self.along_x * more, across + self.along_y * more, self.along_xy * more
        return exx - xx, eyy - yy, exy - xy, -across
