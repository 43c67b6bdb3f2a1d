"""A long notched beam, whose hinge softens as it bends: the load is that of the supports."""

import itertools

import numpy as np
import pytest

import grainlaw as gl
from grainlaw.geometry import from_polygons, notched_beam
from grainlaw.laws import CohesiveCrack
from grainlaw.protocols import ThreePointBending
from grainlaw.units import GPa, MPa, mm

pytestmark = pytest.mark.slow

ROWS = 5  #: of blocks beside the notch, and as many above it
HALF, NOTCH, SLIT, TOP = 1.0, 0.1, 2 * mm, 0.2  #: m: half the length, depth and half the width of the notch, height


def half():
    """Blocks (n, 2) m of the left half, narrower towards the supports; the last column ends at notch and crack."""
    across = [0.0, 0.08, 0.12, *np.linspace(0.12, HALF, 12)[1:]]
    up = np.linspace(0, TOP, 2 * ROWS + 1)
    for low, high in itertools.pairwise(up):
        for left, right in itertools.pairwise(across):
            end = HALF - SLIT if right == HALF and high <= NOTCH else right
            yield [(left, low), (end, low), (end, high), (left, high)]


def test_load_and_supports_of_a_beam_that_softens_agree():
    blocks = [np.array(corners) for corners in half()]
    blocks += [block[::-1] * [-1, 1] + [2 * HALF, 0] for block in blocks]
    region = notched_beam(2 * HALF, TOP, notch_depth=NOTCH, notch_width=2 * SLIT, span=1.8, bearing=0.04)
    concrete = gl.Elastic(youngs_modulus=30 * GPa, poissons_ratio=0.2, density=2400)
    law = CohesiveCrack(
        kn=2e13, ks=1e13, tensile_strength=3.33 * MPa, cohesion=10 * MPa, friction_angle=30, residual_friction_angle=30,
        mode_i_energy=124, mode_ii_energy=1240,
    )  # fmt: skip
    beam = gl.Specimen(from_polygons(blocks, region=region), concrete)
    result = gl.simulate(beam, law, ThreePointBending(maximum_deflection=1 * mm, samples=400), frames=1)
    load, supports = result.curves["force_top"], result.curves["force_bottom"]
    assert np.abs(load - supports).max() < 0.005 * result.summary["failure_force"]
    assert result.curves["force"][-1] < 0.1 * result.summary["failure_force"]  # it has nearly parted
    assert result.summary["work_of_fracture"] == pytest.approx(124, rel=0.2)
