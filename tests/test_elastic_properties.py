"""Elastic properties from static solutions: closed forms, the slow run, bounds, and states of a run."""

import re
import time
import warnings
from types import SimpleNamespace

import attrs
import numpy as np
import pytest
from bodies import FACES, GRAVITY, Motion, box
from support import BRITTLE, HILLERBORG, ROCK, STIFF, STRONG, nodal_forces, small_sample, state_of

import grainlaw as gl
from grainlaw.engine.spring_statics import ElasticModel, _tangents, stiffness_of_contacts
from grainlaw.engine.stability import stiffness_matrix
from grainlaw.geometry import Bricks, Hexagonal, disc, rectangle, together
from grainlaw.laws import BandisClosure, CohesiveCrack, Friction, Linear, PrePeak
from grainlaw.protocols import UniaxialCompression
from grainlaw.units import mm

LAW, RIGID = Linear(**STIFF), gl.Rigid(density=3100)
E, NU = ROCK.youngs_modulus, ROCK.poissons_ratio
PLANE_E, PLANE_NU, SHEAR = E / (1 - NU**2), NU / (1 - NU), E / (2 * (1 + NU))  # of the plane problem
HEIGHT = 40 * mm
BOUNDARIES = ("kinematic", "static")


def column(rows, material=ROCK, **options):
    grains = Bricks(rows=rows).tessellate(rectangle(20 * mm, HEIGHT))
    return gl.Specimen(attrs.evolve(grains, **options), material)


# --- closed forms ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("boundary", BOUNDARIES)
@pytest.mark.parametrize("plane", gl.Plane)
def test_one_block_is_its_rock(plane, boundary):
    rock = attrs.evolve(ROCK, plane=plane)
    found = gl.elastic_properties(column(1, rock), LAW, boundary=boundary)
    young, ratio = (PLANE_E, PLANE_NU) if plane is gl.Plane.STRAIN else (E, NU)
    stiff = young / (1 - ratio**2) * np.array([[1, ratio, 0], [ratio, 1, 0], [0, 0, (1 - ratio) / 2]])
    assert (found.apparent_modulus, found.apparent_poisson) == pytest.approx((young, ratio), rel=1e-9)
    assert (found.modulus, found.poisson) == pytest.approx((E, NU), rel=1e-9)
    assert found.stiffness == pytest.approx(stiff, rel=1e-9, abs=1)
    assert found.boundary == boundary


def in_series(springs):
    """Compliance (3, 3) 1/Pa of a column of blocks with springs (n, 2) Pa/m between them."""
    kn, ks = (np.sum(1 / np.asarray(springs), axis=0) / HEIGHT).tolist()
    return np.array([
        [1 / PLANE_E, -PLANE_NU / PLANE_E, 0], [-PLANE_NU / PLANE_E, 1 / PLANE_E + kn, 0], [0, 0, 1 / SHEAR + ks],
    ])  # fmt: skip


def test_blocks_in_series_with_their_contacts():
    found = gl.elastic_properties(column(4), LAW, boundary="static")
    expected = in_series([(LAW.kn, LAW.ks)] * 3)
    assert np.linalg.inv(found.stiffness) == pytest.approx(expected, rel=1e-8, abs=1e-20)
    assert found.apparent_modulus == pytest.approx(1 / expected[1, 1], rel=1e-9)
    assert found.apparent_poisson == pytest.approx(PLANE_NU / PLANE_E / expected[1, 1], rel=1e-9)


def test_every_contact_has_the_stiffness_of_its_own_law():
    laws = {(0, 1): Linear(kn=1e13, ks=2e12), (1, 1): Linear(kn=3e13, ks=5e12), (1, 2): Linear(kn=2e13, ks=1e13)}
    found = gl.elastic_properties(column(4, phase=np.array([0, 1, 1, 2])), laws, boundary="static")
    expected = in_series([(1e13, 2e12), (3e13, 5e12), (2e13, 1e13)])
    assert np.linalg.inv(found.stiffness) == pytest.approx(expected, rel=1e-8, abs=1e-20)


def test_a_rim_that_holds_every_contact_leaves_the_rock():
    """All corners of a column lie on its rim: under a uniform strain no contact opens or slips."""
    found, rock = (gl.elastic_properties(column(rows), LAW, boundary="kinematic").stiffness for rows in (4, 1))
    assert found == pytest.approx(rock, rel=1e-9, abs=1)


def test_rigid_blocks_are_their_contacts():
    found = gl.elastic_properties(column(5, RIGID), LAW)
    assert (found.apparent_modulus, found.apparent_poisson) == pytest.approx((LAW.kn * HEIGHT / 4, 0), rel=1e-9)
    assert found.stiffness[1, 1] == pytest.approx(LAW.kn * HEIGHT / 4, rel=1e-9)
    assert found.stiffness[0].tolist() == [np.inf, 0, 0]  # nothing strains across it


# --- the run ---------------------------------------------------------------------------------------------------------


@pytest.mark.thorough
@pytest.mark.parametrize("material", [ROCK, RIGID], ids=["elastic", "rigid"])
@pytest.mark.parametrize("name", ["linear", "cohesive", "by phase"])
def test_equal_to_uniaxial_compression(name, material):
    cohesive = CohesiveCrack(**STRONG, mode_i_energy=150, mode_ii_energy=300, pre_peak=PrePeak.LINEAR)
    by_phase = {(0, 0): LAW, (0, 1): Linear(kn=1e13, ks=3e12), (1, 1): Linear(kn=3e12, ks=1e12)}
    law = {"linear": LAW, "cohesive": cohesive, "by phase": by_phase}[name]
    grains = small_sample().grains
    specimen = gl.Specimen(attrs.evolve(grains, phase=np.arange(grains.count) % 2), material)
    run = gl.simulate(specimen, law, UniaxialCompression(maximum_strain=3e-4, samples=100, stop_fraction=0))
    found = gl.elastic_properties(specimen, law)
    for key in ("apparent_modulus", "apparent_poisson", "modulus", "poisson"):
        # The run turns and shifts its grains by the order of its strain, which shows where lateral strains cancel.
        assert getattr(found, key) == pytest.approx(run.summary[key], rel=1e-3, abs=1e-4)


# --- the tensor ------------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def large():
    specimen = small_sample(grains=755, width=50 * mm, height=125 * mm)
    return specimen, {boundary: gl.elastic_properties(specimen, LAW, boundary=boundary) for boundary in BOUNDARIES}


@pytest.mark.parametrize("specimen", [small_sample(), small_sample(material=RIGID)], ids=["elastic", "rigid"])
@pytest.mark.parametrize("boundary", BOUNDARIES)
def test_a_stiffness_is_symmetric_and_positive_definite(specimen, boundary):
    found = gl.elastic_properties(specimen, LAW, boundary=boundary).stiffness
    assert found == pytest.approx(found.T, rel=1e-9, abs=1e-9 * found.max())
    assert (np.linalg.eigvalsh(found) > 0.1 * found.max()).all()


def test_uniform_strain_is_stiffer_than_platens_and_those_than_uniform_stress(large):
    """Of all fields with the same ends, that of the static solution has the least energy (Hill 1963; Huet 1990)."""
    _, found = large
    strain, stress = (1 / np.linalg.inv(found[boundary].stiffness)[1, 1] for boundary in BOUNDARIES)
    assert strain > found["kinematic"].apparent_modulus > stress
    assert (np.linalg.eigvalsh(found["kinematic"].stiffness - found["static"].stiffness) > 0).all()


def test_many_voronoi_grains_are_isotropic(large):
    for found in large[1].values():
        (xx, xy, xs), (_, yy, ys), (*_, ss) = found.stiffness
        assert xx == pytest.approx(yy, rel=0.02)
        assert ss == pytest.approx((xx + yy - 2 * xy) / 4, rel=0.02)
        assert max(abs(xs), abs(ys)) < 0.02 * ss


def test_it_takes_less_than_a_second(large):
    start = time.perf_counter()
    gl.elastic_properties(large[0], LAW)
    assert time.perf_counter() - start < 1  # 0.14 s on a quiet machine


def test_it_prints_as_a_table_with_units():
    text = str(gl.elastic_properties(column(1), LAW))
    assert f"E* (GPa)  {PLANE_E * 1e-9:.2f}" in text
    assert "stiffness (GPa), static boundary" in text
    assert text.splitlines()[-1].split() == ["xy", "0.000", "0.000", f"{SHEAR * 1e-9:.3f}"]


# --- at a state ------------------------------------------------------------------------------------------------------

JOINT = Friction(**STIFF, friction_angle=30)


def at(specimen, law, *, closure=0.0, slip=0.0):
    """Two blocks, the upper one pressed down and pushed to the right: properties under a uniform stress."""
    state, moved = state_of(specimen, law), np.zeros((len(specimen.mesh.nodes), 2))
    moved[specimen.mesh.node_grain == 1] = slip, -closure
    nodal_forces(state, moved)
    return np.linalg.inv(gl.elastic_properties(specimen, law, boundary="static", state=state).stiffness)


def test_a_joint_that_sticks_slides_or_is_open():
    two, expected = column(2), in_series([(JOINT.kn, JOINT.ks)])
    sticks = at(two, JOINT, closure=1e-7, slip=1e-8)
    assert sticks == pytest.approx(expected, rel=1e-5, abs=1e-16)
    slides = at(two, JOINT, closure=1e-7, slip=1e-6)
    assert slides[1, 1] == pytest.approx(expected[1, 1], rel=1e-5)
    assert slides[2, 2] > 1e6 * expected[2, 2]
    assert at(two, JOINT, closure=-1e-7)[1, 1] > 1e6 * expected[1, 1]


def test_a_closure_that_stiffens_counts_with_its_tangent():
    """Bandis: pressure kn d / (1 - d/m), tangent kn / (1 - d/m)^2."""
    joint = attrs.evolve(JOINT, closure=BandisClosure(maximum_closure=4e-6))
    found = at(column(2), joint, closure=3e-6)
    assert found[1, 1] == pytest.approx(in_series([(16 * joint.kn, joint.ks)])[1, 1], rel=1e-5)


def test_a_softening_bond_counts_as_it_unloads():
    """Hillerborg's law returns to the origin: f (1 - D) / o, with o between the peak and the end of the softening."""
    peak, last = HILLERBORG.strength / HILLERBORG.kn, 2 * HILLERBORG.energy / HILLERBORG.strength
    secant = HILLERBORG.strength * (1 - (2e-6 - peak) / (last - peak)) / 2e-6
    found = at(column(2), HILLERBORG, closure=-2e-6)
    assert found[1, 1] == pytest.approx(in_series([(secant, HILLERBORG.ks)])[1, 1], rel=1e-5)


def test_the_first_state_is_the_declared_stiffness():
    specimen = small_sample()
    fresh = gl.elastic_properties(specimen, BRITTLE, state=state_of(specimen, BRITTLE))
    declared = gl.elastic_properties(specimen, BRITTLE)
    assert fresh.apparent_modulus == pytest.approx(declared.apparent_modulus, rel=1e-6)
    assert fresh.stiffness == pytest.approx(declared.stiffness, rel=1e-6, abs=1e3)


def test_faces_that_are_apart_are_told_to_count_as_closed():
    """Their moduli are those of closed ones; a state of a run knows better, and says nothing."""
    specimen = small_sample(12)
    apart, closed = (Friction(**STIFF, friction_angle=30, gap=gap) for gap in (2e-6, 0.0))
    with pytest.warns(UserWarning, match="Friction counts with its stiffness, but the faces are 2e-06 m apart"):
        found = gl.elastic_properties(specimen, apart)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert found.apparent_modulus == gl.elastic_properties(specimen, closed).apparent_modulus


def test_a_closed_contact_without_a_bond_is_a_spring_along_its_length():
    """Energy of a rigid motion of the upper block: kn L in closure, ks L in slip, kn L^3 / 12 in rotation."""
    width = 0.1
    blocks = together(box(width, 0.1, name="lower"), box(width, 0.1, bottom=0.1, name="upper"))
    faces = attrs.evolve(FACES, ks=0.4 * FACES.kn)
    motion = Motion(blocks, faces, fixed=[0], gravity=(0.0, -GRAVITY), damping=gl.integration.LocalDamping())
    motion.run(0.05)
    mesh, matrix = motion.state.mesh, stiffness_of_contacts(motion.state)
    place, upper = mesh.nodes - (width / 2, 0.1), mesh.node_grain == 1
    for field, expected in [
        (np.stack([0 * place[:, 0], upper], axis=1), faces.kn * width),
        (np.stack([upper, 0 * place[:, 0]], axis=1), faces.ks * width),
        (np.stack([-place[:, 1] * upper, place[:, 0] * upper], axis=1), faces.kn * width**3 / 12),
        (np.stack([-place[:, 1], place[:, 0]], axis=1), 0.0),  # of both blocks together
    ]:
        motion_of_nodes = field.astype(float).ravel()
        found = motion_of_nodes @ (matrix @ motion_of_nodes)
        assert found == pytest.approx(expected, rel=1e-4, abs=1e-4 * faces.kn * width**3)


@pytest.mark.parametrize("material", [ROCK, RIGID], ids=["elastic", "rigid"])
def test_contacts_without_a_bond_are_springs_beside_the_bonds(material):
    """Three times as stiff as those in the same places: four times the stiffness in all."""
    specimen = column(2, material)
    kn, ks = (np.full((2, 1), k / 4) for k in (LAW.kn, LAW.ks))
    more = stiffness_matrix(specimen, 4 * kn, 4 * ks) - stiffness_matrix(specimen, kn, ks)  # less that of the zones
    modulus = 1 / (HEIGHT / PLANE_E + 1 / LAW.kn) * HEIGHT if material is ROCK else LAW.kn * HEIGHT
    assert ElasticModel(specimen, kn, ks, more).between_smooth_platens()[0] == pytest.approx(modulus, rel=1e-9)


# --- refusals --------------------------------------------------------------------------------------------------------


def test_what_has_no_answer_is_refused():
    specimen, disc_of_grains = column(2), gl.Specimen(Hexagonal(grain_size=8 * mm).tessellate(disc(40 * mm)), ROCK)
    apart = gl.Specimen(together(box(1, 1, name="lower"), box(1, 1, bottom=1, name="upper")), ROCK)
    other = state_of(column(2), LAW)
    for arguments, words in [
        ((disc_of_grains, LAW), "specimen is not allowed, its boundaries are"),
        ((apart, LAW), "specimen is not allowed, its boundaries are"),
        ((column(1, RIGID), LAW), "a rigid grain reaches from the top to the bottom"),
        ((specimen, LAW, "periodic"), "boundary = 'periodic' is not allowed, it must be 'kinematic' or 'static'"),
        ((specimen, LAW, "static", other), "state is not allowed, it is of another specimen"),
        ((other.specimen, Linear(**STIFF), "static", other), "state is not allowed, it is of a run with another law"),
        ((specimen, Linear(kn=np.full(3, 1e13), ks=1e13)), "stiffness has 3 entries"),
    ]:  # fmt: skip
        named = dict(zip(("specimen", "law", "boundary", "state"), arguments, strict=False))
        with pytest.raises(gl.ParameterError, match=re.escape(words)):
            gl.elastic_properties(**named)


def test_trial_displacements_are_a_little_of_those_of_a_point_and_of_the_grain_size():
    """Against less slip where a bond holds, against more where it is broken; nothing where a point softens."""
    asked = {}

    def tangent(name, sign):
        def answer(opening, slip, memory, little):
            asked[name] = little
            return sign * np.array([1.0, -2.0, 3.0, 4.0])

        return answer

    group = SimpleNamespace(
        compiled=SimpleNamespace(batch=lambda opening, slip, memory: (opening, 2 * slip)),
        tangent=tangent("normal", 1), tangent_in_slip=tangent("shear", -1),
    )  # fmt: skip
    state = SimpleNamespace(specimen=SimpleNamespace(grains=SimpleNamespace(grain_size=2e-3)))
    opening, slip = np.array([0.0, 1e-4, 0.0, 1e-4]), np.array([0.0, -1e-5, -1e-3, 1e-3])
    rows = _tangents(state, group, opening, slip, np.zeros((1, 4)), np.array([False, False, True, True]))
    assert rows.tolist() == [[1, 0, 3, 4], [0, 2, 0, 0]]
    assert asked["normal"] == pytest.approx([2e-12, 1e-10, 1e-9, 1e-9], rel=1e-9)
    assert asked["shear"] == pytest.approx([-2e-12, 1e-10, -1e-9, 1e-9], rel=1e-9)


def test_rigid_grains_without_springs_resist_no_stress():
    specimen = gl.Specimen(Bricks(rows=2, columns=2).tessellate(rectangle(1, 1)), gl.Rigid(density=3000))
    none = np.zeros((2, len(specimen.mesh.interfaces)))
    assert np.abs(ElasticModel(specimen, none, none).under_uniform_stress()).max() < 1
