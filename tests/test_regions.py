"""Regions: what they refuse, and that grains fill every one of them."""

from __future__ import annotations

import attrs
import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from support import BRITTLE, ROCK
from tiling import BEAM, BEND, assert_sides_complete, assert_tiles

import grainlaw as gl
from grainlaw.fields import ParameterError
from grainlaw.geometry import (
    Breakable,
    Cleavage,
    Hexagonal,
    Jointed,
    JointSet,
    JointSets,
    Laguerre,
    Lognormal,
    Trigons,
    Voronoi,
    VoronoiCells,
    disc,
    plate_with_hole,
    polygon,
    rectangle,
    regular,
    semi_disc,
    shear_box,
)
from grainlaw.geometry.cells.any_voronoi import NEAR, Cells, Pair, _equally_far, _turned, settled
from grainlaw.geometry.cells.cutting import Cutter, _parting
from grainlaw.geometry.cells.joining import tiling_of
from grainlaw.geometry.cells.merging import merge_short_edges
from grainlaw.geometry.cells.sides import depths
from grainlaw.region import Region
from grainlaw.tessellation import TilingError
from grainlaw.units import mm

every = pytest.mark.parametrize("tessellator", [Hexagonal, Voronoi])


def ring(corners: int, radius: float, x: float = 0, y: float = 0) -> np.ndarray:
    angle = np.arange(corners) * 2 * np.pi / corners
    return np.column_stack([x + radius * np.cos(angle), y + radius * np.sin(angle)])


SQUARE = [(0, 0), (4, 0), (4, 4), (0, 4)]
SHAPES = {
    "beam": BEAM,
    "semi_disc": BEND,
    "disc": disc(0.05),
    "curved jaws": disc(0.05, loaded=10, flat=False, sides=90),
    "shear box": shear_box(0.1, 0.08, gap=0.005),
    "L": polygon([(0, 0), (2, 0), (2, 1), (1, 1), (1, 2), (0, 2)]),
    "plate with holes": polygon(SQUARE, holes={"hole": ring(24, 0.8, 2, 2), "pore": ring(5, 0.05, 0.4, 0.4)}),
}
HOLED = polygon(SQUARE, holes={"hole": [(1, 1), (3, 1.2), (2.5, 3)]})
every_shape = pytest.mark.parametrize("region", SHAPES.values(), ids=SHAPES)


@pytest.mark.thorough
@every
@every_shape
@pytest.mark.parametrize("grains", [1, 2, 40, 300])
def test_grains_fill_shapes(tessellator: type, region: Region, grains: int) -> None:
    made = tessellator(grains=grains).tessellate(region)
    assert_tiles(made)
    assert_sides_complete(made)


@st.composite
def star_shaped(draw: st.DrawFn) -> Region:
    """Corners at random distances round the origin, half of the regions with a hole there."""
    outline = draw(st.lists(st.integers(50, 150), min_size=4, max_size=11))
    hole = draw(st.one_of(st.just([]), st.lists(st.integers(3, 30), min_size=3, max_size=8)))
    turned = draw(st.floats(0, 1))

    def corners(radii: list[int]) -> np.ndarray:
        angle = (np.arange(len(radii)) + turned) * 2 * np.pi / len(radii)
        return np.array(radii)[:, None] / 100 * np.column_stack([np.cos(angle), np.sin(angle)])

    holes = {"hole": corners(hole)} if hole else {}
    try:
        return polygon(corners(outline), "rim", holes)
    except ParameterError:  # the hole meets a side that passes near the origin
        assume(False)
        raise


@pytest.mark.thorough
@every
@settings(max_examples=60)
@given(region=star_shaped(), grains=st.one_of(st.integers(1, 4), st.integers(5, 120)))
def test_grains_fill_any_region(tessellator: type, region: Region, grains: int) -> None:
    made = tessellator(grains=grains).tessellate(region)
    assert_tiles(made)
    assert_sides_complete(made)


def star(outline: list[int], hole: list[int], turned: float) -> Region:
    """With these radii (cm), at equal angles from that of ``turned``."""

    def corners(radii: list[int]) -> np.ndarray:
        angle = (np.arange(len(radii)) + turned) * 2 * np.pi / len(radii)
        return np.array(radii)[:, None] / 100 * np.column_stack([np.cos(angle), np.sin(angle)])

    return polygon(corners(outline), "rim", {"hole": corners(hole)})


@pytest.mark.parametrize(
    ("outline", "hole", "turned", "grains"),
    [
        ([51, 51, 51, 51, 51, 150, 150, 150, 51], [30, 4, 30, 4, 4, 30], 0, 1),  # a merge went past the end of a side
        ([150, 150, 150, 150, 150, 50], [10] * 6, 1e-10, 95),  # sides all but on lines of the lattice
        ([100, 150, 150, 100, 150, 100, 150, 100, 150, 150], [20, 20, 3, 20, 3], 1e-9, 3),
    ],
)
def test_hexagons_fill_regions_of_near_coincidences(
    outline: list[int], hole: list[int], turned: float, grains: int
) -> None:
    made = Hexagonal(grains=grains).tessellate(star(outline, hole, turned))
    assert_tiles(made)
    assert_sides_complete(made)


@pytest.mark.thorough
@settings(max_examples=30)
@given(
    region=star_shaped(),
    seed=st.integers(0, 99),
    relaxation=st.integers(0, 2),
    merge=st.sampled_from([0, 0.25, 0.6]),
)
def test_grains_fill_with_any_options(region: Region, seed: int, relaxation: int, merge: float) -> None:
    component = Voronoi(grains=50, seed=seed, relaxation=relaxation, merge=merge)
    made = component.tessellate(region)
    assert_tiles(made)
    again = component.tessellate(region)
    assert np.array_equal(made.vertices, again.vertices)
    assert np.array_equal(made.corners, again.corners)


@pytest.mark.thorough
@pytest.mark.parametrize(("name", "least"), [("beam", 0.1), ("semi_disc", 0.1), ("L", 0.1), ("plate with holes", 0)])
def test_few_grains_are_added_and_none_is_a_sliver(name: str, least: float) -> None:
    """A hole with sides far shorter than the grains is the exception: each side bounds a grain of its own."""
    region = SHAPES[name]
    made = [Voronoi(grains=400, seed=seed).tessellate(region) for seed in range(4)]
    assert max(grains.count for grains in made) <= 420
    assert min(grains.areas.min() for grains in made) > least * region.area / 400


def test_no_grain_reaches_across_a_thin_notch() -> None:
    made = Voronoi(grains=60).tessellate(BEAM)
    x, y = (made.vertices[made.corners] - [0.1, 0]).T
    low = y < 0.0199
    left = np.minimum.reduceat(np.where(low, x, 1), made.first[:-1])
    right = np.maximum.reduceat(np.where(low, x, -1), made.first[:-1])
    beside = made.centroids[:, 1] < 0.0199
    assert not ((left < -4e-5) & (right > 4e-5) & beside).any()
    assert made.edges.length[made.edges.boundary_names.index("notch") == made.edges.side].sum() == pytest.approx(0.0401)


def test_a_boundary_of_grains_begins_in_the_reentrant_corner() -> None:
    region = SHAPES["L"]
    made = Voronoi(grains=200, merge=0).tessellate(region)
    corner = int(np.flatnonzero((made.vertices == [1, 1]).all(axis=1))[0])
    assert np.sum(made.corners == corner) == 2


def test_a_cell_out_of_sight_goes_to_those_who_see_it() -> None:
    """Left of a slit the cells are those of the seeds on the left, as if there were none on the right."""
    slit = [(0, 0), (0.999, 0), (0.999, 3), (1.001, 3), (1.001, 0), (2, 0), (2, 4), (0, 4)]
    seeds = np.array([(0.3, 0.5), (0.3, 1.5), (0.3, 2.5), (1.1, 1), (1.1, 2), (1, 3.6)])
    made = Cells(polygon(slit), seeds, 1.0).tiling().tessellation()
    one = np.flatnonzero((abs(made.centroids - [0.4995, 1.5]) < 1e-9).all(axis=1))
    assert made.areas[one] == pytest.approx([0.999])


def test_split_sides_change_no_grain() -> None:
    plain, split = (Voronoi(grains=150).tessellate(region) for region in (rectangle(1, 2), shear_box(1, 2)))
    inner = [vertex for vertex in plain.vertices if 0.2 < vertex[0] < 0.8]
    distance = np.min([np.hypot(*(split.vertices - vertex).T).min() for vertex in inner])
    assert distance < 1e-9
    assert split.count == 150


def test_boundaries_of_the_mesh_have_the_sides_of_holes() -> None:
    region = SHAPES["plate with holes"]
    specimen = gl.Specimen(Voronoi(grains=200).tessellate(region), ROCK, refinement=1)
    for name, length in (("hole", 48 * 0.8 * np.sin(np.pi / 24)), ("pore", 10 * 0.05 * np.sin(np.pi / 5))):
        ends = specimen.mesh.nodes[specimen.mesh.boundary_edges[name]]
        assert np.hypot(*(ends[:, 1] - ends[:, 0]).T).sum() == pytest.approx(length)
    assert specimen.mesh.zone_areas.min() > 0
    assert specimen.mesh.zone_areas.sum() == pytest.approx(region.area)


@pytest.mark.parametrize(
    ("outline", "message"),
    [
        ([(0, 0), (1, 0)], "outline has the shape"),
        ([(0, 0), (1, 0), (np.inf, 1)], "not finite"),
        ([(0, 0), (1, 1), (1, 0)], "outline runs clockwise"),
        ([(0, 0), (1, 1), (1, 0), (0, 1)], "crosses or touches itself at its sides 0 and 2"),
        ([(0, 0), (2, 0), (2, 2), (1, 0), (0, 2)], "crosses or touches itself at its sides 0 and 2"),
        ([(0, 0), (2, 0), (1, 0), (1, 1)], "crosses or touches itself at its sides 0 and 1"),
        ([(0, 0), (1, 0), (1, 0), (0, 1)], "crosses or touches itself"),
        ([(0, 0), (1, 0), "corner"], "outline = .* must be an array of float"),
    ],
)
def test_region_refuses(outline: list, message: str) -> None:
    with pytest.raises(ParameterError, match=message):
        Region(outline, ("side",) * len(outline))


STAR = [(r * np.cos(a), r * np.sin(a)) for a, r in zip(np.arange(14) * np.pi / 7, [1, 0.3] * 7, strict=True)]


@pytest.mark.parametrize(
    ("outline", "area"),
    [
        ([(0, 0), (1, 0), (2, 0), (2, 2), (1, 1), (0, 2)], 3),  # concave, with a corner in a line
        ([(0, 0), (1, 0), (1, 1), (2, 1), (2, 0), (3, 0), (3, 2), (0, 2)], 5),  # two sides apart on one line
        ([(2, 1), (2.5, 0), (4, 0), (0, 4), (0, 0), (1.5, 0)], 7.5),  # the line of side 0 meets side 2
        (STAR, 7 * 0.3 * np.sin(np.pi / 7)),
    ],
)
def test_region_may_be_any_simple_polygon(outline: list, area: float) -> None:
    region = Region(outline, ("side",) * len(outline))
    assert region.area == pytest.approx(area)
    assert region.bounds.tolist() == [np.min(outline, axis=0).tolist(), np.max(outline, axis=0).tolist()]


def test_region_needs_a_name_for_each_side() -> None:
    with pytest.raises(ParameterError, match="sides has 2 names for 3 sides"):
        Region([(0, 0), (1, 0), (0, 1)], ["a", "b"])
    with pytest.raises(ParameterError, match="must be names"):
        Region([(0, 0), (1, 0), (0, 1)], ["a", "b", ""])


@pytest.mark.parametrize("value", [0, -1, np.nan, np.inf, "1", None, True])
def test_rectangle_refuses(value: object) -> None:
    with pytest.raises(ParameterError, match="rectangle: height = "):
        rectangle(1, value)
    with pytest.raises(ParameterError, match="rectangle: width = "):
        rectangle(value, 1)


HOLE = [(1, 1), (1, 2), (2, 2), (2, 1)]


@pytest.mark.parametrize(
    ("holes", "names", "message"),
    [
        ([HOLE[::-1]], [("a",) * 4], "hole 0 runs counter-clockwise"),
        ([HOLE], [("a",) * 3], "hole_sides of hole 0 has 3 names for 4 sides"),
        ([HOLE], [], "hole_sides has 0 entries for 1 holes"),
        ([HOLE], ["hole"], "hole_sides .* a list of names for each hole"),
        ([[(1, 1), (2, 2)]], [("a",) * 2], "hole 0 has the shape"),
        ([np.add(HOLE, 10)], [("a",) * 4], "hole 0 must lie inside the outline"),
        ([np.add(HOLE, [3, 0])], [("a",) * 4], r"hole 0 crosses or touches outline, its side \d meets side 1"),
        ([np.add(HOLE, [2, 0])], [("a",) * 4], "hole 0 crosses or touches outline"),
        ([np.add(HOLE, [2, 2.5])], [("a",) * 4], "hole 0 crosses or touches outline"),
        ([HOLE, np.add(HOLE, 0.5)], [("a",) * 4] * 2, "hole 1 crosses or touches hole 0"),
        ([HOLE, np.multiply(HOLE, 0.2) + 1.2], [("a",) * 4] * 2, "hole 1 must lie .* outside the other holes"),
        ([[(1, 1), (2, 2), (2, 1), (1, 2)]], [("a",) * 4], "hole 0 crosses or touches itself at its sides 0 and 2"),
        ([[(1, 1), (2, 2), (np.nan, 1)]], [("a",) * 3], "hole 0 has a corner that is not finite"),
        ([["a"]], [("a",)], "holes must be arrays of float"),
    ],
)
def test_region_refuses_holes(holes: list, names: list, message: str) -> None:
    with pytest.raises(ParameterError, match=f"Region: {message}"):
        Region(SQUARE, ("side",) * 4, holes, names)


def test_region_with_a_hole() -> None:
    region = Region(SQUARE, tuple("abcd"), [HOLE])
    assert region.area == 15
    assert region.boundary_names == (*"abcd", "hole")
    assert region.contains(np.array([(0.5, 0.5), (1.5, 1.5), (1.5, 2.5), (5, 1)])).tolist() == [
        True,
        False,
        True,
        False,
    ]


def test_polygon_may_run_either_way() -> None:
    """Each side keeps its name: a from (0, 0) to (4, 0)."""
    for points, names in ((SQUARE, tuple("abcd")), (SQUARE[::-1], tuple("cbad"))):
        region = polygon(points, names, {"hole": HOLE[::-1], "other": np.add(HOLE, 1.5)})
        assert region.area == 14
        assert region.names[4:] == ("hole",) * 4 + ("other",) * 4
        start = {name: corner.tolist() for name, corner in zip(region.names, region.start, strict=True)}
        assert [start[name] for name in "abcd"] == np.array(SQUARE).tolist()
    ring = [(-1, 2), *SQUARE[::-1]]  # (0, 4), (4, 4), (4, 0) and (0, 0) follow, and e runs from there back to (-1, 2)
    region = polygon(ring, tuple("abcde"))
    assert region.start.tolist() == np.array(ring[::-1]).tolist()
    assert region.names == tuple("dcbae")


@pytest.mark.thorough
def test_no_vertex_is_left_where_nothing_meets() -> None:
    """Cuts that are joined again leave none on a side of the region: one of them made the time step tiny."""
    region = semi_disc(75 * mm, notch_depth=18 * mm, notch_width=0.5 * mm, span=45 * mm, bearing=3 * mm)
    made = Voronoi(grains=400, seed=1).tessellate(region)
    grains_at = np.bincount(made.corners, minlength=len(made.vertices))
    alone = made.vertices[grains_at == 1]
    distance = np.hypot(*(alone[:, None] - region.outline[None]).transpose(2, 0, 1)).min(axis=1)
    assert distance.max() < 1e-12  # only corners of the region have one grain
    assert made.edges.length.min() > 4e-5


def test_depth_below_the_nearest_side_of_a_bent_region():
    bent = polygon([(0, 0), (2, 0), (2, 1), (1, 1), (1, 2), (0, 2)])
    points = np.array([(0.5, 0.4), (0.9, 0.9), (1.2, 1.3), (3, 0.5), (1.8, 0.5), (3, 2)])
    expected = [0.4, np.hypot(0.1, 0.1), -0.2, -1, 0.2, -np.hypot(1, 1)]  # of the second and last to corners
    assert depths(bent, points) == pytest.approx(expected)


def scaled(region: Region, by: float) -> Region:
    return attrs.evolve(region, outline=by * region.outline, holes=[by * hole for hole in region.holes])


@pytest.mark.thorough
@pytest.mark.parametrize("by", [2.0**-7, 0.01, 7.0])
def test_grains_round_a_hole_of_many_sides_are_the_same_at_any_scale(by: float) -> None:
    """Seeds that are equally far from a corner tie but for rounding; pairs of seeds that share one cannot all be."""
    here, there = (Voronoi(grains=150, seed=3).tessellate(plate_with_hole(12 * k, 12 * k, 2 * k)) for k in (1.0, by))
    assert there.vertices / by == pytest.approx(here.vertices, abs=1e-9)
    assert here.areas.min() > 1e-3


def test_a_speck_at_a_corner_vanishes_as_a_whole() -> None:
    """No edge of it can be merged alone: the grain to its left would be bent at the corner, or straight before it."""
    bent, e = polygon([(-1, -0.1), (0, 0), (1, -0.1), (1, 1), (-1, 1)]), 0.01
    before, inside, top = (-e, -0.1 * e), (-e / 2, e), (0, 1)
    left, right = [(-1, -0.1), before, inside, top, (-1, 1)], [(0, 0), (1, -0.1), (1, 1), top, inside]
    speck = [before, (0, 0), inside]
    rings = tiling_of(bent, np.array([*left, *right, *speck], dtype=float), np.array([0, 5, 10, 13]), 1e-9)
    assert merge_short_edges(rings, 0.05).tessellation().count == 3
    made = merge_short_edges(rings, 0.05, 1e-3).tessellation()
    assert_tiles(made)
    assert made.areas == pytest.approx([1.05, 1.05])
    assert merge_short_edges(rings, e, 1e-3).tessellation().count == 3  # one of its edges is longer


def test_a_grain_without_an_area_is_refused_before_a_run() -> None:
    thin = 1e-8
    x = np.array([0, 1, 1 + thin, 2])
    vertices = np.concatenate([np.column_stack([x, 0 * x]), np.column_stack([x, 0 * x + 1])])
    corners = np.array([0, 1, 5, 4, 1, 2, 6, 5, 2, 3, 7, 6])
    grains = gl.Tessellation(rectangle(2, 1), vertices, corners, np.array([0, 4, 8, 12]))
    with pytest.raises(ParameterError, match=r"Specimen: cell 1 at \(1, 0.5\) m is so thin"):
        gl.simulate(gl.Specimen(grains, ROCK), BRITTLE, gl.protocols.UniaxialCompression())


@pytest.mark.parametrize("region", [SHAPES["L"], HOLED], ids=["L", "holed"])
@pytest.mark.parametrize(
    "made",
    [
        lambda by: Hexagonal(grains=60),
        lambda by: Voronoi(grains=60),
        lambda by: Laguerre(grains=40, sizes=Lognormal(deviation=0.3)),
        lambda by: Jointed(Hexagonal(grains=40), {"fault": [np.multiply([(0.1, 0.1), (3, 2.5)], by)]}),
        lambda by: JointSets(sets=[JointSet(dip=d, spacing=0.7 * by, through=(by / 9, by / 5)) for d in (30, -50)]),
        lambda by: Breakable(Voronoi(grains=8), Trigons(count=6), seed=5),
        lambda by: Breakable(Voronoi(grains=8), VoronoiCells(count=6)),
        lambda by: Breakable(Voronoi(grains=8), Cleavage(spacing=0.2 * by)),
    ],
)
def test_grains_of_a_region_as_large_as_a_country_or_as_small_as_a_crystal_are_the_same(made, region: Region) -> None:
    """Powers of two scale numbers without rounding."""
    here = made(1.0).tessellate(region)
    for by in (2.0**-20, 2.0**20):
        there = made(by).tessellate(scaled(region, by))
        assert there.vertices / by == pytest.approx(here.vertices, abs=1e-8)
        assert np.sort(there.areas) / by**2 == pytest.approx(np.sort(here.areas))


def test_seeds_go_to_the_large_parts_of_cells_that_a_corner_cuts() -> None:
    """One cell fills an L, which is parted from its corner: two trapezoids, each a square and half a square."""
    moved = Cells(SHAPES["L"], np.array([(0.6, 0.7)]), 1.0).next_seeds(relaxed=False)
    assert moved[np.argsort(moved[:, 0])] == pytest.approx(np.array([(4 / 9, 11 / 9), (11 / 9, 4 / 9)]))
    small = Cells(SHAPES["L"], np.array([(0.6, 0.7)]), 3.0)  # a part has 1.5 m2 of 9
    assert small.next_seeds(relaxed=False).tolist() == [[0.6, 0.7]]
    longer = polygon([(0, 0), (3, 0), (3, 1), (1, 1), (1, 2), (0, 2)])
    relaxed = Cells(longer, np.array([(0.6, 0.7)]), 4.0).next_seeds(relaxed=True)  # of the part of 2.5 m2
    assert relaxed == pytest.approx(np.array([(26 / 15, 7 / 15)]))
    convex = Cells(rectangle(2, 1), np.array([(0.6, 0.7), (1.5, 0.2)]), 1.0)
    assert convex.next_seeds(relaxed=False).tolist() == [[0.6, 0.7], [1.5, 0.2]]


def test_seeds_become_equally_far_from_a_corner_by_moving_as_little_as_can_be() -> None:
    seeds = np.array([(1.3, 0.6), (0.5, 1.2), (0.2, 0.1), (1.8, 0.2)])
    moved = settled(seeds, Cutter(SHAPES["L"], 1e-9), 1.0)
    far, then = (np.hypot(*(each - [1, 1]).T) for each in (seeds, moved))
    assert then[0] == pytest.approx(then[1], abs=1e-12)
    assert np.array_equal(moved[2:], seeds[2:])
    least = abs(far[0] - far[1]) / np.sqrt(2)  # each goes half of the way, on its ray
    assert np.linalg.norm(moved - seeds) == pytest.approx(least, rel=0.01)


@pytest.mark.parametrize(("skew", "turned"), [(0, None), (40, None), (-40, None), (41, 36), (85, 36), (-41, -36)])
def test_a_boundary_is_turned_where_it_would_leave_more_than_half_a_turn(skew: float, turned: float | None) -> None:
    """From a corner of 270 degrees it may run up to 45 degrees beside the bisector, at 225 degrees."""
    found = Cutter(SHAPES["L"], 1e-9).reentrant[2]
    assert (found.corner, found.play) == ((1, 1), pytest.approx(np.pi / 4))
    angles = np.radians(225 + skew + np.array([25, -25]))
    seeds = np.array([1, 1]) + np.array([[0.3], [0.8]]) * np.column_stack([np.cos(angles), np.sin(angles)])
    direction = _turned(found, seeds)
    if turned is None:
        assert direction is None
    else:
        turn = np.radians(225 + turned)
        assert direction == pytest.approx((np.cos(turn), np.sin(turn)))
        pair = Pair(found.corner, (0, 1), direction)
        one, other = _equally_far(seeds, [pair], 1.0) - [1, 1]
        assert np.hypot(*one) == pytest.approx(np.hypot(*other))
        assert (one - other) @ direction == pytest.approx(0, abs=1e-12)


def test_seeds_of_several_corners_become_equally_far_each_from_its_own() -> None:
    """The boundaries of the first and the last pair are turned, that of the second is not."""
    seeds = np.array([(1, 0.3), (-0.8, 0.4), (11, 2.2), (9.3, 1.8), (5, 8), (6.2, 9.3), (3, 3)])
    ways = [(0.6, 0.8), None, (-0.28, 0.96)]
    pairs = [Pair(corner, (2 * k, 2 * k + 1), ways[k]) for k, corner in enumerate([(0, 0.1), (10, 1), (5.2, 9.1)])]
    moved = _equally_far(seeds, pairs, 1.0)
    assert np.array_equal(moved[6], seeds[6])
    for pair in pairs:
        one, other = moved[list(pair.seeds)] - pair.corner
        assert one @ one == pytest.approx(other @ other, rel=1e-12)
        assert pair.turned is None or (one - other) @ pair.turned == pytest.approx(0, abs=1e-12)


def test_only_a_corner_of_more_than_a_half_turn_is_reentrant() -> None:
    """The flanks of the notch rise by 3 m on 2 m, so that a cut may lie 90 degrees less that slope off the bisector."""
    notched = polygon([(0, 0), (2, 0), (4, 0), (4, 4), (2, 1), (0, 4)])
    found = Cutter(notched, 1e-9).reentrant
    assert list(found) == [3]
    assert found[3].corner == (2, 1)
    assert found[3].bisector == pytest.approx((0, -1))
    assert found[3].play == pytest.approx(np.arctan(2 / 3))


@pytest.mark.parametrize(
    ("corners", "direction"),
    [
        ([(0, 0.1), (2, -3), (2.4, 0.6)], (-1, -0.9)),  # of the three the one nearest to the bisector
        ([(0.2, 0.9), (2, -3), (2.4, 0.6)], (-np.sqrt(0.5), -np.sqrt(0.5))),  # none is near: the bisector
        ([(0.4, 0.7), (0.7, 0.4), (0.6, 0.5)], (-0.4, -0.5)),
    ],
)
def test_a_corner_is_parted_along_its_bisector_or_to_a_corner_near_to_that(corners: list, direction: tuple) -> None:
    """From a corner at (1, 1), where the bisector is at 225 degrees: within 20 degrees of it."""
    found = Cutter(SHAPES["L"], 1e-9).reentrant[2]
    assert _parting(found, corners) == pytest.approx(direction)


@pytest.mark.parametrize("meets", [0, 1, 3, None])
def test_cells_that_do_not_meet_are_cut_again_with_coarser_distances(meets, monkeypatch):
    """Each is ten times the last; what the coarsest does not make is refused."""
    tried = []

    def cut(region, seeds, size, near):
        tried.append(near)
        if len(tried) - 1 != meets:
            raise TilingError(f"attempt {len(tried)}")
        return "made"

    monkeypatch.setattr(regular, "_cut", cut)
    region = polygon([(0, 0), (2, 0), (2, 1), (1, 1), (1, 2), (0, 2)])
    if meets is None:
        with pytest.raises(TilingError, match="attempt 4"):
            Hexagonal(grains=10).tessellate(region)
    else:
        assert Hexagonal(grains=10).tessellate(region) == "made"
    assert tried == pytest.approx(NEAR * 10.0 ** np.arange(4 if meets is None else meets + 1))
