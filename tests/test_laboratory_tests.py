"""Splitting, bending, shearing and cycling: elastic answers, fracture energy along a straight joint, refusals."""

import math

import attrs
import numpy as np
import pytest
from scipy.sparse.linalg import spsolve
from support import BRITTLE, ROCK, STIFF, STRONG, small_sample

import grainlaw as gl
from grainlaw.engine.stability import stiffness_matrix
from grainlaw.geometry import Bricks, Voronoi, disc, notched_beam, polygon, rectangle, semi_disc, shear_box
from grainlaw.laws import CohesiveCrack, Friction, Linear, MohrCoulomb
from grainlaw.materials import Thermal
from grainlaw.protocols import (
    BiaxialCompression,
    Brazilian,
    Creep,
    Cyclic,
    DirectShear,
    Heating,
    Platens,
    SemiCircularBend,
    ThreePointBending,
    UniaxialCompression,
    UniaxialTension,
)
from grainlaw.protocols.bending import beam_shape_factor, flexural_strength, shape_factor
from grainlaw.units import mm

LINEAR = Linear(**STIFF)


def disc_stress(x, y, half):
    """Stresses across and along over 2 P/(pi D), at places over the radius, under pressure on arcs of 2 ``half`` rad.

    Point loads (Timoshenko and Goodier), times what Hondros 1959 gives for arcs in the middle.
    """
    r1, r2 = x**2 + (1 - y) ** 2, x**2 + (1 + y) ** 2
    across = 1 - 2 * ((1 - y) * x**2 / r1**2 + (1 + y) * x**2 / r2**2)
    along = 1 - 2 * ((1 - y) ** 3 / r1**2 + (1 + y) ** 3 / r2**2)
    wide = np.sin(2 * half) / half
    return across * (wide - 1), along / 3 * (wide + 1)


@pytest.mark.thorough
def test_the_middle_of_an_elastic_disc():
    grains = Voronoi(grains=2000, seed=1).tessellate(disc(50 * mm, loaded=10, flat=False, sides=144))
    test = Brazilian(loading=gl.Constant(speed=0.02, ramp=2e-4), maximum_strain=2e-4, samples=200, jaws=Platens.SMOOTH)
    found = gl.simulate(gl.Specimen(grains, ROCK), LINEAR, test).curves
    places = np.random.default_rng(0).uniform(-0.2, 0.2, (4000, 2))
    across, along = (s.mean() for s in disc_stress(*places[np.hypot(*places.T) < 0.2].T, np.radians(5)))
    assert found["middle_across"][-1] / found["stress"][-1] == pytest.approx(across, rel=0.02)
    assert found["middle_along"][-1] / found["stress"][-1] == pytest.approx(along, rel=0.02)
    assert (across, along) == pytest.approx((1, -3), rel=0.06)
    assert found["stress_top"][-1] == pytest.approx(found["stress_bottom"][-1], rel=0.02)


LENGTH, SPAN, BEARING = 50 * mm, 40 * mm, 4 * mm


def beam_outline(height):
    """Corners and side names of a beam whose bottom and top have a corner in the middle."""
    middle, b = LENGTH / 2, BEARING / 2
    left, right = middle - SPAN / 2, middle + SPAN / 2
    corners = [
        (0, 0), (left - b, 0), (left + b, 0), (middle, 0), (right - b, 0), (right + b, 0), (LENGTH, 0),
        (LENGTH, height), (middle + b, height), (middle, height), (middle - b, height), (0, height),
    ]  # fmt: skip
    names = ["bottom", "support_left", "bottom", "bottom", "support_right", "bottom", "right", "top", "load", "load",
             "top", "left"]  # fmt: skip
    return corners, names


def static_bending(specimen):
    """N/m per m of deflection of an elastic beam on rollers, by a sparse solve: independent of the engine's loop."""
    mesh, count = specimen.mesh, len(specimen.mesh.interfaces)
    matrix = stiffness_matrix(specimen, np.full((2, count), STIFF["kn"]), np.full((2, count), STIFF["ks"]))
    held = {2 * int(mesh.middle(name)[0]) + 1: 0.0 for name in ("support_left", "support_right")}
    load = mesh.middle("load")
    held |= {2 * int(i) + axis: value for i in load for axis, value in ((0, 0.0), (1, -1.0))}
    fixed = np.array(sorted(held))
    free = np.setdiff1d(np.arange(2 * len(mesh.nodes)), fixed)
    u = np.zeros(2 * len(mesh.nodes))
    u[fixed] = [held[k] for k in fixed]
    u[free] = spsolve(matrix[free][:, free].tocsc(), -matrix[free][:, fixed] @ u[fixed])
    return -(matrix @ u)[2 * load + 1].sum()


def beam(height, grains, **options):
    return gl.Specimen(Voronoi(grains=grains, seed=1).tessellate(polygon(*beam_outline(height))), ROCK, **options)


@pytest.mark.thorough
def test_an_elastic_beam_bends_as_its_zones_do():
    specimen = beam(10 * mm, 150)
    result = gl.simulate(
        specimen, LINEAR, ThreePointBending(loading=gl.Constant(speed=0.05), maximum_deflection=1.5e-5, samples=400)
    )
    found = result.curves["force"][-1] / result.curves["deflection"][-1]
    assert found == pytest.approx(static_bending(specimen), rel=0.01)
    assert result.summary["energy_error"] < 1e-4
    moment = result.summary["largest_force"] * SPAN / 4
    assert result.summary["largest_flexural_strength"] == pytest.approx(moment / ((10 * mm) ** 2 / 6), rel=1e-9)


NOTCHED = notched_beam(50 * mm, 10 * mm, span=SPAN, notch_depth=3 * mm, notch_width=1 * mm, bearing=BEARING)


@pytest.mark.parametrize(
    ("region", "test", "load", "motions"),
    [
        (
            rectangle(10 * mm, 20 * mm), UniaxialCompression(maximum_strain=1e-4, samples=10), "stress",
            ("strain", "strain_points", "lateral_strain"),
        ),
        (NOTCHED, ThreePointBending(maximum_deflection=1e-5, samples=10), "force", ("deflection", "mouth")),
    ],
    ids=["prism", "beam"],
)  # fmt: skip
def test_loads_and_motions_are_means_over_the_same_steps(region, test, load, motions):
    """An elastic specimen is as stiff in the first of few samples as in the last: by the end of it, half as stiff."""
    specimen = gl.Specimen(Voronoi(grains=40, seed=1).tessellate(region), ROCK)
    curves = gl.simulate(specimen, LINEAR, test).curves
    for motion in motions:
        stiffness = curves[load][1:] / curves[motion][1:]
        assert stiffness == pytest.approx(stiffness[-1], rel=0.02), motion


@pytest.mark.thorough
def test_a_beam_is_as_strong_however_far_it_may_bend():
    """Where its way is mostly that in which a failed beam parts, it breaks within few of the samples asked for."""
    specimen = gl.Specimen(Voronoi(grains=40, seed=1).tessellate(NOTCHED), ROCK)
    law = MohrCoulomb(**STIFF, tensile_strength=9e6, cohesion=29e6, friction_angle=55, residual_friction_angle=30)
    test = ThreePointBending(until=gl.Until.FAILURE)
    near, far = (
        gl.simulate(specimen, law, attrs.evolve(test, maximum_deflection=limit)).summary for limit in (10e-6, 200e-6)
    )
    assert far["failure_deflection"] < 200e-6 / 40
    assert far["flexural_strength"] == pytest.approx(near["flexural_strength"], rel=0.005)


def force_through(result, x):
    """N/m, upwards, with which the contacts that a section at ``x`` passes pull what lies left of it, at the end."""
    grains, nodes = result.specimen.grains, result.mesh.nodes[result.interfaces]
    left = grains.centroids[result.mesh.node_grain[result.interfaces[:, [0, 2]]], 0] < x
    along = nodes[:, 1] - nodes[:, 0]  # counter-clockwise round the first grain: its normal points to the right of it
    contacts = result.frames[-1].bonds
    normal, shear = (contacts[name].reshape(2, -1).mean(axis=0) for name in ("normal", "shear"))
    return float((left[:, 0].astype(int) - left[:, 1]) @ (shear * along[:, 1] - normal * along[:, 0]))


HALF_DISC = semi_disc(40 * mm, notch_depth=8 * mm, notch_width=1 * mm, span=24 * mm, bearing=3 * mm)


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("region", "test", "sections"),
    [
        (
            polygon(*beam_outline(10 * mm)),
            ThreePointBending(loading=gl.Constant(speed=0.05), maximum_deflection=1.5e-5),
            (10 * mm, 40 * mm),
        ),
        (HALF_DISC, SemiCircularBend(loading=gl.Constant(speed=0.01), maximum_deflection=3e-6), (-8 * mm, 8 * mm)),
    ],
    ids=["beam", "half disc"],
)
def test_each_half_of_the_load_passes_to_its_support(region, test, sections):
    """Equilibrium of what lies left of a section: P/2 up at the support, or P/2 up and P down, and the shear force."""
    specimen = gl.Specimen(Voronoi(grains=150, seed=1).tessellate(region), ROCK)
    result = gl.simulate(specimen, LINEAR, attrs.evolve(test, samples=400))
    curves = result.curves
    half = [-force_through(result, sections[0]), force_through(result, sections[1])]
    assert half == pytest.approx([curves["force_top"][-1] / 2] * 2, rel=0.03)
    assert half == pytest.approx([curves["force_bottom"][-1] / 2] * 2, rel=0.03)
    assert not [name for name in curves if "stress" in name]  # a force is none
    assert result.summary["imbalance"] < 1e-4


def test_zones_bend_as_a_slender_beam_does():
    """Timoshenko's beam of the modulus that grains and contacts have together in plane strain, 1/E' + 1/(k h)."""
    height = 2.5 * mm
    specimen = beam(height, 500, refinement=1)
    young = 1 / (1 / 64e9 + 1 / (1.05e14 * np.sqrt(LENGTH * height / specimen.grains.count)))
    slender = SPAN**3 / (48 * young * height**3 / 12) + SPAN / (4 * 5 / 6 * young / 2.6 * height)
    assert static_bending(specimen) == pytest.approx(1 / slender, rel=0.05)


def test_flexural_strength_is_that_of_the_ligament():
    """The moment P S / 4 over the section modulus h^2 / 6 of what is left above the notch."""
    region = notched_beam(length=0.1, height=0.025, span=0.08, notch_depth=0.01, notch_width=0.001, bearing=0.004)
    specimen = gl.Specimen(Voronoi(grains=60, seed=1).tessellate(region), ROCK)
    assert flexural_strength(1e5, specimen) == pytest.approx(1e5 * 0.08 / 4 / (0.015**2 / 6), rel=1e-9)


@pytest.mark.thorough
def test_bending_along_a_straight_joint_spends_the_fracture_energy():
    height = 10 * mm
    corners, names = beam_outline(height)
    halves = np.array([0, 1, 2, 3, 9, 10, 11, 3, 4, 5, 6, 7, 8, 9])
    grains = gl.Tessellation(polygon(corners, names), np.array(corners), halves, np.array([0, 7, 14]))
    law = CohesiveCrack(**STRONG, mode_i_energy=60, mode_ii_energy=120)
    test = ThreePointBending(maximum_deflection=3e-4, stop_fraction=0, loading=gl.Constant(speed=0.01))
    result = gl.simulate(gl.Specimen(grains, ROCK, refinement=1), law, test)
    rise = (1 - 2 / np.e) * law.kn * law.peak_opening**2
    assert result.curves["tensile_cracks"][-1] == 4  # all contact points of the ligament
    spent = (result.curves["energy_contacts_normal"][-1] + result.curves["energy_contacts_shear"][-1]) / height
    assert spent - rise == pytest.approx(60, rel=1e-3)
    assert result.summary["work_of_fracture"] - rise == pytest.approx(60, rel=0.03)  # with what the damping took
    assert result.summary["energy_error"] < 1e-6


@pytest.mark.thorough
def test_toughness_of_a_half_disc():
    """Y' = 5.85 at a/R = 0.5 and s/2R = 0.8 by hand: -1.297 + 7.6128 - 6.8178 + 7.14795."""
    assert shape_factor(0.5, 0.8) == pytest.approx(6.64595, abs=1e-4)
    specimen = gl.Specimen(Voronoi(grains=60, seed=1).tessellate(HALF_DISC), ROCK)
    result = gl.simulate(
        specimen, LINEAR, SemiCircularBend(loading=gl.Constant(speed=0.02), maximum_deflection=6e-6, samples=50)
    )
    found = result.summary
    expected = shape_factor(0.4, 0.6) * found["largest_force"] * np.sqrt(np.pi * 8 * mm) / (40 * mm)
    assert found["largest_toughness"] == pytest.approx(expected, rel=1e-9)
    assert np.isnan(found["toughness"])  # springs do not break
    assert result.curves["mouth"][-1] > 0


@pytest.mark.thorough
def test_a_shear_box_shears_a_specimen_through_the_middle():
    """Less stiff than the gap alone in simple shear, for its ends are free and the halves give way, but not by far."""
    gap, height = 4 * mm, 8 * mm
    specimen = gl.Specimen(Voronoi(grains=200, seed=1).tessellate(shear_box(30 * mm, height, gap)), ROCK)
    test = DirectShear(normal_stress=5e6, maximum_slip=4e-6, loading=gl.Constant(speed=0.1), resolution=1e-7)
    result = gl.simulate(specimen, LINEAR, test)
    curves = result.curves
    assert curves["normal_stress"][-1] == pytest.approx(5e6, rel=0.02)
    shear = 53.2e9 / (2 * 1.28)
    stiffness = curves["shear_stress"][-1] / curves["displacement"][-1]
    assert 0.4 * shear / gap < stiffness < shear / gap
    strong = gl.simulate(
        specimen, MohrCoulomb(**STRONG), attrs.evolve(test, maximum_slip=6e-5, loading=gl.Constant(speed=0.2))
    )
    assert strong.curves["shear_stress"].max() < 0.9 * stiffness * 6e-5
    assert len(strong.cracks) > 5


@pytest.mark.parametrize("until", gl.Until)
def test_a_level_that_is_not_reached_has_no_loop(until):
    pull = UniaxialTension(until=until, samples=100)
    once = gl.simulate(small_sample(12), BRITTLE, pull)
    found = gl.simulate(small_sample(12), BRITTLE, Cyclic(test=pull, levels=(5e-5, 1e-3)))
    assert found.curves["stage"][-1] == 2
    assert found.curves["strain"].max() == pytest.approx(once.curves["strain"].max(), rel=0.02)
    assert len(found.summary["unloading_moduli"]) == 1


@pytest.mark.thorough
def test_cycles_of_an_elastic_specimen_lose_nothing():
    press = UniaxialCompression(maximum_strain=4e-4, samples=100)
    cycles = Cyclic(test=press, levels=(1e-4, 2e-4))
    result = gl.simulate(small_sample(20), LINEAR, cycles)
    assert result.curves["stage"].max() == 4
    assert result.summary["unloading_moduli"] == pytest.approx([result.summary["apparent_modulus"]] * 2, rel=0.01)
    stored = 0.5 * 53e9 * np.array([1e-4, 2e-4]) ** 2
    assert np.abs(result.summary["lost_work"]) == pytest.approx(0 * stored, abs=0.02 * stored[1])
    stress = result.curves["stress"]
    turned = [stress[result.curves["stage"] == stage] for stage in range(5)]
    assert turned[1][-1] < 0.12 * turned[1][0]
    assert turned[4][-1] == pytest.approx(gl.simulate(small_sample(20), LINEAR, press).curves["stress"][-1], rel=0.01)


@pytest.mark.thorough
def test_levels_count_from_the_end_of_a_heating():
    """Elastic, heated by 100 K, which strains it by four times the level: it unloads at the level all the same."""
    warm = small_sample(12, material=Thermal(material=ROCK, expansion=8e-6))
    press = UniaxialCompression(maximum_strain=4e-4, samples=40, loading=gl.Constant(speed=0.1))
    heating = Heating(to=120, samples=10, loading=gl.HeatingRate(rate=1e5), test=press)
    found, cold = (gl.simulate(warm, LINEAR, Cyclic(test=test, levels=(2e-4,))) for test in (heating, press))
    strain, stage = found.curves["strain"], found.curves["stage"]
    assert found.stages == ["heat to 120 °C", "rest", "load 1", "unload 1", "compression"]
    assert strain[stage == 2][-1] - strain[stage == 1][-1] == pytest.approx(2e-4, abs=2e-5)
    assert found.begins == np.argmax(stage == 2)
    assert found.summary["unloading_moduli"] == pytest.approx(cold.summary["unloading_moduli"], rel=0.01)


@pytest.mark.thorough
def test_cycles_of_grains_that_slide_lose_work():
    """Friction alone under confinement: every loop costs, and more the farther it goes."""
    press = BiaxialCompression(confinement=10e6, maximum_strain=1.2e-3, samples=200, stop_fraction=0)
    cycles = Cyclic(test=press, levels=(4e-4, 8e-4), load="deviator", unload_to=0.0)
    result = gl.simulate(small_sample(30), Friction(**STIFF, friction_angle=15), cycles)
    assert result.curves["stage"].max() == 5
    first, second = result.summary["lost_work"]
    assert 0 < first < second


@pytest.mark.parametrize(
    ("region", "test", "says"),
    [
        (disc(20 * mm), UniaxialCompression(), "no boundary named left or right .it has: bottom, rim, top"),
        (disc(20 * mm), BiaxialCompression(confinement=1e6), "no boundary named left or right"),
        (rectangle(10 * mm, 20 * mm), ThreePointBending(), "no boundary named load or support_left or support_right"),
        (rectangle(10 * mm, 20 * mm), SemiCircularBend(), "no boundary named load"),
        (rectangle(10 * mm, 20 * mm), DirectShear(normal_stress=0), "it must have two, one on the other"),
        (semi_disc(20 * mm, notch_depth=4 * mm, notch_width=1 * mm, span=12 * mm, bearing=2 * mm), Brazilian(),
         "no boundary named top .it has: bottom, load, notch"),
        (rectangle(20 * mm, 20 * mm), Brazilian(), "no disc: its rim is 1.41 to 1.41 times half of its width"),
    ],
)  # fmt: skip
def test_a_specimen_that_does_not_fit_is_refused(region, test, says):
    specimen = gl.Specimen(Voronoi(grains=12, seed=1).tessellate(region), ROCK)
    with pytest.raises(gl.ParameterError, match=says):
        gl.simulate(specimen, LINEAR, test)


def test_the_loops_of_given_curves_lose_what_they_enclose():
    """Up to (2, 2), down a straight line to (1, 0), up again by (1.5, 2): a triangle of height 1 over a base of 1.

    Then up to (4, 6), down to (3, 0) and up by (3.5, 6): a triangle of 1.5. Over half the way it is twice
    as stiff, and loses half of the work.
    """

    @attrs.frozen
    class Given(gl.LoadingProtocol):
        def stages(self, specimen):
            return []

        def measure(self, state):
            return {}

        def summary(self, curves, specimen):
            return {"kept": 1}

    x = np.array([0, 2, 2, 1.5, 1, 1, 1.5, 2, 4, 4, 3.5, 3, 3, 3.5, 4, 5])
    y = np.array([0, 2, 2, 1.0, 0, 0, 2.0, 2, 6, 6, 3.0, 0, 0, 6.0, 6, 6])
    stage = np.repeat([0, 1, 2, 3, 4], [2, 3, 4, 3, 4])
    test = Cyclic(test=Given(), levels=(2, 4), displacement="x", load="y")
    given = {"x": x, "y": y, "stage": stage, "shear_cracks": 0 * x}
    found = test.summary(given | {"tensile_cracks": np.array([0, 3, 3, 3] + 12 * [4])}, None)
    assert np.isnan(found.pop("felicity_ratios")).tolist() == [True, True]
    assert found.pop("residual_strains") == [1.0, 3.0]
    assert found == {"kept": 1, "unloading_moduli": [2.0, 6.0], "lost_work": pytest.approx([0.5, 1.5], rel=1e-4)}
    fails = {**given, "y": np.where((stage == 4) & (y > 0), 3.0, y), "tensile_cracks": 0 * x}
    lost = test.summary(fails, None)["lost_work"]
    assert lost == pytest.approx([0.5, math.nan], nan_ok=True, rel=1e-4)  # it failed in the second
    # A contact point breaks at 1.5 of the 2 before, then one at all of the 6 before; one in unloading does not count.
    y[6] = 1.5
    found = test.summary(given | {"tensile_cracks": np.array([0, 3, 3, 3, 4, 4, 5, 6, 7, 7, 7, 7, 7, 7, 8, 8])}, None)
    assert found["felicity_ratios"] == [0.75, 1.0]
    # The same, by points that break in tension at first, and in shear from the second unloading on.
    sheared = {**given, "tensile_cracks": np.repeat([0, 3, 4], [1, 3, 12]), "x": x / 2,
               "shear_cracks": np.repeat([0, 1, 2, 3, 4], [6, 1, 1, 6, 2])}  # fmt: skip
    assert attrs.evolve(test, levels=(1, 2)).summary(sheared, None) == {
        "kept": 1, "unloading_moduli": [4.0, 12.0], "lost_work": pytest.approx([0.125, 0.75], rel=1e-4),
        "residual_strains": [0.5, 1.5], "felicity_ratios": [0.75, 1.0],
    }  # fmt: skip
    higher = y + 0.5  # what is left when unloading ends is drawn on to nothing
    assert test.summary({**given, "y": higher, "tensile_cracks": 0 * x}, None)["residual_strains"] == pytest.approx(
        [1 - 0.5 / 2, 3 - 0.5 / 6]
    )
    first = {name: values[:9] for name, values in given.items()} | {"tensile_cracks": np.zeros(9)}
    assert test.summary(first, None)["unloading_moduli"] == [2.0]  # it was not unloaded again
    for ends, count in ((14, 2), (13, 1), (11, 1), (7, 1), (6, 0)):  # of a loop, two rows down and two up
        part = {name: values[:ends] for name, values in sheared.items()}
        assert len(attrs.evolve(test, levels=(1, 2)).summary(part, None)["lost_work"]) == count


def test_a_test_without_a_drive_cannot_be_reversed():
    """As creep, whose modulus would be that of a loop that never was; loops of loops would lose those inside."""
    with pytest.raises(gl.ParameterError, match=r"Cyclic: test = .* last stage, here 'creep', has a Drive to reverse"):
        Cyclic(test=Creep(load=1e7, duration=1.0), levels=(1e-3,)).stages(small_sample(12))
    with pytest.raises(gl.ParameterError, match=r"Cyclic: test = .* without loops"):
        Cyclic(test=Cyclic(levels=(1e-3,)), levels=(2e-3,))


@pytest.mark.parametrize(
    "levels", [(), (0.2, 0.1), (-0.1,), 0.1, [0.2, 0.1], (True, 2), (math.nan,), (1e-3, math.inf), np.array(0.1)]
)
def test_levels_must_grow(levels):
    with pytest.raises(gl.ParameterError, match="Cyclic: levels"):
        Cyclic(levels=levels)
    assert Cyclic(levels=[0.1, 0.2]) == Cyclic(levels=np.array([0.1, 0.2])) == Cyclic(levels=(0.1, 0.2))


def test_a_level_beyond_the_end_of_the_test_is_refused():
    """In per cent for a share, or of another test."""
    cycles = Cyclic(test=UniaxialCompression(maximum_strain=1e-3), levels=(5e-4, 0.06))
    with pytest.raises(
        gl.ParameterError, match=r"levels = 0\.06 is not allowed, the test UniaxialCompression ends at a s"
    ):
        cycles.stages(small_sample(4))
    assert attrs.evolve(cycles, levels=(5e-4, 1e-3)).stages(small_sample(4))


@pytest.mark.thorough
def test_a_specimen_that_breaks_under_its_confinement_is_reported():
    """Weak joints of a pile that is free to slide inside: the confining stage ends with the data so far."""
    specimen = gl.Specimen(Bricks(rows=4, columns=2).tessellate(rectangle(10 * mm, 20 * mm)), ROCK)
    tilted = small_sample(40)
    weak = MohrCoulomb(**STIFF, tensile_strength=1e3, cohesion=1e4, friction_angle=1, residual_friction_angle=0)
    with pytest.raises(gl.StageError, match=r"contact points broke under the confinement of 200 MPa alone") as caught:
        gl.simulate(tilted, weak, BiaxialCompression(confinement=200e6))
    assert len(caught.value.result.cracks) > 1
    assert np.isfinite(caught.value.result.curves["stress"]).all()
    assert gl.simulate(specimen, LINEAR, BiaxialCompression(confinement=1e6, maximum_strain=1e-4)).summary


@pytest.mark.thorough
def test_toughness_of_a_notched_beam_is_that_at_its_tip():
    """By the load and the published shape factor, and by an integral round the tip; a span of 3.2 heights."""
    region = notched_beam(95 * mm, 25 * mm, notch_depth=8 * mm, notch_width=0.5 * mm, span=80 * mm, bearing=3 * mm)
    block = Voronoi(grains=80, seed=1).tessellate(rectangle(25 * mm, 25 * mm))
    beam, stiff = Voronoi(grains=300, seed=1).tessellate(region), Linear(kn=1e15, ks=1e15)
    specimen = gl.Specimen(beam, ROCK, refinement=1)
    result = gl.simulate(specimen, stiff, ThreePointBending(maximum_deflection=4e-6, samples=100), frames=2)
    elastic = gl.elastic_properties(gl.Specimen(block, ROCK, refinement=1), stiff)
    tip = gl.notch_tip(specimen, inner=3 * mm, outer=7 * mm)
    plane = {name: getattr(elastic, name) for name in ("apparent_modulus", "apparent_poisson")}
    at_tip = gl.stress_intensity(result, tip, **plane).mode_i
    assert result.summary["largest_toughness"] == pytest.approx(at_tip, rel=0.03)
    assert np.isnan(result.summary["toughness"])  # springs do not break


@pytest.mark.parametrize("depth", [0.1, 0.2, 0.3, 0.4, 0.5, 0.6])
def test_the_shape_factor_of_a_beam_is_that_of_the_handbook(depth):
    """Tada, Paris and Irwin 2000: a span of eight heights."""
    fitted = 1.106 - 1.552 * depth + 7.71 * depth**2 - 13.53 * depth**3 + 14.23 * depth**4
    assert beam_shape_factor(depth, 8) == pytest.approx(np.sqrt(np.pi * depth) * fitted, rel=0.015)
