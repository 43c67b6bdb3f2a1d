"""Grains filled with cells: they tile, keep their grains' outlines, have no short edges; what is refused."""

import warnings

import attrs
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats
from tiling import BEAM, BEND, SLOPE, SQUARE, assert_sides_complete, assert_tiles, polygon_of, shoelace

import grainlaw as gl
from grainlaw.fields import ParameterError
from grainlaw.geometry import (
    Breakable,
    Bricks,
    Cleavage,
    Hexagonal,
    Jointed,
    JointSet,
    JointSets,
    Minerals,
    Trigons,
    Voronoi,
    VoronoiCells,
    disc,
    polygon,
    rectangle,
)
from grainlaw.geometry.breakable import _cells, _lattice, _scattered, triangles
from grainlaw.geometry.cells import merging
from grainlaw.geometry.cells.merging import merge_short_edges
from grainlaw.geometry.cells.sides import held, released
from grainlaw.geometry.cells.tiling import Tiling

REGIONS = {
    "rectangle": rectangle(1, 2), "disc": disc(1.0), "slope": SLOPE, "beam": BEAM, "bend": BEND,
    "hole": polygon([(0, 0), (4, 0), (4, 4), (0, 4)], holes={"hole": [(1, 1), (3, 1.2), (2.5, 3)]}),
}  # fmt: skip
FILLINGS = st.one_of(
    st.builds(VoronoiCells, count=st.integers(2, 15), relaxation=st.integers(0, 3)),
    st.builds(Trigons, count=st.integers(2, 20)),
    st.builds(Cleavage, spacing=st.just(0.07), angle=st.one_of(st.none(), st.integers(-180, 180))),
)


def outline_areas(grains):
    """(n,) m2, of the cells of each grain together."""
    return np.bincount(np.unique(grains.parent, return_inverse=True)[1], grains.areas)


@pytest.mark.thorough
@pytest.mark.parametrize("region", REGIONS.values(), ids=REGIONS)
@settings(max_examples=5)
@given(cells=FILLINGS, count=st.integers(1, 25), seed=st.integers(0, 10**6))
def test_cells_tile_any_region_and_keep_the_grains(region, cells, count, seed):
    grains = Voronoi(grains=count, seed=seed)
    whole, made = grains.tessellate(region), Breakable(grains, cells, seed=seed).tessellate(region)
    assert_tiles(made)
    assert_sides_complete(made)
    assert np.array_equal(np.unique(made.parent), np.arange(whole.count))
    assert outline_areas(made) == pytest.approx(whole.areas, rel=1e-9)


@pytest.mark.thorough
@settings(max_examples=15)
@given(cells=FILLINGS, seed=st.integers(0, 10**6))
def test_every_cell_lies_in_its_grain(cells, seed):
    whole = Hexagonal(grains=20).tessellate(REGIONS["rectangle"])
    made = Breakable(Hexagonal(grains=20), cells, seed=seed).tessellate(REGIONS["rectangle"])
    for cell in range(made.count):
        grain = polygon_of(whole, made.parent[cell])
        for point in polygon_of(made, cell):
            along, away = np.roll(grain, -1, axis=0) - grain, point - grain
            assert (along[:, 0] * away[:, 1] - along[:, 1] * away[:, 0] > -1e-9).all()


@pytest.mark.thorough
@pytest.mark.parametrize("cells", [VoronoiCells(count=8), Trigons(count=12)], ids=lambda cells: type(cells).__name__)
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_no_short_edge_is_left(cells, seed):
    grains, region = Voronoi(grains=200, seed=seed), rectangle(0.05, 0.1)
    size = np.sqrt(region.area / 200 / cells.count)
    loose, merged = (Breakable(grains, cells, merge=m).tessellate(region) for m in (0, 0.25))
    assert merged.edges.length.min() > 0.25 * size
    assert_tiles(merged)
    if isinstance(cells, VoronoiCells):
        assert (loose.edges.length < 0.25 * size).mean() > 0.1
    assert merged.count == pytest.approx(200 * cells.count, rel=0.1 if isinstance(cells, VoronoiCells) else 0.3)
    assert merged.areas.min() > 0.05 * size**2


def test_a_merge_does_not_fold_a_cell_with_a_straight_corner():
    """Without its short edge the upper cell has only corners on one line; the lower ones share its straight corner."""
    region = rectangle(1, 1)
    points = [(0, 0), (0.5, 0), (0.5, 0.5), (0, 0.5), (1, 0), (1, 0.5), (1, 0.51), (1, 1), (0, 1)]
    vertices = np.array(points)
    corners = [0, 1, 2, 3, 1, 4, 5, 2, 3, 2, 5, 6, 3, 6, 7, 8]
    on = region_sides_of(vertices)
    tiling = Tiling(region, vertices, on, np.array(corners), np.array([0, 4, 8, 12, 16]))
    tiling.tessellation()
    middle = np.array([3, 2, 5]), np.zeros(3, dtype=int)
    tiling, lines = held(tiling, np.array([[0, 0.5]]), np.array([[1, 0.5]]), middle)
    assert np.flatnonzero((tiling.on == 4).any(axis=1)).tolist() == [2, 3, 5]
    assert np.array_equal(np.sort(released(tiling).on), np.sort(on))
    merged = merge_short_edges(tiling, 0.1, 0.0, lines)
    merged.tessellation()
    assert len(merged.first) == 5


def region_sides_of(vertices):
    """(v, 2) sides of the unit square that each vertex is on."""
    sides = np.column_stack([vertices[:, 1] == 0, vertices[:, 0] == 1, vertices[:, 1] == 1, vertices[:, 0] == 0])
    return np.array([[*np.flatnonzero(row), -1, -1][:2] for row in sides])


def test_count_and_size_mean_the_same():
    region = rectangle(1, 1)
    size = np.sqrt(1 / 50 / 9)
    one, other = (
        Breakable(Voronoi(grains=50), VoronoiCells(**of)).tessellate(region) for of in ({"count": 9}, {"size": size})
    )
    assert np.array_equal(one.corners, other.corners)
    assert one.vertices == pytest.approx(other.vertices)


@pytest.mark.parametrize("size", [1e-5, 1e5])
def test_cells_grow_with_their_region(size):
    """What counts as one point, as a short edge and as a small cell is measured by the cells; one cell vanishes."""
    cells = Breakable(Voronoi(grains=20, seed=2), VoronoiCells(count=8, relaxation=0))
    one, other = (cells.tessellate(rectangle(side, side)) for side in (1, size))
    assert one.count < attrs.evolve(cells, merge=0.0).tessellate(rectangle(1, 1)).count
    assert np.array_equal(one.corners, other.corners)
    assert other.vertices / size == pytest.approx(one.vertices, abs=1e-9)


def test_cleavage_of_a_brick_makes_equal_strips():
    made = Breakable(Bricks(rows=1, columns=2), Cleavage(spacing=0.1, angle=90)).tessellate(rectangle(1, 1))
    assert made.count == 10
    assert made.areas == pytest.approx(0.1)
    inside = made.edges.kind == 1
    across = made.vertices[made.edges.end[inside]] - made.vertices[made.edges.start[inside]]
    assert across[:, 0] == pytest.approx(0, abs=1e-12)


def test_cleavage_has_an_angle_of_its_own_in_each_grain():
    made = Breakable(Bricks(rows=1, columns=2), Cleavage(spacing=0.1, angle=[90, 0])).tessellate(rectangle(1, 1))
    edges = made.edges
    along = made.vertices[edges.end] - made.vertices[edges.start]
    for grain, axis in ((0, 0), (1, 1)):
        inside = (edges.kind == 1) & (made.parent[edges.left] == grain)
        assert inside.sum() == (4 if grain == 0 else 9)
        assert along[inside, axis] == pytest.approx(0, abs=1e-12)
    turned = Breakable(Hexagonal(grains=30), Cleavage(spacing=0.03)).tessellate(rectangle(1, 1))
    angles = np.degrees(np.arctan2(*(turned.vertices[turned.edges.end] - turned.vertices[turned.edges.start]).T))
    assert np.histogram(angles[turned.edges.kind == 1] % 180, 6, (0, 180))[0].min() > 0  # all directions are there


def test_phases_may_have_cells_of_their_own_or_none():
    minerals = Minerals(Voronoi(grains=100), {"quartz": 0.6, "mica": 0.4})
    made = Breakable(minerals, {"mica": Cleavage(spacing=0.02, angle=0)}).tessellate(rectangle(1, 1))
    cells = np.bincount(made.parent)
    phase = minerals.tessellate(rectangle(1, 1)).phase
    assert (cells[phase == 0] == 1).all()
    assert (cells[phase == 1] > 1).all()
    assert made.phase_names == ("quartz", "mica")
    assert np.array_equal(made.phase, phase[made.parent])
    with pytest.raises(ParameterError, match=r"there is no phase 'mika' \(phases: quartz, mica\)"):
        Breakable(minerals, {"mika": Trigons(count=3)}).tessellate(rectangle(1, 1))
    with pytest.raises(ParameterError, match=r"there is no phase 2 \(phases: quartz, mica\)"):
        Breakable(minerals, {2: Trigons(count=3)}).tessellate(rectangle(1, 1))


def test_the_smallest_cells_tell_how_many_there_would_be(monkeypatch):
    """A square of 1 m2 in cells of 0.1 mm, wherever these are: 1e8."""
    minerals, told = Minerals(Voronoi(grains=20), {"quartz": 0.6, "mica": 0.4}), []

    def refused(text, count):
        told.append(count)
        raise ParameterError(text)

    monkeypatch.setattr("grainlaw.geometry.breakable.check_room", refused)
    for names in (("quartz", "mica"), ("mica", "quartz")):
        cells = dict(zip(names, (Trigons(size=1e-4), Trigons(size=0.1)), strict=True))
        with pytest.raises(ParameterError, match=r"Breakable: cells make about 1e\+08 grains"):
            Breakable(minerals, cells).tessellate(rectangle(1, 1))
    assert told == pytest.approx([1e8, 1e8])


def test_fine_cells_stay_as_they_are_beside_coarse_ones():
    """Edges vanish that are short beside the smallest cells: here none, and a grain has as many as alone."""
    minerals, fine = Minerals(Voronoi(grains=12), {"quartz": 0.6, "mica": 0.4}), Trigons(size=0.04)
    alone, both = (
        Breakable(minerals, {"mica": fine, **more}).tessellate(rectangle(1, 1))
        for more in ({}, {"quartz": Trigons(size=0.5)})
    )
    mica = np.unique(alone.parent[alone.phase == 1])
    assert mica.size > 2
    assert (np.bincount(both.parent)[mica] == np.bincount(alone.parent)[mica]).all()


def test_joints_of_the_grains_are_kept():
    blocks = JointSets(sets=[JointSet(dip=0, spacing=0.5, name="bedding"), JointSet(dip=90, spacing=0.5)])
    made = Breakable(blocks, VoronoiCells(count=6)).tessellate(rectangle(1, 1))
    assert made.kinds == ("between", "inside", "bedding", "set 2")
    for kind in (2, 3):
        assert made.edges.length[made.edges.kind == kind].sum() == pytest.approx(1)
    assert not (made.edges.kind == 0)[made.edges.right >= 0].any()
    again = Breakable(Jointed(blocks, {"fault": [[(0.25, -1), (0.25, 2)]]}), Trigons(count=4)).tessellate(
        rectangle(1, 1)
    )
    assert again.edges.length[again.edges.kind == 4].sum() == pytest.approx(1)


def test_the_same_seed_makes_the_same_cells():
    one, same, other = (
        Breakable(Voronoi(grains=20), VoronoiCells(count=5), seed=s).tessellate(rectangle(1, 1)) for s in (1, 1, 2)
    )
    assert np.array_equal(one.vertices, same.vertices)
    assert np.array_equal(one.corners, same.corners)
    assert not np.array_equal(one.corners, other.corners)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: VoronoiCells(), "VoronoiCells: give either count or size, not neither"),
        (lambda: Trigons(count=3, size=1), "Trigons: give either count or size, not both"),
        (lambda: VoronoiCells(count=0), "count = 0 is not allowed"),
        (lambda: VoronoiCells(size=-1), "size = -1 m is not allowed"),
        (lambda: Cleavage(spacing=0), "spacing = 0 m is not allowed"),
        (lambda: Cleavage(spacing=1, angle="steep"), "angle = 'steep' is not allowed"),
        (lambda: Cleavage(spacing=1, angle=[]), r"angle = \[\] is not allowed"),
        (lambda: Cleavage(spacing=1, angle=[np.nan]), r"angle = \[nan\] is not allowed"),
        (lambda: Breakable(Voronoi(grains=5), 3), "cells = 3 is not allowed, it must be VoronoiCells"),
        (lambda: Breakable(Voronoi(grains=5), {}), "cells = {} is not allowed"),
        (lambda: Breakable(3, Trigons(count=3)), "tessellator = 3 is not allowed"),
        (lambda: Breakable(Voronoi(grains=5), Trigons(count=3), merge=1), "merge = 1 .* is not allowed"),
        (
            lambda: Breakable(Voronoi(grains=5), Trigons(size=1e-9)).tessellate(polygon(SQUARE)),
            r"cells make about 1e\+18 grains, that is not allowed, the memory",
        ),
        (
            lambda: Breakable(Bricks(rows=3), Cleavage(spacing=0.1, angle=[1, 2])).tessellate(polygon(SQUARE)),
            "angle has 2 entries, it must have one for each grain, also for 2",
        ),
    ],
)
def test_what_is_refused(make, words):
    with pytest.raises(ParameterError, match=words):
        make()


def test_triangles_well_inside_are_equilateral():
    """As many as fit where all corners are deeper than two edges; those at the rim fill the rest."""
    edge = 2 / 3**0.25 * 0.05
    made = np.array(triangles(SQUARE, 0.05, np.random.default_rng(1)))
    assert sum(map(shoelace, made)) == pytest.approx(1)
    assert min(map(shoelace, made)) > 0
    deep = made[(abs(made - 0.5).max(axis=(1, 2)) < 0.5 - 2 * edge)]
    assert np.hypot(*(np.roll(deep, 1, axis=1) - deep).transpose(2, 0, 1)) == pytest.approx(edge)
    assert (1 - 6 * edge) ** 2 < len(deep) * 0.05**2 < (1 - 4 * edge) ** 2
    rim = np.unique(np.round(made[made[..., 1] == 0][:, 0], 9))
    assert rim == pytest.approx(np.linspace(0, 1, round(1 / edge) + 1))


def test_lattices_of_triangles_are_turned_at_random():
    """By up to 60 degrees, and shifted: their first point is anywhere in a cell of the lattice."""
    points = [np.array(_lattice(SQUARE, 0.25, np.random.default_rng(seed))) @ [1, 1j] for seed in range(150)]
    along = [min(each[1:] - each[0], key=abs) for each in points]
    assert np.abs(along) == pytest.approx(0.25)
    assert stats.kstest(np.angle(along, deg=True) % 60 / 60, "uniform").pvalue > 0.01
    away = [(each[0] - (0.5 + 0.5j)) / step for each, step in zip(points, along, strict=True)]
    row = np.imag(away) / np.sqrt(0.75)
    assert stats.kstest(row % 1, "uniform").pvalue > 0.01
    assert stats.kstest((np.real(away) - row / 2) % 1, "uniform").pvalue > 0.01


@pytest.mark.parametrize(("length", "count"), [(1.9, 2), (2.1, 4)])
def test_a_polygon_too_narrow_for_the_lattice_has_its_middle_if_it_is_large(length, count):
    """Beyond three times the size squared, which 1.5 m by 2 m is."""
    made = triangles([(5, 0), (5 + length, 0), (5 + length, 1.5), (5, 1.5)], 1.0, np.random.default_rng(1))
    assert len(made) == count
    assert [(5 + length / 2, 0.75) in triangle for triangle in made] == [count == 4] * count


def test_cells_of_seeds_are_what_is_nearest_to_them():
    """Round the origin, where signs differ: parts that all cells have alone cover the square once."""
    seeds = np.random.default_rng(3).uniform(-1, 1, (60, 2))
    square = [(-1, -1), (1, -1), (1, 1), (-1, 1)]
    made = _cells(square, [tuple(seed) for seed in seeds], 1e-12)
    assert sum(shoelace(np.array(cell)) for cell in made) == pytest.approx(4, rel=1e-12)
    for k, cell in enumerate(made):
        away = np.hypot(*(np.array(cell)[:, None] - seeds).transpose(2, 0, 1))
        assert away[:, k] == pytest.approx(away.min(axis=1), abs=1e-12)


def test_seeds_of_cells_are_uniform():
    """In a trapezoid: x up to the share p of its area; sqrt, for the width falls evenly from 2 to 1."""
    points = np.array(_scattered([(1, 1), (5, 1), (5, 2), (1, 3)], 4000, np.random.default_rng(1)))
    x, y = (points - 1).T
    assert stats.kstest((2 * x - x**2 / 8) / 6, "uniform").pvalue > 0.01
    assert stats.kstest(y / (2 - x / 4), "uniform").pvalue > 0.01


def test_a_vertex_where_nothing_turns_or_meets_is_dropped():
    """On a side and in one grain; one in a corner of the region, between two grains or inside stays."""
    region = rectangle(1, 1)
    vertices = np.array(
        [(0, 0), (0.25, 0), (0.5, 0), (1, 0), (1, 1), (0.5, 1), (0, 1), (0, 0.5), (0.4, 0.5), (0.5, 0.5)]
    )
    left, right = [0, 1, 2, 9, 5, 6, 7], [2, 3, 4, 5, 9]
    kind = np.arange(12)
    tiling = Tiling(
        region, vertices, region_sides_of(vertices), np.array(left + right), np.array([0, 7, 12]), kind=kind
    )
    found = merging._without_idle(tiling)
    assert found.corners.tolist() == [0, 2, 9, 5, 6, 2, 3, 4, 5, 9]
    assert found.first.tolist() == [0, 5, 10]
    assert found.kind.tolist() == [0, 2, 3, 4, 5, 7, 8, 9, 10, 11]
    assert merging._without_idle(found) is found


@pytest.mark.parametrize("cells", [VoronoiCells, Trigons])
def test_one_cell_in_a_grain_is_refused(cells):
    """It would divide the larger grains."""
    with pytest.raises(gl.ParameterError, match="count = 1 is not allowed, it must be a whole number, at least 2"):
        cells(count=1)


def test_cells_larger_than_the_grains_are_told():
    """Half a metre for half a millimetre."""
    grains, region = Voronoi(grains=12, seed=1), rectangle(0.02, 0.02)
    with pytest.warns(gl.UnitWarning, match=r"Breakable: cells of 0\.5 m divide no grain of 0\.00577 m: is the unit"):
        Breakable(grains, VoronoiCells(size=0.5)).tessellate(region)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        Breakable(grains, VoronoiCells(count=2)).tessellate(region)
        Breakable(grains, VoronoiCells(size=0.004)).tessellate(region)
