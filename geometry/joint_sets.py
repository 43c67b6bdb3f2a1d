"""Jointed rock: blocks that families of parallel joints cut out of a region."""

from __future__ import annotations

import math
import warnings
from collections.abc import Sequence
from typing import Any

import attrs
import numpy as np

from grainlaw.arguments import Checked, checked
from grainlaw.fields import ParameterError, UnitWarning, parameter, vector
from grainlaw.geometry.cells.any_voronoi import NEAR, frame
from grainlaw.geometry.cells.convex import Polygon, polygon_of, split
from grainlaw.geometry.cells.cutting import Cutter
from grainlaw.geometry.cells.joining import tiling_of_parts
from grainlaw.geometry.cells.merging import merge_short_edges
from grainlaw.geometry.cells.sides import Sides, held, region_sides, released
from grainlaw.geometry.cells.tiling import Tiling
from grainlaw.messages import refusal
from grainlaw.region import Region
from grainlaw.tessellation import BETWEEN, INSIDE, Tessellation, Tessellator

MOST = 1_000_000  #: joints of a set


@attrs.frozen(kw_only=True)
class JointSet(metaclass=Checked):
    """Parallel joints without end; ``dip`` counts from the x axis, negative where they fall to the right.

    A law is given to them by their ``name``, which is "set 1", "set 2" and so on unless given.
    """

    #: from the x axis, negative where the joints fall to the right
    dip: float = parameter("deg", above=-90, at_most=90)
    spacing: float = parameter("m")  #: between joints, at right angles to them
    through: tuple[float, float] = vector("m", default=(0.0, 0.0))  #: a point on one of them
    name: str = ""  #: by which laws name the set; set 1, set 2 ... if not given

    @property
    def along(self) -> tuple[float, float]:
        """Unit vector."""
        return math.cos(math.radians(self.dip)), math.sin(math.radians(self.dip))

    def cut(self, polygon: Polygon, near: float) -> list[Polygon]:
        """The strips of a convex polygon between the joints, across them from right to left."""
        tx, ty = self.along
        height = [((y - self.through[1]) * tx - (x - self.through[0]) * ty) / self.spacing for x, y in polygon]
        strips, rest = [], polygon
        for number in range(math.ceil(min(height)), math.floor(max(height)) + 1):
            offset = number * self.spacing
            rest, right = split(rest, (self.through[0] - offset * ty, self.through[1] + offset * tx), (tx, ty), near)
            strips += [right] if right else []
            if not rest:
                break
        return [*strips, rest] if rest else strips

    def joint_at(self, points: np.ndarray, near: float) -> np.ndarray:
        """(n,) number of the joint on which each point (n, 2) m lies, counted from ``through``; nan without."""
        tx, ty = self.along
        height = (points - self.through) @ (-ty, tx)
        number = np.round(height / self.spacing)
        return np.where(abs(height - number * self.spacing) < 2 * near, number, np.nan)


def _sets(value: Any) -> tuple[JointSet, ...]:
    made = tuple(value) if isinstance(value, Sequence) else (value,)
    if not made or not all(isinstance(each, JointSet) for each in made):
        raise refusal("JointSets: sets", value, "a list of at least one JointSet")
    names = [each.name for each in made if each.name]
    if len(set(names)) < len(names) or {BETWEEN, INSIDE} & {*names}:
        raise refusal("JointSets: names", names, f"different for each set, none of them {BETWEEN} or {INSIDE}")
    return made


@attrs.frozen(kw_only=True)
class JointSets(Tessellator):
    """Blocks between the joints of one or more sets; at the sides of a region they may be thin.

    Where joints of oblique sets nearly meet in one point, they leave slivers with edges far shorter than the others,
    which would rule the stable time step: edges below ``merge`` vanish. The joints of the first set stay straight where
    that suffices. Edges on joints are ``joints`` of the tessellation, by the name of their set.

    Bedding that dips out of a slope by 35 degrees, and cross joints at right angles to it::

        slope = polygon([(0, 0), (40, 0), (40, 10), (20, 10), (10, 30), (0, 30)])
        bedding, cross = JointSet(dip=-35, spacing=2.0), JointSet(dip=55, spacing=3.0)
        grains = JointSets(sets=[bedding, cross]).tessellate(slope)
    """

    sets: Sequence[JointSet] = attrs.field(converter=_sets)  #: sets of parallel joints
    merge: float = parameter("spacings", default=0.1, at_least=0, below=0.5)  #: shorter edges vanish where they can

    @checked
    def tessellate(self, region: Region) -> Tessellation:
        """Fill a region, strip by strip.

        Raises ParameterError for a spacing too small for it, TilingError for joints that all but coincide with a side.
        """
        spacing = min(each.spacing for each in self.sets)
        near = NEAR * spacing
        for each in self.sets:
            if np.hypot(*np.ptp(region.bounds, axis=0)) > MOST * each.spacing:
                raise ParameterError(
                    f"JointSets: spacing = {each.spacing:g} m is not allowed, it gives too many joints"
                )
        cells: list[Polygon] = [polygon_of(frame(region).outline)]
        for each in self.sets:
            cells = [strip for cell in cells for strip in each.cut(cell, near)]
        cutter, sides = Cutter(region, near), list(range(len(region.start)))
        pieces = [[piece] for cell in cells for piece in cutter.pieces(cell, sides)]
        made = self._named(tiling_of_parts(region, pieces, near), near)
        merged = merge_short_edges(made, 0.0)  # drops what the cuts of joined pieces left
        limit, smallest = self.merge * spacing, self.merge * spacing**2 / 2
        merged, lines = self._first_set_held(merged, near)
        merged = merge_short_edges(merged, limit, smallest, lines)
        merged = merge_short_edges(released(merged), limit, smallest, region_sides(region))
        names = [each.name or f"set {k}" for k, each in enumerate(self.sets, 1)]
        blocks = merged.tessellation(joints=names)
        for name, each in zip(names, self.sets, strict=True):
            if not len(blocks.joints[name]):
                words = f"JointSets: no joint of {each} is left in the region: are spacing, through and merge right?"
                warnings.warn(UnitWarning(words), stacklevel=3)
        return blocks

    def _named(self, tiling: Tiling, near: float) -> Tiling:
        """The tiling that knows which edges lie on a joint of which set."""
        kind = tiling.kind.copy()
        for number, each in enumerate(self.sets, 1):
            joint = each.joint_at(tiling.vertices, near)
            kind[joint[tiling.corners] == joint[tiling.corners[tiling.next]]] = number
        return attrs.evolve(tiling, kind=kind)

    def _first_set_held(self, tiling: Tiling, near: float) -> tuple[Tiling, Sides]:
        first = self.sets[0]
        joint = first.joint_at(tiling.vertices, near)
        vertex = np.flatnonzero(np.isfinite(joint))
        numbers, line = np.unique(joint[vertex], return_inverse=True)
        tx, ty = first.along
        start = np.array(first.through) + numbers[:, None] * first.spacing * np.array([-ty, tx])
        return held(tiling, start, start + np.array([tx, ty]), (vertex, line))
