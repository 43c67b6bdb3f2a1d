"""J and stress intensity factors of a crack, from integrals over zones and bonds round its tip.

Axes are those of the crack: the first along its direction, the second to the left of it. Index letters: ``z`` zone,
``c`` interface, ``p`` contact point, ``e`` end of an interface, ``k`` corner of a zone, ``a`` and ``b`` axes.
"""

from __future__ import annotations

import math
from typing import Any

import attrs
import numpy as np

from grainlaw.arguments import Checked, checked
from grainlaw.engine.stability import shape_functions
from grainlaw.fields import ParameterError, checked_number, checked_vector, parameter
from grainlaw.loads import Fluid, Pressure, Traction
from grainlaw.material import Elastic
from grainlaw.messages import refusal
from grainlaw.protocol import LoadingProtocol
from grainlaw.results.frames import Frame
from grainlaw.results.result import Result
from grainlaw.specimen import Specimen

# --- where the tip is, the ring round it, and whether it is fit for an integral ---------------------------------------

STRAIGHT = 1e-3  #: of the outer radius: nearer than this to the line of the crack is on it


def _position(value: Any) -> tuple[float, float]:
    x, y = checked_vector("CrackTip: position", value).tolist()
    return x, y


@attrs.frozen(kw_only=True)
class CrackTip(metaclass=Checked):
    """The tip of a straight crack, and the ring round it over which J and stress intensity factors are integrated.

    The weight q of the integrals is 1 within ``inner`` and falls to 0 at ``outer``. The crack must be straight between
    these radii, and the ring free of other cracks and of damage; some three grains or more should lie within ``inner``.
    """

    position: tuple[float, float] = attrs.field(converter=_position, metadata={"unit": "m"})  #: before the test
    #: into which the crack would grow straight on, counter-clockwise from the x axis
    direction: float = parameter("deg", default=0.0, above=-math.inf)
    inner: float = parameter("m")  #: radius up to which the weight is 1
    outer: float = parameter("m")  #: radius at which the weight has fallen to 0

    def __attrs_post_init__(self) -> None:
        if not self.outer > self.inner:
            raise ParameterError(
                f"CrackTip: outer = {self.outer:g} m is not allowed, it must be above inner = {self.inner:g} m"
            )

    @property
    def axes(self) -> np.ndarray:
        """(2, 2) unit vectors along the crack and to the left of it."""
        angle = math.radians(self.direction)
        return np.array([[math.cos(angle), math.sin(angle)], [-math.sin(angle), math.cos(angle)]])


@checked
def notch_tip(specimen: Specimen, *, inner: float, outer: float, boundary: str = "notch") -> CrackTip:
    """The tip of a notch that is a boundary of a specimen, such as that of a notched beam or of a half disc.

    It is the middle of what is farthest from the middle of its mouth. Raises ParameterError for another boundary.
    """
    region = specimen.grains.region
    if boundary not in region.boundary_names:
        raise refusal("notch_tip: boundary", boundary, f"one of {', '.join(region.boundary_names)}")
    sides = np.array(region.names) == boundary
    corners, times = np.unique(np.concatenate([region.start[sides], region.end[sides]]), axis=0, return_counts=True)
    mouth = corners[times == 1]
    middle = mouth.mean(axis=0) if len(mouth) == 2 else np.full(2, np.nan)
    far = np.hypot(*(corners - middle).T)
    if not far.max() > np.hypot(*(mouth[:1] - middle).T).max() * (1 + 1e-6):
        raise refusal("notch_tip: boundary", boundary, "a notch, with its mouth in a side of the specimen")
    tip = corners[far >= far.max() * (1 - 1e-9)].mean(axis=0)
    x, y = tip - middle
    return CrackTip(position=tip, direction=math.degrees(math.atan2(y, x)), inner=inner, outer=outer)


def check_ring(where: str, result: Result, frame: Frame, tip: CrackTip) -> None:
    """Raise ParameterError, which begins with ``where``, for grains, a place or a ring that J is not known of."""
    specimen = result.specimen
    if not specimen.is_elastic.all():
        material = next(one for one, _ in specimen.materials if type(one) is not Elastic)
        raise refusal(f"{where}: material of the grains", material, "Elastic, of all grains")
    place = (specimen.mesh.nodes - tip.position) @ tip.axes.T
    _check_boundaries(where, specimen, tip, place, _loaded(result))
    _check_zones(where, specimen, tip, np.hypot(*place.T))
    touching = frame.contacts.get("position", np.zeros((0, 2))) - tip.position
    within = int((np.hypot(*touching.T) < tip.outer).sum())
    if within:
        raise ParameterError(
            f"{where}: tip: outer = {tip.outer:g} m is not allowed, grains touch without a bond at {within} places "
            "within it, and J would miss their forces"
        )


def _loaded(result: Result) -> set[str]:
    """Boundaries on which stages of the test put pressures or stresses; none of a test that is only recorded."""
    stages = result.protocol.stages(result.specimen) if isinstance(result.protocol, LoadingProtocol) else ()
    loads = (load for stage in stages for load in stage.of(Pressure, Traction, Fluid))
    return {load.boundary for load in loads if not getattr(load, "cracks_only", False)}


def _check_boundaries(where: str, specimen: Specimen, tip: CrackTip, place: np.ndarray, loaded: set[str]) -> None:
    at = f"({', '.join(f'{x:g}' for x in tip.position)}) m"
    near, inside = STRAIGHT * tip.outer, bool(specimen.grains.region.contains(np.array([tip.position]))[0])
    left: dict[str, float] = {}
    for name, edges in specimen.mesh.boundary_edges.items():
        start, end = place[edges[:, 0]], place[edges[:, 1]]
        along = end - start
        share = np.clip(-(start * along).sum(axis=1) / (along**2).sum(axis=1), 0, 1)
        distance = np.hypot(*(start + share[:, None] * along).T)
        inside |= bool((distance <= near).any())
        flank = (abs(along[:, 1]) <= STRAIGHT * abs(along[:, 0])) & (np.maximum(start[:, 0], end[:, 0]) <= near)
        farthest = np.maximum(np.hypot(*start.T), np.hypot(*end.T))
        beyond = (distance < tip.outer) & (farthest > tip.inner) & ~flank
        if name in loaded and (flank & (distance < tip.outer)).any():
            raise ParameterError(
                f"{where}: tip: the boundary {name}, a face of the crack within {tip.outer:g} m of its tip, is loaded: "
                "J would miss that"
            )
        if beyond.any():
            left[name] = float(distance[beyond].min())
    if not inside:
        raise ParameterError(f"{where}: tip: position = {at} is not allowed, it lies outside of the specimen")
    if left:
        name = min(left, key=left.__getitem__)
        raise ParameterError(
            f"{where}: tip: outer = {tip.outer:g} m is not allowed, the boundary {name} is {left[name]:.4g} m from the "
            f"tip at {at}: the ring must lie in the specimen; only the faces of the crack, straight behind its tip, "
            "may be boundaries there, and the end of a notch within inner"
        )


def _check_zones(where: str, specimen: Specimen, tip: CrackTip, radius: np.ndarray) -> None:
    corners = radius[specimen.mesh.zones]
    if not ((corners > tip.inner) & (corners < tip.outer)).all(axis=1).any():
        raise ParameterError(
            f"{where}: tip: inner = {tip.inner:g} m and outer = {tip.outer:g} m are not allowed, no zone lies between "
            f"them: the grain size is {specimen.grains.grain_size:.4g} m"
        )
    at_tip = (corners <= STRAIGHT * tip.outer).any(axis=1)
    reach = float(corners[at_tip].max(initial=0.0))
    if reach > tip.inner:
        raise ParameterError(
            f"{where}: tip: inner = {tip.inner:g} m is not allowed, the zones at the tip reach as far as {reach:.4g} m"
        )


HELD = 1e-3  #: of the largest stress: less tension than this across its faces is none
THREE = np.array([[4, 1, 1], [1, 4, 1], [1, 1, 4]]) / 6  #: points in a zone, by the shares of its corners


@attrs.frozen(kw_only=True)
class StressIntensity(metaclass=Checked):
    """Stress intensity factors of a crack."""

    mode_i: float  #: Pa sqrt(m), K_I, positive where the crack opens
    mode_ii: float  #: Pa sqrt(m), K_II, positive where the face on the left of the crack moves along its direction
    energy_release_rate: float  #: J/m2, G = (K_I^2 + K_II^2) / E*, to be compared with J


@checked
def j_integral(result: Result, tip: CrackTip, frame: int = -1) -> float:
    """J (J/m2) of a crack at one of the frames, by a domain integral (Li, Shih and Needleman 1985).

    doi:10.1016/0013-7944(85)90029-3. It counts zones, opening and slip of bonds, and tractions and fluid on the faces
    of the crack: docs/measures.md. The specimen must be at rest and without weight. Raises ParameterError for grains
    that are not :class:`~grainlaw.Elastic`, a tip outside of the specimen and a ring that leaves it.
    """
    return _Disc("j_integral", result, tip, result.frame("j_integral", frame)).j()


@checked
def stress_intensity(
    result: Result, tip: CrackTip, *, apparent_modulus: float, apparent_poisson: float, frame: int = -1
) -> StressIntensity:
    """Stress intensity factors of a crack at one of the frames, by the interaction integral (Yau, Wang, Corten 1980).

    doi:10.1115/1.3153665. ``apparent_modulus`` (Pa) and ``apparent_poisson`` are E* and nu* of the plane problem, of
    grains and contacts together, as :func:`~grainlaw.elastic_properties` finds them. Raises ParameterError as
    :func:`j_integral` does, and where bonds in tension hold the faces of the crack together beyond the inner radius.
    """
    modulus = checked_number("stress_intensity: apparent_modulus", apparent_modulus, "Pa", above=0)
    poisson = checked_number("stress_intensity: apparent_poisson", apparent_poisson, above=-1, at_most=1)
    disc = _Disc("stress_intensity", result, tip, result.frame("stress_intensity", frame))
    disc.check_open("stress_intensity", tip)
    one, two = (modulus / 2 * disc.interaction(mode, modulus, poisson) for mode in (1, -1j))
    return StressIntensity(mode_i=one, mode_ii=two, energy_release_rate=(one**2 + two**2) / modulus)


class _Disc:
    """Zones, bonds and faces of the crack within the outer radius; the mean rotation of the zones is taken out."""

    def __init__(self, where: str, result: Result, tip: CrackTip, frame: Frame) -> None:
        check_ring(where, result, frame, tip)
        self._place = (result.mesh.nodes - tip.position) @ tip.axes.T
        self._moved = frame.displacement @ tip.axes.T
        self._q = np.clip((tip.outer - np.hypot(*self._place.T)) / (tip.outer - tip.inner), 0.0, 1.0)
        zones = np.flatnonzero((self._q[result.mesh.zones] > 0).any(axis=1))
        self._corners = result.mesh.zones[zones]
        self._take_zones(result.specimen.zone_stiffness[zones])
        self._take_interfaces(result, frame, STRAIGHT * tip.outer)

    def _take_zones(self, stiffness: np.ndarray) -> None:
        """Stress (z, b, a), the first of Piola and Kirchhoff, stored energy, gradients of displacement and weight."""
        corners = self._corners
        shape = shape_functions(self._place, corners)
        slopes, self.area = shape[:6].reshape(2, 3, -1).transpose(2, 1, 0), shape[6]
        deformation = np.eye(2) + np.einsum("zkb,zka->zba", self._moved[corners], slopes)
        turn = _rotation(np.einsum("z,zba->ba", self.area, deformation))
        self._moved, deformation = self._moved @ turn, turn.T @ deformation
        own = _rotation(deformation)
        stretch = own.transpose(0, 2, 1) @ deformation - np.eye(2)
        strain = np.stack([stretch[:, 0, 0], stretch[:, 1, 1], stretch[:, 0, 1] + stretch[:, 1, 0]], axis=1)
        xx, yy, xy = np.einsum("zab,zb->az", stiffness, strain)  # isotropic: the same in all axes
        self.energy = (xx * strain[:, 0] + yy * strain[:, 1] + xy * strain[:, 2]) / 2
        self.stress = own @ np.stack([xx, xy, xy, yy], axis=1).reshape(-1, 2, 2)
        self.gradient = deformation - np.eye(2)
        self.fall = np.einsum("zk,zka->za", self._q[corners], slopes)
        self.points = np.einsum("gk,zka->gza", THREE, self._place[corners])

    def _take_interfaces(self, result: Result, frame: Frame, near: float) -> None:
        """Contact points of bonds, and of faces of the crack: on its line, behind its tip, and not in tension."""
        chosen = np.flatnonzero((self._q[result.interfaces[:, :2]] > 0).any(axis=1))
        ends = result.interfaces[chosen]
        place, q = self._place[ends[:, :2]], self._q[ends[:, :2]]
        edge = place[:, 1] - place[:, 0]
        length = np.hypot(*edge.T)
        s = edge / length[:, None]
        n = np.stack([s[:, 1], -s[:, 0]], axis=1)
        jump = self._moved[ends[:, 2:]] - self._moved[ends[:, :2]]
        weight = result.specimen.contact_points.weights(length)
        share = np.array([[1 - weight, weight], [weight, 1 - weight]])  # of the ends (p, e, c) in both points
        bonds = {name: row.reshape(2, -1)[:, chosen] for name, row in frame.bonds.items()}
        normal = bonds["normal"] - bonds.get("fluid_pressure", 0.0)
        root = np.sqrt(np.abs([place[:, 0, 0], place[:, :, 0].mean(axis=1), place[:, 1, 0]]))
        rows = {
            "traction": normal[..., None] * n + bonds["shear"][..., None] * s,
            "place": np.einsum("pec,cea->pca", share, place),
            "jump": np.einsum("pec,cea->pca", share, jump),
            "q": np.einsum("pec,ce->pc", share, q),
            "behind": (root[:-1] + root[1:]) ** 2 / 4,
        }
        beside = [self._beside(ends[:, side]) for side in ([0, 1], [2, 3])]
        same = {
            "n": n,
            "s": s,
            "half": length / 2,
            "slope": (jump[:, 1] - jump[:, 0]) / length[:, None] * s[:, :1],
            "along": (q[:, 1] - q[:, 0]) / length,
            "across": np.mean([np.einsum("ca,ca->c", self.fall[z], n) for z in beside], axis=0),
            "stress": np.mean([np.einsum("cba,cb,ca->c", self.stress[z], s, s) for z in beside], axis=0),
        }
        rows |= {name: np.stack([row, row]) for name, row in same.items()}
        behind = (np.abs(place[..., 1]) <= near).all(axis=1) & (place[..., 0] <= near).all(axis=1)
        face = behind & (normal <= 0)
        self._held = np.where(behind & (rows["q"] < 1), normal, 0.0)
        self.bonds, self.faces = (_Points(**{name: row[kind] for name, row in rows.items()}) for kind in (~face, face))

    def check_open(self, where: str, tip: CrackTip) -> None:
        """Raise ParameterError where the line of the crack bears tension in the ring behind its tip."""
        tension, most = float(self._held.max(initial=0.0)), float(np.abs(self.stress).max())
        if tension > HELD * most:
            x, y = tip.position
            raise ParameterError(
                f"{where}: tip: position = ({x:g}, {y:g}) m with direction = {tip.direction:g} deg is not allowed, "
                f"bonds on the line of the crack bear {tension:.4g} Pa in tension beyond {tip.inner:g} m behind its tip"
            )

    def _beside(self, edges: np.ndarray) -> np.ndarray:
        """(c,) zones of the disc that have the edges (c, 2)."""
        count = 1 + int(self._corners.max())
        sides = np.sort(self._corners[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1) @ [count, 1]
        order = np.argsort(sides)
        return order[np.searchsorted(sides[order], np.sort(edges, axis=1) @ [count, 1])] // 3

    def j(self) -> float:
        """J/m2: zones, bonds and faces of the crack."""
        flux = np.einsum("zba,zb->za", self.stress, self.gradient[:, :, 0])
        flux[:, 0] -= self.energy
        zones = np.sum(self.area[:, None] * flux * self.fall)
        one = self.bonds
        shear, opening, slip = (_dot(a, b) for a, b in ((one.traction, one.s), (one.jump, one.n), (one.jump, one.s)))
        stored = _dot(one.traction, one.jump) / 2
        turned = one.n[:, 0] * (shear * opening + one.stress * slip) - one.s[:, 0] * stored
        bonds = np.sum(one.half * (one.n[:, 0] * one.across * stored + one.along * turned))
        two = self.faces
        return float(zones + bonds + np.sum(two.half * two.q * _dot(two.traction, two.slope)))

    def interaction(self, mode: complex, modulus: float, poisson: float) -> float:
        """J/m2, 2 / E* times K_I (``mode`` 1) or K_II (``mode`` -1j) times 1 Pa sqrt(m)."""
        traction, slope = (field.mean(axis=0) for field in williams(self.points, mode, modulus, poisson))
        flux = np.einsum("zba,zb->za", self.stress, slope)
        flux[:, 0] -= _dot(traction, self.gradient[:, :, 1])  # stress and slope along the crack less all of the energy
        flux[:, 1] += _dot(traction, self.gradient[:, :, 0])
        zones = np.sum(self.area[:, None] * flux * self.fall)
        one, two = self.bonds, self.faces
        falls = np.flatnonzero(one.along)  # not at the tip itself, where the field has no end
        traction, _ = williams(one.place[falls], mode, modulus, poisson)
        bonds = np.sum((one.half * one.along)[falls] * _dot(traction, one.jump[falls]))
        _, slope = williams(two.behind[:, None] * [-1, 0], mode, modulus, poisson)  # left face; the right has minus it
        return float(zones + bonds + np.sum(two.half * two.q * _dot(two.traction, 2 * slope * two.n[:, 1:])))


@attrs.frozen
class _Points:
    """Contact points."""

    n: np.ndarray  #: (p, 2) normal, out of the first grain
    s: np.ndarray  #: (p, 2) tangent
    half: np.ndarray  #: (p,) m, half of the interface
    place: np.ndarray  #: (p, 2) m
    behind: np.ndarray  #: (p,) m from the tip, where 1/sqrt(distance) has its mean over the half
    traction: np.ndarray  #: (p, 2) Pa on the first grain
    jump: np.ndarray  #: (p, 2) m, displacement of the second grain less that of the first
    slope: np.ndarray  #: (p, 2) of the jump along the crack
    stress: np.ndarray  #: (p,) Pa along the interface, mean of the zones beside it
    q: np.ndarray  #: (p,) weight
    along: np.ndarray  #: (p,) 1/m, slope of the weight along the interface
    across: np.ndarray  #: (p,) 1/m, and across it, mean of the zones beside it


def williams(place: np.ndarray, mode: complex, modulus: float, poisson: float) -> tuple[np.ndarray, np.ndarray]:
    """Traction (..., 2) Pa on lines along the crack, and slope (..., 2) along it of the displacement, at (..., 2) m.

    Those of K_I - i K_II = ``mode`` in Pa sqrt(m) (Williams 1957), by Muskhelishvili's potentials: phi' is
    mode / (2 sqrt(2 pi z)).
    """
    z = place[..., 0] + 1j * place[..., 1]
    phi = mode / (2 * math.sqrt(2 * math.pi)) / np.sqrt(z)
    bent, psi = -phi / (2 * z), np.conj(mode) / mode * phi - phi / 2
    even, odd = (3 - poisson) / (1 + poisson) * phi - np.conj(phi), z * np.conj(bent) + np.conj(psi)
    slope, turned = (even - odd) * (1 + poisson) / modulus, np.conj(z) * bent + psi
    traction = np.stack([turned.imag, 2 * phi.real + turned.real], axis=-1)
    return traction, np.stack([slope.real, slope.imag], axis=-1)


def _rotation(deformation: np.ndarray) -> np.ndarray:
    """(..., 2, 2) of deformation gradients, Eq. (2)."""
    c = deformation[..., 0, 0] + deformation[..., 1, 1]
    s = deformation[..., 1, 0] - deformation[..., 0, 1]
    return (np.stack([c, -s, s, c], axis=-1) / np.hypot(c, s)[..., None]).reshape(*np.shape(c), 2, 2)


def _dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """(p,) of (p, 2)."""
    return (a * b).sum(axis=1)
