"""What protocols measure on boundaries, and what their platens are given, by hand."""

import numpy as np
import pytest
from support import ROCK

import grainlaw as gl
from grainlaw.gauges import points_on
from grainlaw.geometry import Bricks, between_platens, rectangle
from grainlaw.protocols import DirectShear

BLOCK = gl.Specimen(Bricks(rows=1).tessellate(rectangle(4e-3, 8e-3)), ROCK, refinement=3)  # eight parts of each side
STEEL = gl.Elastic(youngs_modulus=200e9, poissons_ratio=0.3, density=7850)


@pytest.mark.parametrize(
    ("boundary", "count", "share", "places"),
    [
        ("left", 1, 1.0, [4]), ("left", 2, 1.0, [2, 6]), ("left", 2, 0.5, [3, 5]), ("right", 4, 1.0, [1, 3, 5, 7]),
        ("top", 2, 1.0, [1, 3]), ("bottom", 4, 0.5, [1.25, 1.75, 2.25, 2.75]),
    ],
)  # fmt: skip
def test_points_lie_in_the_middle_of_equal_parts(boundary, count, share, places):
    """mm along the boundary, or the node nearest to it."""
    nodes = BLOCK.mesh.nodes[points_on(BLOCK.mesh, boundary, count, share)]
    along = nodes[:, 1 if boundary in ("left", "right") else 0] * 1e3
    step = 1.0 if boundary in ("left", "right") else 0.5
    assert np.abs(along - places).max() <= step / 2 + 1e-12
    assert np.array_equal(along, np.sort(along))


@pytest.mark.parametrize("overhang", [0.0, 2e-3])
def test_a_shear_test_presses_with_its_stress_on_the_specimen(overhang):
    """Whatever the length of the platen: force and stiffness are those of the specimen's width, in every stage."""
    joint = Bricks(rows=2).tessellate(rectangle(40e-3, 20e-3))
    specimen = gl.Specimen(between_platens(joint, 5e-3, overhang), {0: ROCK, 1: STEEL})
    test = DirectShear(normal_stress=3e6, normal_stiffness=2e10, reverse_to=0.5)
    length = specimen.mesh.boundary_lengths["top"]
    stages = test.stages(specimen)
    assert [stage.name for stage in stages] == ["press", "shear", "reverse"]
    assert length == pytest.approx(40e-3 + 2 * overhang)
    for stage in stages:
        (hold,) = stage.of(gl.Hold)
        assert hold.stress * length == pytest.approx(-3e6 * 40e-3)
        assert hold.stiffness * length == pytest.approx(0 if stage.name == "press" else 2e10 * 40e-3)
