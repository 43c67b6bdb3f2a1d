"""A specimen: grains, their material, and their contact points."""

from __future__ import annotations

import enum
import functools
from abc import abstractmethod
from collections.abc import Iterable, Mapping
from typing import Any

import attrs
import numpy as np

from grainlaw.arguments import Checked
from grainlaw.mesh import Mesh, build_mesh
from grainlaw.parameter import ParameterError, parameter, part, whole_number
from grainlaw.short_form import in_one_line
from grainlaw.tessellation import Tessellation


class Plane(enum.Enum):
    """Condition in the third direction."""

    STRAIN = enum.auto()  #: no strain
    STRESS = enum.auto()  #: no stress


@attrs.frozen(kw_only=True)
class Elastic(metaclass=Checked):
    """Linear elastic, isotropic grains that deform: small strain, finite rotation."""

    youngs_modulus: float = parameter("Pa", usual=(1e8, 1e12))
    poissons_ratio: float = parameter("1", above=-1.0, below=0.5)
    density: float = parameter("kg/m3", usual=(500, 20_000))
    plane: Plane = part(Plane, Plane.STRAIN)

    @property
    def constants(self) -> tuple[float, float, float]:
        """Stress per strain (Pa): along the axis, across it, in shear; Eq. (4)."""
        e, nu = self.youngs_modulus, self.poissons_ratio
        shear = e / (2 * (1 + nu))
        if self.plane is Plane.STRESS:
            return e / (1 - nu**2), e * nu / (1 - nu**2), shear
        common = e / ((1 + nu) * (1 - 2 * nu))
        return common * (1 - nu), common * nu, shear


@attrs.frozen(kw_only=True)
class Rigid(metaclass=Checked):
    """Grains that move but do not deform."""

    density: float = parameter("kg/m3", usual=(500, 20_000))


class ContactPoints(metaclass=Checked):
    """Where the two contact points of an interface lie; strength depends on it (docs/theory.md)."""

    @abstractmethod
    def weights(self, lengths: np.ndarray) -> np.ndarray:
        """Distance of each point from its end, as a fraction of the interface's length (c,) m; at most one half."""


@attrs.frozen
class GaussPoints(ContactPoints):
    """At 0.2113 and 0.7887 of the length: exact for a traction that varies linearly."""

    def weights(self, lengths: np.ndarray) -> np.ndarray:
        return np.full(len(lengths), 0.5 - 0.5 / np.sqrt(3))


@attrs.frozen
class EndPoints(ContactPoints):
    """At the corners of the grains; such an interface is three times too stiff in rotation."""

    def weights(self, lengths: np.ndarray) -> np.ndarray:
        return np.zeros(len(lengths))


@attrs.frozen(kw_only=True)
class InsetPoints(ContactPoints):
    """At a distance from the corners, as UDEC rounds them; in the middle of interfaces shorter than twice that."""

    inset: float = parameter("m")

    def weights(self, lengths: np.ndarray) -> np.ndarray:
        return np.minimum(self.inset / lengths, 0.5)


@attrs.frozen(eq=False)
class Specimen(metaclass=Checked):
    """Grains of one material, or of one per mineral phase, and the contact points between them.

    ``refinement`` is how many times every zone is cut into four (and every interface into two).
    """

    grains: Tessellation
    material: Elastic | Rigid | Mapping[Any, Elastic]  #: by number or name of the phase, ... for all others
    contact_points: ContactPoints = part(ContactPoints, GaussPoints())
    refinement: int = whole_number(default=0, at_least=0, at_most=6)

    def __attrs_post_init__(self) -> None:
        if isinstance(self.material, Mapping):
            for key in self.material:
                if isinstance(key, str) and self.grains.phase_number(key) is None:
                    known = ", ".join(self.grains.phase_names) or "without names"
                    raise ParameterError(f"Specimen: material: there is no phase '{key}' (phases: {known})")
            missing = [phase for phase in np.unique(self.grains.phase).tolist() if self._entry(phase) is None]
            if missing:
                names = ", ".join(map(self.grains.phase_name, missing))
                raise ParameterError(f"Specimen: material has no entry for the phases {names} of the grains")

    @property
    def _facts(self) -> dict[str, str]:
        material = (
            in_one_line(self.material) if not isinstance(self.material, Mapping) else f"{len(self.material)} kinds"
        )
        refined = {"refinement": str(self.refinement)} if self.refinement else {}
        points = {"contact points": in_one_line(self.contact_points)}
        return {**self.grains._facts, "material": material, **points, **refined}

    @property
    def is_rigid(self) -> bool:
        """Whether the grains do not deform."""
        return isinstance(self.material, Rigid)

    def check_grain_numbers(self, where: str, numbers: Iterable[int]) -> None:
        """Raise :class:`ParameterError` for a number that no grain has."""
        for number in numbers:
            if not 0 <= number < self.grains.count:
                raise ParameterError(
                    f"{where} = {number} is not allowed, grains are numbered from 0 to {self.grains.count - 1}"
                )

    @functools.cached_property
    def mesh(self) -> Mesh:
        """Nodes, zones and interfaces."""
        return build_mesh(self.grains, self.refinement)

    def _per_zone(self, values: Mapping[int, tuple[float, ...]]) -> np.ndarray:
        phases = sorted(values)
        table = np.array([values[phase] for phase in phases])
        return table[np.searchsorted(phases, self.grains.phase[self.mesh.zone_grain])].T.copy()

    def _entry(self, phase: int) -> Elastic | None:
        """What a mapping of materials has for a phase: by its number, its name, or for all others."""
        assert isinstance(self.material, Mapping)
        name = self.grains.phase_name(phase)
        return next((self.material[key] for key in (phase, name, ...) if key in self.material), None)

    def material_of(self, phase: int) -> Elastic | Rigid:
        """Material of the grains of a phase, by its number. Raises KeyError."""
        found = self._entry(phase) if isinstance(self.material, Mapping) else self.material
        if found is None:
            raise KeyError(phase)
        return found

    @property
    def _materials(self) -> dict[int, Elastic | Rigid]:
        return {phase: self.material_of(phase) for phase in np.unique(self.grains.phase).tolist()}

    @functools.cached_property
    def zone_constants(self) -> np.ndarray:
        """(3, z) Pa: stress per strain of each zone; zeros for rigid grains, whose zones only carry their mass."""
        constants = {p: m.constants if isinstance(m, Elastic) else (0.0,) * 3 for p, m in self._materials.items()}
        return self._per_zone(constants)

    @functools.cached_property
    def zone_masses(self) -> np.ndarray:
        """(z,) kg per metre of thickness."""
        density = self._per_zone({phase: (material.density,) for phase, material in self._materials.items()})[0]
        return density * self.mesh.zone_areas

    @functools.cached_property
    def node_masses(self) -> np.ndarray:
        """(i,) kg per metre of thickness: a third of each zone to each of its nodes."""
        return np.bincount(self.mesh.zones.ravel(), np.repeat(self.zone_masses / 3, 3), len(self.mesh.nodes))
