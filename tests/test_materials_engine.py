"""Properties of the engine that hold for grains of every exported material: patch, rotation, energy, threads."""

import attrs
import numpy as np
import pytest
from every_material import GRAIN, MATERIALS, SCHIST, compliance_along_y
from support import BRITTLE, PULL, STIFF, nodal_forces, small_sample, state_of
from test_determinism import assert_same_bits

import grainlaw as gl
from grainlaw.laws import Linear

EVERY = pytest.mark.parametrize("name", MATERIALS)
STRAIN = np.array([[-4e-3, 1e-3], [1e-3, 1.5e-3]])  # plastic materials yield


def strained(state, gradient, steps=10):
    """Bring all nodes by a uniform gradient of the displacement, in steps."""
    for share in np.arange(1, steps + 1) / steps:
        forces = nodal_forces(state, state.mesh.nodes @ (share * gradient).T)
    state.every_zone.known = None
    return forces


@pytest.mark.thorough
@EVERY
def test_patch(name):
    """A uniform strain gives every zone the stress of one zone alone, and inner nodes no force."""
    specimen = gl.Specimen(small_sample(1).grains, MATERIALS[name], refinement=2)
    state = state_of(specimen, Linear(**STIFF))
    forces = strained(state, STRAIN)
    path = np.outer(np.arange(1, 11) / 10, [STRAIN[0, 0], STRAIN[1, 1], STRAIN[0, 1]])
    expected = gl.trace_material(MATERIALS[name], *path.T).stress[-1]
    assert state.zone_state()[0] == pytest.approx(np.tile(expected, (len(specimen.mesh.zones), 1)), rel=1e-6, abs=100)
    rim = np.unique(np.concatenate(list(specimen.mesh.boundary_edges.values())))
    inner = np.setdiff1d(np.arange(len(forces)), rim)
    assert len(inner) > 20
    assert np.abs(forces[inner]).max() < 1e-9 * np.abs(forces).max()


@EVERY
def test_a_turned_sample_feels_no_change_of_stress(name):
    state = state_of(small_sample(12, material=MATERIALS[name]), Linear(**STIFF))
    strained(state, STRAIN)
    for _ in range(60):  # a softening material takes the strength of the step before: until that is the same
        forces = nodal_forces(state, state.displacement.copy())
    state.every_zone.known = None
    stress, lost = state.zone_state()[0].copy(), state.zone_state()[2].copy()
    angle = np.radians(30)
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    turned = nodal_forces(state, state.positions @ turn.T - state.mesh.nodes)
    state.every_zone.known = None
    full = stress[:, [0, 2, 2, 1]].reshape(-1, 2, 2)
    expected = (turn @ full @ turn.T).reshape(-1, 4)[:, [0, 3, 1]]
    assert np.abs(state.zone_state()[0] - expected).max() < 1e-8 * np.abs(stress).max()
    assert np.abs(turned - forces @ turn.T).max() < 1e-8 * np.abs(forces).max()
    assert state.zone_state()[2] == pytest.approx(lost, abs=1e-6 * max(lost.max(), 1.0))
    (x, y), size = state.positions.T, np.abs(turned).sum()
    assert abs((x * turned[:, 1] - y * turned[:, 0]).sum()) < 1e-12 * size * 0.04


@EVERY
@pytest.mark.alone
def test_the_ledger_closes_and_threads_give_the_same_bits(name):
    specimen, test = small_sample(material=MATERIALS[name]), attrs.evolve(PULL, samples=20)
    first = gl.simulate(specimen, BRITTLE, test)
    assert first.summary["energy_error"] < 1e-6
    assert_same_bits(first, gl.simulate(specimen, BRITTLE, test, threads=3))


@pytest.mark.parametrize("angle", [0, 30, 45, 60, 90])
def test_a_foliated_sample_has_its_turned_compliance(angle):
    """Between smooth platens, with contacts so stiff that only the grains count; and all its grains turned alike."""
    specimen = small_sample(30, material=attrs.evolve(SCHIST, foliation_angle=angle), refinement=1)
    found = gl.elastic_properties(specimen, Linear(kn=1e18, ks=1e18), boundary="static")
    compliance = np.linalg.inv(found.stiffness)
    assert 1 / compliance[1, 1] == pytest.approx(1 / compliance_along_y(SCHIST, angle), rel=1e-4)


def test_grains_that_yield_under_a_compression_carry_coulombs_stress():
    """A bar of plastic grains that do not part: level at the strength of one zone."""
    from grainlaw.geometry import Bricks, rectangle
    from grainlaw.materials import MohrCoulombPlastic
    from grainlaw.protocols import UniaxialCompression

    weak = MohrCoulombPlastic(**GRAIN, tensile_strength=1e6, cohesion=10e6, friction_angle=30)
    specimen = gl.Specimen(Bricks(rows=4, columns=2).tessellate(rectangle(8e-3, 16e-3)), weak)
    test = UniaxialCompression(maximum_strain=2e-3, samples=40, loading=gl.Constant(speed=0.02, ramp=1e-4))
    result = gl.simulate(specimen, Linear(kn=1e15, ks=1e15), test)
    strength = 20e6 * np.tan(np.radians(60))
    assert result.curves["stress"][-1] == pytest.approx(strength, rel=0.01)
    assert result.curves["energy_zones_dissipated"][-1] > 0
