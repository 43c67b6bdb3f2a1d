"""Several bodies: each keeps its own sides and edges, grains part by the gap asked for; walls and platens."""

from __future__ import annotations

import inspect
import textwrap
import tracemalloc

import attrs
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import ConvexHull, HalfspaceIntersection
from support import ROCK
from tiling import polygon_of, shoelace

import grainlaw as gl
from grainlaw import geometry
from grainlaw.geometry import (
    Bricks,
    Hexagonal,
    Voronoi,
    apart,
    between_platens,
    block,
    disc,
    moved,
    polygon,
    rectangle,
    together,
    wall,
)
from grainlaw.mesh import build_mesh
from grainlaw.protocols import Brazilian, UniaxialCompression
from grainlaw.protocols.measures import size
from grainlaw.tessellation import Tessellation, TilingError

MAKERS = [together, block, moved, apart, wall, between_platens]
SQUARE = [(0, 0), (1, 0), (1, 1), (0, 1)]
SLOPE = polygon([(0, 0), (4, 0), (4, 1), (2, 1), (1, 3), (0, 3)], ["base", "right", "foot", "face", "crest", "left"])


def lengths(grains: Tessellation) -> dict[str, float]:
    """m of each boundary that has any."""
    edges = grains.edges
    every = {name: edges.length[edges.side == k].sum() for k, name in enumerate(edges.boundary_names)}
    return {name: pytest.approx(length, rel=1e-9) for name, length in every.items() if length > 0}


def test_all_specimens_of_bodies_are_tried() -> None:
    functions = {each for each in map(vars(geometry).get, geometry.__all__) if inspect.isfunction(each)}
    made = {each for each in functions if inspect.signature(each, eval_str=True).return_annotation is Tessellation}
    assert set(MAKERS) == made


@pytest.mark.parametrize("function", MAKERS)
def test_example_of_each_docstring_runs(function) -> None:
    code = textwrap.dedent(inspect.getdoc(function).split("::\n", 1)[1].split("\n\nRaises")[0])
    names = {**vars(geometry), "gl": gl, "rock": ROCK, "steel": ROCK}
    exec(code, names)
    made = names.get("grains") or names["specimen"].grains
    made.check()


def test_bodies_that_touch_keep_their_own_sides_and_edges() -> None:
    lower, upper = (Voronoi(grains=n).tessellate(rectangle(1, 1)) for n in (20, 30))
    both = together(lower, moved(upper, by=(0, 1)))
    both.check()
    assert both.region is lower.region
    assert lengths(both) == {"bottom": 2, "right": 2, "top": 2, "left": 2}
    high = both.centroids[both.edges.left, 1] > 1
    top = both.edges.side == both.boundary_names.index("top")
    level = both.vertices[both.edges.start, 1]
    assert np.all(level[top & ~high] == 1)  # and not "bottom", the side of the other body that lies there too
    assert np.all(level[top & high] == 2)
    mesh, one, two = (build_mesh(grains, 1) for grains in (both, lower, upper))
    assert np.array_equal(mesh.interface_grains, np.vstack([one.interface_grains, two.interface_grains + 20]))
    assert np.array_equal(mesh.interfaces, np.vstack([one.interfaces, two.interfaces + len(one.nodes)]))


def test_bodies_of_bodies_stay_in_order() -> None:
    a, b, c = (block(np.add(SQUARE, (2 * k, 0)), name, phase=k) for k, name in enumerate("abc"))
    once, nested = together(a, b, c), together(a, together(b, c))
    for made in (once, nested):
        made.check()
        assert made.boundary_names == ("a", "b", "c")
        assert made.body.tolist() == made.phase.tolist() == [0, 1, 2]
        assert np.array_equal(made.centroids, [(0.5, 0.5), (2.5, 0.5), (4.5, 0.5)])
    assert np.array_equal(once.corners, nested.corners)


def test_one_body_alone_is_itself() -> None:
    alone = Voronoi(grains=20).tessellate(SLOPE)
    for one, other in zip(
        attrs.astuple(alone, recurse=False), attrs.astuple(together(alone), recurse=False), strict=True
    ):
        assert np.array_equal(one, other)


@pytest.mark.parametrize("given", [(), (rectangle(1, 1),), ([block(SQUARE)],)])
def test_only_tessellations_come_together(given) -> None:
    with pytest.raises(gl.ParameterError, match=r"bodies must be one or more Tessellations, (nothing|a Region|a list)"):
        together(*given)


def test_check_tells_which_body_is_at_fault() -> None:
    good = together(block(SQUARE, "a"), block(np.add(SQUARE, (2, 0)), "b"))
    half = attrs.evolve(good, bodies=(polygon([(2, 0), (3, 0), (3, 1), (2, 1.5)], "b"),))
    with pytest.raises(TilingError, match=r"edge between vertices 6 and 7 of grain 1|grains of body 1 add up"):
        half.check()
    merged = attrs.evolve(
        Bricks(rows=1, columns=2).tessellate(rectangle(2, 1)),
        region=block(SQUARE).region, bodies=[moved(block(SQUARE), by=(1, 0)).region], body=[0, 1],
    )  # fmt: skip
    with pytest.raises(TilingError, match="grains 0 and 1 share an edge, but are of different bodies"):
        merged.check()
    missing = attrs.evolve(block(SQUARE), region=rectangle(1, 2))
    with pytest.raises(TilingError, match="neither a second grain nor a side"):
        missing.check()
    attrs.evolve(missing, loose=[True]).check()
    with pytest.raises(TilingError, match=r"grains add up to 1\.0 m2, the region has 0\.5 m2"):
        attrs.evolve(missing, loose=[True], region=rectangle(1, 0.5)).check()


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"body": [0]}, r"body has the shape \(1,\) for 2 grains"),
        ({"body": [0, 0]}, "body must give each of the 2 regions grains"),
        ({"body": [0, 2]}, "body must give each of the 2 regions grains"),
        ({"loose": [0, 1]}, "loose must be an array of bool"),
        ({"loose": [True, True], "region": polygon(SQUARE, "grains")}, "a region has a side named grains"),
    ],
)
def test_arrays_that_do_not_fit_are_refused(change, message: str) -> None:
    good = together(block(SQUARE), block(np.add(SQUARE, (2, 0))))
    with pytest.raises((TilingError, gl.ParameterError), match=message):
        attrs.evolve(good, **change)


def test_block_is_one_grain_with_named_sides() -> None:
    made = block(SQUARE[::-1], ["top", "right", "bottom", "left"], phase=3)  # clockwise
    made.check()
    assert (made.count, made.areas[0], made.phase.tolist()) == (1, 1, [3])
    assert lengths(made) == {"top": 1, "right": 1, "bottom": 1, "left": 1}
    bottom = made.edges.side == made.boundary_names.index("bottom")
    assert np.array_equal(made.vertices[made.edges.start[bottom]], [(0, 0)])
    assert lengths(block(SQUARE)) == {"block": 4}


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"corners": SLOPE.outline}, "block: corners must be convex, they do not turn left at 2, 1"),
        ({"corners": [*SQUARE[:1], (0.5, 0), *SQUARE[1:]]}, "block: corners must be convex"),
        ({"corners": SQUARE[:2]}, "at least 3 corners"),
        ({"corners": SQUARE, "name": ["a", "b"]}, "2 names for 4 sides"),
        ({"corners": SQUARE, "phase": -1}, "block: phase = -1 is not allowed"),
    ],
)
def test_block_refuses(values, message: str) -> None:
    with pytest.raises(gl.ParameterError, match=message):
        block(**values)


@settings(max_examples=30, deadline=None)
@given(
    turn=st.floats(-360, 360),
    by=st.tuples(st.floats(-1e4, 1e4), st.floats(-1e4, 1e4)),
    gap=st.sampled_from([0, 0.02]),
    region=st.sampled_from([SLOPE, disc(3.0), polygon(np.multiply(SQUARE, 3), holes={"hole": np.add(SQUARE, 1)})]),
)
def test_moved_grains_are_the_same_elsewhere(turn: float, by: tuple[float, float], gap: float, region) -> None:
    grains = apart(Voronoi(grains=30).tessellate(region), gap)
    there = moved(together(grains, block(np.add(SQUARE, 9))), by, turn)
    there.check()
    here = together(grains, block(np.add(SQUARE, 9)))
    assert np.array_equal(there.edges.side, here.edges.side)
    z, w = (each.vertices @ [1, 1j] for each in (here, there))
    assert w == pytest.approx(z * np.exp(1j * np.radians(turn)) + complex(*by), abs=1e-11)
    assert there.areas == pytest.approx(here.areas, rel=1e-9)


@pytest.mark.parametrize("turn", range(0, 360, 20))
def test_a_thin_plate_far_away_still_fills_its_region(turn: int) -> None:
    plate = Bricks(rows=1, columns=7).tessellate(rectangle(0.05, 0.005))
    moved(plate, by=(700, -800), turn=turn).check()  # corners there are exact to 1e-13 m only


@pytest.mark.parametrize(("values", "named"), [({"by": 1}, "by"), ({"by": (0, np.nan)}, "by"), ({"turn": "x"}, "turn")])
def test_moved_refuses(values, named: str) -> None:
    with pytest.raises(gl.ParameterError, match=f"moved: {named} = .* is not allowed"):
        moved(block(SQUARE), **values)


def test_grains_apart_touch_where_they_met() -> None:
    bonded = Voronoi(grains=50).tessellate(SLOPE)
    loose = apart(bonded)
    loose.check()
    assert np.array_equal(loose.vertices, bonded.vertices[bonded.corners])
    assert len(build_mesh(loose).interfaces) == 0
    inner = bonded.edges.length[bonded.edges.right >= 0].sum()
    assert lengths(loose) == {**{k: v.expected for k, v in lengths(bonded).items()}, "grains": 2 * inner}
    assert loose.region is bonded.region


def test_hexagons_lose_half_the_gap_on_every_side() -> None:
    bonded = Hexagonal(grain_size=0.1).tessellate(rectangle(1, 1))
    parted = apart(bonded, 0.01)
    whole = np.flatnonzero(np.isclose(bonded.areas, 0.01, rtol=1e-9))
    apothem = np.sqrt(0.01 / (2 * np.sqrt(3)))
    assert len(whole) > 30
    assert parted.areas[whole] == pytest.approx(2 * np.sqrt(3) * (apothem - 0.005) ** 2, rel=1e-9)


@settings(max_examples=25, deadline=None)
@given(
    seed=st.integers(0, 1000),
    share=st.floats(0, 0.3),
    merge=st.sampled_from([0, 0.25]),
    region=st.sampled_from([SLOPE, disc(3.0), rectangle(3, 2)]),
)
def test_parted_grains_are_what_half_planes_leave(seed: int, share: float, merge: float, region) -> None:
    bonded = Voronoi(grains=40, seed=seed, merge=merge).tessellate(region)
    gap = share * np.sqrt(region.area / 40)
    parted = apart(bonded, gap)
    parted.check()
    edges = bonded.edges
    outside = {(e[0], e[1]) for e in np.column_stack([edges.start, edges.end])[edges.right < 0].tolist()}
    for g in range(bonded.count):
        ring = bonded.corners[bonded.first[g] : bonded.first[g + 1]].tolist()
        planes = []
        for i, j in zip(ring, ring[1:] + ring[:1], strict=True):
            (x, y), (u, v) = bonded.vertices[[i, j]]
            out = np.array([v - y, x - u]) / np.hypot(u - x, v - y)
            planes.append([*out, -out @ (x, y) + (0 if (i, j) in outside else gap / 2)])
        expected = ConvexHull(HalfspaceIntersection(np.array(planes), parted.centroids[g]).intersections).volume
        assert shoelace(polygon_of(parted, g)) == pytest.approx(expected, rel=1e-7)
    kept = {k: v for k, v in lengths(parted).items() if k != "grains"}
    assert set(kept) == set(region.boundary_names)


def test_a_gap_that_swallows_a_grain_is_refused_by_number() -> None:
    row = together(block([(0, 0), (1, 0), (1, 9), (0, 9)]))  # alone it has no side to move
    assert apart(row, 5.0).areas[0] == 9
    bricks = Bricks(rows=1, columns=3).tessellate(rectangle(3, 9))  # 0 and 2 have one side to move, 1 has two
    assert apart(bricks, 0.9).areas == pytest.approx([9 * 0.55, 9 * 0.1, 9 * 0.55])
    with pytest.raises(gl.ParameterError, match=r"apart: gap = 1 m is not allowed, grain 1 would vanish in it"):
        apart(bricks, 1.0)
    with pytest.raises(gl.ParameterError, match=r"apart: gap = -1 m is not allowed"):
        apart(bricks, -1)


def test_a_hundred_thousand_loose_grains_are_light() -> None:
    bonded = Bricks(rows=320, columns=320).tessellate(rectangle(1, 1))
    tracemalloc.start()
    loose = apart(bonded, 1e-4)
    loose.check()
    mesh = build_mesh(loose)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 500e6
    assert len(mesh.nodes) == 5 * 320**2
    assert loose.areas.sum() == pytest.approx((1 - 319e-4) ** 2)  # each row and column loses 319 gaps


def test_edges_of_many_grains_find_the_sides_of_a_disc_in_little_memory() -> None:
    region = disc(2.0)
    outside = np.stack([region.start, region.end], axis=1)
    tracemalloc.start()
    found = region.side_at(np.concatenate([outside, np.full((100_000, 2, 2), 0.5), outside]))
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    sides = np.arange(len(outside))
    assert np.array_equal(found, [*sides, *np.full(100_000, -1), *sides])
    assert peak < 300e6  # at once it would be 200e6 for each of several arrays


@pytest.mark.parametrize("halves", [2, 9, 10])
@pytest.mark.parametrize("gap", [0, 0.01])
def test_wall_in_running_bond(halves: int, gap: float) -> None:
    grains = wall(halves * 0.12, 0.4, 0.24, 0.08, gap)
    grains.check()
    x = np.array([np.sort(polygon_of(grains, g)[:, 0])[[0, -1]] for g in range(grains.count)])
    course = np.round(grains.centroids[:, 1] / 0.08 - 0.5).astype(int)
    joints = [np.append(x[course == c, 0][1:], ()) - gap / 2 for c in range(5)]
    for c in range(5):
        assert joints[c] == pytest.approx(np.arange(2 - c % 2, halves, 2) * 0.12)
    assert np.array_equal(grains.vertices.min(axis=0), (0, 0))
    assert grains.vertices.max(axis=0) == pytest.approx((halves * 0.12, 0.4))
    open_ends = {c: gap * len(joints[c]) for c in (0, 4)}
    found = lengths(grains)
    assert found["bottom"] == found["top"] == pytest.approx(halves * 0.12 - open_ends[0])
    assert found["left"] == pytest.approx(0.4 - 4 * gap)
    assert grains.areas.sum() == pytest.approx(
        sum((0.08 - gap * (1 - (c in (0, 4)) / 2)) * (halves * 0.12 - gap * len(joints[c])) for c in range(5))
    )


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (
            {"width": 2.5},
            r"wall: width = 2\.5 m is not allowed, it must be 0\.12 m times a whole number of half bricks",
        ),
        ({"width": 0.12}, "wall: width = 0.12 m is not allowed, .* at least 2"),
        ({"height": 0.1}, r"wall: height = 0\.1 m is not allowed, it must be 0\.08 m times a whole number of bricks"),
        ({"brick_width": -1}, "wall: brick_width = -1 m is not allowed"),
        ({"gap": 0.08}, r"wall: gap = 0\.08 m is not allowed, .* below 0\.08"),
    ],
)
def test_wall_refuses(change, message: str) -> None:
    with pytest.raises(gl.ParameterError, match=message):
        wall(**{"width": 2.4, "height": 0.8, "brick_width": 0.24, "brick_height": 0.08, **change})


def test_platens_lie_between_the_sample_and_the_test() -> None:
    sample = Voronoi(grains=60).tessellate(rectangle(0.05, 0.1))
    grains = between_platens(sample, 0.02, overhang=0.01, columns=4)
    grains.check()
    wide = 0.07
    assert lengths(grains) == {
        "rock_bottom": 0.05, "right": 0.1, "rock_top": 0.05, "left": 0.1, "platen_top": wide, "platen_bottom": wide,
        "top": wide, "bottom": wide, "platen_side": 0.08,
    }  # fmt: skip
    assert grains.phase.tolist() == [0] * 60 + [1] * 8
    specimen = gl.Specimen(grains, {0: ROCK, 1: ROCK})
    level = {name: np.unique(specimen.mesh.nodes[nodes, 1]) for name, nodes in specimen.mesh.boundaries.items()}
    for name, y in {"top": 0.12, "platen_top": 0.1, "rock_top": 0.1, "rock_bottom": 0, "bottom": -0.02}.items():
        assert level[name] == pytest.approx([y], abs=1e-15)
    assert size(specimen) == (0.05, 0.1)
    bonds = specimen.mesh.interface_grains
    assert np.all((bonds < 60).all(axis=1) | (bonds >= 60).all(axis=1))
    assert np.count_nonzero(bonds[:, 0] >= 60) == 2 * 3
    assert UniaxialCompression().stages(specimen)


def test_platens_touch_a_disc_at_its_flats() -> None:
    grains = between_platens(Voronoi(grains=60).tessellate(disc(0.05, sides=72)), 0.01, phase=2)
    grains.check()
    flat = 0.05 * np.sin(np.radians(10))
    expected = {"rock_top": flat, "rock_bottom": flat, "top": 0.05, "platen_bottom": 0.05}  # rims have a middle corner
    assert {name: lengths(grains)[name] for name in expected} == expected
    at = grains.vertices[grains.edges.start, 1]
    inner, outer = (at[grains.edges.side == grains.boundary_names.index(name)] for name in ("platen_top", "rock_top"))
    assert set(inner.tolist()) == set(outer.tolist()) == {0.025 * np.cos(np.radians(10))}
    assert Brazilian().stages(gl.Specimen(grains, {0: ROCK, 2: ROCK}))


@pytest.mark.parametrize("change", [{"thickness": 0}, {"overhang": -1}, {"phase": 0.5}])
def test_platens_refuse(change) -> None:
    (name,) = change
    with pytest.raises(gl.ParameterError, match=f"between_platens: {name} = .* is not allowed"):
        between_platens(block(SQUARE), **{"thickness": 1, **change})
