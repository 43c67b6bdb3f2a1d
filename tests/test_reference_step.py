"""The engine beside a step in plain Python loops: the same displacements, velocities and tractions to rounding."""

import numpy as np
import pytest
from bodies import thrown
from reference_step import Reference, RigidReference
from support import ROCK, STIFF, STRONG, advance, impose, small_sample, state_of

import grainlaw as gl
from grainlaw.contact import memory_names
from grainlaw.laws import (
    BandisClosure,
    CohesiveCrack,
    Friction,
    Linear,
    MohrCoulomb,
    MunjizaJoint,
)
from grainlaw.materials import DruckerPrager, MohrCoulombPlastic, Thermal, TransverselyIsotropic

WEAK = STRONG | {"tensile_strength": 1e6, "cohesion": 2e6}
LAWS = {
    "linear": Linear(**STIFF),
    "Mohr-Coulomb": MohrCoulomb(**WEAK),
    "cohesive crack": CohesiveCrack(**WEAK, mode_i_energy=0.5, mode_ii_energy=1.0),
    "closure": CohesiveCrack(**WEAK, mode_i_energy=1, mode_ii_energy=2, closure=BandisClosure(maximum_closure=5e-6)),
    "Munjiza": MunjizaJoint(**WEAK, mode_i_energy=0.5, mode_ii_energy=1.0),
}  # fmt: skip
DRIVES = [gl.loads.Drive(boundary="bottom", axis=1, speed=0.0), gl.loads.Drive(boundary="top", axis=1, speed=1.5)]
LOADS = {
    "free": [],
    "driven": DRIVES,
    "pressed": [*DRIVES, gl.loads.Pressure(boundary="left", pressure=4e6)],
    "loaded": [
        gl.loads.Traction(boundary="top", stress=(1e6, 3e6, -2e6)),
        gl.loads.Gravity(acceleration=(300.0, -1e4)),
    ],
}
#: of grains that deform alone
SOFT = {
    "held": [DRIVES[0], gl.loads.Hold(boundary="top", axis=1, stress=-3e6, stiffness=1e13)],
    "bars": [
        gl.loads.BarEnd(boundary="bottom", axis=1, impedance=4e7),
        gl.loads.BarEnd(boundary="top", axis=1, impedance=9e7, width=0.01, stress=-30e6),
    ],
    "quiet": [*DRIVES, gl.loads.Quiet(boundary="left"), gl.loads.Quiet(boundary="right")],
}
WHOLE = {"youngs_modulus": 60e9, "poissons_ratio": 0.25, "density": 3100}
FLUIDS = [*DRIVES, gl.loads.FluidPressure(boundary="left", pressure=3e6)]
FLUIDS += [gl.loads.FluidPressure(boundary="right", pressure=8e6, cracks_only=True)]
MATERIALS = [
    MohrCoulombPlastic(**WHOLE, tensile_strength=1e5, cohesion=3e5, friction_angle=30, dilation_angle=10),
    DruckerPrager(**WHOLE, cohesion=3e5, friction_angle=30),
    TransverselyIsotropic(
        youngs_modulus=60e9, youngs_modulus_across=30e9, poissons_ratio=0.2, poissons_ratio_across=0.15,
        shear_modulus_across=12e9, foliation_angle=35, density=2700,
    ),
]  # fmt: skip
DAMPINGS = {
    "vibration": gl.integration.VibrationDamping(),
    "sway": gl.integration.SwayDamping(coefficient=1e5),
    "local": gl.integration.LocalDamping(),
    "none": gl.integration.Undamped(),
}
STEPS = 60


def compared(law, loads, damping, kind=Reference, seed=1, temperature=20.0, **options):
    """A specimen that is thrown apart: states of the engine and of the reference after the same steps."""
    specimen = small_sample(9, **options)
    velocity = np.random.default_rng(seed).normal(0, 1.0, (len(specimen.mesh.nodes), 2))
    return both(
        specimen, law, loads, velocity, kind, gl.integration.CentralDifference(damping=damping), temperature=temperature
    )


def both(specimen, law, loads, velocity, kind, integrator, time_step=4e-8, steps=STEPS, detection=None, temperature=20):
    state = state_of(specimen, law, detection)
    impose(state, [*loads, gl.loads.InitialVelocity(velocity=velocity)])
    state.heat.reach(temperature)
    groups = state.contacts.groups if detection else state.bonds.groups
    memory = groups[0].virgin.tolist() if detection else [0.0] * len(memory_names(law))
    told = {"detection": detection, "temperature": temperature}
    reference = kind(specimen, law, loads, integrator, time_step, memory, velocity, **told)
    for count in (steps // 2, steps - steps // 2):
        advance(state, count, time_step, integrator)
        state.let_fluids_follow()
        for _ in range(count):
            reference.step()
        reference.soak()
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
    state, reference = compared(law, DRIVES, gl.integration.VibrationDamping())
    assert_same(state, reference)
    order = state.bonds.order
    for rows, k in ((state.normal, 0), (state.shear, 1)):
        theirs = np.array([[reference.tractions[c, p][k] for c in order] for p in (0, 1)]).ravel()
        assert np.abs(rows - theirs).max() <= 1e-12 * np.abs(theirs).max() * STEPS


@pytest.mark.parametrize(
    "damping", [pytest.param(n, marks=() if n in ("sway", "local") else pytest.mark.thorough) for n in DAMPINGS]
)
@pytest.mark.parametrize("loads", (LOADS | SOFT).values(), ids=LOADS | SOFT)
def test_loads_and_dampings(loads, damping):
    assert_same(*compared(LAWS["cohesive crack"], loads, DAMPINGS[damping]))


@pytest.mark.thorough
@pytest.mark.parametrize("material", MATERIALS, ids=lambda material: type(material).__name__)
def test_materials(material):
    state, reference = compared(LAWS["cohesive crack"], DRIVES, gl.integration.VibrationDamping(), material=material)
    assert_same(state, reference)
    plastic = np.array([memory[-1] if memory else 0.0 for memory in reference.remembered])
    assert np.any(plastic > 0) == hasattr(material, "cohesion")
    assert state.materials.memory("plastic_strain") == pytest.approx(plastic, rel=1e-9)


def test_heat():
    """Grains that a temperature has strained at once."""
    loads, hot = LOADS["free"], Thermal(material=ROCK, expansion=8e-6, expansion_along=3e-6, axis_angle=20)
    assert_same(
        *compared(LAWS["cohesive crack"], loads, gl.integration.VibrationDamping(), material=hot, temperature=90.0)
    )


def test_fluids():
    """At half of the steps they enter what has broken until then."""
    state, reference = compared(LAWS["cohesive crack"], FLUIDS, gl.integration.VibrationDamping(), seed=4)
    assert_same(state, reference)
    pressures = list(reference.wet.values())
    assert pressures.count(3e6) > 0
    assert pressures.count(8e6) > 9


@pytest.mark.thorough
@pytest.mark.parametrize("cracks_only", [False, True])
def test_an_injection(cracks_only):
    """Also what it finds in a crack that it enters at half of the steps."""
    options = {"rate": 5e-3, "volume": 2e-7, "pressure": 2e6, "cracks_only": cracks_only}
    loads = [*DRIVES, gl.loads.Injection(boundary="left", **options)]
    state, reference = compared(LAWS["cohesive crack"], loads, gl.integration.VibrationDamping(), seed=4)
    assert_same(state, reference)
    found = state.pumped
    assert found["injection_pressure"] == pytest.approx(reference.pressure, rel=1e-9)
    assert found["room"] + found["crack_room"] == pytest.approx(reference.room - 2e-7, rel=1e-9)
    assert found["injected"] == pytest.approx(STEPS * 4e-8 * 5e-3)
    assert len(reference.full) > 6
    assert found["injection_pressure"] > 1e5


@pytest.mark.parametrize("points", [gl.EndPoints(), gl.GaussPoints()], ids=repr)
def test_contact_points(points):
    assert_same(*compared(LAWS["linear"], LOADS["free"], gl.integration.Undamped(), contact_points=points))


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


FACES = {
    "friction": Friction(kn=1e12, ks=6e11, friction_angle=30),
    "dilation": MohrCoulomb(
        kn=1e12, ks=6e11, tensile_strength=0, cohesion=0, friction_angle=35, residual_friction_angle=35,
        dilation_angle=8,
    ),
}  # fmt: skip


@pytest.mark.parametrize("seed", [1, *(pytest.param(seed, marks=pytest.mark.thorough) for seed in (2, 3))])
@pytest.mark.parametrize("material", [gl.Rigid(density=2600), pytest.param(ROCK, marks=pytest.mark.thorough)], ids=repr)
@pytest.mark.parametrize(
    ("law", "dashpots"),
    [
        pytest.param("friction", 0.0, marks=pytest.mark.thorough),
        ("friction", 0.3),
        pytest.param("dilation", 0.0, marks=pytest.mark.thorough),
    ],
)
def test_contacts_without_a_bond(law, dashpots, material, seed):
    """Corners that dig into edges, faces that slide on each other, and part."""
    specimen, velocity = thrown(seed, material)
    kind = RigidReference if specimen.is_rigid else Reference
    motion = (
        gl.integration.CentralDifference(damping=gl.integration.Undamped()),
        1e-7,
        1500,
        gl.Detection(damping=dashpots),
    )
    state, reference = both(specimen, FACES[law], [], velocity, kind, *motion)
    place = np.array([[z.real, z.imag] for z in reference.u])
    assert np.abs(state.displacement - place).max() <= 1e-12 * np.abs(place).max()
    assert len(reference.touching.met) > 6
    assert not all(pair.closed for pair in reference.touching.met)


def test_contacts_have_broken_meanwhile():
    """Otherwise the laws would not have been asked for much."""
    state, _ = compared(LAWS["cohesive crack"], DRIVES, gl.integration.VibrationDamping())
    assert 5 < np.count_nonzero(state.memory("damage") >= 1) < len(state.broken_time)
