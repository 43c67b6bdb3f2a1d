"""Each material of grainlaw alone against closed forms, and through the conformance kit."""

import attrs
import numpy as np
import pytest
from every_material import CONE, CRUSHED, GRAIN, MATERIALS, MISES, MOHR, OUTER, SCHIST, compliance_along_y

import grainlaw as gl
import grainlaw.materials
from grainlaw.materials import MohrCoulombPlastic, TransverselyIsotropic

STRAIN = np.linspace(0, 2e-2, 401)


def passive(angle):
    """Ratio of the larger to the smaller principal stress of Coulomb's criterion without cohesion."""
    return np.tan(np.radians(45 + angle / 2)) ** 2


def test_the_list_has_every_exported_material():
    kinds = {type(material) for material in MATERIALS.values()}
    exported = {getattr(grainlaw.materials, name) for name in grainlaw.materials.__all__}
    assert {kind for kind in exported if isinstance(kind, type) and issubclass(kind, gl.Material)} | {
        gl.Elastic
    } <= kinds


@pytest.mark.thorough
@pytest.mark.parametrize("name", MATERIALS)
def test_every_material_conforms(name):
    report = gl.check_material(MATERIALS[name])
    assert report.passed, report


@pytest.mark.parametrize("angle", [0, 30, 45, 60, 90, 135])
def test_a_schist_is_as_soft_as_its_turned_compliance(angle):
    found = gl.compress(attrs.evolve(SCHIST, foliation_angle=angle), 1e-4)
    assert -found.stress[0, 1] / 1e-4 == pytest.approx(1 / compliance_along_y(SCHIST, angle), rel=1e-6)
    assert np.abs(found.stress[0, [0, 2]]).max() < 1.0


def test_an_isotropic_schist_is_elastic():
    shear = GRAIN["youngs_modulus"] / 2.5
    for plane in gl.Plane:
        alike = TransverselyIsotropic(
            **GRAIN, youngs_modulus_across=60e9, poissons_ratio_across=0.25, shear_modulus_across=shear,
            foliation_angle=25, plane=plane,
        )  # fmt: skip
        assert np.allclose(alike.stiffness, gl.Elastic(**GRAIN, plane=plane).stiffness, rtol=1e-12, atol=1e-3)


@pytest.mark.parametrize("pressure", [0.0, 10e6, 40e6])
def test_mohr_coulomb_compressed_follows_the_closed_form(pressure):
    """Elastic with E/(1 - nu^2), then level; plastic strains in the ratio of the dilation angle."""
    found = gl.compress(MOHR, STRAIN, confinement=pressure)
    strength = pressure * passive(40) + 60e6 * np.sqrt(passive(40))
    elastic = pressure + 60e9 / (1 - 0.25**2) * STRAIN
    assert -found.stress[:, 1] == pytest.approx(np.minimum(elastic, strength), rel=1e-5)
    assert found.stress[:, 0] == pytest.approx(-pressure, abs=100)
    up, down = 1 + np.sin(np.radians(10)), 1 - np.sin(np.radians(10))
    assert found.pxx[-1] / found.pyy[-1] == pytest.approx(-up / down, rel=1e-5)
    assert found.pzz[-1] == pytest.approx(0, abs=1e-9)


def test_mohr_coulomb_softens_to_its_residual_strength():
    found = gl.compress(CRUSHED, np.linspace(0, 2e-2, 801), confinement=10e6)
    peak = 10e6 * passive(40) + 60e6 * np.sqrt(passive(40))
    last = 10e6 * passive(30) + 10e6 * np.sqrt(passive(30))
    assert -found.stress[:, 1].min() == pytest.approx(peak, rel=2e-3)  # the strain at the start of a step counts
    after = found.plastic_strain > 1e-2
    assert -found.stress[after, 1][1:] == pytest.approx(last, rel=1e-5)
    equivalent = np.sqrt(2 / 3 * (found.pxx**2 + found.pyy**2 + found.pzz**2 + 2 * found.pxy**2))
    assert found.plastic_strain[-1] == pytest.approx(equivalent[-1], rel=1e-6)  # a path of one direction


@pytest.mark.parametrize("material", [MOHR, CRUSHED], ids=["level", "softening"])
def test_mohr_coulomb_pulled_stops_at_the_tensile_strength(material):
    found = gl.compress(material, -np.linspace(0, 1e-3, 101))
    assert found.stress[:, 1].max() == pytest.approx(10e6, rel=1e-3 if material is MOHR else 0.03)
    assert found.stress[5, 1] == pytest.approx(60e9 / (1 - 0.25**2) * 5e-5, rel=1e-6)
    swollen = gl.trace_material(material, np.linspace(0, 0.1, 3), np.linspace(0, 0.1, 3), 0.0)
    expected = 10e6 if material is MOHR else 0.0
    assert swollen.stress[-1] == pytest.approx([expected, expected, 0], abs=1)


def test_mohr_coulomb_in_an_oedometer_is_on_an_edge():
    """Both stresses across are equal, so two planes are active: solved here for their common flow."""
    material = attrs.evolve(MOHR, friction_angle=10, dilation_angle=5)  # 40 degrees would not yield so
    size, (up, down) = 5e-3, (1 + np.sin(np.radians(5)), 1 - np.sin(np.radians(5)))
    bulk, shear = 60e9 / 1.5, 60e9 / 2.5
    stiffness = bulk - 2 * shear / 3 + 2 * shear * np.eye(3)
    start, flow = stiffness @ [-size, 0, 0], stiffness @ [-2 * down, up, up]
    normal = np.array([-(1 - np.sin(np.radians(10))), 1 + np.sin(np.radians(10)), 0])  # of the plane of x and y
    steps = (normal @ start - 60e6 * np.cos(np.radians(10))) / (normal @ flow)
    found = gl.trace_material(material, np.linspace(0, -size, 200), 0.0, 0.0)
    assert steps > 0
    assert found.stress[-1, :2] == pytest.approx((start - steps * flow)[:2], rel=1e-6)
    once = gl.trace_material(material, -size, 0.0, 0.0)  # in one step
    assert once.stress[-1] == pytest.approx(found.stress[-1], rel=1e-6, abs=1)


def test_mohr_coulomb_does_not_care_for_the_axes():
    """The same strain turned gives the turned stress, in yield by shear and by tension."""
    angle = np.radians(25)
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    for strain in (np.diag([-4e-3, 1e-3]), np.diag([3e-3, -1e-3]), np.diag([2e-3, 1e-3])):
        t = turn @ strain @ turn.T
        here = gl.trace_material(CRUSHED, strain[0, 0], strain[1, 1], 0.0).stress[0]
        there = gl.trace_material(CRUSHED, t[0, 0], t[1, 1], t[0, 1]).stress[0]
        expected = turn @ np.diag(here[:2]) @ turn.T
        assert there == pytest.approx([expected[0, 0], expected[1, 1], expected[0, 1]], rel=1e-9, abs=1e-3)


@pytest.mark.parametrize("pressure", [0.0, 20e6])
def test_the_cone_of_plane_strain_has_coulombs_strength(pressure):
    """Drucker and Prager (1952): with dilation by the friction angle, once elastic strains no longer change."""
    material = attrs.evolve(CONE, dilation_angle=40)
    found = gl.compress(material, np.linspace(0, 5e-2, 501), confinement=pressure)
    strength = pressure * passive(40) + 60e6 * np.sqrt(passive(40))
    assert -found.stress[-1, 1] == pytest.approx(strength, rel=1e-4)


def test_the_cone_without_friction_yields_at_twice_the_cohesion():
    found = gl.compress(MISES, np.linspace(0, 5e-2, 501))
    assert -found.stress[-1, 1] == pytest.approx(60e6, rel=1e-4)


@pytest.mark.parametrize("material", [CONE, OUTER], ids=["plane strain", "outer"])
def test_the_tip_of_the_cone_is_that_of_coulomb(material):
    found = gl.trace_material(material, np.linspace(0, 0.1, 3), np.linspace(0, 0.1, 3), 0.0)
    assert found.stress[-1] == pytest.approx([30e6 / np.tan(np.radians(40))] * 2 + [0], rel=1e-9, abs=1)


@pytest.mark.parametrize("material", [CONE, OUTER, MOHR, CRUSHED], ids=["cone", "outer", "mohr", "crushed"])
def test_unloading_is_elastic_and_the_work_is_stored_or_dissipated(material):
    strain = np.concatenate([np.linspace(0, 2e-2, 801), np.linspace(2e-2, 1.99e-2, 11)])
    found = gl.compress(material, strain, confinement=5e6)
    slope = np.diff(found.stress[801:, 1]) / np.diff(found.strain[801:, 1])
    assert slope == pytest.approx(60e9 / (1 - 0.25**2), rel=1e-5)
    lost = found.work - found.stored
    assert np.diff(lost).min() > -1e-6 * lost[-1]
    assert lost[-1] > 0.01 * found.work[-1]


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: attrs.evolve(SCHIST, poissons_ratio_across=0.5), "poissons_ratio_across = 0.5 .* = 0.365148"),
        (lambda: attrs.evolve(SCHIST, poissons_ratio_across=[0.1, -0.4]), "poissons_ratio_across = -0.4 is not"),
        (lambda: attrs.evolve(CONE, dilation_angle=41), "dilation_angle = 41 is above friction_angle = 40"),
        (lambda: attrs.evolve(MOHR, tensile_strength=40e6), "tensile_strength = 4e.07 Pa lies beyond the apex"),
        (lambda: attrs.evolve(CRUSHED, residual_cohesion=31e6), "residual_cohesion = 3.1e.07 is above cohesion"),
        (lambda: attrs.evolve(CRUSHED, dilation_angle=35), "dilation_angle = 35 is above residual_friction_angle"),
        (lambda: attrs.evolve(CRUSHED, softening_strain=0), "softening_strain = 0 is not allowed"),
        (lambda: gl.compress(MOHR, 1e-3, confinement=-20e6), "compress: MohrCoulombPlastic cannot keep the stress"),
        (lambda: gl.check_material(gl.Rigid(density=1000)), "material = Rigid.* must be a Material"),
        (lambda: gl.check_material(attrs.evolve(SCHIST, foliation_angle=[1, 2])), "give the material of one grain"),
        (lambda: gl.trace_material(MOHR, [0, np.nan], 0, 0), "trace_material: strain = "),
    ],
)  # fmt: skip
def test_what_makes_no_material_is_refused(make, message):
    with pytest.raises(gl.ParameterError, match=message):
        make()


def test_fields_of_parameters_are_checked_entry_by_entry():
    fields = {"cohesion": np.array([30e6, 20e6]), "tensile_strength": 5e6}
    assert MohrCoulombPlastic(**GRAIN | fields, friction_angle=40).cohesion[1] == 20e6
