"""Polygons from elsewhere become a tessellation: checked, with their outline as region, concave ones cut."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import attrs
import numpy as np
from scipy.spatial import cKDTree

from grainlaw.fields import ParameterError, checked_number
from grainlaw.geometry.cells.convex import hull, polygon_of
from grainlaw.geometry.cells.cutting import Cutter
from grainlaw.geometry.cells.outline import Names, outline, region_of
from grainlaw.geometry.cells.shared_edges import Polygons, place, split_at_hanging
from grainlaw.geometry.cells.sides import region_sides
from grainlaw.geometry.cells.slivers import warn_of_slivers, without_short_edges
from grainlaw.messages import refusal
from grainlaw.region import Region
from grainlaw.tessellation import Tessellation

NEAR = 1e-9  #: of the size of a concave polygon: nearer to a vertex is that vertex


def tessellation_of(
    where: str, polygons: Polygons, *, tolerance: float, region: Region | None = None, names: Names | None = None,
    holes: bool = True, phase: np.ndarray | None = None, phase_names: Sequence[str] = (),
    parent: np.ndarray | None = None, merge: float = 0.0,
) -> Tessellation:  # fmt: skip
    """Polygons that fill a region, or whose outline is the region; each is one grain, or a cell of ``parent`` (p,).

    Edges shorter than ``merge`` times the size of the grains vanish where these stay convex. A place that alone rules
    the stable time step is told (:class:`~grainlaw.geometry.cells.slivers.SliverWarning`).

    Raises ParameterError, which begins with ``where``, with numbers of polygons and the place of the fault.
    """
    polygons = split_at_hanging(polygons, tolerance, 0 if region is None else len(region.start))
    _refuse_touching(where, polygons)
    if region is None:
        region = region_of(polygons.vertices, outline(where, polygons, holes=holes), names or {}, tolerance)
    else:
        polygons = _held(polygons, region, tolerance)
        _refuse_outside(where, polygons, region)
        outline(where, polygons, holes=True)
    made = _convex(polygons, tolerance)
    count = len(polygons.given)
    own = np.arange(count) if parent is None else np.unique(parent, return_inverse=True)[1]
    used, corners = np.unique(made.corners, return_inverse=True)
    options: dict[str, Any] = {} if phase is None else {"phase": phase[made.given], "phase_names": tuple(phase_names)}
    if len(made.given) > count or parent is not None:
        options["parent"] = own[made.given]
    grains = Tessellation(region, made.vertices[used], corners, made.first, **options)
    grains.check()
    if merge > 0:
        grains = without_short_edges(grains, merge)
    warn_of_slivers(where, grains)
    return grains


def checked_merge(where: str, merge: Any) -> float:
    """A share of the grain size below one. Raises ParameterError, which begins with ``where``."""
    value = checked_number(f"{where}: merge", merge, "grain sizes", at_least=0)
    if value >= 1:
        raise refusal(f"{where}: merge", merge, "below 1 grain size")
    return value


def _refuse_touching(where: str, polygons: Polygons) -> None:
    """A polygon with one vertex twice touches itself."""
    key = polygons.owner * len(polygons.vertices) + polygons.corners
    found, times = np.unique(key, return_counts=True)
    if times.max() > 1:
        p, v = divmod(int(found[times.argmax()]), len(polygons.vertices))
        raise ParameterError(f"{where}: polygon {p} touches itself at {place(polygons.vertices[v])}")


def _held(polygons: Polygons, region: Region, tolerance: float) -> Polygons:
    """Loose vertices within ``tolerance`` (m) of a side of the region put onto it."""
    loose = polygons.loose
    at = np.union1d(polygons.corners[loose], polygons.next[loose])
    at = at[at >= len(region.start)]
    start, along = region.start, region.end - region.start
    length = np.hypot(*along.T)
    away = polygons.vertices[at][:, None] - start
    share = (away * along).sum(axis=2) / length
    off = np.abs(away[..., 1] * along[:, 0] - away[..., 0] * along[:, 1]) / length
    near = np.where((share >= 0) & (share <= length), off, np.inf)
    side = near.argmin(axis=1)
    on = np.where(near.min(axis=1) <= tolerance, side, -1)
    vertices = polygons.vertices.copy()
    vertices[at] = region_sides(region).hold(vertices[at], np.column_stack([on, np.full(len(at), -1)]))
    return attrs.evolve(polygons, vertices=vertices)


def _refuse_outside(where: str, polygons: Polygons, region: Region) -> None:
    loose = polygons.loose
    ends = polygons.vertices[np.column_stack([polygons.corners[loose], polygons.next[loose]])]
    off = region.side_at(ends) < 0 if len(loose) else np.zeros(0, dtype=bool)
    if off.any():
        k = off.argmax()
        raise ParameterError(
            f"{where}: polygon {polygons.owner[loose[k]]} has an edge with the middle {place(ends[k].mean(axis=0))} "
            "where neither a second polygon nor a side of the region is: a gap, an overlap, or outside of the region"
        )


def _convex(polygons: Polygons, tolerance: float) -> Polygons:
    """Concave polygons cut into convex ones, with the corners that this gives to their neighbours."""
    concave = polygons.concave
    if not len(concave):
        return polygons
    vertices, rings, given = polygons.vertices, [], []
    cut = set(concave.tolist())
    for p in range(len(polygons.given)):
        ring = polygons.ring(p)
        parts = [ring]
        if p in cut:
            vertices, parts = _parts(vertices, ring)
        rings += parts
        given += [int(polygons.given[p])] * len(parts)
    first = np.cumsum([0, *map(len, rings)])
    return split_at_hanging(Polygons(vertices, np.concatenate(rings), first, np.array(given)), 1e-3 * tolerance)


def _parts(vertices: np.ndarray, ring: np.ndarray) -> tuple[np.ndarray, list[np.ndarray]]:
    """Convex polygons that make up one, and the vertices with those of the cuts."""
    points = vertices[ring]
    origin, size = points.mean(axis=0), np.ptp(points, axis=0).max()
    shape = (points - origin) / size
    region = Region(shape, ("side",) * len(shape))
    pieces = Cutter(region, NEAR).pieces(hull(polygon_of(shape)), list(range(len(shape))))
    known, number, parts = shape, ring, []
    for piece in pieces:
        corners = []
        for corner in piece:
            away, k = cKDTree(known).query(corner)
            if away > 4 * NEAR:
                vertices = np.concatenate([vertices, [np.array(corner) * size + origin]])
                known, number = np.concatenate([known, [corner]]), np.append(number, len(vertices) - 1)
                k = len(number) - 1
            corners.append(int(number[k]))
        parts.append(np.array(corners))
    return vertices, parts
