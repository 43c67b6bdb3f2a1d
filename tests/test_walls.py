"""Walls in running bond, and platens above and below a sample: their joints, sides and refusals."""

from __future__ import annotations

import numpy as np
import pytest
from support import ROCK
from tiling import SQUARE, lengths, polygon_of

import grainlaw as gl
from grainlaw.geometry import Minerals, Voronoi, between_platens, block, disc, rectangle, wall
from grainlaw.protocols import Brazilian, UniaxialCompression
from grainlaw.protocols.measures import size


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
        ({"width": 0.12}, "wall: width = 0.12 m is not allowed, .* from 2 to 10000"),
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


@pytest.mark.thorough
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


def test_platens_have_a_name_beside_named_minerals() -> None:
    sample = Minerals(Voronoi(grains=20), {"quartz": 0.5, "mica": 0.5}).tessellate(rectangle(1, 1))
    grains = between_platens(sample, 0.1, columns=2)
    assert grains.phase_names == ("quartz", "mica", "platen")
    assert grains.phase[20:].tolist() == [2] * 4
    assert between_platens(sample, 0.1, phase="steel").phase_names[2:] == ("steel",)
    for taken in ("mica", 1):
        with pytest.raises(gl.ParameterError, match=r"phase = .* must be a name of their own, as the phases of these"):
            between_platens(sample, 0.1, phase=taken)


@pytest.mark.parametrize("change", [{"thickness": 0}, {"overhang": -1}, {"phase": 0.5}])
def test_platens_refuse(change) -> None:
    (name,) = change
    with pytest.raises(gl.ParameterError, match=f"between_platens: {name} = .* is not allowed"):
        between_platens(block(SQUARE), **{"thickness": 1, **change})
