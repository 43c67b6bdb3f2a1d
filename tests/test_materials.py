"""Each material of grainlaw alone against closed forms, and through the conformance kit."""

import itertools
from types import SimpleNamespace

import attrs
import numpy as np
import pytest
from every_material import CONE, CRUSHED, GRAIN, MATERIALS, MISES, MOHR, OUTER, SCHIST, compliance_along_y
from toy_materials import CUBIC

import grainlaw as gl
import grainlaw.materials
from grainlaw.materials import Cone, MohrCoulombPlastic, TransverselyIsotropic

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


def turned(tensor, angle):
    """A tensor (2, 2) by its components in axes at an angle (degrees)."""
    c, s = np.cos(np.radians(angle)), np.sin(np.radians(angle))
    turn = np.array([[c, -s], [s, c]])
    return turn.T @ tensor @ turn


@pytest.mark.parametrize("material", [SCHIST, gl.Elastic(**GRAIN)], ids=["schist", "elastic"])
@pytest.mark.parametrize("angle", [0, 30, 115])
def test_an_elastic_grain_follows_hookes_law_in_space(material, angle):
    """Its compliance along x, y and z of the foliation, inverted as a whole, with a strain across the plane."""
    if isinstance(material, TransverselyIsotropic):
        m = attrs.evolve(material, foliation_angle=angle)
        e, far, nu, nu_far, shear = 60e9, 20e9, 0.2, 0.1, 8e9
    else:
        m, e, far, nu, nu_far, shear = material, 60e9, 60e9, 0.25, 0.25, 60e9 / 2.5
    soft = np.array(
        [[1 / e, -nu_far / far, -nu / e], [-nu_far / far, 1 / far, -nu_far / far], [-nu / e, -nu_far / far, 1 / e]]
    )
    for exx, eyy, exy, ezz in np.random.default_rng(0).normal(size=(3, 4)) * 1e-3:
        strain = turned(np.array([[exx, exy], [exy, eyy]]), angle)
        sx, sy, sz = np.linalg.solve(soft, [strain[0, 0], strain[1, 1], ezz])
        sxy = 2 * shear * strain[0, 1]
        stress = turned(np.array([[sx, sxy], [sxy, sy]]), -angle)
        stored = 0.5 * (sx * strain[0, 0] + sy * strain[1, 1] + sz * ezz) + sxy * strain[0, 1]
        assert m.stress(exx, eyy, exy, ezz) == pytest.approx((stress[0, 0], stress[1, 1], stress[0, 1]))
        assert m.energy(exx, eyy, exy, ezz) == pytest.approx(stored)
        assert np.array(m.stiffness) @ [exx, eyy, 2 * exy] == pytest.approx(m.stress(exx, eyy, exy, 0.0))


@pytest.mark.parametrize("material", [SCHIST, gl.Elastic(**GRAIN)], ids=["schist", "elastic"])
def test_in_plane_stress_the_third_direction_is_free(material):
    m = attrs.evolve(material, plane=gl.Plane.STRESS)
    stress = m.stress(1e-3, 2e-3, 3e-4, 0.0)
    assert m.stress(1e-3, 2e-3, 3e-4, 5e-3) == stress
    assert np.array(m.stiffness) @ [1e-3, 2e-3, 6e-4] == pytest.approx(stress)
    stored = 0.5 * (stress[0] * 1e-3 + stress[1] * 2e-3) + stress[2] * 3e-4
    assert m.energy(1e-3, 2e-3, 3e-4, 5e-3) == pytest.approx(stored)


BULK, SHEAR = 60e9 / 1.5, 60e9 / 2.5  # of GRAIN
HOOKE = BULK - 2 * SHEAR / 3 + 2 * SHEAR * np.eye(3)  # of principal strains


def returned(trial, planes, flows, limits):
    """Principal stresses (Pa) after the return to the planes n.s <= limit with these flows: all sets of them tried."""
    for count in range(4):
        for some in map(list, itertools.combinations(range(len(planes)), count)):
            n, g = planes[some], HOOKE @ flows[some].T
            steps = np.linalg.lstsq(n @ g, n @ trial - limits[some])[0] if count else np.zeros(0)
            stress = trial - (g @ steps if count else 0.0)
            if (steps >= 0).all() and (planes @ stress <= limits + 1.0).all():
                return stress
    raise AssertionError("no set of planes holds it")


def hexagon(sine):
    """Normals (6, 3) of the planes of Mohr and Coulomb at the sine of an angle."""
    each = [np.array([1 + sine, -(1 - sine), 0])[list(order)] for order in itertools.permutations(range(3))]
    return np.array(each)


@pytest.mark.parametrize("dilation", [0.0, 10.0, 40.0])
def test_mohr_coulomb_returns_to_planes_and_edges(dilation):
    sine, limit, seen = np.sin(np.radians(40)), 60e6 * np.cos(np.radians(40)), set()
    material = attrs.evolve(MOHR, dilation_angle=dilation)
    for first, second, share in np.random.default_rng(0).uniform(size=(60, 3)):
        trial = np.array([-60e6 * first, 0, -200e6 - 800e6 * second])
        trial[1] = trial[0] + share * (trial[2] - trial[0])
        expected = returned(trial, hexagon(sine), hexagon(np.sin(np.radians(dilation))), np.full(6, limit))
        assert material.sheared(*trial, sine, limit) == pytest.approx(np.sort(expected)[::-1], rel=1e-6, abs=10)
        high, middle, low = np.sort(expected)[::-1]
        seen.add("upper" if high - middle < 10 else "lower" if middle - low < 10 else "plane")
    assert seen == {"upper", "lower", "plane"}


@pytest.mark.parametrize(
    "trial", [(9e6, 5e6, 1e6), (40e6, 2e6, -30e6), (40e6, 30e6, -30e6), (60e6, 50e6, 40e6), (40e6, 12e6, 3e6)]
)
def test_the_cut_off_returns_to_its_planes_edges_and_corner(trial):
    expected = returned(np.array(trial), np.eye(3), np.eye(3), np.full(3, 10e6))
    assert MOHR.cut_off(*trial, 10e6) == pytest.approx(expected, rel=1e-6, abs=10)


INNER = attrs.evolve(CONE, cone=Cone.INNER)


def slopes(material, angle):
    """Of sqrt(J2) over the mean stress and over the cohesion: the cones of Drucker and Prager for that of Coulomb."""
    s, c = np.sin(angle), np.cos(angle)
    factor = {
        Cone.PLANE_STRAIN: 3 / np.sqrt(9 * c**2 + 12 * s**2), Cone.OUTER: 6 / np.sqrt(3) / (3 - s),
        Cone.INNER: 6 / np.sqrt(3) / (3 + s),
    }[material.cone]  # fmt: skip
    return factor * s, factor * c


@pytest.mark.parametrize("material", [MOHR, CRUSHED, CONE, OUTER, INNER, MISES])
def test_stress_is_that_of_the_elastic_strain_and_within_the_strength(material):
    """Half softened where it softens: plastic strain is that of Vermeer and de Borst (1984)."""
    random, yielded = np.random.default_rng(0), 0
    angle = np.radians(40 if material is not MISES else 0)
    plane = [[HOOKE[0, 0], HOOKE[0, 1], 0], [HOOKE[1, 0], HOOKE[1, 1], 0], [0, 0, SHEAR]]
    assert np.array(material.stiffness) == pytest.approx(np.array(plane))
    for exx, eyy, exy, ezz in random.normal(size=(40, 4)) * np.geomspace(3e-5, 5e-3, 40)[:, None]:
        before = random.normal(size=4) * 2e-5
        sxx, syy, sxy, *after, plastic = material.stress(exx, eyy, exy, ezz, *before, 5e-3)
        elastic = np.array([exx, eyy, ezz, exy]) - after
        szz = HOOKE[2] @ elastic[:3]
        assert (sxx, syy) == pytest.approx(HOOKE[:2] @ elastic[:3], rel=1e-9, abs=1e-3)
        assert sxy == pytest.approx(2 * SHEAR * elastic[3], rel=1e-9, abs=1e-3)
        stored = 0.5 * (sxx * elastic[0] + syy * elastic[1] + szz * elastic[2]) + sxy * elastic[3]
        assert material.energy(exx, eyy, exy, ezz, *after, plastic) == pytest.approx(stored)
        new = after - before
        equivalent = np.sqrt(2 / 3 * (new[:3] @ new[:3] + 2 * new[3] ** 2))
        assert plastic - 5e-3 == pytest.approx(equivalent, abs=1e-12)
        principal = np.sort(np.append(np.linalg.eigvalsh([[sxx, sxy], [sxy, syy]]), szz))
        mean, deviator = principal.mean(), np.sqrt(np.sum((principal - principal.mean()) ** 2) / 2)
        yielded += (strained := np.abs(new).max() > 1e-12)
        if isinstance(material, MohrCoulombPlastic):
            soft = 0.5 if material is CRUSHED else 0.0
            sine = np.sin(angle) + soft * (0.5 - np.sin(angle))
            held = 60e6 * np.cos(angle) + soft * (10e6 * np.cos(np.pi / 6) - 60e6 * np.cos(angle))
            over = max((hexagon(sine) @ principal).max() - held, principal[2] - 10e6 * (1 - soft))
        else:
            cone, slope = slopes(material, angle), slopes(material, np.radians(material.dilation_angle))
            over = deviator + cone[0] * mean - cone[1] * 30e6
            swollen, sheared = new[:3].sum(), np.sqrt(equivalent**2 * 3 / 2 - new[:3].sum() ** 2 / 3)
            at_tip = cone[0] > 0 and mean == pytest.approx(cone[1] / cone[0] * 30e6)
            assert at_tip or swollen == pytest.approx(slope[0] * np.sqrt(2) * sheared, abs=1e-9)
        assert over < 1e3
        assert over == pytest.approx(0, abs=1e3) or not strained
    assert 5 < yielded < 40


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


@pytest.mark.parametrize("newton", [True, False])
def test_a_crystal_compressed_follows_hookes_law_and_stores_all_work(newton, monkeypatch):
    """Its confinement, too; and where Newton's method leads nowhere, the elastic stiffness leads there."""
    if not newton:
        monkeypatch.setattr("scipy.optimize.root", lambda apart, values, tol: SimpleNamespace(x=values))
    c11, c12, pressure = CUBIC.c11, CUBIC.c12, 20e6
    found = gl.compress(CUBIC, STRAIN, confinement=pressure)
    confined = -pressure / (c11 + c12)
    yy = confined - STRAIN
    xx = (-pressure - c12 * yy) / c11
    assert found.strain == pytest.approx(np.column_stack([xx, yy, 0 * xx]), abs=1e-10)
    stress = np.column_stack([0 * xx - pressure, c12 * xx + c11 * yy, 0 * xx])
    assert found.stress == pytest.approx(stress, rel=1e-5, abs=100)
    stored = 0.5 * (stress * found.strain).sum(axis=1)
    assert stored[0] == pytest.approx(pressure**2 / (c11 + c12))
    assert found.stored == pytest.approx(stored, rel=1e-5)
    assert found.work == pytest.approx(stored, rel=1e-5)


def test_a_trace_of_a_material_has_the_names_of_its_memory_and_no_other():
    found = gl.trace_material(MOHR, 1e-3, 0.0, 0.0)
    assert found.plastic_strain is found.memory["plastic_strain"]
    with pytest.raises(AttributeError, match=r"a trace has strain, stress, work, stored and .*plastic_strain.*damage"):
        found.damage  # noqa: B018


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
