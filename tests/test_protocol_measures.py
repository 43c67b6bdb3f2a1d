"""What protocols measure on boundaries, and what their stages impose, by hand."""

import math
import warnings
from types import SimpleNamespace

import attrs
import numpy as np
import pytest
from support import ROCK

import grainlaw as gl
from grainlaw.gauges import points_on
from grainlaw.geometry import (
    Bricks,
    Voronoi,
    between_platens,
    disc,
    moved,
    notched_beam,
    plate_with_hole,
    rectangle,
    semi_disc,
    shear_box,
)
from grainlaw.geometry.bodies import renamed
from grainlaw.protocols import (
    BiaxialCompression,
    Brazilian,
    Creep,
    DirectShear,
    Excavation,
    FreeMotion,
    Heating,
    JointTension,
    PlaneWave,
    SemiCircularBend,
    ThreePointBending,
    UniaxialCompression,
    UniaxialTension,
    Wave,
)
from grainlaw.protocols.bending import ligament, notch_depth
from grainlaw.protocols.creep import lowest_rate
from grainlaw.protocols.measures import certificate, failure_of
from grainlaw.units import mm

BLOCK = gl.Specimen(Bricks(rows=1).tessellate(rectangle(4e-3, 8e-3)), ROCK, refinement=3)  # eight parts of each side
STEEL = gl.Elastic(youngs_modulus=200e9, poissons_ratio=0.3, density=7850)


@pytest.mark.parametrize(
    ("boundary", "count", "share", "places"),
    [
        ("left", 1, 1.0, [4]), ("left", 2, 1.0, [2, 6]), ("left", 2, 0.5, [3, 5]), ("right", 4, 1.0, [1, 3, 5, 7]),
        ("top", 2, 1.0, [1, 3]), ("bottom", 4, 0.5, [1.25, 1.75, 2.25, 2.75]),
    ],
)  # fmt: skip
def test_points_lie_in_the_middle_of_equal_parts(boundary, count, share, places):
    """mm along the boundary, or the node nearest to it."""
    nodes = BLOCK.mesh.nodes[points_on(BLOCK.mesh, boundary, count, share)]
    along = nodes[:, 1 if boundary in ("left", "right") else 0] * 1e3
    step = 1.0 if boundary in ("left", "right") else 0.5
    assert np.abs(along - places).max() <= step / 2 + 1e-12
    assert np.array_equal(along, np.sort(along))


@pytest.mark.parametrize("overhang", [0.0, 2e-3])
def test_a_shear_test_presses_with_its_stress_on_the_specimen(overhang):
    """Whatever the length of the platen: force and stiffness are those of the specimen's width, in every stage."""
    joint = Bricks(rows=2).tessellate(rectangle(40e-3, 20e-3))
    specimen = gl.Specimen(between_platens(joint, 5e-3, overhang), {0: ROCK, 1: STEEL})
    test = DirectShear(normal_stress=3e6, normal_stiffness=2e10, reverse_to=0.5)
    length = specimen.mesh.boundary_lengths["top"]
    stages = test.stages(specimen)
    assert [stage.name for stage in stages] == ["press", "shear", "reverse"]
    assert length == pytest.approx(40e-3 + 2 * overhang)
    for stage in stages:
        (hold,) = stage.of(gl.loads.Hold)
        assert hold.stress * length == pytest.approx(-3e6 * 40e-3)
        assert hold.stiffness * length == pytest.approx(0 if stage.name == "press" else 2e10 * 40e-3)


# --- measures of a motion and of forces that are given ----------------------------------------------------------------


def seen(specimen, displacement, forces=(), **more):
    """What a protocol reads of a state; means over steps are 0.9 of the displacement, as they lag behind it."""
    forces = dict(forces)
    return SimpleNamespace(
        specimen=specimen, mesh=specimen.mesh, displacement=displacement,
        mean_displacement=None if displacement is None else 0.9 * displacement,
        moved=lambda name: 0.9 * displacement[specimen.mesh.boundaries[name]].mean(axis=0),
        reaction=lambda name: np.array(forces.get(name, (0.0, 0.0))), **more,
    )  # fmt: skip


def strained(specimen, xx, yy):
    """An even strain, and a motion as a whole."""
    return specimen.mesh.nodes * [xx, yy] + [3e-6, -5e-6]


#: 4 mm wide, 8 mm high; the rows 3 to 6 lie in the middle half
ROWS = gl.Specimen(moved(Bricks(rows=8).tessellate(rectangle(4e-3, 8e-3)), by=(-7e-3, 50e-3)), ROCK)
ROW_STRESS = np.outer(np.arange(8.0) ** 2, [1e6, -2e6, 3e6])
MIDDLE = (4 + 9 + 16 + 25) / 4


def test_between_platens_forces_are_over_the_width_and_strains_over_the_sides():
    state = seen(
        ROWS, strained(ROWS, 1e-3, -2e-3), {"top": (7.0, -8e3), "bottom": (7.0, 6e3)}, grain_stress=lambda: ROW_STRESS
    )
    expected = {
        "strain": 1.8e-3, "stress": 1.75e6, "stress_top": 2e6, "stress_bottom": 1.5e6, "strain_points": 1.8e-3,
        "stress_window": 2e6 * MIDDLE, "lateral_strain": 0.9e-3, "volumetric_strain": -0.9e-3,
    }  # fmt: skip
    assert UniaxialCompression().measure(state) == pytest.approx(expected, rel=1e-12)
    kept = ("lateral_strain", "volumetric_strain")
    pulled = {name: value if name in kept else -value for name, value in expected.items()}
    assert UniaxialTension().measure(state) == pytest.approx(pulled, rel=1e-12)


def test_where_no_grain_lies_in_the_middle_all_of_the_rock_counts():
    """Of two blocks by their areas, not of the platens."""
    grains = between_platens(Bricks(rows=2).tessellate(rectangle(4e-3, 2e-3)), 1e-3, 1e-3)
    specimen = gl.Specimen(grains, {0: ROCK, 1: STEEL})
    rock = specimen.grains.phase == 0
    stress = np.where(rock[:, None], -1e6, 5e9) * np.ones(3)
    found = UniaxialCompression().measure(seen(specimen, strained(specimen, 0, 0), grain_stress=lambda: stress))
    assert found["stress_window"] == pytest.approx(1e6, rel=1e-12)


def test_a_confined_specimen_has_a_deviator_and_a_share_of_broken_bonds():
    """Points of two groups of bonds; one of their four that have a bond at all has broken."""
    groups = [
        SimpleNamespace(cohesive=np.array([[0, 1], [4, 5]])),
        SimpleNamespace(cohesive=np.zeros((2, 0), dtype=int)),
    ]
    broken = np.full(8, np.nan)
    broken[[2, 4]] = 1e-5
    state = seen(
        ROWS, strained(ROWS, 0, 0), {"top": (0, -8e3), "bottom": (0, 8e3)}, grain_stress=lambda: ROW_STRESS,
        bonds=SimpleNamespace(groups=groups), broken_time=broken,
    )  # fmt: skip
    found = BiaxialCompression(confinement=0.5e6).measure(state)
    assert (found["deviator"], found["broken_bonds"]) == pytest.approx((1.5e6, 0.25))


def test_the_stress_in_a_disc_is_two_p_over_pi_d():
    """P = 3 kN/m; in the middle are the grains within a tenth of D of the centre, by their areas."""
    centre = np.array([50e-3, 30e-3])
    specimen = gl.Specimen(moved(Voronoi(grains=200, seed=1).tessellate(disc(20e-3)), by=centre), ROCK)
    width = np.ptp(specimen.mesh.nodes[:, 0])
    far, areas = np.hypot(*(specimen.grains.centroids - centre).T) / width, specimen.grains.areas
    stress = np.outer(np.where(far <= 0.1, 1 + far, 1e6), [1.0, -3.0, 0.0])
    force = {"top": (9.0, -4e3), "bottom": (9.0, 2e3)}
    found = Brazilian(shape_factor=0.9).measure(
        seen(specimen, strained(specimen, 1e-3, -2e-3), force, grain_stress=lambda: stress)
    )
    middle, split = np.average(1 + far[far <= 0.1], weights=areas[far <= 0.1]), 0.9 * 2 / (math.pi * width)
    assert width == pytest.approx(20e-3, rel=2e-3)
    expected = {
        "strain": 1.8e-3, "force": 3e3, "stress": split * 3e3, "stress_top": split * 4e3, "stress_bottom": split * 2e3,
        "middle_across": middle, "middle_along": -3 * middle,
    }  # fmt: skip
    assert found == pytest.approx(expected, rel=1e-9)


NOTCHED = gl.Specimen(
    Voronoi(grains=40, seed=1).tessellate(
        notched_beam(length=0.1, height=0.02, span=0.08, notch_depth=0.005, notch_width=0.002, bearing=0.004)
    ),
    ROCK,
)


@pytest.mark.parametrize("test", [ThreePointBending(), SemiCircularBend()])
def test_a_beam_sinks_against_its_supports_and_its_notch_opens(test):
    """One support sinks by 14, the other by 6, the load by 30 um; the upper corners of the notch do not count."""
    x, y = NOTCHED.mesh.nodes.T
    sunk = -10e-6 - 1e-3 * y + 4e-6 * np.sign(x - 0.05) * (np.abs(x - 0.05) > 0.02)
    motion = np.column_stack([4e-6 + 3e-3 * x + 1e-3 * np.sign(x - 0.05) * y, sunk])
    force = {"load": (1.0, -3e3), "support_left": (1.0, 1e3), "support_right": (1.0, 1.5e3)}
    expected = {"deflection": 18e-6, "force": 2750.0, "force_top": 3e3, "force_bottom": 2500.0, "mouth": 5.4e-6}
    assert test.measure(seen(NOTCHED, motion, force)) == pytest.approx(expected, rel=1e-9)


def test_a_shear_box_adds_up_what_its_halves_hold():
    region = shear_box(30e-3, 8e-3, 4e-3)
    specimen = gl.Specimen(Voronoi(grains=20, seed=1).tessellate(region), ROCK)
    width, height = np.ptp(specimen.mesh.nodes, axis=0)
    nodes = specimen.mesh.nodes
    motion = np.column_stack([2e-3 * nodes[:, 1] + 1e-6, 1e-3 * nodes[:, 1]])
    force = {
        "top": (100.0, -6e3), "left_upper": (200.0, 9.0), "right_upper": (300.0, 9.0), "bottom": (-10.0, 9.0),
        "left_lower": (-20.0, 9.0), "right_lower": (-30.0, 9.0),
    }  # fmt: skip
    expected = {
        "displacement": 0.9 * motion[specimen.mesh.boundaries["top"], 0].mean(), "dilation": 0.9e-3 * height,
        "shear_stress": 330 / width, "shear_stress_top": 600 / width, "shear_stress_bottom": 60 / width,
        "normal_stress": 6e3 / width,
    }  # fmt: skip
    assert DirectShear(normal_stress=1e6).measure(seen(specimen, motion, force)) == pytest.approx(expected, rel=1e-12)


def test_the_means_over_a_joint_leave_out_the_contacts_in_platens():
    """Two points of one contact, by their lengths; the tangent runs to the left, so slip and shear change sign."""
    grains = between_platens(Bricks(rows=2).tessellate(rectangle(4e-3, 2e-3)), 1e-3, columns=2)
    specimen = gl.Specimen(grains, {0: ROCK, 1: STEEL})
    rock, pairs = specimen.grains.phase == 0, specimen.mesh.interface_grains
    order = np.arange(len(pairs))[::-1]
    joint = np.tile(rock[pairs].all(axis=1)[order], 2)
    assert joint.sum() == 2
    first, second = np.flatnonzero(joint)
    values = np.full(len(joint), 1e9)
    values[first], values[second] = 1.0, 5.0
    lengths = np.ones(len(joint))
    lengths[second] = 3.0
    state = seen(
        specimen, strained(specimen, 0, 2e-3), {"top": (8.0, 8e3), "bottom": (-4.0, -4e3)}, contact_lengths=lengths,
        bonds=SimpleNamespace(order=order), opening=values, slip=2 * values, normal=3 * values, shear=4 * values,
        memory=lambda name: {"damage": np.where(np.arange(len(joint)) == second, 1.0, 0.99)}[name],
    )  # fmt: skip
    means = {"opening": 4.0, "slip": -8.0, "normal": 12.0, "shear": -16.0, "broken": 0.75}
    pulled = {"pressure": -12.0, "stress": 1.5e6, "stress_top": 2e6, "stress_bottom": 1e6}
    pulled["strain"] = 0.9 * (2e-3 * 3e-3 - 5e-6) / 2e-3
    assert JointTension().measure(state) == pytest.approx(means | pulled, rel=1e-9)
    slid = {
        "displacement": 0.9 * 3e-6, "dilation": 0.9 * 2e-3 * 2e-3, "shear_stress": 1.5e3, "shear_stress_top": 2e3,
        "shear_stress_bottom": 1e3, "normal_stress": -2e6,
    }  # fmt: skip
    assert DirectShear(normal_stress=0).measure(state) == pytest.approx(means | slid, rel=1e-9)


@pytest.mark.parametrize(("wave", "axis"), [(Wave.P, 0), (Wave.BAR, 0), (Wave.S, 1)])
def test_a_gauge_reads_the_zones_within_a_grain_size_of_it(wave, axis):
    """By their areas; without places at a quarter and three quarters of the length, which begins at 10 mm."""
    specimen = gl.Specimen(moved(Voronoi(grains=40, seed=1).tessellate(rectangle(40e-3, 4e-3)), by=(10e-3, 0)), ROCK)
    mesh, size = specimen.mesh, specimen.grains.grain_size
    x = mesh.nodes[mesh.zones, 0].mean(axis=1)
    stress = np.outer(x, [1.0, 100.0, 10.0])
    velocity = np.column_stack([mesh.nodes[:, 0], 10 * mesh.nodes[:, 0]])
    state = seen(specimen, 0 * mesh.nodes, zone_state=lambda: (stress,), velocity=velocity)
    expected = {}
    for k, place in enumerate((20e-3, 40e-3)):
        near = np.abs(x - place) <= size
        expected |= {f"{name}_{k}": 10**axis * np.average(x[near], weights=mesh.zone_areas[near])
                     for name in ("stress", "velocity")}  # fmt: skip
    assert PlaneWave(wave=wave).measure(state) == pytest.approx(expected, rel=1e-12)


def test_a_gauge_needs_a_zone_near_it():
    """Of rows of one brick, whose zones have their middles at thirds of the length, far from an end."""
    specimen = gl.Specimen(Bricks(rows=40, columns=1).tessellate(rectangle(40e-3, 40e-3)), ROCK)
    with pytest.raises(gl.ParameterError, match=r"gauges = 0.0001 m has no zone whose middle is within a grain size"):
        PlaneWave(gauges=(1e-4,)).stages(specimen)


def test_a_half_disc_without_a_notch_has_no_toughness():
    grains = Voronoi(grains=30, seed=1).tessellate(rectangle(40e-3, 20e-3))
    plain = renamed(grains, {"top": "load", "left": "support_left", "right": "support_right"})
    with pytest.raises(gl.ParameterError, match="SemiCircularBend: the specimen has no boundary named notch"):
        SemiCircularBend().stages(gl.Specimen(plain, ROCK))


@pytest.mark.parametrize(("depth", "span", "told"), [(8, 24, False), (12.3, 24, True), (8, 18, True)])
def test_a_half_disc_beyond_the_published_formula_is_warned_of(depth, span, told):
    region = semi_disc(40 * mm, notch_depth=depth * mm, notch_width=1 * mm, span=span * mm, bearing=2 * mm)
    half = gl.Specimen(Voronoi(grains=60, seed=1).tessellate(region), ROCK)
    with warnings.catch_warnings(record=True) as found:
        warnings.simplefilter("always")
        SemiCircularBend().stages(half)
    assert [f"here {depth / 20:.3g} and {span / 40:.3g}" in str(each.message) for each in found] == [True] * told


def test_free_motion_of_nothing_has_no_centre():
    specimen = gl.Specimen(Bricks(rows=2, columns=1).tessellate(rectangle(4e-3, 4e-3)), ROCK)
    curves = {name: np.zeros(2) for name in ("largest_speed", "mean_speed", "centre_x", "centre_y")}
    found = FreeMotion(duration=1e-6, fixed=[0, 1]).summary(curves, specimen)
    assert np.isnan([found["centre_moved_x"], found["centre_moved_y"]]).all()


def test_an_opening_has_the_width_between_its_ends():
    """Its rim moves with the square of the angle from an axis: only what lies within 10 degrees of it counts."""
    grains = Voronoi(grains=60, seed=1).tessellate(plate_with_hole(0.1, 0.1, 0.02, sides=72))
    specimen = gl.Specimen(moved(grains, by=(0.2, 0.3)), ROCK)
    rim = specimen.mesh.boundaries["hole"]
    angle = np.degrees(np.arctan2(*(specimen.mesh.nodes[rim] - [0.2, 0.3]).T[::-1]))
    motion = np.zeros((len(specimen.mesh.nodes), 2))
    motion[rim, 0] = np.where(np.abs(angle) < 90, 1e-6, -3e-6) * (1 + (np.abs(np.abs(angle) - 90) < 79) * 1e3)
    motion[rim, 1] = np.where(angle > 0, 2e-6, 1e-5) * (1 + (np.abs(np.abs(angle) - 90) > 11) * 1e3)
    found = Excavation().measure(seen(specimen, motion + np.array([5e-6, 7e-6])))
    assert found == pytest.approx({"width": 4e-6, "height": -8e-6}, rel=1e-9)


def test_heating_measures_its_expansion_and_the_mean_stress():
    stress = np.outer([1.0, 4.0], [1e6, -2e6, 3e6])
    halves = gl.Specimen(Bricks(columns=2, rows=1).tessellate(rectangle(4e-3, 8e-3)), ROCK)
    found = Heating(to=100).measure(seen(halves, strained(halves, 1e-3, 2e-3), grain_stress=lambda: stress))
    expected = {"expansion_x": 1e-3, "expansion_y": 2e-3, "stress_x": 2.5e6, "stress_y": -5e6}
    assert found == pytest.approx(expected, rel=1e-12)


# --- summaries of curves that are given -------------------------------------------------------------------------------

#: peaks at the eighth sample and falls; above a tenth of it from the fourth on, with a dip that is no failure
LOAD = np.array([0, 0.5, 0.9, 2, 3, 2.9, 6, 10, 4, 3])
WAY = np.array([0, 1, 2, 3, 4, 4.02, 6, 7, 8, 9])


def given(**columns):
    """Curves of a test that was quasi-static, in which nothing broke."""
    none = np.zeros(len(LOAD))
    usual = {"energy_zones": none + 100, "energy_contacts_normal": none, "energy_contacts_shear": none}
    usual |= {"stage": none, "vibration": none, "imbalance": none, "stability": none + 1, "temperature": none + 20}
    return usual | {name: np.asarray(values, dtype=float) for name, values in columns.items()}


def test_a_certificate_is_of_the_rise_from_a_tenth_of_the_load_at_failure():
    """Up to the sample before it. It was unstable at both ends where the load grew from 2 to 3, and where it fell."""
    curves = given(
        load=LOAD, way=WAY, stability=[-1, np.nan, 1, -1, -1, -1, 1, 1, -1, -1],
        vibration=[9, 9, 9, 1, 2, 4, 1, 9, 9, 9], imbalance=[9, 9, 9, 0.01, 0.03, 0.02, 0, 9, 9, 9],
        energy_zones=[1, 1, 1, 50, 50, 50, 10, 1, 1, 1], energy_contacts_normal=[0, 0, 0, 50, 20, 20, 20, 0, 0, 0],
        energy_contacts_shear=[0, 0, 0, 0, 5, 10, 0, 0, 0, 0],
    )  # fmt: skip
    found = certificate(curves, failure_of(curves, "load", "way"), "load")
    assert found == pytest.approx({"kinetic_ratio": 4 / 80, "imbalance": 0.03, "unstable_rise": 0.1})
    late = curves | {"load": np.array([0, 0, 0, 0, 0.9, 1.2, 5, 10, 4, 3])}  # from the sixth: two samples are too few
    assert np.isnan(list(certificate(late, failure_of(late, "load", "way"), "load").values())).all()
    late["load"][4] = 1.1
    assert np.isfinite(list(certificate(late, failure_of(late, "load", "way"), "load").values())).all()
    assert np.isnan(list(certificate(curves | {"load": 0 * LOAD}, None, "load").values())).all()


#: a block of plane strain with E = 60 GPa and nu = 0.25, up to its strength at 60 MPa; pressed, then pulled
STRESS = np.array([0, 6, 12, 18, 24, 30, 40, 60, 20, 10]) * 1e6
STRAIN = np.append(STRESS[:-3] / 64e9, [1.2e-3, 1.3e-3, 1.5e-3])
CERTIFIED = {"kinetic_ratio": 0.0, "imbalance": 0.0, "unstable_rise": 0.0}
MODULI = {"apparent_modulus": 64e9, "apparent_poisson": 1 / 3, "modulus": 60e9, "poisson": 0.25}


@pytest.mark.parametrize(("test", "sign"), [(UniaxialCompression(), -1), (UniaxialTension(), 1)])
def test_what_a_uniaxial_test_tells(test, sign):
    curves = given(stress=STRESS, strain=STRAIN, lateral_strain=-sign * STRAIN / 3)
    expected = {"strength": 60e6, "failure_strain": 1.2e-3, "largest_stress": 60e6, **MODULI, **CERTIFIED}
    assert test.summary(curves, ROWS) == pytest.approx(expected, rel=1e-9)
    few = curves | {"stress": np.array([0, 1, 2, 20, 31, 32, 40, 60, 20, 10]) * 1e6}  # one is in the middle
    assert np.isnan([test.summary(few, ROWS)[name] for name in MODULI]).all()


def test_a_confined_test_counts_from_the_confined_state():
    """Its strength is that of the deviator and the confinement."""
    n = 3
    before = {"stress": [0, 4e6, 8e6], "strain": [0, 1e-4, 2e-4], "lateral_strain": [0, 1e-5, 2e-5]}
    part = {"stress": STRESS + 8e6, "strain": STRAIN + 2e-4, "lateral_strain": STRAIN / 3 + 2e-5}
    curves = {name: np.append(before[name], part[name]) for name in part}
    rest = {name: np.append(np.zeros(n), values) for name, values in given().items()}
    curves = rest | curves | {"stage": np.append(np.zeros(n), np.ones(10)), "deviator": curves["stress"] - 8e6}
    found = BiaxialCompression(confinement=8e6).summary(curves, ROWS)
    strong = {"strength": 68e6, "failure_strain": 1.2e-3, "largest_stress": 68e6, "confinement": 8e6}
    assert found == pytest.approx(strong | MODULI | CERTIFIED, rel=1e-9)


def test_a_confined_test_ends_by_what_it_counts_from_the_confined_state():
    columns = {"stage": [0, 0, 1, 1], "strain": [0, 2, 3, 7], "damaged": [0, 1, 1, 4], "stress": [1, 2, 3, 4]}
    curves = {name: np.array(values, dtype=float) for name, values in columns.items()}
    seen = BiaxialCompression(confinement=8e6).counted(curves, 2)
    assert {name: values.tolist() for name, values in seen.items()} == {
        "stage": [0, 0], "strain": [1, 5], "damaged": [0, 3], "stress": [3, 4],
    }  # fmt: skip
    confining = BiaxialCompression(confinement=8e6).counted(curves, 0)
    assert confining["strain"].tolist() == [0, 2, 3, 7]
    assert BiaxialCompression(confinement=0).counted(curves, 2)["strain"].tolist() == [3, 7]


def test_few_samples_after_the_confinement_do_not_end_it():
    """The first one after it has a tenth of the load already, and a deformation too."""
    load = np.array([-8, 0, 10, 20, 30, 40, 50, 60, 60, 60]) * 1e6
    strain = np.array([0, 20, 36, 51, 67, 82, 98, 114, 117, 119]) * 1e-5
    stage = np.append([0, 0], np.ones(8))
    curves = given(stress=load + 8e6, deviator=load, strain=strain, lateral_strain=strain / 3, stage=stage)
    found = BiaxialCompression(confinement=8e6).summary(curves, ROWS)
    assert found["strength"] == pytest.approx(68e6)
    assert found["failure_strain"] == pytest.approx(94e-5)


def test_what_a_split_disc_tells():
    curves = given(stress=STRESS, strain=STRAIN, force=STRESS * 1e-3)
    expected = {"strength": 60e6, "failure_force": 60e3, "failure_strain": 1.2e-3, "largest_stress": 60e6}
    assert Brazilian().summary(curves, ROWS) == pytest.approx(expected | CERTIFIED, rel=1e-9)


def test_what_a_bent_beam_tells():
    """The moment P S/4 over h^2/6; the work over the ligament h. The half disc by Kuruppu and others 2014, by hand."""
    force, way = LOAD * 1e3, WAY * 1e-5
    curves = given(force=force, deflection=way)
    work = sum((force[k] + force[k + 1]) / 2 * (way[k + 1] - way[k]) for k in range(9)) / 0.015
    common = {"failure_force": 1e4, "failure_deflection": 7e-5, "largest_force": 1e4, "work_of_fracture": work}
    flexural = 1e4 * 0.08 / 4 / (0.015**2 / 6)
    beam = {"flexural_strength": flexural, "largest_flexural_strength": flexural}
    inner = 1.99 - 0.25 * 0.75 * (2.15 - 3.93 * 0.25 + 2.7 * 0.25**2)  # ASTM E399: a span of four, a quarter notched
    tough = 1e4 * 0.08 / 0.02**1.5 * 3 * math.sqrt(0.25) * inner / (2 * (1 + 2 * 0.25) * 0.75**1.5)
    beam |= {"toughness": tough, "largest_toughness": tough}
    assert ThreePointBending().summary(curves, NOTCHED) == pytest.approx(common | beam | CERTIFIED, rel=1e-9)
    factor = -1.297 + 9.516 * 0.8 - (0.47 + 16.457 * 0.8) * 0.1 + (1.071 + 34.401 * 0.8) * 0.1**2
    toughness = factor * 1e4 * math.sqrt(math.pi * 0.005) / 0.1
    disc = {"toughness": toughness, "largest_toughness": toughness}
    assert SemiCircularBend().summary(curves, NOTCHED) == pytest.approx(common | disc | CERTIFIED, rel=1e-9)
    whole = gl.Specimen(Voronoi(grains=4, seed=1).tessellate(rectangle(0.1, 0.02)), ROCK)
    assert (ligament(whole), notch_depth(whole)) == pytest.approx((0.02, 0.0))
    assert (ligament(NOTCHED), notch_depth(NOTCHED)) == pytest.approx((0.015, 0.005))


def test_what_a_sheared_joint_tells():
    """Its residual stress is that at the end of shearing, before it goes back."""
    stage = [0, 1, 1, 1, 1, 1, 1, 1, 1, 2]
    curves = given(shear_stress=LOAD, displacement=WAY, slip=WAY - 0.5, stage=stage)
    expected = {"strength": 10, "failure_slip": 6.5, "largest_stress": 10, "residual_stress": 4}
    assert DirectShear(normal_stress=0).summary(curves, ROWS) == pytest.approx(expected | CERTIFIED)
    del curves["slip"]
    boxed = expected | {"failure_slip": 7}
    assert DirectShear(normal_stress=0).summary(curves, ROWS) == pytest.approx(boxed | CERTIFIED)
    stopped = curves | {"stage": np.zeros(10)}
    assert DirectShear(normal_stress=0).summary(stopped, ROWS)["residual_stress"] == 3
    whole = {name: values[:5] for name, values in curves.items()}  # it has not failed
    assert np.isnan(DirectShear(normal_stress=0).summary(whole, ROWS)["residual_stress"])


def test_what_a_pulled_joint_tells():
    curves = given(normal=LOAD, opening=WAY, broken=[0, 0, 0, 0, 0, 0, 0.9, 0.99, 1, 1])
    expected = {"strength": 10, "failure_opening": 7, "largest_stress": 10, "breaking_opening": 8}
    assert JointTension().summary(curves, ROWS) == pytest.approx(expected | CERTIFIED)
    curves["broken"][:] = 0.99
    assert np.isnan(JointTension().summary(curves, ROWS)["breaking_opening"])


def test_an_opening_has_closed_since_it_was_full():
    curves = {
        "stage": np.array([0, 0, 0, 1, 1]),
        "width": np.array([0, 3, 9, 5, 2]),
        "height": np.array([0, 1, 4, 5, -7]),
    }
    assert Excavation().summary(curves, ROWS) == {"closure_x": 7, "closure_y": 11}


def test_a_gauge_tells_its_largest_stress_and_velocity_with_their_signs():
    curves = {
        "time": np.arange(4.0), "stress_0": np.array([0, 1, -3, 2.0]), "velocity_0": np.array([0, 1, 2, -4.0]),
        "stress_1": np.array([0, 0, 1, 2.0]), "velocity_1": np.array([0, 5, 2, -4.0]),
    }  # fmt: skip
    assert PlaneWave().summary(curves, ROWS) == {
        "peak_stress_0": -3, "peak_time_0": 2, "peak_velocity_0": -4, "peak_stress_1": 2, "peak_time_1": 3,
        "peak_velocity_1": 5,
    }  # fmt: skip


def test_the_centre_of_bodies_that_move():
    """Of four rows, one fixed, of which two are twice as heavy as the others, by where the nodes have their masses."""
    heavy = gl.Elastic(youngs_modulus=60e9, poissons_ratio=0.25, density=2 * ROCK.density)
    grains = attrs.evolve(Bricks(rows=4).tessellate(rectangle(4e-3, 8e-3)), phase=np.array([0, 0, 1, 1]))
    specimen = gl.Specimen(grains, {0: ROCK, 1: heavy})
    test = FreeMotion(duration=1.0, fixed=[0], tracked=[3])
    place, speed = np.array([[9, 9], [1, 2], [3, 4], [5, 7.0]]), np.array([[9, 9], [3, 4], [0, 1], [0, 0.0]])
    state = seen(specimen, None, grain_motion=lambda: (place, speed), rotation=lambda k: 0.25 * k)
    assert test.measure(state) == pytest.approx({
        "mean_speed": 2, "largest_speed": 5, "centre_x": (1 + 6 + 10) / 5, "centre_y": (2 + 8 + 14) / 5, "x_3": 5,
        "y_3": 7, "rotation_3": 0.75,
    })  # fmt: skip
    curves = {
        "largest_speed": np.array([0, 5, 1.0]), "mean_speed": np.array([0, 3, 2.0]), "centre_x": np.array([0, 0, 1.0]),
        "centre_y": np.array([0, 0, 2.0]),
    }  # fmt: skip
    assert test.summary(curves, specimen) == pytest.approx({
        "largest_speed": 5, "last_mean_speed": 2, "centre_moved_x": 1 - 2e-3, "centre_moved_y": 2 - (3 + 10 + 14) / 5e3,
    })  # fmt: skip
    still = attrs.evolve(test, fixed=[0, 1, 2, 3], tracked=[]).measure(state)
    assert (still["mean_speed"], still["largest_speed"]) == (0, 0)
    assert np.isnan(still["centre_x"])


def test_what_heating_tells_before_a_test_and_without_one():
    """Vibration over all energy, where that is more than a hundredth of its largest; the test counts what it breaks."""
    heating = Heating(to=(300, 20))
    curves = given(
        stage=[0, 0, 0, 1, 1, 2, 3, 3, 3, 3], energy_kinetic=[0, 0, 10, 0, 0, 0, 0, 0, 0, 0],
        energy_zones=[0.5, 1, 80, 60, 1, 1, 1, 1, 1, 1], energy_contacts_normal=np.full(10, 0.0),
        energy_contacts_shear=[0, 0.1, 10, 0, 0, 0, 0, 0, 0, 0], vibration=[0.5, 0.22, 10, 3, 0, 0, 9, 9, 9, 9],
        temperature=[20, 100, 300, 200, 100, 20, 20, 20, 20, 20], tensile_cracks=[0, 1, 2, 2, 2, 3, 5, 5, 5, 5],
        shear_cracks=[0, 0, 0, 1, 1, 4, 4, 6, 6, 6], expansion_x=WAY, expansion_y=2 * WAY,
    )  # fmt: skip
    hot = {"highest_temperature": 300, "thermal_cracks": 7, "heating_kinetic_ratio": 0.2}
    alone = {name: values[:6] for name, values in curves.items()} | {"stage": np.repeat([0.0, 1.0], 3)}
    assert heating.summary(alone, ROWS) == pytest.approx(hot | {"expansion_x": 4.02, "expansion_y": 8.04})

    cooled = Heating(to=-80).summary(alone | {"temperature": np.linspace(-10, -80, 6)}, ROWS)
    assert cooled["highest_temperature"] == 20  # before the first sample

    class Counts(gl.LoadingProtocol):
        quantities = BiaxialCompression.quantities

        def stages(self, specimen):
            return []

        def measure(self, state):
            return {}

        def summary(self, curves, specimen):
            return {name: curves[name].tolist() for name in ("stage", "tensile_cracks", "strain")}

    tested = attrs.evolve(heating, test=Counts())
    after = {"stage": [0, 0, 0, 0], "tensile_cracks": [2, 2, 2, 2], "strain": [1, 2, 3, 4]}
    hot["heating_kinetic_ratio"] = pytest.approx(0.2)
    curves["strain"] = np.arange(10.0)
    curves["broken_bonds"] = np.full(10, 0.3)
    assert (heating.begins(curves), tested.begins(curves)) == (0, 6)
    assert tested.counted(curves, 6)["broken_bonds"].tolist() == [0.0] * 4  # what heat has broken, no confinement has
    assert tested.summary(curves, ROWS) == hot | after
    for first, strain in ((7, [2, 3, 4]), (6, [1, 2, 3, 4]), (3, [3, 4, 5, 6, 7, 8, 9])):  # not while it is heated
        assert tested.counted(curves, first)["strain"].tolist() == strain
    heated = {name: values[:6] for name, values in curves.items()}
    assert tested.summary(heated, ROWS) == hot


def crept(**changed):
    """Loaded in two samples, then held: jumps after the fourth and the sixth sample; at rest at the end."""
    names = ("energy_external", "unbalanced", "motion")
    curves = {name: np.ones(8) for name in names} | {
        "stage": [0, 0, 1, 1, 1, 1, 1, 1], "jumps": [0, 0, 0, 0, 1, 1, 2, 2], "aged": [0, 0, 0, 0, 10, 10, 40, 40],
        "strain": np.array([0, 9, 10, 11, 12, 13, 14, 16]) * 1e-4, "lateral_strain": np.arange(8) * 1e-5,
        "tensile_cracks": [0, 0, 1, 1, 2, 2, 3, 4], "shear_cracks": [0, 1, 1, 1, 1, 2, 2, 2],
    }  # fmt: skip
    for name in names[1:]:
        curves[name] = np.full(8, 1e-5)
    return {name: np.asarray(values, dtype=float) for name, values in (curves | changed).items()}


def test_creep_is_told_by_its_equilibria():
    test = Creep(load=5e7, duration=100.0, failure_strain=7e-4)
    curve = {name: values.tolist() for name, values in test.curve(crept()).items()}
    assert curve == {
        "time": [0, 10, 40], "strain": pytest.approx([11e-4, 13e-4, 16e-4]),
        "lateral_strain": pytest.approx([3e-5, 5e-5, 7e-5]), "cracks": [2, 4, 6],
    }  # fmt: skip
    moving = crept(unbalanced=[0] * 7 + [1], motion=[0] * 7 + [1])
    assert test.curve(moving)["time"].tolist() == [0, 10]  # it does not rest after the last jump
    found = test.summary(crept(), ROWS)
    assert 10 < found.pop("time_of_lowest_rate") < 40
    assert found.pop("lowest_rate") == pytest.approx(1e-5)  # 3e-4 in 30 s, after 2e-4 in 10 s
    assert np.isnan(found.pop("time_to_failure"))
    assert found == {
        "held_stress": 5e7, "confinement": 0.0, "failed": False, "initial_strain": pytest.approx(11e-4),
        "creep_strain": pytest.approx(5e-4), "cracks_at_first": 2, "cracks": 6, "jumps": 2,
    }  # fmt: skip
    broken = attrs.evolve(test, failure_strain=5.9e-4).summary(crept(), ROWS)
    assert (broken["failed"], broken["time_to_failure"]) == (True, 40.0)


def test_the_lowest_rate_is_that_over_a_quarter_of_the_time():
    """A tenth a second, between 4 and 14 s a hundredth; over a quarter, of 5 s."""
    time = np.array([0, 4, 14, 20.0])
    strain = np.array([0, 0.4, 0.5, 1.1])
    fine = np.linspace(0, 20, 20001)
    rate, when = lowest_rate(fine, np.interp(fine, time, strain))
    assert rate == pytest.approx(0.01, rel=1e-6)
    assert 6.4 < when < 11.6
    assert lowest_rate(time, strain)[0] == pytest.approx(0.01)
    # A failure that comes with a jump: before it 0.02 in 3.9 s of 4
    late = np.array([0, 1.3, 2.6, 3.9, 4.0])
    rate, when = lowest_rate(late, np.array([0, 0.005, 0.012, 0.02, 1.0]))
    assert rate == pytest.approx(0.005 / 1.3)
    assert 0.49 < when < 0.81
    assert np.isnan(lowest_rate(time[:2], strain[:2])).all()
    assert np.isnan(lowest_rate(time, -strain)).all()
    assert np.isnan(lowest_rate(0 * time, strain)).all()
