"""Grains from polygons: hanging vertices, concave grains, and what is refused with its place."""

import re

import attrs
import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from tiling import BEAM, assert_sides_complete, assert_tiles, polygon_of, shoelace

from grainlaw.fields import ParameterError
from grainlaw.geometry import Voronoi, disc, from_polygons, polygon, polygons, rectangle
from grainlaw.geometry.cells import shared_edges
from grainlaw.geometry.cells.outline import _inside
from grainlaw.geometry.cells.shared_edges import Polygons

pytestmark = pytest.mark.filterwarnings("ignore::grainlaw.geometry.SliverWarning")

UNIT = [(0, 0), (1, 0), (1, 1), (0, 1)]
RIGHT = [(1, 0), (2, 0), (2, 1), (1, 1)]
ANGLE = [(0, 0), (2, 0), (2, 1), (1, 1), (1, 2), (0, 2)]  # an L of 3 m2
REGIONS = st.sampled_from([rectangle(2, 1), disc(1.0), BEAM])


def drawn(grains):
    """Polygons of all grains, without the corners where they do not turn."""
    rings = []
    for g in range(grains.count):
        ring = polygon_of(grains, g)
        before, after = ring - np.roll(ring, 1, axis=0), np.roll(ring, -1, axis=0) - ring
        rings.append(ring[abs(before[:, 0] * after[:, 1] - before[:, 1] * after[:, 0]) > 1e-12 * shoelace(ring)])
    return rings


@pytest.mark.thorough
@settings(max_examples=25)
@given(region=REGIONS, seed=st.integers(1, 1000), size=st.sampled_from([1e-4, 1.0, 1e3]), given_region=st.booleans())
def test_drawn_grains_come_back(region, seed, size, given_region):
    """In any order, either way round, from any corner; BEAM has corners where only one grain turns."""
    grains = Voronoi(grains=25, seed=seed).tessellate(region)
    random = np.random.default_rng(seed)
    order = random.permutation(grains.count)
    rings = [np.roll(drawn(grains)[g], random.integers(9), axis=0)[:: random.choice([1, -1])] * size for g in order]
    scaled = attrs.evolve(region, outline=region.outline * size) if given_region else None
    made = from_polygons(rings, region=scaled)
    assert_tiles(made)
    assert made.areas == pytest.approx(grains.areas[order] * size**2)
    assert not made.is_breakable
    if given_region:
        assert_sides_complete(made)
        assert set(made.boundary_names) == set(region.names)


@pytest.mark.thorough
@settings(max_examples=25)
@given(seed=st.integers(1, 1000), share=st.floats(0.01, 0.45))
def test_corners_nearer_than_the_tolerance_are_one(seed, share):
    grains = Voronoi(grains=25, seed=seed, merge=0.3).tessellate(rectangle(1, 1))
    shortest = grains.edges.length.min()
    random = np.random.default_rng(seed)
    tolerance = share * shortest
    shift = [random.uniform(-1, 1, ring.shape) for ring in drawn(grains)]
    rings = [ring + tolerance * each / 4 for ring, each in zip(drawn(grains), shift, strict=True)]
    made = from_polygons(rings, tolerance=tolerance)
    assert_tiles(made)
    assert np.bincount(made.parent, made.areas) == pytest.approx(grains.areas, abs=tolerance * 4)
    assert set(made.region.boundary_names) == {"bottom", "right", "top", "left"}


@pytest.mark.thorough
@settings(max_examples=25)
@given(region=REGIONS, seed=st.integers(1, 1000))
def test_concave_grains_are_cut_into_cells_of_one_grain(region, seed):
    """Two neighbours drawn as one grain are concave, mostly."""
    grains = Voronoi(grains=25, seed=seed).tessellate(region)
    edges = grains.edges
    free, rings, wanted = set(range(grains.count)), [], []
    for i, j, left, right in zip(edges.start, edges.end, edges.left, edges.right, strict=True):
        if {left, right} <= free:
            one, other = (grains.corners[grains.first[g] : grains.first[g + 1]].tolist() for g in (left, right))
            one = one[one.index(j) :] + one[: one.index(j)]  # from j on, i last
            other = other[other.index(i) :] + other[: other.index(i)]
            assume(len(set(one) & set(other)) == 2)
            rings.append(grains.vertices[one + other[1:-1]])
            wanted.append(grains.areas[[left, right]].sum())
            free -= {left, right}
    rings += [polygon_of(grains, g) for g in free]
    wanted += [grains.areas[g] for g in free]
    made = from_polygons(rings, phases=np.arange(len(rings)))
    assert_tiles(made)
    assert np.bincount(made.parent, made.areas) == pytest.approx(wanted)
    assert np.array_equal(made.phase, made.parent)


def test_a_hanging_vertex_is_a_corner_of_both():
    made = from_polygons([[(0, 0), (2, 0), (2, 1), (0, 1)], [(0, 1), (1, 1), (1, 2), (0, 2)],
                          [(1, 1), (2, 1), (2, 2), (1, 2)]], ["quartz", "mica", "quartz"])  # fmt: skip
    assert_tiles(made)
    assert (1, 1) in map(tuple, polygon_of(made, 0))
    assert made.phase_names == ("quartz", "mica")
    assert made.phase.tolist() == [0, 1, 0]
    assert made.region.outline.tolist() == [[0, 0], [2, 0], [2, 2], [0, 2]]
    assert made.region.sides == ("bottom", "right", "top", "left")


def test_a_hanging_vertex_does_not_bend_an_edge():
    """It is off by less than the tolerance; left there, it would make the lower grain concave."""
    rings = [[(0, 0), (2, 0), (2, 1), (0, 1)], [(0, 1), (1, 0.9996), (1, 2), (0, 2)],
             [(1, 0.9996), (2, 1), (2, 2), (1, 2)]]  # fmt: skip
    made = from_polygons(rings, tolerance=1e-3)
    assert_tiles(made)
    assert not made.is_breakable
    assert made.areas == pytest.approx([2, 1, 1], rel=1e-12)


def test_corners_near_to_a_given_region_are_put_on_it():
    rings = [[(0, 0.0003), (1, -0.0002), (1, 1), (0, 1)], [(1.0002, 0), (2, 0), (2, 1), (1, 1)]]
    region = polygon(np.add([(0, 0), (2, 0), (2, 1), (0, 1)], (6, 3)))
    made = from_polygons([np.add(ring, (6, 3)) for ring in rings], region=region, tolerance=1e-3)
    assert_tiles(made)
    assert_sides_complete(made)
    assert made.areas.sum() == pytest.approx(2, rel=1e-12)
    assert from_polygons([UNIT, RIGHT], region=rectangle(2, 1)).areas.tolist() == [1, 1]


def test_a_corner_near_to_an_oblique_side_of_a_given_region_is_put_on_it():
    """Off by 0.4 mm, with 1 mm allowed; the side is as long as 5 m."""
    rings = [[(0, 0), (4, 0), (2.00024, 1.50032)], [(0, 0), (2.00024, 1.50032), (0, 3)]]
    region = polygon(np.add([(0, 0), (4, 0), (0, 3)], (6, 3)))
    made = from_polygons([np.add(ring, (6, 3)) for ring in rings], region=region, tolerance=1e-3)
    assert polygon_of(made, 0) == pytest.approx(np.array([(6, 3), (10, 3), (8, 4.5)]), abs=1e-12)
    assert made.areas == pytest.approx([3, 3])


def test_an_angle_is_cut_at_its_corner():
    made = from_polygons([ANGLE, [(1, 1), (2, 1), (2, 2), (1, 2)]])
    assert_tiles(made)
    assert made.parent.tolist() == [0, 0, 1]
    assert made.areas[2] == 1
    assert made.edges.kind[(made.edges.left == 0) & (made.edges.right == 1)].tolist() == [1]


def test_a_hole_is_one_only_where_it_is_asked_for():
    frame = [[(0, 0), (3, 0), (2, 1), (1, 1)], [(3, 0), (3, 3), (2, 2), (2, 1)], [(3, 3), (0, 3), (1, 2), (2, 2)],
             [(0, 3), (0, 0), (1, 1), (1, 2)]]  # fmt: skip
    with pytest.raises(ParameterError, match=r"gap of 1 m2 between polygons 0, 1, 2 and 3 near \(1\.5, 1\.5\) m"):
        from_polygons(frame)
    made = from_polygons(frame, holes=True)
    assert_tiles(made)
    assert made.region.area == pytest.approx(8)
    assert made.region.hole_sides == (("hole",) * 4,)
    around = polygon([(0, 0), (3, 0), (3, 3), (0, 3)], "rim", holes={"well": [(1, 1), (2, 1), (2, 2), (1, 2)]})
    assert from_polygons(frame, region=around).boundary_names == ("rim", "well")


@pytest.mark.parametrize(
    ("polygons", "said"),
    [
        ([[(0, 0), (1, 1), (1, 0), (0, 1)]], "polygon 0 crosses or touches itself near (0.5, 0.5) m"),
        ([UNIT, [(1, 0), (3, 0), (2, 0), (2, 1), (1, 1)]], "polygon 1 crosses or touches itself near (3, 0) m"),
        ([UNIT, [(1, 0), (1, 0), (1, 1)]], "polygon 1 at (1, 0) m has less than 3 different corners"),
        ([[(0, 0), (2, 0), (1, 0), (1, 1)]], "polygon 0 crosses or touches itself near (2, 0) m"),
        ([UNIT, [(1, 0), (3, 0), (2, 0)]], "polygon 1 crosses or touches itself near (3, 0) m"),
        ([UNIT, [(0.9, 0), (2, 0), (2, 1), (0.9, 1)]], "polygons 0 and 1 overlap at the edge with the middle (0.95,"),
        ([UNIT, [(0.5, 0.25), (1.5, 0.5), (0.5, 0.75)]], "polygons 0 and 1 overlap near (1, 0.375) m"),
        ([UNIT, [(0.2, 0.2), (0.8, 0.5), (0.2, 0.8)]], "polygon 1 overlaps others near (0.4, 0.5) m, by 0.18 m2"),
        ([UNIT, [(1, 0), (2, 0), (2, 1), (1, 1), (0.7, 0.5)]], "polygons 0 and 1 overlap at the corner (1, 0) m"),
        ([UNIT, UNIT], "polygons 0 and 1 overlap at the edge"),
        ([UNIT, [(1, 1), (2, 1), (2, 2), (1, 2)]], "polygons 0 and 1 touch at a corner only, at (1, 1) m"),
        ([UNIT, RIGHT, np.add(UNIT, (2, 1))], "polygons 1 and 2 touch at a corner only, at (2, 1) m"),
        ([UNIT, [(3, 0), (4, 0), (4, 1), (3, 1)]], "polygon 1 lies apart from the others, at (3.5, 0.5) m"),
        ([UNIT, [(1, 0), (2, 0), (2, 1), (1, 1), (1.3, 0.5)]], "gap of 0.15 m2 between polygons 0 and 1 near (1.1"),
    ],
)
def test_faults_are_refused_with_their_place(polygons, said):
    with pytest.raises(ParameterError, match=re.escape(said)):
        from_polygons(polygons)


def test_a_polygon_thinner_than_the_tolerance_touches_itself():
    horn = [(1, 0), (2, 0), (2, 1), (1, 1), (1, 0.6), (1.5, 0.5), (1, 0.5999)]
    with pytest.raises(ParameterError, match=r"polygon 1 crosses or touches itself near \(1, 0\.6\) m"):
        from_polygons([UNIT, horn], tolerance=1e-3)
    tongue = [(1, 0), (2, 0), (2, 1), (1.5, 0.0005), (1, 1)]
    with pytest.raises(ParameterError, match=r"polygon 1 touches itself at \(1\.5, 0\) m"):
        from_polygons([UNIT, tongue], tolerance=1e-3)


@pytest.mark.parametrize(
    ("width", "said"),
    [(3, "polygon 1 has an edge with the middle (2, 0.5) m where"), (1.5, "polygon 1 has an edge with the middle")],
)
def test_polygons_must_fill_a_given_region(width, said):
    with pytest.raises(ParameterError, match=re.escape(said)):
        from_polygons([UNIT, RIGHT], region=rectangle(width, 1))


def test_a_gap_is_no_hole_of_a_given_region():
    with pytest.raises(ParameterError, match=r"with the middle \(1, 0\.5\) m where neither a second polygon"):
        from_polygons([UNIT, [*RIGHT, (1.3, 0.5)]], region=rectangle(2, 1))


@pytest.mark.parametrize(
    ("polygons", "options", "said"),
    [
        ([], {}, "at least one polygon"), (5, {}, "a list of polygons"), ([UNIT[:2]], {}, "polygon 0 has 2 corners"),
        ([UNIT, [(0, 0), (1, np.nan), (2, 2)]], {}, "polygon 1 ="), ([UNIT], {"phases": ["a", "b"]}, "phases ="),
        ([UNIT], {"phases": [-1]}, "phases ="), ([UNIT], {"tolerance": -1}, "tolerance ="),
        ([UNIT], {"phases": "q"}, "phases ="),
    ],
)  # fmt: skip
def test_other_input_is_refused(polygons, options, said):
    with pytest.raises(ParameterError, match=said):
        from_polygons(polygons, **options)


def test_only_what_turns_both_ways_is_searched_for_crossings(monkeypatch):
    searched, search = [], shared_edges.crossing_sides
    monkeypatch.setattr(
        shared_edges, "crossing_sides", lambda start, *more: searched.append(len(start)) or search(start, *more)
    )
    rings = [np.add(UNIT, (5, 7)), ANGLE, np.add(UNIT, (9, 9))[::-1], [(9, 0), (10, 0), (11, 0), (9, 1), (8, 0.5)]]
    first = np.cumsum([0, *map(len, rings)])
    made = shared_edges.cleaned("rings", np.concatenate(rings), np.arange(first[-1]), first)
    assert searched == [6]
    assert made.areas == pytest.approx([1, 3, 1, 1.5])


def test_a_point_inside_a_loop_is_left_of_its_longest_edge():
    """Of 5 m, from (3, 4) to the origin; a millionth of its length away from its middle."""
    found = _inside(np.array([(0, 0), (1, 0), (3, 4)], dtype=float))
    assert found == pytest.approx(np.array([(1.5 + 4e-6, 2 - 3e-6)]), abs=1e-12)


def test_only_concave_polygons_are_cut():
    rings = [np.add(UNIT, (5, 7)), ANGLE, [(9, 0), (10, 0), (11, 0), (9, 1)]]
    first = np.cumsum([0, *map(len, rings)])
    made = Polygons(np.concatenate(rings), np.arange(first[-1]), first, np.arange(3))
    assert made.concave.tolist() == [1]
    assert made.areas == pytest.approx([1, 3, 1])
    for size in (1e-6, 1e6):  # m: a dent of a thousandth of the size is one in any of them
        dented = size * np.array([(0, 0), (1, 0), (1, 1), (0.5, 0.999), (0, 1)])
        made = Polygons(dented, np.arange(5), np.array([0, 5]), np.arange(1))
        assert made.concave.tolist() == [0]


def test_a_cut_that_ends_on_an_edge_gives_its_neighbour_a_corner():
    """From the corner at (3, 1) at 45 degrees down to (2, 0); no corner of the polygon is near to that direction."""
    angle = [(0, 0), (4, 0), (4, 1), (3, 1), (3, 2), (0, 2)]
    made = from_polygons([np.add(ring, (6, 3)) for ring in (angle, [(0, -1), (4, -1), (4, 0), (0, 0)])])
    assert_tiles(made)
    assert made.parent.tolist() == [0, 0, 1]
    assert sorted(made.areas[:2]) == pytest.approx([1.5, 5.5])
    assert polygon_of(made, 2).tolist() == [[6, 2], [10, 2], [10, 3], [8, 3], [6, 3]]


def test_a_polygon_may_end_where_it_began():
    rings = polygons._rings([[*UNIT, UNIT[0]], RIGHT])
    assert [ring.tolist() for ring in rings] == [[[*point] for point in UNIT], [[*point] for point in RIGHT]]
    with pytest.raises(ParameterError, match="polygon 1 has 2 corners, it must have at least 3"):
        polygons._rings([UNIT, [(0, 0), (1, 0), (0, 0)]])
    with pytest.raises(ParameterError, match="polygon 0 has 1 corners, it must have at least 3"):
        polygons._rings([[(0, 0)]])
