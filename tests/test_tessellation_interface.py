"""The interface of tessellations: its example, the edges it tells, and the faults that its check must find."""

from __future__ import annotations

import inspect
import textwrap

import attrs
import numpy as np
import pytest
from tiling import assert_sides_complete, assert_tiles

import grainlaw as gl
from grainlaw.fields import ParameterError
from grainlaw.geometry import rectangle
from grainlaw.tessellation import Tessellation, Tessellator, TilingError


def toy() -> type[Tessellator]:
    """The class in the docstring of the interface."""
    code = textwrap.dedent(inspect.getdoc(Tessellator).split("::\n", 1)[1])
    names = {"attrs": attrs, "gl": gl, "np": np}
    exec(code, names)
    return names["Bricks"]


def test_example_of_the_interface_tiles() -> None:
    made = toy()(rows=5, columns=2).tessellate(rectangle(2, 3))
    made.check()
    assert_tiles(made)
    assert_sides_complete(made)
    assert made.count == 10
    assert len(made.edges) == 27


def test_edges_of_two_squares() -> None:
    vertices = [(0, 0), (1, 0), (2, 0), (2, 1), (1, 1), (0, 1)]
    made = Tessellation(rectangle(2, 1), vertices, [1, 4, 5, 0, 4, 1, 2, 3], [0, 4, 8])
    made.check()
    edges = made.edges
    inner = np.flatnonzero(edges.right >= 0)
    assert inner.tolist() == [0]
    assert (edges.start[0], edges.end[0], edges.left[0], edges.right[0]) == (1, 4, 0, 1)
    assert edges.left_corners[0].tolist() == [0, 1]
    assert edges.right_corners[0].tolist() == [5, 4]
    names = [edges.boundary_names[side] for side in edges.side[1:]]
    assert names == ["top", "left", "bottom", "bottom", "right", "top"]
    assert made.areas.tolist() == [1, 1]
    assert made.centroids.tolist() == [[0.5, 0.5], [1.5, 0.5]]
    assert made.phase.tolist() == [0, 0]


def bricks() -> Tessellation:
    return toy()(rows=3, columns=3).tessellate(rectangle(3, 3))


def without_a_grain() -> Tessellation:
    good = bricks()
    return Tessellation(good.region, good.vertices, good.corners[4:], good.first[:-1])


def with_a_crack() -> Tessellation:
    good = bricks()
    vertices, corners = np.vstack([good.vertices, good.vertices[5]]), good.corners.copy()
    corners[np.flatnonzero(corners == 5)[0]] = len(good.vertices)
    return attrs.evolve(good, vertices=vertices, corners=corners)


def with_a_grain_twice() -> Tessellation:
    good = bricks()
    twice = [*good.corners, *good.corners[:4]]
    return Tessellation(good.region, good.vertices, twice, [*good.first, good.first[-1] + 4])


def with_a_vertex_moved(vertex: int, to: tuple[float, float]) -> Tessellation:
    good = bricks()
    vertices = good.vertices.copy()
    vertices[vertex] = to
    return attrs.evolve(good, vertices=vertices)


def with_a_grain_turned_round() -> Tessellation:
    good = bricks()
    return attrs.evolve(good, corners=[*good.corners[3::-1], *good.corners[4:]])


@pytest.mark.parametrize(
    ("fault", "message"),
    [
        (without_a_grain, "neither a second grain nor a side"),
        (with_a_crack, "neither a second grain nor a side"),
        (with_a_grain_twice, "2 grains lie on the same side of the edge from vertex"),
        (lambda: with_a_vertex_moved(5, (0.2, 0.2)), "grain 0 is not convex near its vertex"),
        (lambda: with_a_vertex_moved(1, (1, 0.01)), "neither a second grain nor a side"),
        (lambda: with_a_vertex_moved(0, (1e-10, 1e-10)), "areas of the grains add up to"),
        (with_a_grain_turned_round, "grain 0 runs clockwise"),
        (lambda: with_a_vertex_moved(5, (np.nan, 1)), "must be finite"),
        (lambda: attrs.evolve(bricks(), first=[0, 2, *range(8, 37, 4)]), "grain 0 has less than 3 corners"),
        (lambda: attrs.evolve(bricks(), first=[0, 4]), "first must run from 0 to the number of corners, 36"),
        (lambda: attrs.evolve(bricks(), vertices=bricks().vertices[:-1]), "corners must be vertex numbers below 15"),
        (lambda: attrs.evolve(bricks(), corners=bricks().corners + 0.5), "corners = .* must be an array of int"),
        (lambda: attrs.evolve(bricks(), phase=np.zeros(2, dtype=int)), r"phase has the shape \(2,\) for 9 grains"),
    ],
)
def test_check_finds(fault, message: str) -> None:
    with pytest.raises((TilingError, ParameterError), match=message):
        fault().check()
