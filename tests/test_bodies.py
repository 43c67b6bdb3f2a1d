"""Several bodies: each keeps its own sides and edges, also where it touches another and after it was moved."""

from __future__ import annotations

import inspect
import re
import textwrap
import tracemalloc

import attrs
import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from support import ROCK
from tiling import SLOPE, SQUARE, lengths

import grainlaw as gl
from grainlaw import geometry
from grainlaw.geometry import (
    Bricks,
    Voronoi,
    apart,
    between_platens,
    block,
    disc,
    lying,
    moved,
    polygon,
    rectangle,
    shear_box,
    together,
    wall,
)
from grainlaw.laws import Linear
from grainlaw.mesh import build_mesh
from grainlaw.tessellation import Tessellation, TilingError

MAKERS = [together, block, moved, lying, apart, wall, between_platens]


def test_all_specimens_of_bodies_are_tried() -> None:
    functions = {each for each in map(vars(geometry).get, geometry.__all__) if inspect.isfunction(each)}
    made = {each for each in functions if inspect.signature(each, eval_str=True).return_annotation is Tessellation}
    read = {geometry.from_polygons, geometry.from_labels, geometry.from_mesh, geometry.read_tess}
    assert set(MAKERS) == made - read


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
    names = ("bottom", "right", "top", "left")
    assert lengths(both) == dict.fromkeys([*names, *(f"{name}_2" for name in names)], pytest.approx(1))
    high = both.centroids[both.edges.left, 1] > 1
    tops = [both.boundary_names.index(name) for name in ("top", "top_2")]
    top = np.isin(both.edges.side, tops)
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


@given(
    depth=st.floats(-0.4, 0.4), along=st.floats(-0.5, 1.5), turn=st.floats(0, 360),
    corners=st.integers(3, 9), scale=st.sampled_from([1e-3, 1.0, 1e3]),
)  # fmt: skip
def test_bodies_may_touch_but_not_lie_in_each_other(depth, along, turn, corners, scale) -> None:
    assume(abs(depth) > 1e-6)
    angle = 2 * np.pi * np.arange(corners) / corners - np.pi / 2  # a corner down
    lowest = np.column_stack([along + np.cos(angle), 2 - depth + np.sin(angle)])
    base = moved(block(np.multiply([(-9, 0), (9, 0), (9, 1), (-9, 1)], scale)), turn=turn)
    stone = moved(block(scale * lowest), turn=turn)
    if depth < 0:
        together(base, stone).check()
        return
    with pytest.raises(gl.ParameterError, match="bodies 0 and 1 are not allowed to lie in each other") as refused:
        together(base, stone)
    assert float(re.search(r"by (\S+) m", str(refused.value))[1]) == pytest.approx(scale * depth, rel=0.01)


def test_what_touches_does_not_lie_in_each_other() -> None:
    rock = Voronoi(grains=30).tessellate(rectangle(1, 1))
    for turn in (0, 17, 123):  # placed by rounding on either side of each other
        moved(together(rock, moved(rock, by=(0, 1)), moved(apart(rock), by=(1, 0))), (3, 4), turn).check()
    within = block([(0.4, 0.4), (0.6, 0.4), (0.5, 0.6)])  # crosses no side of the region
    with pytest.raises(gl.ParameterError, match="bodies 0 and 1 are not"):
        together(rock, within)
    loose = attrs.evolve(together(block(SQUARE), block(np.add(SQUARE, (2, 0)))), loose=[True, True])
    loose.check()
    with pytest.raises(TilingError, match=r"grains 0 and 1 lie 0\.3 m in each other"):
        attrs.evolve(
            loose, vertices=loose.vertices - np.repeat([(0, 0), (1.3, 0)], 4, axis=0), region=rectangle(9, 9)
        ).check()


@pytest.mark.parametrize("given", [(), (rectangle(1, 1),), ([block(SQUARE)],)])
def test_only_tessellations_come_together(given) -> None:
    words = r"together: (there are no bodies, .* at least one|bodies = .* not allowed, it must be a) Tessellation"
    with pytest.raises(gl.ParameterError, match=words):
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
        ({"loose": [0, 1]}, "loose = .* must be an array of bool"),
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


@pytest.mark.thorough
@settings(max_examples=30)
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


def test_a_specimen_that_lies_is_loaded_along_what_was_x():
    """Two stripes side by side: in parallel along y, in series along x."""
    grains = Bricks(rows=1, columns=2).tessellate(rectangle(4e-3, 4e-3))
    grains = attrs.evolve(grains, phase=np.array([0, 1]))
    stiff = gl.Elastic(youngs_modulus=60e9, poissons_ratio=0.0, density=2600)
    rocks, moduli = {0: stiff, 1: attrs.evolve(stiff, youngs_modulus=20e9)}, []
    for each in (grains, lying(grains)):
        moduli.append(gl.elastic_properties(gl.Specimen(each, rocks), Linear(kn=1e18, ks=1e18)).apparent_modulus)
    assert moduli == pytest.approx([40e9, 30e9], rel=1e-4)


def test_four_quarter_turns_change_nothing():
    grains = Voronoi(grains=12, seed=1).tessellate(shear_box(4e-3, 8e-3))
    turned = grains
    for _ in range(4):
        turned = lying(turned)
    assert turned.vertices == pytest.approx(grains.vertices, abs=1e-18)
    assert turned.region.sides == grains.region.sides
    assert set(lying(grains).region.sides) == {
        "right",
        "top_lower",
        "top_upper",
        "left",
        "bottom_upper",
        "bottom_lower",
    }


def test_a_body_far_away_lies_where_it_stood():
    """Its lower left corner stays, what was its bottom is now on the right."""
    made = lying(block([(5, 7), (6, 7), (6, 10), (5, 10)], ["bottom", "right", "top", "left"]))
    made.check()
    assert made.region.bounds.tolist() == [[5, 7], [8, 8]]
    ends = dict(zip(made.region.sides, np.stack([made.region.start, made.region.end], axis=1).tolist(), strict=True))
    assert ends == {
        "right": [[8, 7], [8, 8]], "top": [[8, 8], [5, 8]], "left": [[5, 8], [5, 7]], "bottom": [[5, 7], [8, 7]],
    }  # fmt: skip


def test_phases_without_names_are_named_by_their_numbers_beside_those_with_names():
    rock = attrs.evolve(block(np.add(SQUARE, (2, 0))), phase_names=["mica"])
    both = together(block(SQUARE, phase=2), rock)
    assert both.phase_names == ("0", "1", "2", "mica")
    assert both.phase.tolist() == [2, 3]
