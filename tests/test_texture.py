"""The texture of grains in numbers, against hand-computed ones, and pictures of grains."""

import attrs
import numpy as np
import pytest
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.figure import Figure
from support import ROCK

import grainlaw as gl
from grainlaw.engine.stability import highest_frequency, stiffness_matrix
from grainlaw.geometry import (
    Breakable,
    Bricks,
    Cleavage,
    Hexagonal,
    Jointed,
    Laguerre,
    Minerals,
    Voronoi,
    VoronoiCells,
    from_polygons,
    moved,
    rectangle,
    texture,
)


def test_bricks_by_hand():
    """Twelve bricks of 1 m by 2 m: between them 2 rows of 4 m, and 3 columns of 6 m."""
    found = texture(Bricks(rows=3, columns=4).tessellate(rectangle(4, 6)))
    assert (found.grains, found.cells) == (12, 12)
    assert found.diameters.mean == pytest.approx(2 * np.sqrt(2 / np.pi))
    assert found.diameters.cv == pytest.approx(0, abs=1e-12)
    assert found.circularity.mean == pytest.approx(4 * np.pi * 2 / 6**2)
    assert found.rose[[0, 9]] == pytest.approx([8, 18])
    assert found.rose.sum() == pytest.approx(26)
    assert found.anisotropy == pytest.approx(10 / 26)
    assert found.direction == pytest.approx(np.pi / 2)
    turned = texture(moved(Bricks(rows=3, columns=4).tessellate(rectangle(4, 6)), turn=25))
    assert (turned.anisotropy, turned.direction) == pytest.approx((10 / 26, np.radians(115)))
    assert turned.rose[[2, 11]] == pytest.approx([8, 18])
    assert found.shortest_edge == pytest.approx(1)
    assert found.edge.percentiles[50] == pytest.approx(1)
    assert not len(found.slivers)
    assert (found.fractions, found.like_share) == ({"0": pytest.approx(1)}, 1)


def test_the_diameters_asked_for_are_those_of_circles():
    """Of 1 and 3 m2, for grains that fill 4 m2."""
    grains = from_polygons([[(0, 0), (1, 0), (1, 1), (0, 1)], [(1, 0), (4, 0), (4, 1), (1, 1)]])
    asked = texture(grains, Laguerre(areas=[1.0, 3.0])).asked["diameters"]
    diameters = 2 * np.sqrt(np.array([1, 3]) / np.pi)
    assert asked.mean == pytest.approx(diameters.mean())
    assert asked.cv == pytest.approx(diameters.std() / diameters.mean())
    assert asked.percentiles[50] == pytest.approx(diameters.mean())


def test_scatter_of_two_squares():
    """Diameters as 1 to 2: their mean is 1.5, their deviation 0.5."""
    squares = [[(0, 0), (1, 0), (1, 1), (0, 1)], [(1, 0), (5, 0), (5, 1), (1, 1)]]
    assert texture(from_polygons(squares, ["a", "a"], rectangle(5, 1))).diameters.cv == pytest.approx(1 / 3)


def test_cells_of_one_grain_count_as_one():
    region = rectangle(0.05, 0.1)
    whole, broken = (
        texture(t.tessellate(region))
        for t in (Voronoi(grains=60), Breakable(Voronoi(grains=60), VoronoiCells(count=7)))
    )
    assert (broken.grains, broken.cells > 350) == (60, True)
    assert broken.diameters.percentiles == pytest.approx(whole.diameters.percentiles)
    assert broken.circularity.mean == pytest.approx(whole.circularity.mean)
    assert broken.rose.sum() == pytest.approx(whole.rose.sum())
    assert broken.anisotropy == pytest.approx(whole.anisotropy)


def test_like_boundary_of_a_chessboard_and_of_halves():
    bricks = Bricks(rows=4, columns=4).tessellate(rectangle(1, 1))
    chess = attrs.evolve(bricks, phase=np.indices((4, 4)).sum(axis=0).ravel() % 2)
    halves = attrs.evolve(bricks, phase=np.arange(16) // 8)
    assert texture(chess).like_share == 0
    assert texture(halves).like_share == pytest.approx(20 / 24)
    # Of 16 bricks 4 have two neighbours, 8 three and 4 four: 2 * 24^2 - 152 of 48^2 - 152 pairs of sides are alike.
    assert texture(halves).clustering == pytest.approx(20 / 24 / (1000 / 2152))


def test_what_was_asked_is_beside_what_is_found():
    asked = Minerals(Voronoi(grains=200), {"quartz": 0.3, "mica": 0.7}, clustering=1.3)
    lines = str(texture(asked.tessellate(rectangle(1, 1)), asked)).splitlines()
    words = {line.split("  ")[0]: line.split()[-2:] for line in lines}
    assert words["grains"] == ["200", "200"]
    assert words["quartz (%)"][1] == "30.00"
    assert float(words["quartz (%)"][0]) == pytest.approx(30, abs=0.1)
    assert float(words["clustering"][0]) == pytest.approx(1.3, rel=0.01)
    assert words["clustering"][1] == "1.3"


def test_strips_are_slivers():
    bricks = Breakable(Bricks(rows=1, columns=2), Cleavage(spacing=0.02, angle=90), merge=0).tessellate(rectangle(1, 1))
    assert len(texture(bricks).slivers) == bricks.count
    assert not len(texture(Hexagonal(grains=50).tessellate(rectangle(1, 1))).slivers)


def stable_step(grains):
    """s, without contacts."""
    specimen = gl.Specimen(grains, ROCK)
    none = np.zeros((2, len(specimen.mesh.interfaces)))
    return 2 / highest_frequency(stiffness_matrix(specimen, none, none), np.repeat(specimen.node_masses, 2))


def test_the_time_step_is_told_from_the_worst_node():
    """Where the worst is a hundred times worse, the step is as much shorter; the median hardly changes."""
    region = rectangle(0.05, 0.1)
    grains = [
        t.tessellate(region)
        for t in (
            Voronoi(grains=200), Voronoi(grains=200, merge=0), Breakable(Voronoi(grains=50), VoronoiCells(count=5)),
            Breakable(Voronoi(grains=50), VoronoiCells(count=5), merge=0), Hexagonal(grains=200),
        )
    ]  # fmt: skip
    ratio = [texture(each).step_ratio * median_step(each) / stable_step(each) for each in grains]
    assert ratio == pytest.approx([np.mean(ratio)] * 5, rel=0.2)
    assert stable_step(grains[1]) < 0.2 * stable_step(grains[0])


def median_step(grains):
    """Of root of mass over stiffness of the nodes, for unit density and modulus."""
    mesh = gl.Specimen(grains, ROCK).mesh
    mass, stiffness = np.zeros(len(mesh.nodes)), np.zeros(len(mesh.nodes))
    for zone, area in zip(mesh.zones, mesh.zone_areas, strict=True):
        for k in range(3):
            across = mesh.nodes[zone[k - 1]] - mesh.nodes[zone[k - 2]]
            mass[zone[k]] += area / 3
            stiffness[zone[k]] += across @ across / (4 * area)
    return np.median(np.sqrt(mass / stiffness))


def test_pictures():
    made = Breakable(
        Jointed(Minerals(Voronoi(grains=40), {"quartz": 0.6, "mica": 0.4}), {"bedding": [[(0, 0), (0.05, 0.1)]]}),
        VoronoiCells(count=4),
    ).tessellate(rectangle(0.05, 0.1))
    axes = made.plot().axes[0]
    legend = [text.get_text() for text in axes.get_legend().get_texts()]
    assert [words.split()[0] for words in legend] == ["quartz", "mica", "bedding"]
    shares = [made.areas[made.phase == k].sum() / 0.005 for k in (0, 1)]
    assert [float(words.split()[1]) for words in legend[:2]] == pytest.approx(
        [100 * share for share in shares], abs=0.05
    )
    filled, *lines = axes.collections
    assert isinstance(filled, PolyCollection)
    assert [type(each) for each in lines] == [LineCollection] * 3
    assert [len(each.get_segments()) for each in lines] == [np.sum(made.edges.kind == kind) for kind in (1, 0, 2)]
    assert Bricks().tessellate(rectangle(1, 1)).plot().axes[0].get_legend() is None
    mine = Figure().subplots()
    assert made.plot(by="area", ax=mine) is mine.figure
    assert np.allclose(mine.collections[0].get_array().sum() * 1e-6, sum(area * n for area, n in areas_by_grain(made)))
    colors = made.plot(by="parent").axes[0].collections[0].get_facecolor()
    edges = made.edges
    apart = (edges.right >= 0) & (made.parent[edges.left] != made.parent[edges.right])
    assert (colors[edges.left[apart]] != colors[edges.right[apart]]).any(axis=1).all()
    with pytest.raises(gl.ParameterError, match="by = 'colour' is not allowed, it must be 'phase', 'area' or 'parent'"):
        made.plot(by="colour")


def areas_by_grain(grains):
    """Area of each grain, and how many cells it has."""
    for parent in np.unique(grains.parent):
        mine = grains.parent == parent
        yield grains.areas[mine].sum(), mine.sum()


def test_phases_are_named_where_there_are_several():
    bricks = Bricks(rows=1, columns=2).tessellate(rectangle(2, 1))
    assert repr(texture(bricks)) == "Texture(grains: 2, cells: 2, slivers: 0)"
    both = attrs.evolve(bricks, phase=np.array([1, 0]), phase_names=("quartz", "mica"))
    assert repr(texture(both)) == "Texture(grains: 2, cells: 2, slivers: 0, phases: quartz, mica)"
