"""A specimen: grains, their material, and their contact points."""

from __future__ import annotations

import functools
from abc import abstractmethod
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import attrs
import numpy as np

from grainlaw.arguments import Checked, fits
from grainlaw.edge_keys import check_keys, check_known, keys_of, words_of
from grainlaw.fields import ParameterError, parameter, part, whole_number
from grainlaw.material import Elastic, Material, Rigid, knows_temperature, stiffness_of
from grainlaw.memory import ROOM
from grainlaw.mesh import Mesh, build_mesh
from grainlaw.messages import refusal, short
from grainlaw.short_form import in_one_line
from grainlaw.tessellation import Tessellation

if TYPE_CHECKING:
    from grainlaw.drawing.figure import Figure


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

    inset: float = parameter("m")  #: distance from the corners

    def weights(self, lengths: np.ndarray) -> np.ndarray:
        return np.minimum(self.inset / lengths, 0.5)


def _tied(given: Any) -> tuple[Any, ...]:
    keys = given if isinstance(given, (list, tuple)) else (given,)
    made = tuple(tuple(key) if isinstance(key, list) else key for key in keys)
    check_keys("Specimen: tied", made)
    return made


def _slits(given: Any) -> tuple[str, ...]:
    names = (given,) if isinstance(given, str) else given
    if not fits(names, Sequence[str]) or len({*names}) < len(names):
        raise refusal("Specimen: slits", given, "different names of joints")
    return tuple(names)


@attrs.frozen(eq=False)
class Specimen(metaclass=Checked):
    """Grains of one material, or of one per mineral phase, and the contact points between them.

    ``refinement`` is how many times every zone is cut into four (and every interface into two). Edges that are ``tied``
    are no contacts: grains share the nodes there, as zones of one grain do. They are named as laws name theirs: by a
    pair of phases, "between", "inside" for cells of one grain, the name of a joint, or ... for all edges. Joints that
    are ``slits`` have two free faces, a boundary by their name, which are contacts where they meet.
    """

    grains: Tessellation  #: the polygons
    material: Material | Rigid | Mapping[Any, Material]  #: by number or name of the phase, ... for all others
    contact_points: ContactPoints = part(ContactPoints, GaussPoints())  #: where the two points of an interface lie
    refinement: int = whole_number(default=0, at_least=0, at_most=6)  #: times every zone is cut into four
    tied: tuple[Any, ...] = attrs.field(default=(), converter=_tied)  #: keys of edges at which grains share nodes
    slits: tuple[str, ...] = attrs.field(default=(), converter=_slits)  #: names of joints with free faces
    cite: tuple[str, ...] = ()  #: works that the rock is taken from: results and their files say them

    def __attrs_post_init__(self) -> None:
        self.grains.check_tiling()
        check_known("Specimen: tied", self.tied, self.grains)
        for name in self.slits:
            if name not in self.grains.joints:
                wanted = ", ".join(self.grains.joints) or "of which there are none"
                raise refusal("Specimen: slits", self.slits, f"names of joints: {wanted}")
            if name in self.grains.boundary_names:
                raise ParameterError(f"Specimen: slits: there is a boundary {name}: give the joint another name")
        if self.tied and self.is_rigid:
            raise ParameterError("Specimen: tied is not allowed with rigid grains, which have no nodes to share")
        if isinstance(self.material, Mapping):
            for key in self.material:
                if key is not ... and self.grains.phase_number(key) is None:
                    known = self.grains.known_phases
                    raise ParameterError(f"Specimen: material: there is no phase {key!r} (phases: {known})")
            missing = [phase for phase in np.unique(self.grains.phase).tolist() if self._entry(phase) is None]
            if missing:
                names = ", ".join(map(self.grains.phase_name, missing))
                raise ParameterError(f"Specimen: material has no entry for the phases {names} of the grains")
        for own, _ in self.materials:
            if not hasattr(own, "density"):
                raise ParameterError(
                    f"Specimen: material: {type(own).__name__} has no density; declare one: density: float = "
                    'gl.parameter("kg/m3")'
                )
        if len(planes := {own.plane for own, _ in self.materials if isinstance(own, Material)}) > 1:
            found = " and ".join(sorted(f"plane {plane.name.lower()}" for plane in planes))
            raise ParameterError(f"Specimen: material: there are grains in {found}, they must be all in one")

    @property
    def _facts(self) -> dict[str, str]:
        material = (
            in_one_line(self.material) if not isinstance(self.material, Mapping) else f"{len(self.material)} kinds"
        )
        refined = {"refinement": str(self.refinement)} if self.refinement else {}
        points = {"contact points": in_one_line(self.contact_points)}
        tied = {"tied": ", ".join(map(words_of, self.tied))} if self.tied else {}
        slits = {"slits": ", ".join(self.slits)} if self.slits else {}
        return {**self.grains._facts, "material": material, **points, **refined, **tied, **slits}

    @property
    def is_rigid(self) -> bool:
        """Whether the grains do not deform."""
        return isinstance(self.material, Rigid)

    def plot(self, by: str = "phase", *, ax: Any = None) -> Figure:
        """Draw the grains before the test, see :meth:`Tessellation.plot`. Returns the figure."""
        return self.grains.plot(by, ax=ax)

    def check_grain_numbers(self, where: str, numbers: Iterable[int]) -> None:
        """Raise :class:`ParameterError` for a number that no grain has."""
        for number in numbers:
            if not 0 <= number < self.grains.count:
                raise ParameterError(
                    f"{where} = {number} is not allowed, grains are numbered from 0 to {self.grains.count - 1}"
                )

    @functools.cached_property
    def conducts(self) -> bool:
        """Whether heat can flow through all grains: their materials say how."""
        return all(isinstance(material, Material) and material.conductivity for material, _ in self.materials)

    def check_temperature(self, where: str, temperature: float) -> None:
        """Raise :class:`ParameterError` for a temperature (°C) that no material feels, or that one does not know."""
        knowing = [
            material for material, _ in self.materials if isinstance(material, Material) and knows_temperature(material)
        ]
        if not knowing:
            raise ParameterError(
                f"{where} = {temperature:g} °C is not allowed: no material of the specimen depends on the temperature; "
                "grainlaw.materials.Thermal makes one that expands"
            )
        for material in knowing:
            low, high = material.temperatures
            for one in (ROOM, temperature):
                if not low <= one <= high:
                    begins = " at which every run begins" if one == ROOM else ""
                    raise ParameterError(
                        f"{where} = {temperature:g} °C is not allowed: {short(material)} is known from {low:g} to "
                        f"{high:g} °C, not at {one:g} °C{begins}"
                    )

    @functools.cached_property
    def mesh(self) -> Mesh:
        """Nodes, zones and interfaces. Raises :class:`ParameterError` for a cell without an area to speak of."""
        edges, tied = self.grains.edges, None
        if self.tied:
            pairs = np.stack([edges.left, edges.right], axis=1)
            tied = keys_of(self.grains, self.tied, pairs, edges.kind) >= 0
        mesh = build_mesh(self.grains, self.refinement, tied, self.slits)
        mesh.check_areas("Specimen")
        return mesh

    def _entry(self, phase: int) -> Material | None:
        """What a mapping of materials has for a phase: by its number, its name, or for all others."""
        assert isinstance(self.material, Mapping)
        name = self.grains.phase_name(phase)
        return next((self.material[key] for key in (phase, name, ...) if key in self.material), None)

    def material_of(self, phase: int) -> Material | Rigid:
        """Material of the grains of a phase, by its number. Raises KeyError."""
        found = self._entry(phase) if isinstance(self.material, Mapping) else self.material
        if found is None:
            raise KeyError(phase)
        return found

    @functools.cached_property
    def materials(self) -> list[tuple[Material | Rigid, np.ndarray]]:
        """The materials with the grains (n,) that each has, ascending."""
        found: dict[int, tuple[Material | Rigid, list[int]]] = {}
        for phase in np.unique(self.grains.phase).tolist():
            own = self.material_of(phase)
            found.setdefault(id(own), (own, []))[1].append(phase)
        return [(own, np.flatnonzero(np.isin(self.grains.phase, phases))) for own, phases in found.values()]

    @functools.cached_property
    def is_elastic(self) -> np.ndarray:
        """(g,) whether the engine's own pass for :class:`Elastic` finds the stress of each grain."""
        elastic = np.zeros(self.grains.count, dtype=bool)
        for material, grains in self.materials:
            elastic[grains] = type(material) is Elastic
        return elastic

    @functools.cached_property
    def grain_stiffness(self) -> np.ndarray:
        """(g, 3, 3) Pa: stress xx, yy, xy over exx, eyy and the shear angle; zeros for rigid grains.

        Raises :class:`ParameterError` for a material whose stiffness is not positive definite.
        """
        stiffness = np.zeros((self.grains.count, 3, 3))
        for material, grains in self.materials:
            if isinstance(material, Material):
                stiffness[grains] = stiffness_of(material, len(grains))
        return stiffness

    @functools.cached_property
    def zone_stiffness(self) -> np.ndarray:
        """(z, 3, 3) Pa, as :attr:`grain_stiffness`."""
        return self.grain_stiffness[self.mesh.zone_grain]

    @functools.cached_property
    def zone_masses(self) -> np.ndarray:
        """(z,) kg per metre of thickness."""
        density = np.empty(self.grains.count)
        for material, grains in self.materials:
            if np.shape(material.density) not in ((), (len(grains),)):
                raise refusal(
                    f"{type(material).__name__}: density", material.density,
                    f"a number, or an array with one entry for each of the {len(grains)} grains of the material",
                )  # fmt: skip
            density[grains] = material.density
        return density[self.mesh.zone_grain] * self.mesh.zone_areas

    @functools.cached_property
    def shear_wave_speed(self) -> float:
        """m/s in the grains, the slowest of several minerals; 0 for rigid grains, in which there are no waves."""
        if self.is_rigid:
            return 0.0
        return float(np.sqrt(np.min(self.zone_stiffness[:, 2, 2] * self.mesh.zone_areas / self.zone_masses)))

    def passage(self, distance: float) -> float:
        """s, in which a shear wave passes a distance (m); 0 where no waves run."""
        return distance / self.shear_wave_speed if self.shear_wave_speed > 0 else 0.0

    @property
    def longest_passage(self) -> float:
        """s, in which a shear wave passes the longer side of the specimen; 0 where no waves run."""
        return self.passage(float(np.ptp(self.mesh.nodes, axis=0).max()))

    @property
    def vicinity(self) -> tuple[float, float]:
        """Two grain sizes (m; roots of their mean area), and the time (s) in which a shear wave passes them, or 0."""
        distance = 2 * self.grains.mean_size
        return distance, self.passage(distance)

    @functools.cached_property
    def node_masses(self) -> np.ndarray:
        """(i,) kg per metre of thickness: a third of each zone to each of its nodes."""
        return np.bincount(self.mesh.zones.ravel(), np.repeat(self.zone_masses / 3, 3), len(self.mesh.nodes))

    @functools.cached_property
    def grain_masses(self) -> np.ndarray:
        """(g,) kg per metre of thickness."""
        return np.bincount(self.mesh.node_grain, self.node_masses, self.grains.count)

    def grain_means(self, of_nodes: np.ndarray) -> np.ndarray:
        """(g, k) over each grain the means of what nodes (i, k) have, by their masses: of places its centre of mass."""
        of, mass, count = self.mesh.node_grain, self.node_masses, self.grains.count
        sums = [np.bincount(of, mass * values, count) for values in of_nodes.T]
        return np.column_stack(sums) / self.grain_masses[:, None]

    def grain_rotations(self, positions: np.ndarray) -> np.ndarray:
        """(g,) rad, counter-clockwise: the turn of each grain that fits the positions (i, 2) m of its nodes best."""
        of, mass, count = self.mesh.node_grain, self.node_masses, self.grains.count
        (x, y), (p, q) = ((each - self.grain_means(each)[of]).T for each in (self.mesh.nodes, positions))
        sine, cosine = (np.bincount(of, mass * values, count) for values in (x * q - y * p, x * p + y * q))
        return np.arctan2(sine, cosine)
