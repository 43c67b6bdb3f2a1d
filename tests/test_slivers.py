"""Slivers of grains from elsewhere: told with what they cost, merged where asked for."""

import re
import warnings

import meshio
import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from tiling import assert_tiles, polygon_of

from grainlaw.cli.sample import grains_of_file
from grainlaw.fields import ParameterError
from grainlaw.geometry import (
    SliverWarning,
    Voronoi,
    from_mesh,
    from_polygons,
    read_tess,
    rectangle,
    texture,
    write_tess,
)

THIN = 2e-4
LEFT = [(0, 0), (1, 0), (1, 1), (0, 1)]
STRIP = [(1, 0), (1 + THIN, 0), (1 + THIN, 1), (1, 1)]
RIGHT = [(1 + THIN, 0), (2, 0), (2, 1), (1 + THIN, 1)]


def test_a_strip_between_grains_is_told_and_merged():
    """The step of a strip goes with its width."""
    with pytest.warns(SliverWarning, match=r"from_polygons: .* cell 1 at \(1\.0001, 0\.5\) m, .* of 0\.0002 m"):
        drawn = from_polygons([LEFT, STRIP, RIGHT], ["quartz", "clay", "mica"])
    assert drawn.count == 3
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        made = from_polygons([LEFT, STRIP, RIGHT], ["quartz", "clay", "mica"], merge=0.1)
    assert_tiles(made)
    assert [made.phase_names[k] for k in made.phase] == ["quartz", "mica"]
    assert made.areas == pytest.approx([1, 1], rel=2 * THIN)
    squares = from_polygons([LEFT, [(1, 0), (2, 0), (2, 1), (1, 1)]])
    assert texture(made).step_ratio == pytest.approx(texture(squares).step_ratio, rel=1e-3)


@pytest.mark.parametrize(("width", "count"), [(0.1, 3), (0.09, 2)])
def test_a_thin_triangle_vanishes_below_half_of_an_edge_by_a_grain_size(width, count):
    """Between two halves of 4 m by 1 m: the grain size is nearly 2 m, so the limit is 0.2 m2 less a little."""
    low, high = 1 - width / 2, 1 + width / 2
    rings = [[(0, 0), (4, 0), (4, 1), (0, low)], [(0, low), (4, 1), (0, high)], [(0, high), (4, 1), (4, 2), (0, 2)]]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SliverWarning)
        made = from_polygons(rings, merge=0.1)
    assert_tiles(made)
    assert made.count == count


def test_what_is_told_is_the_step_of_the_texture():
    with pytest.warns(SliverWarning) as told:
        drawn = from_polygons([LEFT, STRIP, RIGHT])
    ratio = float(re.search(r"step is (\S+) of", str(told[0].message))[1])
    assert ratio == pytest.approx(texture(drawn).step_ratio, rel=0.05)
    assert ratio < 2 * THIN


@pytest.mark.thorough
@settings(max_examples=15)
@given(seed=st.integers(0, 999), grains=st.integers(20, 120))
@example(seed=999, grains=27)
def test_merged_polygons_tile_and_cost_less(seed, grains):
    whole = Voronoi(grains=grains, seed=seed, relaxation=0, merge=0).tessellate(rectangle(1, 2))
    rings = [polygon_of(whole, g) for g in range(whole.count)]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SliverWarning)
        drawn, made = from_polygons(rings), from_polygons(rings, merge=0.1)
    assert_tiles(made)
    size = drawn.grain_size
    short = [np.sum(one.edges.length < 0.1 * size) for one in (drawn, made)]
    assert short[1] <= max(0.2 * short[0], 1)  # one of three may stay, as at the rim beside a small grain
    assert texture(made).step_ratio >= min(texture(drawn).step_ratio, 0.1)
    change = made.areas - drawn.areas[made.parent]
    assert abs(change).max() < 0.25 * size**2  # half of the outline moved by what vanishes


def test_a_sliver_of_a_mesh(tmp_path):
    """Two squares of two triangles each, and beside the diagonal of the first a triangle 1e-4 thin."""
    points = [(0, 0), (1, 0), (1, 1), (0, 1), (2, 0), (2, 1), (1 - 1e-4, 1)]
    triangles = [(0, 1, 2), (0, 2, 6), (0, 6, 3), (1, 4, 5), (1, 5, 2)]
    file = tmp_path / "grains.vtk"
    mesh = meshio.Mesh(
        np.column_stack([points, np.zeros(7)]), {"triangle": np.array(triangles)},
        cell_data={"grain": [np.array([1, 1, 1, 2, 2])]},
    )  # fmt: skip
    meshio.write(file, mesh)
    with pytest.warns(SliverWarning, match="from_mesh: .* ruled by cell 1 at"):
        drawn = from_mesh(file, grain_data="grain")
    assert drawn.count == 5
    made = from_mesh(file, grain_data="grain", merge=0.1)
    assert_tiles(made)
    assert made.parent.tolist() == [0, 0, 1, 1]
    assert made.edges.length.min() > 0.99


def test_a_tessellation_file_and_its_section(tmp_path):
    whole = Voronoi(grains=60, seed=3, relaxation=0, merge=0).tessellate(rectangle(1, 1))
    file = tmp_path / "grains.tess"
    write_tess(whole, file)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SliverWarning)
        made = read_tess(file, merge=0.15)
        again, section = grains_of_file(str(file), {"merge": 0.15})
    assert texture(made).shortest_edge > texture(whole).shortest_edge
    assert np.array_equal(made.vertices, again.vertices)
    assert section == {"merge": 0.15}


@pytest.mark.parametrize("merge", [-0.1, 1, np.nan, "0.1", True])
def test_what_is_refused(merge, tmp_path):
    for read in (lambda: from_polygons([LEFT], merge=merge), lambda: from_mesh(tmp_path / "no.msh", merge=merge)):
        with pytest.raises(ParameterError, match=r"merge = .* is not allowed"):
            read()
