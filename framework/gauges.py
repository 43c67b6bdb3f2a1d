"""Where the strain of a specimen is measured, as with gauges in the laboratory."""

from __future__ import annotations

from abc import abstractmethod
from typing import ClassVar

import attrs
import numpy as np

from grainlaw.arguments import Checked
from grainlaw.columns import STRAIN
from grainlaw.fields import parameter
from grainlaw.mesh import Mesh
from grainlaw.once import once_each
from grainlaw.specimen import Specimen

__all__ = ["CentreGauges", "ClipGauges", "Gauges", "WholeSpecimen"]


@once_each
def points_on(mesh: Mesh, boundary: str, count: int, share: float = 1.0) -> np.ndarray:
    """(k,) nodes of a boundary nearest to ``count`` places, spread evenly along the middle ``share`` of it."""
    nodes = mesh.boundaries[boundary]
    place = mesh.nodes[nodes]
    along = place[:, np.argmax(np.ptp(place, axis=0))]
    wanted = along.min() + np.ptp(along) * (0.5 + share * ((np.arange(count) + 0.5) / count - 0.5))
    return nodes[np.abs(along[:, None] - wanted).argmin(axis=0)]


def lateral_strain(specimen: Specimen, displacement: np.ndarray) -> float:
    """Change of width over width, from 12 points on the left and 12 on the right side (24, as in the paper).

    They lie in the middle half of the height, as strain gauges do, where the platens have little influence.
    ``displacement`` is (i, 2) m.
    """
    low, high = specimen.grains.region.bounds
    left, right = (displacement[points_on(specimen.mesh, side, 12, 0.5), 0].mean() for side in ("left", "right"))
    return float(right - left) / float(high[0] - low[0])


def has_platens(specimen: Specimen) -> bool:
    """Whether platens are separate bodies: the specimen's ends are then the boundaries rock_top and rock_bottom."""
    return "rock_top" in specimen.mesh.boundaries


def ends(specimen: Specimen) -> tuple[str, str]:
    """Boundaries at the upper and the lower end of the specimen itself."""
    return ("rock_top", "rock_bottom") if has_platens(specimen) else ("top", "bottom")


def axial_strain_of_points(specimen: Specimen, displacement: np.ndarray) -> float:
    """Change of height over height, from points on both ends (the paper's 9); ``displacement`` is (i, 2) m."""
    low, high = specimen.grains.region.bounds
    top, bottom = (displacement[points_on(specimen.mesh, end, 9), 1].mean() for end in ends(specimen))
    return float(top - bottom) / float(high[1] - low[1])


class Gauges(metaclass=Checked):
    """Where a test of a prism measures the strains from which moduli, CI and CD are found."""

    axial: ClassVar[str] = "strain_points"  #: column with the axial strain of the moduli

    @abstractmethod
    def strains(self, specimen: Specimen, displacement: np.ndarray) -> tuple[float, float]:
        """Lateral and axial strain, extension positive, of the displacement (i, 2) m of the nodes."""


@attrs.frozen
class WholeSpecimen(Gauges):
    """Width from 12 points in the middle half of each side, height from 9 points on each end, as in the paper.

    Moduli take the approach of the platens.
    """

    axial: ClassVar[str] = STRAIN

    def strains(self, specimen: Specimen, displacement: np.ndarray) -> tuple[float, float]:
        return lateral_strain(specimen, displacement), axial_strain_of_points(specimen, displacement)


@attrs.frozen(kw_only=True)
class CentreGauges(Gauges):
    """Gauges glued on the middle of the specimen: the change of distance between the edges of a window there.

    Each edge is the 12 nodes nearest to 12 places along it.
    """

    share: float = parameter("1", default=0.25, above=0, at_most=1)  #: of width and height that the window has

    def strains(self, specimen: Specimen, displacement: np.ndarray) -> tuple[float, float]:
        low, high = specimen.grains.region.bounds
        middle, half = (low + high) / 2, self.share * (high - low) / 2
        (left, bottom), (right, top) = (middle - half).tolist(), (middle + half).tolist()
        mesh, wide, tall = specimen.mesh, (left, right), (bottom, top)
        sides = (_nearest(mesh, ((x, x), tall)) for x in wide)
        levels = (_nearest(mesh, (wide, (y, y))) for y in tall)
        return _elongation(mesh, displacement, 0, *sides), _elongation(mesh, displacement, 1, *levels)


@attrs.frozen
class ClipGauges(Gauges):
    """Gauges clipped on: the width at mid-height, and the sides between a quarter and three quarters of the height."""

    def strains(self, specimen: Specimen, displacement: np.ndarray) -> tuple[float, float]:
        mesh = specimen.mesh
        sides = [points_on(mesh, side, 1) for side in ("left", "right")]
        along = np.concatenate([points_on(mesh, side, 2) for side in ("left", "right")])
        lower, upper = along[np.argsort(mesh.nodes[along, 1])].reshape(2, 2)
        return _elongation(mesh, displacement, 0, *sides), _elongation(mesh, displacement, 1, lower, upper)


@once_each
def _nearest(mesh: Mesh, line: tuple[tuple[float, float], tuple[float, float]]) -> np.ndarray:
    """(k,) nodes nearest to 12 places spread evenly along a line, from its x and its y at both ends."""
    x, y = (np.linspace(*between, 12) for between in line)
    return np.hypot(mesh.nodes[:, 0, None] - x, mesh.nodes[:, 1, None] - y).argmin(axis=0)


def _elongation(mesh: Mesh, displacement: np.ndarray, axis: int, start: np.ndarray, end: np.ndarray) -> float:
    """Change of the distance between two lots of nodes over that distance."""
    apart = mesh.nodes[end, axis].mean() - mesh.nodes[start, axis].mean()
    return float((displacement[end, axis].mean() - displacement[start, axis].mean()) / apart)


def __dir__() -> list[str]:  # a notebook offers what is public
    return [*__all__]
