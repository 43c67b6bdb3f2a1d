"""What a calibration may aim at, and the parameters it may look for."""

import math
import re
import warnings

import attrs
import numpy as np
import pytest
from formula_rocks import BASE, RANGES, TIED, space
from hypothesis import given
from hypothesis import strategies as st
from support import STIFF

import grainlaw as gl
from grainlaw.calibration.space import Space, space_of
from grainlaw.calibration.targets import AIMS, Target, checked_quantities, measured_by, needed_tests
from grainlaw.laws import BandisClosure, CohesiveCrack, MohrCoulomb
from grainlaw.units import GPa, MPa


def test_a_target_is_a_value_or_a_value_with_its_uncertainty():
    targets = gl.Targets(ucs=120 * MPa, tensile_strength=(8 * MPa, 0.5 * MPa), youngs_modulus=60 * GPa)
    assert targets.ucs.uncertainty == pytest.approx(2.4 * MPa)
    assert targets.given["tensile_strength"].uncertainty == 0.5 * MPa
    assert list(targets.tested) == ["ucs", "tensile_strength"]
    assert list(targets.elastic) == ["youngs_modulus"]


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        ({"friction_angle": 90}, r"friction_angle = 90.* must be below 90"),
        ({"friction_angle": -3}, "friction_angle = -3 deg is not allowed"),
        ({"poissons_ratio": 0.5}, "poissons_ratio = 0.5.* below 0.5"),
        ({"poissons_ratio": 0.0}, "poissons_ratio = 0.0.* not 0, as it is met to a share of itself"),
        ({"ucs": -1e6}, r"ucs = -1e\+06|ucs = -1000000.0 Pa"),
        ({"ucs": (1e8, -1)}, "ucs: uncertainty = -1"),
        ({"ucs": "120 MPa"}, r"ucs = '120 MPa' is not allowed, it must be a number \(Pa\)"),
        ({"ucs": 1e8, "confinements": [-1e6]}, r"confinements\[0\] = -1000000.0 Pa"),
        ({"ucs": 1e8, "confinements": [1e6, 1e6]}, "each only once"),
        ({"triaxial": [1e6, 4e6]}, "triaxial = .* must be a mapping of confinements"),
        ({"triaxial": {-1e6: 4e6}}, r"triaxial = -1000000\.0 Pa"),
        ({"triaxial": {2e7: 1e7}}, r"strength of 10 MPa under 20 MPa is not allowed, it is the axial"),
        ({"triaxial": {2e7: (4e8, -1)}}, "Targets: strength at 20 MPa: uncertainty = -1"),
        ({"uniaxial": 1e8}, "there is no 'uniaxial'"),
        ({}, "there is no target"),
    ],
)
def test_targets_that_no_rock_has_are_refused(wrong, words):
    with pytest.raises(gl.ParameterError, match=words):
        gl.Targets(**wrong)


def test_quantities_are_what_tests_to_failure_measure_each_once():
    assert checked_quantities("envelope", ["ucs", "crack_damage", "ucs"]) == ("ucs", "crack_damage")
    for wrong, question in (("youngs_modulus", ""), ("ucs_", "; did you mean 'ucs'")):
        with pytest.raises(gl.ParameterError, match=f"^envelope: there is no quantity '{wrong}'{question}"):
            checked_quantities("envelope", ["ucs", wrong])


def test_tests_follow_from_the_targets():
    assert needed_tests(["tensile_strength", "cohesion"]) == ("compression", "confined", "tension")
    assert needed_tests(["fracture_toughness", "brazilian_strength"]) == ("brazilian", "bending")
    line = gl.Targets(ucs=1e8)
    assert {"ucs", "crack_damage"} <= set(measured_by(["compression"], line))
    assert "cohesion" not in measured_by(["compression"], line)
    assert "cohesion" in measured_by(["compression", "confined"], line)
    names = {name for name in gl.Targets.__slots__ if not name.startswith("_")}
    assert names - {"confinements", "triaxial"} <= set(AIMS)


def test_strengths_under_confinement_are_targets_by_their_pressure():
    """Without a line, unless it is asked for too; they are measured where confined tests are."""
    targets = gl.Targets(triaxial={75 * MPa: (703 * MPa, 9 * MPa), 2.5 * MPa: 200 * MPa})
    assert targets.given == {
        "strength at 2.5 MPa": Target(200 * MPa, 4 * MPa), "strength at 75 MPa": Target(703 * MPa, 9 * MPa)
    }  # fmt: skip
    assert targets.tested == targets.given
    assert targets.pressures == ()
    assert targets.confined
    assert AIMS["strength at 2.5 MPa"].confinement == 2.5 * MPa
    assert AIMS["strength at 2.5 MPa"].shown.heading == "strength at 2.5 MPa (MPa)"
    assert needed_tests([*targets.given]) == ("compression", "confined")
    names = measured_by(["compression", "confined"], targets)
    assert {*targets.given, "ucs"} <= set(names)
    assert not {"cohesion", "friction_angle"} & set(names)
    assert "strength at 75 MPa" not in measured_by(["compression"], targets)
    both = gl.Targets(cohesion=3e7, friction_angle=50, confinements=[1e6], triaxial={75 * MPa: 703 * MPa})
    assert both.pressures == (1e6,)
    assert not gl.Targets(tensile_strength=1e7).confined


def test_confinements_are_a_twentieth_of_the_strength_if_none_is_given():
    assert gl.Targets(ucs=126.65 * MPa).pressures == (pytest.approx(6.33 * MPa),)
    line = gl.Targets(cohesion=18.35 * MPa, friction_angle=57.68).pressures  # UCS 126.65 MPa by Mohr and Coulomb
    assert line == (pytest.approx(126.65 * MPa / 20, rel=2e-3),)
    assert gl.Targets(ucs=1e8, confinements=[4 * MPa, 2 * MPa]).pressures == (2 * MPa, 4 * MPa)
    assert gl.Targets(tensile_strength=1e7).pressures == ()


@given(st.lists(st.floats(0.01, 0.99), min_size=4, max_size=4), st.floats(0.3, 3))
def test_groups_do_not_see_the_strength_of_similar_rocks(place, times):
    rocks = space()
    point = rocks.points(np.array([place]))
    powers = {"tensile_strength": 1, "cohesion": 1, "friction_angle": 0, "mode_i_energy": 2}
    similar = point * times ** np.array([powers[name] for name in rocks.names])
    assert rocks.coordinates(similar) == pytest.approx(rocks.coordinates(point), abs=1e-9)
    assert rocks.scales(similar) == pytest.approx(times * rocks.scales(point))
    assert rocks.at_reference(similar) == pytest.approx(rocks.at_reference(point), rel=2e-5)
    assert rocks.scales(rocks.at_reference(similar)) == pytest.approx(1, rel=1e-5)


def test_groups_are_one_fewer_than_the_parameters():
    assert space().groups == (
        "cohesion / tensile_strength", "friction_angle", "mode_i_energy / tensile_strength^2"
    )  # fmt: skip


@pytest.mark.parametrize(
    ("law", "free", "tied", "is_free"),
    [
        (BASE, RANGES, TIED, True),
        (BASE, RANGES, {}, False),  # a fixed energy in shear
        (BASE, {name: RANGES[name] for name in ("tensile_strength", "cohesion", "friction_angle")}, {}, False),
        (attrs.evolve(BASE, closure=BandisClosure(maximum_closure=math.inf)), RANGES, TIED, True),
        (attrs.evolve(BASE, closure=BandisClosure(maximum_closure=5e-6)), RANGES, TIED, False),
        (
            MohrCoulomb(**STIFF, tensile_strength=1e7, cohesion=4e7, friction_angle=40, residual_friction_angle=5),
            {name: RANGES[name] for name in ("tensile_strength", "cohesion")}, {}, True,
        ),
        (
            MohrCoulomb(**STIFF, tensile_strength=1e7, cohesion=4e7, friction_angle=40, residual_cohesion=1e6),
            {name: RANGES[name] for name in ("tensile_strength", "cohesion")}, {}, False,
        ),
        (BASE, {"friction_angle": (30, 50)}, {}, False),
    ],
)  # fmt: skip
def test_the_scale_is_free_where_nothing_with_dimensions_is_fixed(law, free, tied, is_free):
    assert (space(law, free, tied).scale is not None) == is_free


def test_the_scale_is_the_first_stress_that_is_above_zero():
    """Not an energy before it, nor a stress whose range begins at zero: neither can be what all others are over."""
    first = {"mode_i_energy": RANGES["mode_i_energy"], "cohesion": (0, 60 * MPa), "friction_angle": (30, 50)}
    assert space(free={**first, "tensile_strength": RANGES["tensile_strength"]}).scale.name == "tensile_strength"


def test_coordinates_are_from_minus_one_to_one_of_all_that_the_groups_can_be():
    """The strength is from 5 to 30 MPa, so that a group in its power n has the root of 6^n more to both sides."""
    rocks = space()
    reference, root = rocks.reference, np.sqrt(6)
    ends = [(reference, 20e6 / root, 30, 5 / 6), (reference, 60e6 * root, 50, 300 * 6)]
    assert rocks.coordinates(np.array(ends)) == pytest.approx(np.array([[-1, -1, -1], [1, 1, 1]]), abs=1e-9)
    middle = (reference, np.sqrt(20e6 * 60e6), 40, np.sqrt(5 * 300))
    twice = (2 * reference, 2 * middle[1], 40, 4 * middle[3])  # a rock that is similar
    assert rocks.coordinates(np.array([middle, twice])) == pytest.approx(np.zeros((2, 3)), abs=1e-9)
    plain = space(free={"tensile_strength": (5 * MPa, 20 * MPa), "friction_angle": (30, 50)}, tied={})
    assert plain.coordinates(np.array([(5e6, 50), (10e6, 30)])) == pytest.approx(np.array([(-1, 1), (0, -1)]), abs=1e-9)


def test_a_coordinate_of_a_range_from_zero_is_even_in_the_parameter():
    """A cohesion from 0 to 60 MPa over a strength from 5 to 30 MPa: the root of 6 more to its high side."""
    rocks = space(free={**RANGES, "cohesion": (0, 60 * MPa)})
    highest, angle, energy = 60e6 * np.sqrt(6), 40, np.sqrt(5 * 300)
    points = [(rocks.reference, share * highest, angle, energy) for share in (0, 0.25, 1)]
    points.append((2 * rocks.reference, highest, angle, 4 * energy))  # in proportion as half of the highest
    assert rocks.scale.name == "tensile_strength"
    assert rocks.coordinates(np.array(points))[:, 0] == pytest.approx([-1, -0.5, 1, 0], abs=1e-9)


def test_the_prior_is_even_and_leaves_out_what_the_law_refuses():
    rocks = space(free={**RANGES, "cohesion": (5 * MPa, 60 * MPa)})
    points = rocks.prior(512, seed=1)
    assert len(points) == 512
    strength, cohesion, angle, _ = points.T
    assert np.all(strength * np.tan(np.radians(angle)) <= cohesion * (1 + 1e-9))
    whole = space(free={"tensile_strength": (5 * MPa, 20 * MPa), "mode_i_energy": (1, 100)}, tied={}).prior(1024, 3)
    assert np.median(whole, axis=0) == pytest.approx([10 * MPa, 10], rel=0.01)  # even in the logarithm
    assert rocks.prior(512, seed=1) == pytest.approx(points)


def test_the_prior_gives_up_where_the_law_refuses_nearly_all(monkeypatch):
    """Ten points are drawn as 16 at a time, until they are more than 200 for each and 4096: 6112 with one of each."""
    rocks, given = space(), iter(range(1000))

    def allowed(self, points):
        next(given)  # it does not go on for ever
        return np.arange(len(points)) < 0

    monkeypatch.setattr(type(rocks), "allowed", allowed)
    with pytest.raises(gl.ParameterError, match=r"CohesiveCrack refuses nearly all of it, 0 of 6112 points are left"):
        rocks.prior(10, 1)


def test_a_law_is_made_with_what_is_tied():
    law = space().made({"tensile_strength": 1e7, "cohesion": 3e7, "friction_angle": 40, "mode_i_energy": 60})
    assert (law.mode_ii_energy, law.mode_i_energy, law.residual_friction_angle) == (120, 60, 5)


def test_many_points_are_asked_of_a_law_at_once(monkeypatch):
    """By what it refuses they were halved, down to single ones: of 16,384 points that took half a minute."""
    free = {"tensile_strength": (3e6, 40e6), "cohesion": (5e6, 20e6), "friction_angle": (2, 60)}
    asked = space_of(BASE, free, {"residual_friction_angle": ("friction_angle", 0.5)}, {})
    points = asked.points(np.random.default_rng(1).random((300, 3)))
    apex = points[:, 1] / np.tan(np.radians(points[:, 2]))
    made, calls = Space.made, []
    monkeypatch.setattr(Space, "made", lambda self, values: calls.append(1) or made(self, values))
    takes = asked.allowed(points)
    assert np.array_equal(takes, points[:, 0] <= apex)
    assert 60 < takes.sum() < 240
    assert len(calls) == 2


@pytest.mark.parametrize(
    ("law", "free", "tied", "words"),
    [
        (BASE, {"tensile_strenght": (1, 2)}, {}, "there is no parameter 'tensile_strenght'; did you mean"),
        (BASE, {"cohesion": (2, 1)}, {}, r"free: cohesion = \(2, 1\) is not allowed, .* in Pa, the lower end first"),
        (BASE, {"friction_angle": (20, 100)}, {}, "friction_angle = 100 deg is not allowed, it must be .* below 90"),
        (BASE, {"tensile_strength": (-1, 2e6)}, {}, "tensile_strength = -1 Pa is not allowed, .* above 0"),
        (BASE, {"cohesion": 3}, {}, r"free: cohesion = 3 is not allowed, it must be \(low, high\)"),
        (BASE, {}, {}, "free is empty"),
        (BASE, {"cohesion": (1e6, 2e6)}, {"cohesion": ("cohesion", 2)}, "'cohesion' is free and tied"),
        (BASE, {"cohesion": (1e6, 2e6)}, {"mode_i_energy": ("cohesion", 2)}, "is in J/m2, but cohesion in Pa"),
        (BASE, {"cohesion": (1e6, 2e6)}, {"mode_i_energy": ("energy", 2)}, "'energy' is not free"),
        (BASE, {"cohesion": (1e6, 2e6)}, {"mode_i_energy": (5, 2)}, "it must be .name of a free parameter, factor"),
        (BASE, {"cohesion": (1e6, 2e6)}, {"mode_i_energy": ("cohesion", "2")}, "it must be .name of a free parameter"),
        (BASE, {"cohesion": (1e6, 2e6)}, {"mode_i_energy": 2}, "it must be .name of a free parameter, factor"),
        (CohesiveCrack, {"cohesion": (1e6, 2e6)}, {}, "CohesiveCrack needs kn, ks, tensile_strength"),
        ("cohesive", {"cohesion": (1e6, 2e6)}, {}, "law = 'cohesive' is not allowed"),
    ],
)
def test_what_cannot_be_looked_for_is_refused(law, free, tied, words):
    with pytest.raises(gl.ParameterError, match=words):
        space_of(law, free, tied, {})


def test_confinements_without_their_unit_are_told():
    for aims, where in (
        ({"confinements": (2, 4e6)}, "confinements[0] = 2"),
        ({"triaxial": {10: 220e6}}, "triaxial = 10"),
    ):
        with pytest.warns(gl.UnitWarning, match=re.escape(f"Targets: {where} Pa is unusual, usual are 10000 to 1e+09")):
            gl.Targets(ucs=150e6, friction_angle=45, **aims)


def test_a_range_without_its_unit_is_told_once():
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        found = space_of(BASE, {"cohesion": (15, 60)}, {}, {})
        found.allowed(found.points(np.array([[0.2], [0.8]])))
    assert [str(each.message) for each in told] == [
        "calibrate: free: cohesion = 15 Pa is unusual, usual are 1000 to 1e+10 Pa: is the unit right?"
    ]


def test_a_range_that_cuts_off_an_interval_is_told():
    rocks = space(free={"tensile_strength": (10 * MPa, 40 * MPa), "cohesion": (20 * MPa, 80 * MPa)}, tied={})
    places = np.column_stack([np.linspace(0.5, 1.0, 101), np.linspace(0.0, 1.0, 101)])  # the other is not determined
    points = rocks.points(places)
    words = (
        "The range of tensile_strength, 10 MPa to 40 MPa, cuts off the interval, 20.3 MPa to 39.3 MPa: a wider one "
        "may hold more."
    )
    assert rocks.at_ends(rocks.points(np.array([[0.8, 0.5]]))[0], points) == words
    both = rocks.at_ends(rocks.points(np.array([[0.995, 0.5]]))[0], points)
    assert both == "The best is at an end of the range of tensile_strength: a wider one may meet more."
    assert rocks.at_ends(points[60], points[40:60]) == ""


def test_two_regions_are_not_told_as_one_interval():
    rocks = space(free={"tensile_strength": (10 * MPa, 40 * MPa), "cohesion": (20 * MPa, 80 * MPa)}, tied={})
    random = np.random.default_rng(1)
    low, high, other = random.uniform(0, 0.25, 300), random.uniform(0.75, 1, 100), random.uniform(0, 1, 400)
    (words,) = rocks.two_regions(rocks.points(np.column_stack([np.concatenate([low, high]), other])))
    begin = "tensile_strength lies in two regions with hardly anything between them: "
    low_one, high_one = r"10\.\d+ MPa to 1[34]\.\d+ MPa \(75 %\)", r"2[89]\.\d+ MPa to 39\.\d+ MPa \(25 %\)\."
    assert re.fullmatch(f"{begin}{low_one} or {high_one}", words)
    assert not rocks.two_regions(rocks.points(np.column_stack([np.linspace(0, 1, 400), other])))
    few = np.concatenate([random.uniform(0, 0.25, 396), [0.9] * 4])  # a straggler is no region
    assert not rocks.two_regions(rocks.points(np.column_stack([few, other])))
    assert not rocks.two_regions(rocks.points(np.column_stack([np.full(400, 0.5), other])))


@pytest.mark.thorough
def test_ranges_that_the_law_refuses_as_a_whole_are_refused():
    rocks = space(free={"tensile_strength": (20 * MPa, 30 * MPa), "cohesion": (1 * MPa, 2 * MPa)}, tied={})
    with pytest.raises(gl.ParameterError, match=r"refuses nearly all of it, .*; of one of the others CohesiveCrack: "):
        rocks.prior(16, seed=0)
