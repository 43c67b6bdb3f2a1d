"""Where the tip of a crack is, the ring round it over which J is integrated, and whether it is fit for that."""

from __future__ import annotations

import math
from typing import Any

import attrs
import numpy as np

from grainlaw.arguments import Checked, checked
from grainlaw.fields import ParameterError, checked_vector, parameter
from grainlaw.loads import FluidPressure, Pressure, Traction
from grainlaw.material import Elastic
from grainlaw.messages import refusal
from grainlaw.protocol import LoadingProtocol
from grainlaw.results.frames import Frame
from grainlaw.results.result import Result
from grainlaw.specimen import Specimen

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
    loads = (load for stage in stages for load in stage.of(Pressure, Traction, FluidPressure))
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
