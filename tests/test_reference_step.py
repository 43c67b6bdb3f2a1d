"""The engine beside a step in plain Python loops: the same displacements, velocities and tractions to rounding."""

import numpy as np
import pytest
from reference_step import Reference, RigidReference
from support import STIFF, STRONG, advance, impose, small_sample, state_of

import grainlaw as gl
from grainlaw.contact import memory_names
from grainlaw.laws import (
    BandisClosure,
    CohesiveCrack,
    Linear,
    MohrCoulomb,
    MunjizaJoint,
)
from grainlaw.materials import DruckerPrager, MohrCoulombPlastic, TransverselyIsotropic

WEAK = STRONG | {"tensile_strength": 1e6, "cohesion": 2e6}
LAWS = {
    "linear": Linear(**STIFF),
    "Mohr-Coulomb": MohrCoulomb(**WEAK),
    "cohesive crack": CohesiveCrack(**WEAK, mode_i_energy=0.5, mode_ii_energy=1.0),
    "closure": CohesiveCrack(**WEAK, mode_i_energy=1, mode_ii_energy=2, closure=BandisClosure(maximum_closure=5e-6)),
    "Munjiza": MunjizaJoint(**WEAK, mode_i_energy=0.5, mode_ii_energy=1.0),
}  # fmt: skip
DRIVES = [gl.Drive(boundary="bottom", axis=1, speed=0.0), gl.Drive(boundary="top", axis=1, speed=1.5)]
LOADS = {
    "free": [],
    "driven": DRIVES,
    "pressed": [*DRIVES, gl.Pressure(boundary="left", pressure=4e6)],
    "loaded": [gl.Traction(boundary="top", stress=(1e6, 3e6, -2e6)), gl.Gravity(acceleration=(300.0, -1e4))],
}
#: of grains that deform alone
SOFT = {
    "held": [DRIVES[0], gl.Hold(boundary="top", axis=1, stress=-3e6, stiffness=1e13)],
    "quiet": [*DRIVES, gl.Quiet(boundary="left"), gl.Quiet(boundary="right")],
}
WHOLE = {"youngs_modulus": 60e9, "poissons_ratio": 0.25, "density": 3100}
MATERIALS = [
    MohrCoulombPlastic(**WHOLE, tensile_strength=1e5, cohesion=3e5, friction_angle=30, dilation_angle=10),
    DruckerPrager(**WHOLE, cohesion=3e5, friction_angle=30),
    TransverselyIsotropic(
        youngs_modulus=60e9, youngs_modulus_across=30e9, poissons_ratio=0.2, poissons_ratio_across=0.15,
        shear_modulus_across=12e9, foliation_angle=35, density=2700,
    ),
]  # fmt: skip
DAMPINGS = {
    "vibration": gl.VibrationDamping(),
    "sway": gl.SwayDamping(coefficient=1e5),
    "local": gl.LocalDamping(),
    "none": gl.Undamped(),
}
STEPS = 60


def compared(law, loads, damping, kind=Reference, seed=1, **options):
    """A specimen that is thrown apart: states of the engine and of the reference after the same steps."""
    specimen = small_sample(9, **options)
    velocity = np.random.default_rng(seed).normal(0, 1.0, (len(specimen.mesh.nodes), 2))
    state = state_of(specimen, law)
    impose(state, [*loads, gl.InitialVelocity(velocity=velocity)])
    integrator, time_step = gl.CentralDifference(damping=damping), 4e-8
    memory = state.bonds.arrays.memory[: len(memory_names(law)), 0].tolist()
    reference = kind(specimen, law, loads, integrator, time_step, memory, velocity)
    advance(state, STEPS, time_step, integrator)
    for _ in range(STEPS):
        reference.step()
    return state, reference


def assert_same(state, reference):
    def plane(numbers):
        return np.array([[z.real, z.imag] for z in numbers])

    for mine, theirs in (
        (state.displacement, plane(reference.u)), (state.freedoms.arrays.velocity.T, plane(reference.v)),
    ):  # fmt: skip
        assert np.abs(mine - theirs).max() <= 1e-12 * np.abs(theirs).max() * STEPS


@pytest.mark.parametrize("law", LAWS.values(), ids=LAWS)
def test_laws(law):
    state, reference = compared(law, DRIVES, gl.VibrationDamping())
    assert_same(state, reference)
    order = state.bonds.order
    for rows, k in ((state.normal, 0), (state.shear, 1)):
        theirs = np.array([[reference.tractions[c, p][k] for c in order] for p in (0, 1)]).ravel()
        assert np.abs(rows - theirs).max() <= 1e-12 * np.abs(theirs).max() * STEPS


@pytest.mark.parametrize("damping", DAMPINGS.values(), ids=DAMPINGS)
@pytest.mark.parametrize("loads", (LOADS | SOFT).values(), ids=LOADS | SOFT)
def test_loads_and_dampings(loads, damping):
    assert_same(*compared(LAWS["cohesive crack"], loads, damping))


@pytest.mark.parametrize("material", MATERIALS, ids=lambda material: type(material).__name__)
def test_materials(material):
    state, reference = compared(LAWS["cohesive crack"], DRIVES, gl.VibrationDamping(), material=material)
    assert_same(state, reference)
    plastic = np.array([memory[-1] if memory else 0.0 for memory in reference.remembered])
    assert np.any(plastic > 0) == hasattr(material, "cohesion")
    assert state.materials.memory("plastic_strain") == pytest.approx(plastic, rel=1e-9)


@pytest.mark.parametrize("points", [gl.EndPoints(), gl.GaussPoints()], ids=repr)
def test_contact_points(points):
    assert_same(*compared(LAWS["linear"], LOADS["free"], gl.Undamped(), contact_points=points))


@pytest.mark.parametrize("loads", LOADS.values(), ids=LOADS)
@pytest.mark.parametrize("damping", DAMPINGS.values(), ids=DAMPINGS)
def test_rigid_grains(loads, damping):
    rigid = {"kind": RigidReference, "seed": 2, "material": gl.Rigid(density=3100)}
    state, reference = compared(LAWS["cohesive crack"], loads, damping, **rigid)
    rows = np.array([[z.real for z in reference.moved], [z.imag for z in reference.moved], reference.turned])
    for mine, theirs in zip(state.freedoms.arrays.displacement, rows, strict=True):
        assert np.abs(mine - theirs).max() <= 1e-12 * np.abs(theirs).max() * STEPS
    place = np.array([[z.real, z.imag] for z in reference.u])
    assert np.abs(state.displacement - place).max() <= 1e-12 * np.abs(place).max() * STEPS


def test_contacts_have_broken_meanwhile():
    """Otherwise the laws would not have been asked for much."""
    state, _ = compared(LAWS["cohesive crack"], DRIVES, gl.VibrationDamping())
    assert 5 < np.count_nonzero(state.memory("damage") >= 1) < len(state.broken_time)
