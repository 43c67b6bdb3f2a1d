"""What the emulator that comes with grainlaw says of a rock: its polynomials, its inputs, what it does not know."""

import math

import attrs
import numpy as np
import pytest
from support import small_sample

import grainlaw as gl
from grainlaw.calibration import calibrate as calibration
from grainlaw.calibration import first_look as module
from grainlaw.calibration.first_look import (
    FILES,
    FirstMatch,
    Fit,
    ShippedEmulator,
    features,
    looked_at,
    places,
    shipped,
    terms,
)
from grainlaw.calibration.moduli import expected_stiffness
from grainlaw.calibration.space import space_of
from grainlaw.calibration.stiffness_search import Stiffness
from grainlaw.calibration.targets import Target
from grainlaw.geometry import Breakable, Voronoi, VoronoiCells, disc, rectangle
from grainlaw.laws import CohesiveCrack, ExponentialSoftening, MohrCoulomb, XuNeedleman
from grainlaw.units import GPa, MPa, mm

ROCK = gl.Elastic(youngs_modulus=60 * GPa, poissons_ratio=0.25, density=2700)
LAW = MohrCoulomb(kn=1e14, ks=4e13, tensile_strength=10 * MPa, cohesion=30 * MPa, friction_angle=40,
                  residual_friction_angle=5)  # fmt: skip
CRACK = CohesiveCrack(kn=1e14, ks=4e13, tensile_strength=10 * MPa, cohesion=30 * MPa, friction_angle=40,
                      residual_friction_angle=5, mode_i_energy=50, mode_ii_energy=100)  # fmt: skip
OTHER = XuNeedleman(kn=1e14, ks=4e13, tensile_strength=10 * MPa, cohesion=30 * MPa, residual_friction_angle=5)
FREE = {"tensile_strength": (4 * MPa, 20 * MPa), "cohesion": (15 * MPa, 60 * MPa), "friction_angle": (25, 55)}


def specimen(seed=1, grains=100):
    return gl.Specimen(Voronoi(grains=grains, seed=seed).tessellate(rectangle(20 * mm, 50 * mm)), ROCK)


def linear(inputs, **by):
    """A fit to ``inputs`` whose only terms are a constant and those of first degree, per unit of place."""
    powers = terms(len(inputs))
    coefficients = np.zeros(len(powers))
    coefficients[0] = by.pop("constant")
    for one, value in by.items():
        row = np.flatnonzero((powers.sum(axis=1) == 1) & (powers[:, inputs.index(one)] == 1))
        coefficients[row] = value
    return Fit(inputs, coefficients, error=0.0, scatter=0.0)


CONTACTS = ("tension", "angle", "residual", "stiffness", "ratio", "strain", "width", "slenderness", "pressure")
ENDS = {"tension": (-3, 1), "angle": (0, 80), "residual": (0, 1), "stiffness": (-2, 4), "ratio": (-3, 1),
        "strain": (-10, -5), "width": (1, 3), "slenderness": (2, 3), "pressure": (-5, 1)}  # fmt: skip


def coulomb(error=0.0):
    """Rocks whose strength grows with the angle; by confinement with a power of 8 at 40 degrees."""
    fits = {
        "ucs": linear(CONTACTS[:2], constant=1.5, angle=0.4),
        "tension": linear(CONTACTS[:2], constant=-0.3),
        "brazilian": linear(("width",), constant=0.1, width=0.2),
        "steepness": linear(("angle", "pressure"), constant=8.0, angle=2.0),
        "modulus": linear(("angle", "ratio"), constant=-0.1, angle=-0.2),
        "poisson": linear(("angle", "ratio"), constant=0.01, angle=0.04),
    }
    return ShippedEmulator(ENDS, {name: attrs.evolve(fit, error=error) for name, fit in fits.items()})


def match(targets, *, error=0.0, specimens=None, **given):
    space = space_of(attrs.evolve(LAW, **given), FREE, {}, {})
    made = gl.Targets(**targets)
    shapes = specimens or {"prism": specimen()}
    return FirstMatch(space, made.tested, made.pressures, shapes, 1.0, coulomb(error))


# --- polynomials ------------------------------------------------------------------------------------------------------


def test_features_are_products_of_legendre_polynomials_up_to_the_third_degree():
    x, y = 0.3, -0.7
    first, second, third = (lambda t: t), (lambda t: (3 * t**2 - 1) / 2), (lambda t: (5 * t**3 - 3 * t) / 2)
    expected = [
        1, x, y, second(x), x * y, second(y), third(x), second(x) * y, first(x) * second(y), third(y),
    ]  # fmt: skip
    assert features(np.array([[x, y]]))[0] == pytest.approx(expected)
    assert terms(2).sum(axis=1).tolist() == [0, 1, 1, 2, 2, 2, 3, 3, 3, 3]


def test_places_are_from_minus_one_to_one_over_the_range():
    found = places(
        {"a": np.array([2.0, 3.0, 6.0]), "b": np.array([0.0, 1.0, 2.0])}, ("b", "a"), {"a": (2, 6), "b": (0, 4)}
    )
    assert found.tolist() == [[-1, -1], [-0.5, -0.5], [0, 1]]


# --- what it is asked -------------------------------------------------------------------------------------------------


def test_inputs_are_ratios_of_the_law_and_of_the_specimen():
    """100 grains in 20 mm x 50 mm: a grain has 1e-5 m2."""
    made = match({"ucs": 100 * MPa}, friction_angle=40)
    inputs, law = made.inputs(np.array([[10 * MPa, 30 * MPa, 45.0]]))
    grain = math.sqrt(1e-5)
    assert {name: float(value[0]) for name, value in inputs.items()} == pytest.approx({
        "tension": math.log(1 / 3), "angle": 45.0, "residual": math.tan(math.radians(5)), "ratio": math.log(0.4),
        "stiffness": math.log(1e14 * grain / 60e9), "strain": math.log(30e6 / 60e9),
    })  # fmt: skip
    assert law["cohesion"] == [30 * MPa]
    soft = match({"ucs": 100 * MPa}, kn=1e10, ks=1e11).inputs(np.array([[10 * MPa, 30 * MPa, 45.0]]))[0]
    assert (soft["stiffness"], soft["ratio"]) == (ENDS["stiffness"][0], ENDS["ratio"][1])
    stiffer = attrs.evolve(made, grains=2.0).inputs(np.array([[10 * MPa, 30 * MPa, 45.0]]))[0]
    assert stiffer["strain"] == pytest.approx(math.log(15e6 / 60e9))


def test_cracks_have_the_length_of_their_energy_in_grains_and_the_ratio_of_their_energies():
    """50 J/m2 times 60 GPa over (10 MPa)^2 is 30 mm; G_II is twice G_I."""
    space = space_of(CRACK, {**FREE, "mode_i_energy": (5, 500)}, {"mode_ii_energy": ("mode_i_energy", 2)}, {})
    ends = {**ENDS, "length": (-2, 3), "energies": (0, 2)}
    made = FirstMatch(space, {}, (), {"prism": specimen()}, 1.0, ShippedEmulator(ends, coulomb().fits))
    point = np.array([[10 * MPa, 30 * MPa, 45.0, 50.0]])
    inputs, _ = made.inputs(point)
    assert float(inputs["length"][0]) == pytest.approx(math.log(0.03 / math.sqrt(1e-5)))
    assert float(inputs["energies"][0]) == pytest.approx(math.log(2))
    assert made.known(point).tolist() == [True]
    tough = np.array([[10 * MPa, 30 * MPa, 45.0, 500.0]])
    assert float(made.inputs(tough)[0]["length"][0]) == 3  # beyond: as at the end
    assert "the mode I energy times E over tensile strength squared and grain size is 94.9, it" in made.beyond(tough[0])


def test_what_lies_beyond_the_emulator_is_told():
    point = np.array([10 * MPa, 30 * MPa, 45.0])
    assert match({"ucs": 100 * MPa}).beyond(point) == ""
    assert match({"ucs": 100 * MPa}, kn=1e10, ks=1e11).beyond(point) == (
        "The emulator answers as at the end of what it knows: kn times grain size over E is 0.000527, it knows 0.135 "
        "to 54.6 and ks over kn is 10, it knows 0.0498 to 2.72."
    )


def test_tied_parameters_follow():
    space = space_of(LAW, {"cohesion": (15 * MPa, 60 * MPa)}, {"tensile_strength": ("cohesion", 0.25)}, {})
    made = FirstMatch(space, {}, (), {"prism": specimen()}, 1.0, coulomb())
    assert made.inputs(np.array([[20 * MPa]]))[0]["tension"] == pytest.approx(math.log(0.25))


def test_targets_follow_from_what_is_emulated():
    """UCS is the cohesion times exp(1.5 + 0.4 place); under p it is (1 + p/UCS)^8.25 times as much; lines by hand."""
    ucs, under = 30 * MPa * math.exp(1.5 + 0.4 * (45 / 40 - 1)), 5 * MPa
    peak = ucs * (1 + under / ucs) ** 8.25
    steep = (peak - ucs) / under
    sine = (steep - 1) / (steep + 1)
    wide = np.clip(math.log(16e-3 / math.sqrt(math.pi * 8e-3**2 / 60)), 1, 3)
    round_one = gl.Specimen(Voronoi(grains=60, seed=1).tessellate(disc(16 * mm)), ROCK)
    made = match(
        {"ucs": 1e8, "cohesion": 1e7, "friction_angle": 50, "tensile_strength": 5e6, "brazilian_strength": 8e6,
         "triaxial": {20 * MPa: 200 * MPa}, "confinements": [under]},
        specimens={"prism": specimen(), "disc": round_one},
    )  # fmt: skip
    means, covariances = made.predicted(np.array([[10 * MPa, 30 * MPa, 45.0]]))
    expected = {
        "ucs": math.log(ucs), "cohesion": math.log(ucs * (1 - sine) / (2 * math.sqrt(1 - sine**2))),
        "friction_angle": math.degrees(math.asin(sine)), "tensile_strength": math.log(10 * MPa) - 0.3,
        "brazilian_strength": math.log(10 * MPa) + 0.1 + 0.2 * (wide - 2),
        "strength at 20 MPa": math.log(ucs) + 8.25 * math.log(1 + 20 * MPa / ucs),
    }  # fmt: skip
    assert dict(zip(made.targets, means[0], strict=True)) == pytest.approx(expected, rel=1e-3)
    assert covariances == pytest.approx(np.zeros((1, 6, 6)))
    other = made.logs(made.quantities(np.array([[10 * MPa, 30 * MPa, 45.0]])), {"steepness": 0.25})
    assert other[0, -1] == pytest.approx(math.log(ucs) + 8.5 * math.log(1 + 20 * MPa / ucs))


def test_its_errors_go_into_what_is_likely():
    """Strengths that rest on the same quantity err together; the likelihood is that of a normal distribution."""
    given = {"ucs": (120 * MPa, 3 * MPa), "triaxial": {5 * MPa: (160 * MPa, 4 * MPa)}}
    made = match(given, error=0.05)
    point = np.array([[10 * MPa, 30 * MPa, 40.0]])
    ucs = math.log(30 * MPa) + 1.5
    share = math.log1p(5 * MPa / math.exp(ucs))
    slope = 1 - 8 * 5 * MPa / (math.exp(ucs) + 5 * MPa)  # of the strength under confinement by that without
    covariance = 0.05**2 * np.array([[1, slope], [slope, slope**2 + share**2]])
    covariance += np.diag([(3 / 120) ** 2, (4 / 160) ** 2])
    off = np.array([ucs - math.log(120 * MPa), ucs + 8 * share - math.log(160 * MPa)])
    expected = -0.5 * (off @ np.linalg.solve(covariance, off) + math.log(np.linalg.det(covariance)))
    assert made.log_likelihood(point) == pytest.approx(expected, rel=1e-3)
    assert made.implausibility(point)[0] == pytest.approx(np.abs(off) / np.sqrt(np.diag(covariance)), rel=1e-3)


def test_rocks_beyond_its_ranges_are_not_likely():
    points = np.array([[10 * MPa, 30 * MPa, 40.0], [1 * MPa, 30 * MPa, 40.0]])
    assert np.isfinite(match({"ucs": 120 * MPa}).log_likelihood(points)).tolist() == [True, False]


def test_what_no_target_depends_on_excludes_no_rock():
    """By similarity the strain at which contacts fail matters under confinement alone."""
    soft = np.array([[2 * MPa, 6 * MPa, 40.0]])  # a ten thousandth of the modulus, half of the least it was taught
    of = {"ucs": 25 * MPa, "tensile_strength": 1.5 * MPa, "brazilian_strength": 1.5 * MPa}
    free, confined = (
        attrs.evolve(match(targets), emulator=shipped(MohrCoulomb)) for targets in (of, of | {"friction_angle": 45})
    )
    assert free.known(soft).tolist() == [True]
    assert confined.known(soft).tolist() == [False]


# --- moduli -----------------------------------------------------------------------------------------------------------


def test_a_test_is_as_soft_as_cracks_make_it():
    """At 60 degrees by exp(-0.2), and wider by 0.03; cracks make nothing stiffer, as the polynomial has it at 10."""
    made = match({"ucs": 1e8})
    found = made.moduli(np.array([10 * MPa, 30 * MPa, 60.0]), 50 * GPa, 0.2)
    assert found == pytest.approx({"youngs_modulus": 50 * GPa * math.exp(-0.2), "poissons_ratio": 0.23})
    found = made.moduli(np.array([10 * MPa, 30 * MPa, 10.0]), 50 * GPa, 0.2)
    assert found == {"youngs_modulus": 50 * GPa, "poissons_ratio": 0.2}
    unsure = match({"ucs": 1e8}, error=0.02).moduli(np.array([10 * MPa, 30 * MPa, 60.0]), 50 * GPa, 0.2)
    softer, wider = 0.2 / (1 + 0.1**2), 0.03 / (1 + (2 / 3) ** 2)  # nearer to 0, the nearer to the error
    assert unsure == pytest.approx({"youngs_modulus": 50 * GPa * math.exp(-softer), "poissons_ratio": 0.2 + wider})


def test_a_modulus_is_met_where_the_emulator_is_as_unsure_as_far_off(monkeypatch):
    """Contacts 3 % stiffer crack less by 0.9 %, across twice the error; what is below it once counted as nothing."""
    emulator = coulomb(0.01)
    softening = attrs.evolve(linear(("stiffness",), constant=-0.19, stiffness=0.9), error=0.01)
    emulator = attrs.evolve(emulator, fits={**emulator.fits, "modulus": softening})
    monkeypatch.setattr(module, "shipped", lambda law: emulator)
    targets = gl.Targets(ucs=100 * MPa, youngs_modulus=45 * GPa)
    space = space_of(LAW, {"friction_angle": (30, 70)}, {}, {})

    def statics(aims):
        kn = 2e3 * aims["youngs_modulus"]
        return Stiffness(
            parameters={"kn": kn, "ks": kn / 2}, grains=1.0, modulus=aims["youngs_modulus"], poisson=0.2, solutions=1
        )

    found = expected_stiffness(space, targets, {"prism": specimen()}, statics, 0)
    assert found.tested["youngs_modulus"] == pytest.approx(45 * GPa, rel=0.01)


def test_statics_aim_beside_the_targets_by_as_much_as_the_test_is_expected_to_differ(monkeypatch):
    """A UCS that takes 60 degrees, where the test is exp(-0.2) times as stiff, and wider by 0.03."""
    monkeypatch.setattr(module, "shipped", lambda law: coulomb())
    ucs = 30 * MPa * math.exp(1.5 + 0.4 * (60 / 40 - 1))
    space = space_of(LAW, {"friction_angle": (30, 70)}, {}, {})
    targets = gl.Targets(ucs=(ucs, 0.001 * ucs), youngs_modulus=40 * GPa, poissons_ratio=0.25)

    def statics(aims):
        parameters = {"kn": 2e3 * aims["youngs_modulus"], "ks": 1e3 * aims["youngs_modulus"]}
        young, nu = aims.values()
        return Stiffness(parameters=parameters, grains=1.0, modulus=young, poisson=nu, solutions=1)

    found = expected_stiffness(space, targets, {"prism": specimen()}, statics, 0)
    assert found.modulus == pytest.approx(40 * GPa * math.exp(0.2), rel=0.02)
    assert found.poisson == pytest.approx(0.22, rel=0.02)
    assert found.tested == pytest.approx({"youngs_modulus": 40 * GPa, "poissons_ratio": 0.25}, rel=0.01)
    unknown = space_of(OTHER, {"tensile_strength": (5 * MPa, 10 * MPa)}, {}, {})
    assert expected_stiffness(unknown, targets, {"prism": specimen()}, statics, 0).modulus == 40 * GPa
    beyond = space_of(attrs.evolve(LAW, tensile_strength=1 * MPa), {"friction_angle": (30, 70)}, {}, {})
    assert expected_stiffness(beyond, targets, {"prism": specimen()}, statics, 0).modulus == 40 * GPa


# --- the answer -------------------------------------------------------------------------------------------------------


@pytest.mark.thorough
def test_a_rock_is_found_by_its_strengths():
    """Those of the emulator itself, whose inverse is one point."""
    truth = np.array([[8 * MPa, 25 * MPa, 50.0]])
    asked = match({"ucs": 1e8, "tensile_strength": 5e6, "triaxial": {5 * MPa: 2e8}}, error=0.01)
    means = np.exp(asked.predicted(truth)[0][0])
    targets = gl.Targets(
        ucs=(means[0], 0.01 * means[0]), tensile_strength=(means[1], 0.01 * means[1]),
        triaxial={5 * MPa: (means[2], 0.01 * means[2])},
    )  # fmt: skip
    found = looked_at(asked.space, targets, asked.specimens, None, 0, asked.emulator)
    assert list(found.best.values()) == pytest.approx(truth[0].tolist(), rel=0.02)
    assert all(
        low < value < high for value, (low, high) in zip(truth[0], found.summary["intervals"].values(), strict=True)
    )
    value, low, high = found.expected["tensile_strength"]
    assert value == pytest.approx(means[1], rel=0.02)
    assert (low, high) == pytest.approx((value * math.exp(-0.0196), value * math.exp(0.0196)), rel=1e-3)
    begin = found.beginning(50, seed=1)
    assert len(begin) == 50
    assert begin[0] == pytest.approx(list(found.best.values()))
    spread = begin.std(axis=0) / found.posterior.points.std(axis=0)
    assert ((spread > 1.4) & (spread < 2.6)).all()
    assert "first look, by no test" in str(found)
    assert "tensile strength (MPa)" in str(found)


def test_a_line_needs_a_confinement():
    with pytest.raises(gl.ParameterError, match="first_look: cohesion or friction_angle needs confinements"):
        gl.first_look(gl.Targets(cohesion=30 * MPa, tensile_strength=7 * MPa), LAW, FREE, specimen)


@pytest.mark.thorough
def test_what_no_parameters_can_give_is_said():
    asked = match({"ucs": 2000 * MPa}, error=0.01)
    found = looked_at(asked.space, gl.Targets(ucs=2000 * MPa), asked.specimens, None, 0, asked.emulator)
    assert found.posterior is None
    assert found.best == found.expected == {}
    values = asked.predicted(found.nearest[None])[0][0]
    words = f"deviations off: UCS is {math.exp(values[0]) / 1e6:.2f} MPa and not 2000.00 MPa where tensile_strength = "
    assert words in str(found)
    assert str(found).endswith("a wider one may meet more.")
    assert found.least > 3


CELLS = Breakable(Voronoi(grains=20, seed=1), VoronoiCells(count=4))


@pytest.mark.parametrize(
    ("law", "rock", "targets", "words"),
    [
        (OTHER, None, {}, "it knows MohrCoulomb and CohesiveCrack, not XuNeedleman"),
        (attrs.evolve(CRACK, softening=ExponentialSoftening()), None, {}, "the default softening of CohesiveCrack"),
        (attrs.evolve(LAW, residual_cohesion=1 * MPa), None, {}, "broken contacts without cohesion"),
        (LAW, gl.Specimen(CELLS.tessellate(rectangle(0.02, 0.05)), ROCK), {}, "whole grains, bonded everywhere"),
        (LAW, gl.Specimen(small_sample(20).grains, gl.Rigid(density=2700)), {}, "elastic grains of one material"),
        (LAW, None, {"fracture_toughness": 1e6}, "none of the targets fracture_toughness"),
    ],
)
def test_what_it_does_not_know_is_said(law, rock, targets, words):
    space = space_of(law, {"cohesion": (20 * MPa, 40 * MPa)}, {}, {})
    found = looked_at(space, gl.Targets(**(targets or {"ucs": 1e8})), {"prism": rock or specimen()}, None, 0)
    assert words in found


@pytest.mark.parametrize("law", FILES)
def test_the_emulator_of_the_package_is_whole(law):
    emulator = shipped(law)
    assert set(emulator.fits) == {"ucs", "tension", "brazilian", "steepness", "modulus", "poisson"}
    for fit in emulator.fits.values():
        assert len(fit.coefficients) == len(terms(len(fit.inputs)))
        assert set(fit.inputs) <= set(emulator.ends)
        assert 0 < fit.error < fit.scatter


@pytest.mark.thorough
@pytest.mark.filterwarnings("ignore:.*is the unit right")
def test_broken_contacts_without_friction_are_those_of_the_least_that_it_was_taught():
    """That is 0.0002 of the peak's; their own default is none."""
    targets, fits = gl.Targets(ucs=90 * MPa, tensile_strength=6 * MPa), {}
    for angle in (0.0, 0.05):
        law = attrs.evolve(LAW, residual_friction_angle=angle)
        fits[angle] = looked_at(space_of(law, FREE, {}, {}), targets, {"prism": specimen()}, None, 0)
    ends = [fit.expected["ucs"] for fit in fits.values()]
    assert ends[0] == pytest.approx(ends[1], rel=1e-2)


@pytest.mark.thorough
def test_a_first_look_finds_what_a_rock_bears():
    """The rock of LAW: strengths of six specimens, each other than those the emulator has learnt from."""
    from grainlaw.protocols import UniaxialCompression, UniaxialTension

    measured = {}
    for name, test in (("ucs", UniaxialCompression), ("tensile_strength", UniaxialTension)):
        runs = [gl.simulate(specimen(seed), LAW, test(until=gl.Until.FAILURE)) for seed in range(6)]
        strengths = np.array([run.summary["strength"] for run in runs])
        measured[name] = Target(float(strengths.mean()), float(strengths.std(ddof=1) / math.sqrt(6)))
    found = gl.first_look(gl.Targets(**measured), LAW, FREE, specimen)
    low, high = found.summary["intervals"]["tensile_strength"]
    assert low < LAW.tensile_strength < high
    assert found.expected["ucs"][0] == pytest.approx(measured["ucs"].value, rel=0.05)


@pytest.mark.thorough
def test_a_first_look_gives_a_law_with_the_modulus_that_was_asked_for():
    """By statics of the specimens of the first three seeds, with grains as stiff as it says; it warns as a search."""
    targets = gl.Targets(youngs_modulus=45 * GPa, poissons_ratio=0.24, ucs=120 * MPa)
    with pytest.warns(UserWarning, match=r"first_look: 1 targets of strength \(ucs\) for 2 free .* cannot"):
        found = gl.first_look(targets, LAW, {k: FREE[k] for k in ("cohesion", "friction_angle")}, specimen, seeds=2)
    given = [gl.elastic_properties(found.rock(specimen(seed)), found.law).modulus for seed in (1, 2)]
    assert np.mean(given) == pytest.approx(45e9, rel=0.01)
    assert found.parameters == {"kn": found.law.kn, "ks": found.law.ks, **found.best}
    assert found.law.tensile_strength == LAW.tensile_strength
    assert f"E (GPa)                45.00        {found.moduli['youngs_modulus'] / 1e9:.2f}" in str(found)
    for name, target in found.elastic.items():
        low, high = found.match.ends_of(name, found.moduli[name])
        assert low < target.value < high


def test_specimens_that_a_test_of_their_shape_cannot_hold_are_refused():
    """A disc in the place of a prism had a first look, and a UCS."""
    round_one = gl.Specimen(Voronoi(grains=30, seed=1).tessellate(disc(0.03)), ROCK)
    with pytest.raises(gl.ParameterError, match=r"^first_look: specimens: prism: .* no boundary named left or right"):
        gl.first_look(gl.Targets(ucs=120 * MPa), LAW, FREE, lambda seed: round_one)
    with pytest.raises(gl.ParameterError, match=r"^first_look: specimens: prism = None .* that returns a Specimen"):
        gl.first_look(gl.Targets(ucs=120 * MPa), LAW, FREE, lambda seed: None)
    targets = gl.Targets(ucs=120 * MPa, brazilian_strength=9 * MPa)
    with pytest.raises(gl.ParameterError, match=r"^first_look: specimens: disc: Brazilian: the specimen is no disc"):
        gl.first_look(targets, LAW, FREE, {"prism": specimen, "disc": specimen})


def test_strengths_are_met_between_contacts_as_stiff_as_the_answer_wants_them(monkeypatch):
    """Statics that take twice the stiffness at first: what is found with it is looked for again with the right one."""
    asked = []

    def expected(space, targets, ones, statics, seed, point=None):
        asked.append(point)
        return expected_stiffness(space, targets, ones, statics, seed, point) if point is not None else twice

    twice = Stiffness(parameters={"kn": 4e14, "ks": 3.9e14}, grains=1.0, modulus=58 * GPa, poisson=0.26, solutions=1)
    monkeypatch.setattr(calibration, "expected_stiffness", expected)
    wanted = {"ucs": 80 * MPa, "tensile_strength": 8 * MPa, "youngs_modulus": 45 * GPa}
    targets = gl.Targets(**wanted, confinements=[5 * MPa], friction_angle=42.0)
    found = gl.first_look(targets, LAW, FREE, specimen, seeds=2)
    assert found.meets_moduli
    for name in ("ucs", "tensile_strength"):
        assert found.expected[name][0] == pytest.approx(wanted[name], rel=0.02)
    assert len(asked) >= 2
