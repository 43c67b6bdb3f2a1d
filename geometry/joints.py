"""Joints given one by one: traces of a discrete fracture network that cut the grains of any tessellator."""

from __future__ import annotations

import math
import warnings
from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Any

import attrs
import numpy as np

from grainlaw.arguments import checked
from grainlaw.fields import ParameterError, UnitWarning, checked_points, parameter
from grainlaw.geometry.cells.any_voronoi import NEAR
from grainlaw.geometry.cells.convex import Point, Polygon, depth, polygon_of, split
from grainlaw.geometry.cells.joining import tiling_of_parts
from grainlaw.geometry.cells.merging import merge_short_edges
from grainlaw.geometry.cells.sides import held, marked, region_sides, released, vertices_on
from grainlaw.messages import refusal, users_line
from grainlaw.polygon import cross
from grainlaw.region import Region
from grainlaw.tessellation import BETWEEN, INSIDE, Tessellation, Tessellator

BENT = 2.0  #: deg: an edge that is turned by less against its trace counts as on it
THROUGH = 0.5  #: share of its chord from which on a trace that ends in a polygon cuts it

Chord = tuple[Point, Point]


def cut_by(parts: list[list[Polygon]], trace: np.ndarray, near: float) -> list[Chord]:
    """Cut the polygons that a trace (n, 2) m runs through, in place; and the cuts, from side to side.

    ``parts`` has a list of polygons for each grain. Each is cut along the straight line between the points where the
    trace enters and leaves it.
    """
    points = polygon_of(trace)
    low, high = np.minimum(trace[:-1], trace[1:]) - near, np.maximum(trace[:-1], trace[1:]) + near
    chords: list[Chord] = []
    for g, polygons in enumerate(parts):
        every = np.array([corner for polygon in polygons for corner in polygon])
        if not ((low <= every.max(axis=0)) & (high >= every.min(axis=0))).all(axis=1).any():
            continue
        after: list[Polygon] = []
        for polygon in polygons:
            cut, made = _cut(polygon, points, near)
            after += cut
            chords += made
        parts[g] = after
    return chords


def _cut(polygon: Polygon, trace: list[Point], near: float) -> tuple[list[Polygon], list[Chord]]:
    pieces, chords = [polygon], []
    for begin, finish in _passages(polygon, trace):
        middle = (begin[0] + finish[0]) / 2, (begin[1] + finish[1]) / 2
        along = finish[0] - begin[0], finish[1] - begin[1]
        pieces.sort(key=lambda piece: -depth(piece, middle))
        here = pieces[0]
        if math.hypot(*along) <= near or depth(here, middle) <= near:
            continue
        whole = _inside(here, begin, (begin[0] + along[0], begin[1] + along[1]), -math.inf, math.inf)
        if whole is None or whole[1] - whole[0] > 1 / THROUGH:
            continue
        parted = split(here, begin, along, near)
        if all(parted):
            pieces[:1] = parted
            chords.append((_at(begin, along, whole[0]), _at(begin, along, whole[1])))
    return pieces, chords


def _passages(polygon: Polygon, trace: list[Point]) -> list[Chord]:
    """Where a trace enters and leaves a polygon, or begins and ends in it, each time that it does."""
    passages: list[Chord] = []
    goes_on = False
    for begin, finish in pairwise(trace):
        inside = _inside(polygon, begin, finish, 0.0, 1.0)
        if inside is None:
            goes_on = False
            continue
        along = finish[0] - begin[0], finish[1] - begin[1]
        enters, leaves = _at(begin, along, inside[0]), _at(begin, along, inside[1])
        if goes_on and inside[0] == 0:
            passages[-1] = passages[-1][0], leaves
        else:
            passages.append((enters, leaves))
        goes_on = inside[1] == 1
    return passages


def _at(begin: Point, along: Point, share: float) -> Point:
    return begin[0] + share * along[0], begin[1] + share * along[1]


def _inside(polygon: Polygon, begin: Point, finish: Point, low: float, high: float) -> tuple[float, float] | None:
    """From which to which share, between two bounds, of the way from begin to finish one is inside; None if never.

    Cyrus and Beck 1978, doi:10.1016/0097-8493(78)90021-3.
    """
    for (ax, ay), (bx, by) in zip(polygon, polygon[1:] + polygon[:1], strict=True):
        dx, dy = bx - ax, by - ay
        first = dx * (begin[1] - ay) - dy * (begin[0] - ax)
        last = dx * (finish[1] - ay) - dy * (finish[0] - ax)
        if first == last:
            if first < 0:
                return None
        elif first < last:
            low = max(low, first / (first - last))
        else:
            high = min(high, first / (first - last))
    return (low, high) if low < high else None


def _traces(value: Any) -> dict[str, tuple[np.ndarray, ...]]:
    if not isinstance(value, Mapping) or not value:
        raise refusal("Jointed: traces", value, "a mapping of the names of sets to lists of traces")
    made = {}
    for name, traces in value.items():
        if not isinstance(name, str) or name in (BETWEEN, INSIDE, ""):
            raise refusal("Jointed: traces: name", name, f"a text, not {BETWEEN} or {INSIDE}")
        if not isinstance(traces, (Sequence, np.ndarray)) or isinstance(traces, str) or not len(traces):
            raise refusal(f"Jointed: traces of {name}", traces, "a list of traces, each a list of points (x, y) in m")
        made[name] = tuple(_trace(f"Jointed: trace {k} of {name}", trace) for k, trace in enumerate(traces))
    known: dict[frozenset[Any], str] = {}
    for name, traces in made.items():
        for trace in traces:
            ends = frozenset([trace.tobytes(), trace[::-1].tobytes()])
            if (other := known.setdefault(ends, name)) != name:
                raise ParameterError(
                    f"Jointed: the trace from ({trace[0, 0]:g}, {trace[0, 1]:g}) m is in {other} and in {name}; an "
                    "edge is of one set"
                )
    return made


def _trace(where: str, value: Any) -> np.ndarray:
    points = checked_points(where, value)
    if len(points) < 2 or not np.hypot(*np.diff(points, axis=0).T).all():
        raise refusal(where, value, "two or more points, each different from the one before")
    points.flags.writeable = False
    return points


@attrs.frozen
class Jointed(Tessellator):
    """The grains of another tessellator, cut by the traces of joints.

    ``Jointed(Voronoi(grains=755), {"bedding": [[(0, 0.02), (0.03, 0.05)], ...], "cross": [...]})``: traces are lists
    of points (x, y) m. Edges on them are ``joints`` of the tessellation, by the name of their set. In each grain a
    trace is straight from where it enters to where it leaves: bends move to the boundaries of grains. It ends where
    a grain ends: the grain in which it ends is cut through where the trace runs through at least half of it, else it is
    left whole, so that traces are as often lengthened as shortened, by at most half a grain. Traces may leave the
    region; what is outside of it is ignored.

    The parts of a grain keep its number in ``parent``. Edges far shorter than grains, left where a trace passes near to
    a corner, vanish; traces stay straight where that suffices. Raises ParameterError.
    """

    tessellator: Tessellator  #: makes the grains
    traces: Mapping[str, Any] = attrs.field(converter=_traces)  #: lists of polylines (x, y) m, by name of their set
    merge: float = parameter("grain sizes", default=0.25, at_least=0, below=1)  #: shorter edges vanish where they can

    @checked
    def tessellate(self, region: Region) -> Tessellation:
        """Fill a region and cut the grains; the parts of a grain follow each other in number."""
        grains = self.tessellator.tessellate(region)
        size, edges = grains.grain_size, grains.edges
        near, names = NEAR * size, tuple(dict.fromkeys([*grains.joints, *self.traces]))
        corners = polygon_of(grains.vertices[grains.corners])
        parts: list[list[Polygon]] = [[corners[i:j]] for i, j in pairwise(grains.first.tolist())]
        joint = edges.kind >= 2
        lines: list[Chord] = _lines(grains.vertices[edges.start[joint]], grains.vertices[edges.end[joint]])
        kinds = (edges.kind[joint] - 1).tolist()
        segments: list[Chord] = []
        for name, traces in self.traces.items():
            for trace in traces:
                own = _lines(trace[:-1], trace[1:])
                segments += own
                lines += [*own, *cut_by(parts, trace, near)]
                kinds += [names.index(name) + 1] * (len(lines) - len(kinds))
        tiling = tiling_of_parts(region, parts, near)
        begin, finish = np.array(lines).transpose(1, 0, 2)
        tiling = marked(tiling, begin, finish, np.array(kinds), near)
        limit, smallest = self.merge * size, self.merge * size**2 / 2
        start, end = np.array(segments).transpose(1, 0, 2)
        tiling, straight = held(tiling, start, end, vertices_on(tiling.vertices, start, end, near))
        merged = merge_short_edges(tiling, limit, smallest, straight)
        merged = merge_short_edges(released(merged), limit, smallest, region_sides(region))
        made = merged.tessellation(grains, names)
        self._warn_of_misses(made)
        self._warn_of_bends(made, begin, finish)
        return made

    def _warn_of_misses(self, made: Tessellation) -> None:
        """Warn of a set of which no trace cuts a grain, as one in mm, one beside the region, or one that is short."""
        (left, bottom), (right, top) = made.region.bounds
        for name in self.traces:
            if not len(made.joints[name]):
                words = (
                    f"Jointed: no trace of {name} cuts a grain of the region, which has x from {left:g} to {right:g} m "
                    f"and y from {bottom:g} to {top:g} m: is the unit right, and is one as long as a grain?"
                )
                warnings.warn(UnitWarning(words), stacklevel=users_line())

    def _warn_of_bends(self, made: Tessellation, start: np.ndarray, end: np.ndarray) -> None:
        """Warn of a trace that was turned out of its course, lines from start to end, where short edges vanished."""
        for name in self.traces:
            ends = made.vertices[made.joints[name]]
            edge, middle = ends[:, 1] - ends[:, 0], ends.mean(axis=1)
            turned = np.array([_turn(*each, start, end - start) for each in zip(edge, middle, strict=True)])
            bent, length = turned > BENT, np.hypot(*edge.T)
            if bent.any():
                worst = int(np.argmax(turned))
                words = (
                    f"Jointed: a trace of {name} is turned by {turned[worst]:.1f} degrees at ({middle[worst, 0]:.4g}, "
                    f"{middle[worst, 1]:.4g}) m, and {length[bent].sum() / length.sum():.0%} of its set by more than "
                    f"{BENT:g}, so that short edges vanish; merge=0 keeps it straight, and so may other grains"
                )
                warnings.warn(words, stacklevel=users_line())


def _turn(edge: np.ndarray, middle: np.ndarray, start: np.ndarray, along: np.ndarray) -> float:
    """Degrees between an edge and the line that its middle is nearest to, of lines (n, 2) m."""
    share = np.clip(((middle - start) * along).sum(axis=1) / (along**2).sum(axis=1), 0, 1)
    line = along[np.argmin(np.hypot(*(middle - start - share[:, None] * along).T))]
    return math.degrees(math.atan2(abs(cross(line, edge)), abs(line @ edge)))


def _lines(start: np.ndarray, end: np.ndarray) -> list[Chord]:
    return [((a, b), (c, d)) for (a, b), (c, d) in zip(start.tolist(), end.tolist(), strict=True)]
