"""Rock that is all joints is confined and tested: its contact points have no bonds that a confinement could break."""

import numpy as np
import pytest
from support import STIFF, STRONG, small_sample, state_of

import grainlaw as gl
from grainlaw.geometry import Bricks, rectangle
from grainlaw.laws import BartonBandis, CohesiveCrack, Friction, Linear, LinearClosure, MohrCoulomb
from grainlaw.protocols import BiaxialCompression
from grainlaw.units import MPa, mm

FREE = {"tensile_strength": 0, "cohesion": 0}
JOINTS = MohrCoulomb(**STIFF, **FREE, friction_angle=30, residual_friction_angle=30)
TEST = BiaxialCompression(
    confinement=10 * MPa, loading=gl.Constant(speed=0.2), maximum_strain=0.004, samples=40, stop_fraction=0
)


@pytest.fixture(scope="module")
def confined():
    sample = small_sample(80)
    return [gl.simulate(sample, law, TEST) for law in (JOINTS, Friction(**STIFF, friction_angle=30))]


@pytest.mark.thorough
def test_cohesionless_rock_is_confined_and_holds(confined):
    """All points count as broken from their first slip on, and the rock holds as friction alone does."""
    joints, friction = confined
    axial = joints.curves["stage"] == 1
    cracks = joints.curves["tensile_cracks"] + joints.curves["shear_cracks"]
    assert cracks[axial][0] > 0.5 * 2 * len(joints.specimen.mesh.interfaces)
    assert (joints.curves["broken_bonds"] == 0).all()
    for result in confined:  # a tight mosaic interlocks: more than Coulomb's tan^2(45 + phi/2) of its joints
        assert result.summary["largest_stress"] > 10 * MPa * np.tan(np.radians(60)) ** 2
    assert joints.summary["largest_stress"] == pytest.approx(friction.summary["largest_stress"], rel=0.02)


@pytest.mark.thorough
def test_confining_is_elastic_where_nothing_slips(confined):
    """Under equal stress on all sides: the shortening of the grains, and what the joints give besides."""
    for result in confined:
        strain = result.curves["strain"][result.curves["stage"] == 0][-1]
        grains = 10 * MPa * (1 + 0.25) * (1 - 2 * 0.25) / 60e9  # plane strain, isotropic
        assert grains < strain < 3 * grains


def test_level_joints_are_no_weakness():
    """Coulomb by hand: a pile of bricks has no inclined joint that could slide, and is as stiff as its parts."""
    column = gl.Specimen(Bricks(rows=4, columns=1).tessellate(rectangle(10 * mm, 20 * mm)), small_sample(4).material)
    result = gl.simulate(column, JOINTS, TEST)
    joints = 3 / (20 * mm * STIFF["kn"])  # strain per stress
    confined = result.curves["strain"][result.curves["stage"] == 0][-1]
    assert confined == pytest.approx(10 * MPa * ((1 + 0.25) * (1 - 2 * 0.25) / 60e9 + joints), rel=0.01)
    way = result.curves["strain"][-1] - confined  # from the confined state on, to a sample
    assert 0.004 <= way < 0.004 * (1 + 1 / 40)
    rise = way / ((1 - 0.25**2) / 60e9 + joints)
    assert result.summary["largest_stress"] == pytest.approx(10 * MPa + rise, rel=0.01)


@pytest.mark.parametrize(
    ("law", "bonded"),
    [
        (JOINTS, False),
        (Friction(**STIFF, friction_angle=30), False),
        (BartonBandis(**STIFF, friction_angle=40, dilation_angle=15, closure=LinearClosure()), False),
        (MohrCoulomb(**STRONG), True),
        (MohrCoulomb(**STIFF, tensile_strength=0, cohesion=1e6, friction_angle=30), True),
        (CohesiveCrack(**STRONG, mode_i_energy=15, mode_ii_energy=30), True),
        (Linear(**STIFF), True),
    ],
    ids=lambda value: type(value).__name__,
)
def test_what_holds_without_pressure_is_bonded(law, bonded):
    (group,) = state_of(small_sample(10), law).bonds.groups
    assert (group.cohesive == bonded).all()


def test_bonds_are_told_from_joints_point_by_point():
    sample = small_sample(10)
    cohesion = np.where(np.arange(2 * len(sample.mesh.interfaces)) % 2, 1e6, 0.0)
    law = MohrCoulomb(**STIFF, tensile_strength=0, cohesion=cohesion, friction_angle=30)
    (group,) = state_of(sample, law).bonds.groups
    assert np.count_nonzero(group.cohesive) == np.count_nonzero(cohesion)
