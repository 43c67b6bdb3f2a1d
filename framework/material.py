"""The material of a grain: stress of one zone from its strain and memory."""

from __future__ import annotations

import enum
import math
from abc import abstractmethod
from typing import Any

import attrs
import numpy as np

from grainlaw.arguments import Checked
from grainlaw.fields import ParameterError, parameter, part
from grainlaw.memory import SCALARS, names_of_arguments, only_memory, refuse_untold
from grainlaw.messages import refusal

ABSOLUTE_ZERO = -273.15  #: °C
ROUNDING = 1e-9  #: of the largest entry, by which a stiffness may differ from its transpose
Rows = tuple[tuple[Any, Any, Any], tuple[Any, Any, Any], tuple[Any, Any, Any]]


class Plane(enum.Enum):
    """Condition in the third direction."""

    STRAIN = enum.auto()  #: no strain
    STRESS = enum.auto()  #: no stress


class Material(metaclass=Checked):
    """What a grain does to a strain, written in scalars for one zone as a pure function, in plane strain.

    A whole material, a cubic crystal whose axes are those of the specimen (Nye 1985, Physical Properties of Crystals,
    p. 141)::

        @attrs.frozen(kw_only=True)
        class Cubic(gl.Material):
            c11: float = gl.parameter("Pa")
            c12: float = gl.parameter("Pa")
            c44: float = gl.parameter("Pa")
            density: float = gl.parameter("kg/m3")
            stiffness = property(lambda self: ((self.c11, self.c12, 0), (self.c12, self.c11, 0), (0, 0, self.c44)))

            def stress(self, exx, eyy, exy):
                return self.c11 * exx + self.c12 * eyy, self.c12 * exx + self.c11 * eyy, 2 * self.c44 * exy

            def energy(self, exx, eyy, exy):
                sxx, syy, sxy = self.stress(exx, eyy, exy)
                return 0.5 * (sxx * exx + syy * eyy) + sxy * exy

    Strain and stress are those in the frame that turns with the zone, so that the rotation of a grain is no concern of
    its material; its memory stays in that frame. Inside the methods ``self`` gives what it gives in a
    :class:`~grainlaw.ContactLaw`. A parameter may be an array with one entry for each grain of the material. There is
    no strain in the third direction; a material in plane stress says so by its ``plane``, and answers with the stress
    that goes with none there.
    """

    takes_arrays = True  #: parameters may be arrays
    density: Any  #: kg/m3
    plane: Any = Plane.STRAIN  #: what holds in the third direction, by which E and nu follow from E* and nu*
    temperatures: tuple[float, float] = (ABSOLUTE_ZERO, math.inf)  #: °C, lowest and highest that the material knows
    conductivity: float | None = None  #: W/m/K, of heat, alike in all directions; None where it is not known
    heat_capacity: float | None = None  #: J/kg/K; with the conductivity grains conduct heat

    @property
    @abstractmethod
    def stiffness(self) -> Rows:
        """Rows of the stress (xx, yy, xy) over the strains exx, eyy and the shear angle 2 exy (Pa).

        That of the first response, symmetric; no tangent of the material may be stiffer. The stable step and static
        solutions take it. Where parameters are arrays, so are its entries.
        """

    @property
    def exceptions(self) -> dict[str, str]:
        """Properties of :func:`grainlaw.check_material` that the material is known to break: why and by how much."""
        return {}

    @abstractmethod
    def stress(self, exx: Any, eyy: Any, exy: Any, *memory: Any) -> tuple[Any, ...]:
        """Stress xx, yy and xy (Pa, tension positive), then the new memory.

        ``exx``, ``eyy`` and ``exy`` are the components of the strain tensor. The arguments after them are the memory,
        by name, zero at the start. The framework knows ``plastic_strain``, which pictures show. Two names are no
        memory: ``temperature`` is that of the specimen (°C), and ``ezz`` the strain across the plane, 0 unless a
        :class:`~grainlaw.materials.Thermal` around the material takes its free strain from it.
        """

    @abstractmethod
    def energy(self, exx: Any, eyy: Any, exy: Any, *memory: Any) -> Any:
        """Stored energy (J/m3) at a strain, with the memory that ``stress`` returned there: what unloading gives back.

        Work beyond it is what the material has dissipated. What it changes by at a strain that is held, while the
        ``temperature`` changes, is the work of heat.
        """


@attrs.frozen(kw_only=True)
class Elastic(Material):
    """Linear elastic, isotropic grains that deform: small strain, finite rotation."""

    youngs_modulus: float = parameter("Pa", usual=(1e8, 1e12))  #: E
    poissons_ratio: float = parameter("1", above=-1.0, below=0.5)  #: nu
    density: float = parameter("kg/m3", usual=(500, 20_000))  #: mass per volume
    plane: Plane = part(Plane, Plane.STRAIN)  #: what holds in the third direction: no strain or no stress

    @property
    def constants(self) -> tuple[Any, Any, Any]:
        """Stress per strain (Pa): along the axis, across it, in shear; Eq. (4)."""
        e, nu = self.youngs_modulus, self.poissons_ratio
        shear = e / (2 * (1 + nu))
        if self.plane is Plane.STRESS:
            return e / (1 - nu**2), e * nu / (1 - nu**2), shear
        common = e / ((1 + nu) * (1 - 2 * nu))
        return common * (1 - nu), common * nu, shear

    along = property(lambda self: self.constants[0])
    across = property(lambda self: self.constants[1])
    shear = property(lambda self: self.constants[2])
    third = property(lambda self: self.constants[1] if self.plane is Plane.STRAIN else 0.0)
    own = property(lambda self: self.constants[0] if self.plane is Plane.STRAIN else 0.0)

    @property
    def stiffness(self) -> Rows:
        along, across, shear = self.constants
        return (along, across, 0.0), (across, along, 0.0), (0.0, 0.0, shear)

    def stress(self, exx: Any, eyy: Any, exy: Any, ezz: Any) -> tuple[Any, ...]:  # by itself a pass of the engine
        third = self.third * ezz
        return (
            self.along * exx + self.across * eyy + third, self.across * exx + self.along * eyy + third,
            2 * self.shear * exy,
        )  # fmt: skip

    def energy(self, exx: Any, eyy: Any, exy: Any, ezz: Any) -> Any:
        sxx, syy, sxy = self.stress(exx, eyy, exy, ezz)
        szz = self.third * (exx + eyy) + self.own * ezz
        return 0.5 * (sxx * exx + syy * eyy + szz * ezz) + sxy * exy


@attrs.frozen(kw_only=True)
class Rigid(metaclass=Checked):
    """Grains that move but do not deform."""

    density: float = parameter("kg/m3", usual=(500, 20_000))  #: mass per volume


def material_arguments(material: Material, method: str = "stress") -> tuple[str, ...]:
    """Names of what ``stress`` or ``energy`` takes after the strain: scalars of the step, and the memory.

    Raises :class:`ParameterError` where there is no such strain, for memory without a name or a start at zero, and for
    an ``energy`` that takes the time step: what is stored does not depend on it.
    """
    names = names_of_arguments(material, method, "exx, eyy and exy", 3)
    refuse_untold(material, method, names, SCALARS if method == "stress" else ("temperature", "ezz"))
    return names


def knows_temperature(material: Material) -> bool:
    """Whether a material depends on the temperature."""
    return any("temperature" in material_arguments(material, method) for method in ("stress", "energy"))


def knows_time(material: Material) -> bool:
    """Whether a material depends on the time that passes."""
    return "time_step" in material_arguments(material, "stress")


def material_memory(material: Material) -> tuple[str, ...]:
    """Names of a material's memory. Raises :class:`ParameterError` as :func:`material_arguments` does.

    Also where ``energy`` does not take the same.
    """
    names, own = (only_memory(material_arguments(material, method)) for method in ("stress", "energy"))
    if own != names:
        raise ParameterError(
            f"{type(material).__name__}.energy takes the memory ({', '.join(own)}), it must take that of stress "
            f"({', '.join(names)})"
        )
    return names


def _check_entries(material: Any, count: int) -> None:
    """Raise :class:`ParameterError` for a parameter, also of a part, with another number of entries than of grains."""
    for field in attrs.fields(type(material)):
        value = getattr(material, field.name)
        if isinstance(value, np.ndarray) and value.shape != (count,):
            raise ParameterError(
                f"{type(material).__name__}: {field.name} has {value.size} entries, it must have one for each of the "
                f"{count} grains of the material"
            )
        if attrs.has(type(value)):
            _check_entries(value, count)


def stiffness_of(material: Material, count: int = 1) -> np.ndarray:
    """(count, 3, 3) Pa, the declared stiffness at each of the ``count`` grains of a material.

    Raises :class:`ParameterError` for one that is not symmetric and positive definite.
    """
    name = type(material).__name__
    _check_entries(material, count)
    try:
        declared = material.stiffness
    except Exception as error:
        raise ParameterError(f"{name}.stiffness cannot be found: {type(error).__name__}: {error}") from error
    try:
        rows = [[np.broadcast_to(np.asarray(entry, dtype=float), count) for entry in row] for row in declared]
        matrix = np.moveaxis(np.array(rows).reshape(3, 3, count), 2, 0)
    except (TypeError, ValueError):
        wanted = f"three rows of three numbers (Pa), or of arrays with one entry for each of the {count} grains"
        raise refusal(f"{name}.stiffness", declared, f"{wanted} of the material") from None
    size = np.abs(matrix).max(axis=(1, 2))
    odd = np.asarray(np.abs(matrix - matrix.transpose(0, 2, 1)).max(axis=(1, 2)) > ROUNDING * size)
    finite = np.asarray(np.isfinite(matrix).all(axis=(1, 2)))
    least = np.linalg.eigvalsh(np.where(finite[:, None, None], matrix, 0.0))[:, 0]
    wrong = np.flatnonzero(~finite | odd | ~(least > 0))
    if len(wrong):
        first = matrix[wrong[0]].tolist()
        why = "finite" if not finite[wrong[0]] else "symmetric" if odd[wrong[0]] else "positive definite"
        shown = "; ".join(", ".join(f"{entry:.4g}" for entry in row) for row in first)
        raise ParameterError(f"{name}.stiffness = [{shown}] Pa is not allowed, it must be {why}")
    return matrix
