"""Moduli, crack initiation and crack damage of curves whose kinks are known."""

from types import SimpleNamespace

import attrs
import numpy as np
import pytest
from support import ROCK

import grainlaw as gl
from grainlaw.geometry import Bricks, Minerals, rectangle
from grainlaw.materials import Thermal, TransverselyIsotropic
from grainlaw.moduli import converted
from grainlaw.results.standard_measures import peak_of, stress_at_damage
from grainlaw.results.thresholds import (
    crack_closure,
    crack_damage,
    crack_volumetric_strain,
    initiation_by_crack_volume,
    initiation_by_lateral_strain,
    path_to_peak,
    secant_constants,
    strains_disagree,
    stress_at_share,
    tangent_constants,
)

MPA, E = 1e6, 50e9
LOAD = np.linspace(0, 100, 201) * MPA


def lateral_of(load):
    """Slopes 0.25, 0.6 and 1.5 over E, with kinks at 40 and 80 MPa."""
    return np.interp(load, np.array([0, 40, 80, 100]) * MPA, np.array([0, 10, 34, 64]) * MPA / E)


def curves_of(load, lateral, stage=0, confinement=0.0):
    """Columns of a compression test with the modulus E."""
    axial = -load / E
    return {
        "time": np.arange(len(load)) * 1.0, "stage": np.broadcast_to(stage, len(load)), "strain": -axial,
        "stress": load + confinement, "lateral_strain": lateral, "volumetric_strain": axial + lateral,
    }  # fmt: skip


KINKED = curves_of(LOAD, lateral_of(LOAD))


def test_constants_of_a_kinked_curve():
    path = path_to_peak(KINKED)
    assert tangent_constants(path) == pytest.approx((E, 0.6))  # 40 to 60 MPa lie on the second branch
    assert tangent_constants(path, centre=0.2) == pytest.approx((E, 0.25))
    assert secant_constants(path) == pytest.approx((E, 16 / 50))  # 10 + 0.6 x 10 at 50 MPa
    assert secant_constants(path, 0.2) == pytest.approx((E, 0.25))


@pytest.mark.parametrize("sign", [1, -1])  # of the test's strain: it is told from the lateral one
def test_strains_are_enough_without_their_sum(sign):
    bare = {name: values for name, values in KINKED.items() if name != "volumetric_strain"}
    bare["lateral_strain"] = np.r_[0, -1e-9, bare["lateral_strain"][2:]]  # it is told in the end, not from the first
    path = path_to_peak(bare | {"strain": sign * bare["strain"]})
    assert path.axial == pytest.approx(path_to_peak(KINKED).axial)
    assert tangent_constants(path) == pytest.approx((E, 0.6))
    assert not strains_disagree(bare)


def test_a_wrong_column_of_strains_is_a_doubt():
    """The change of area in place of its own sum: a modulus of 185 GPa for 54 came of it."""
    assert not strains_disagree(KINKED)
    assert strains_disagree(KINKED | {"volumetric_strain": 0 * LOAD})
    assert strains_disagree(KINKED | {"strain": KINKED["strain"] / 100})
    late = np.where(LOAD < 60 * MPA, 1.0, 0.3) * KINKED["strain"]  # a gauge that came off at 60 % of the peak
    assert not strains_disagree(KINKED | {"strain": late})


def test_conversion_from_plane_strain():
    bricks = Bricks(rows=1).tessellate(rectangle(0.01, 0.02))
    strain = gl.Specimen(bricks, ROCK)
    # E 60 GPa and nu 0.25 make E* = E/(1 - nu^2) = 64 GPa and nu* = nu/(1 - nu) = 1/3 in plane strain.
    assert converted(64e9, 1 / 3, strain) == pytest.approx((60e9, 0.25))
    stress = gl.Specimen(bricks, attrs.evolve(ROCK, plane=gl.Plane.STRESS))
    assert converted(64e9, 1 / 3, stress) == (64e9, 1 / 3)
    plane = gl.Plane.STRESS
    foliated = TransverselyIsotropic(
        youngs_modulus=6e10, youngs_modulus_across=6e10, poissons_ratio=0.25, poissons_ratio_across=0.25,
        shear_modulus_across=24e9, density=2700, plane=plane,
    )  # fmt: skip
    for rock in (foliated, Thermal(material=attrs.evolve(ROCK, plane=plane), expansion=1e-5)):
        assert converted(64e9, 1 / 3, gl.Specimen(bricks, rock)) == (64e9, 1 / 3)
    assert converted(64e9, 1 / 3, gl.Specimen(bricks, Thermal(material=ROCK, expansion=1e-5)))[0] == pytest.approx(6e10)
    two = Minerals(Bricks(rows=2), {"a": 0.5, "b": 0.5}).tessellate(rectangle(0.01, 0.02))
    with pytest.raises(gl.ParameterError, match="there are grains in plane strain and plane stress, they must be all"):
        gl.Specimen(two, {"a": ROCK, "b": attrs.evolve(ROCK, plane=plane)})


def test_thresholds_of_a_kinked_curve():
    path = path_to_peak(KINKED)
    assert crack_damage(path).value == pytest.approx(80 * MPA)  # the tangent lateral ratio passes 1
    assert crack_damage(path, laterals=2).value == pytest.approx(40 * MPA)  # it passes 1/2
    assert initiation_by_lateral_strain(path).value == pytest.approx(40 * MPA)
    # Beyond 40 MPa it opens by 0.35/E per load; a hundredth of the elastic 0.75 x 100 MPa/E is passed 0.75/0.35 later.
    assert initiation_by_crack_volume(path).value == pytest.approx((40 + 0.75 / 0.35) * MPA)
    assert initiation_by_crack_volume(path, tolerance=0.02).value == pytest.approx((40 + 1.5 / 0.35) * MPA)
    opened = crack_volumetric_strain(path)
    assert opened[[80, 160, 200]] == pytest.approx(np.array([0, 14, 39]) * MPA / E, abs=1e-9)


def soft_foot(load, upto=20 * MPA):
    """Axial strain with twice the slope of E up to a load."""
    return -(load + np.minimum(load, upto)) / E


def test_open_cracks_have_closed_at_the_end_of_the_foot():
    foot = curves_of(LOAD, lateral_of(LOAD), confinement=7 * MPA) | {"deviator": LOAD}
    foot["volumetric_strain"] = soft_foot(LOAD) + foot["lateral_strain"]
    path = path_to_peak(foot)
    assert crack_closure(path).value == pytest.approx(27 * MPA)
    # At 20 of 50 MPa it is 40 MPa/E, and 28 on the line to 70: 12 of 70. The line to 25 MPa has 36 there of 45.
    assert crack_closure(path, least=0.171).value == pytest.approx(27 * MPA)
    flat = crack_closure(path, least=0.172)
    assert np.isnan(flat.value)
    assert flat.why == "the axial strain has no foot of 0.17 of that at 0.5 of the peak"
    assert crack_closure(path, share=0.25, least=0.088).value == pytest.approx(27 * MPA)
    assert np.isnan(crack_closure(path, share=0.25, least=0.09).value)
    assert crack_closure(path, share=0.15).why.startswith("the axial strain has no foot")  # all within the foot
    assert crack_closure(path, share=0.004).why == "fewer than three samples lie below 0.004 of the peak"
    assert crack_closure(path_to_peak(KINKED)).why.startswith("the axial strain has no foot of 0.01")
    assert np.isnan(crack_closure(path_to_peak({})).value)
    later = {name: values[20:] for name, values in foot.items()}  # the path begins at 10 MPa, in the foot
    assert crack_closure(path_to_peak(later)).value == pytest.approx(27 * MPA)


def test_confinement_is_added_and_what_came_before_is_left_out():
    before = curves_of(np.zeros(50), np.linspace(1e-3, 2e-3, 50), stage=0, confinement=10 * MPA)
    after = curves_of(LOAD, 2e-3 + lateral_of(LOAD), stage=1, confinement=10 * MPA)
    curves = {name: np.concatenate([before[name], after[name]]) for name in before}
    curves["volumetric_strain"] -= 1e-3  # the specimen was shorter already
    curves |= {"deviator": curves["stress"] - 10 * MPA, "time": np.arange(251.0)}
    path = path_to_peak(curves)
    assert crack_damage(path).value == pytest.approx(90 * MPA)
    assert initiation_by_lateral_strain(path).value == pytest.approx(50 * MPA)
    assert initiation_by_crack_volume(path).value == pytest.approx((50 + 0.75 / 0.35) * MPA)
    assert secant_constants(path) == pytest.approx((E, 16 / 50))


def test_a_path_that_begins_under_load_has_its_kinks_where_they_are():
    path = path_to_peak(curves_of(LOAD[20:], 1e-3 + lateral_of(LOAD[20:])))  # from 10 MPa on
    assert path.lateral[0] == 0
    assert secant_constants(path) == pytest.approx((E, (16 - 2.5) / 40))
    assert crack_damage(path).value == pytest.approx(80 * MPA)
    assert initiation_by_lateral_strain(path).value == pytest.approx(40 * MPA)
    # To CD the strain rises by 31.5 MPa/E; 30 of the 70 MPa on the way the line is at 13.5 and the strain at 7.5 MPa/E.
    assert initiation_by_lateral_strain(path, least=0.19).value == pytest.approx(40 * MPA)
    assert np.isnan(initiation_by_lateral_strain(path, least=0.191).value)


@pytest.mark.parametrize(("change", "first"), [(45, 45), (55, 0)])
def test_the_path_begins_with_the_stage_that_reaches_half_of_the_peak(change, first):
    path = path_to_peak(curves_of(LOAD, lateral_of(LOAD), (LOAD > change * MPA).astype(int)))
    assert path.load[0] / MPA == pytest.approx(first, abs=0.6)
    assert peak_of(SimpleNamespace(path=path)) == pytest.approx(100 * MPA)
    assert np.isnan(peak_of(SimpleNamespace(path=path_to_peak({}))))
    confined = path_to_peak(curves_of(LOAD, lateral_of(LOAD), 0, 7 * MPA) | {"deviator": LOAD})
    assert peak_of(SimpleNamespace(path=confined)) == pytest.approx(107 * MPA)


def test_a_stage_that_unloads_may_begin_with_the_highest_load():
    """Strains have turned there: that is no reversal of the volume."""
    load = np.concatenate([np.linspace(0.0, 100e6, 51), [101e6, 60e6, 20e6]])
    columns = curves_of(load, 0.25 * load / E, stage=np.repeat([0, 1], [51, 3]))
    for name, still in (("strain", 1.001), ("lateral_strain", 0.99), ("volumetric_strain", 0.99)):
        columns[name][51] = still * columns[name][50]
    path = path_to_peak(columns)
    assert path.load[-1] == 100e6
    assert "all the way to the peak" in crack_damage(path).why


def test_drops_before_the_peak_and_what_follows_it_do_not_count():
    load = np.concatenate([LOAD[:150], LOAD[100:150], LOAD[150:], LOAD[::-1]])
    lateral = lateral_of(load)
    lateral[150:200] += 1e-3
    lateral[-201:] += 5e-3
    stage = np.repeat([0, 1, 2], [150, 50, len(load) - 200])  # unloaded, as a stage of its own does
    path = path_to_peak(curves_of(load, lateral, stage))
    assert np.array_equal(path.load, LOAD)
    assert crack_damage(path).value == pytest.approx(80 * MPA)
    assert initiation_by_lateral_strain(path).value == pytest.approx(40 * MPA)


def test_what_does_not_exist_is_nan():
    straight = path_to_peak(curves_of(LOAD, 0.25 * LOAD / E))
    for measure in (crack_damage, initiation_by_lateral_strain, initiation_by_crack_volume):
        assert np.isnan(measure(straight).value)
    bent = path_to_peak(curves_of(LOAD[:161], lateral_of(LOAD[:161])))  # ends at 80 MPa, before the strain turns
    assert np.isnan(crack_damage(bent).value)
    assert crack_damage(bent, laterals=2).value == pytest.approx(40 * MPA)
    assert np.isnan(crack_damage(straight, laterals=2).value)
    assert np.isnan(initiation_by_lateral_strain(bent).value)
    assert initiation_by_crack_volume(bent).value == pytest.approx((40 + 0.6 / 0.35) * MPA)
    tension = {**KINKED, "volumetric_strain": LOAD / E - lateral_of(LOAD), "lateral_strain": -lateral_of(LOAD)}
    assert np.isnan(crack_damage(path_to_peak(tension)).value)
    assert secant_constants(path_to_peak(tension)) == pytest.approx((E, 16 / 50))
    falls = "the sum of axial and lateral strain falls all the way to the peak"
    assert crack_damage(straight).why == falls
    assert crack_damage(straight, laterals=2).why == falls.replace("lateral", "twice the lateral")
    assert initiation_by_lateral_strain(straight).why == f"there is no CD to end the line at: {falls}"
    assert (
        initiation_by_crack_volume(straight).why == "the crack volume at the peak is less than 0.01 of the elastic one"
    )
    few = initiation_by_crack_volume(path_to_peak(KINKED), low=0.111, high=0.112)
    assert few.why == "fewer than two samples lie between 0.111 and 0.112 of the peak"
    swells = path_to_peak(curves_of(LOAD, 1.5 * LOAD / E))
    assert crack_damage(swells).why == "the sum of axial and lateral strain rises all the way to the peak"
    flat = initiation_by_lateral_strain(path_to_peak(KINKED), least=0.21)  # 7/34 at 40 MPa
    assert flat.why == "the lateral strain is nowhere 0.21 of that at CD below its line"
    for seek in (crack_damage, initiation_by_lateral_strain, initiation_by_crack_volume):
        assert seek(path_to_peak(KINKED)).why == ""
        assert seek(path_to_peak(tension)).why.endswith("the specimen has not become shorter")
    for curves in (
        {},
        {"time": LOAD},
        {**KINKED, "stress": 0 * LOAD},
        {k: KINKED[k] for k in ("time", "stage", "stress")},
    ):
        path = path_to_peak(curves)
        sought = [crack_damage(path), initiation_by_lateral_strain(path), initiation_by_crack_volume(path)]
        values = [*tangent_constants(path), *secant_constants(path), *(each.value for each in sought)]
        assert np.isnan(values).all()


def test_first_hundredth_of_the_cracks_at_the_peak():
    curves = curves_of(np.concatenate([LOAD, LOAD[::-1]]), np.zeros(402))
    count = np.concatenate([np.zeros(101), np.arange(1, 101) * 2, np.full(201, 1000)])  # 200 at the peak, 2 at 50.5 MPa
    assert stress_at_share(curves, curves["time"], count, 0.01) == pytest.approx(50.5 * MPA)
    assert stress_at_share(curves, curves["time"], count, 0.1) == pytest.approx(55 * MPA)
    # Known at four moments only: between 25 and 75 MPa it rises linearly, to 1 of 100 at 25.5 MPa.
    rare = np.array([0.0, 50, 150, 200])
    assert stress_at_share(curves, rare, np.array([0, 0, 100, 100]), 0.01) == pytest.approx(25.5 * MPA)
    assert np.isnan(stress_at_share(curves, curves["time"], np.zeros(402), 0.01))
    assert np.isnan(stress_at_share({"time": LOAD}, LOAD, LOAD, 0.01))


def test_the_onset_of_damage_is_read_from_the_curves_also_of_a_cyclic_test():
    """Up to 60 MPa without damage, down, and up again, where 100 points are damaged from 70 MPa to the peak at 100."""
    load = np.concatenate([np.arange(61.0), np.arange(60.0, 0, -1), np.arange(101.0), [20.0]])
    damaged = np.where(np.arange(len(load)) > 121, np.clip((load - 70) * 100 / 30, 0, 100), 0)
    stage = np.repeat([0, 1, 2], [61, 60, 102])
    curves = {**curves_of(load * MPA, np.zeros(len(load)), stage), "damaged": damaged}
    found = SimpleNamespace(result=SimpleNamespace(of_test=lambda: SimpleNamespace(curves=curves)))
    assert stress_at_damage(found) == pytest.approx(70.3 * MPA)
    assert stress_at_damage(found, 0.5) == pytest.approx(85 * MPA)


def test_bad_shares_are_refused():
    with pytest.raises(gl.ParameterError, match=r"shares of the peak = 0\.5, 0\.5 are not allowed"):
        initiation_by_crack_volume(path_to_peak(KINKED), low=0.5, high=0.5)
