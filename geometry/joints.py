"""Joints given one by one: traces of a discrete fracture network that cut the grains of any tessellator."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Any

import attrs
import numpy as np

from grainlaw.fields import ParameterError, checked_points, parameter
from grainlaw.geometry.cells.any_voronoi import NEAR
from grainlaw.geometry.cells.convex import Polygon, polygon_of
from grainlaw.geometry.cells.joining import tiling_of_parts
from grainlaw.geometry.cells.lines import held, marked, released, vertices_on
from grainlaw.geometry.cells.merging import merge_short_edges
from grainlaw.geometry.cells.sides import region_sides
from grainlaw.geometry.cells.tracing import cut_by
from grainlaw.messages import refusal
from grainlaw.region import Region
from grainlaw.tessellation import BETWEEN, INSIDE, Tessellation, Tessellator

Line = tuple[tuple[float, float], tuple[float, float]]


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

    def tessellate(self, region: Region) -> Tessellation:
        """Fill a region and cut the grains; the parts of a grain follow each other in number."""
        grains = self.tessellator.tessellate(region)
        size, edges = grains.grain_size, grains.edges
        near, names = NEAR * size, tuple(dict.fromkeys([*grains.joints, *self.traces]))
        corners = polygon_of(grains.vertices[grains.corners])
        parts: list[list[Polygon]] = [[corners[i:j]] for i, j in pairwise(grains.first.tolist())]
        joint = edges.kind >= 2
        lines: list[Line] = _lines(grains.vertices[edges.start[joint]], grains.vertices[edges.end[joint]])
        kinds = (edges.kind[joint] - 1).tolist()
        segments: list[Line] = []
        for name, traces in self.traces.items():
            for trace in traces:
                own = _lines(trace[:-1], trace[1:])
                segments += own
                lines += [*own, *cut_by(parts, trace, near)]
                kinds += [names.index(name) + 1] * (len(lines) - len(kinds))
        tiling = tiling_of_parts(region, parts, near)
        start, end = np.array(lines).transpose(1, 0, 2)
        tiling = marked(tiling, start, end, np.array(kinds), near)
        limit, smallest = self.merge * size, self.merge * size**2 / 2
        start, end = np.array(segments).transpose(1, 0, 2)
        tiling, straight = held(tiling, start, end, vertices_on(tiling.vertices, start, end, near))
        merged = merge_short_edges(tiling, limit, smallest, straight)
        merged = merge_short_edges(released(merged), limit, smallest, region_sides(region))
        return merged.tessellation(grains, names)


def _lines(start: np.ndarray, end: np.ndarray) -> list[Line]:
    return [((a, b), (c, d)) for (a, b), (c, d) in zip(start.tolist(), end.tolist(), strict=True)]
