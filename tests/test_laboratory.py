"""The laboratory report: fragments, energy lost and stress windows of small specimens, against hand computation."""

from types import SimpleNamespace

import attrs
import numpy as np
import pytest
from support import ROCK, STIFF, STRONG, Hillerborg, nodal_forces, small_sample, state_of

import grainlaw as gl
from grainlaw.columns import ENERGIES
from grainlaw.engine.dissipation import balance
from grainlaw.geometry import Bricks, rectangle
from grainlaw.laws import BandisClosure, CamachoOrtiz, CohesiveCrack, Friction, Linear, MohrCoulomb, PrePeak
from grainlaw.protocols import DirectShear, JointTension, UniaxialCompression, UniaxialTension
from grainlaw.results.result import energy_error, energy_made, energy_returned
from grainlaw.window import window_mean

COHESIVE = CohesiveCrack(**STRONG, mode_i_energy=150, mode_ii_energy=150)


def blocks(height=4e-3):
    return gl.Specimen(Bricks(rows=2).tessellate(rectangle(10e-3, height)), ROCK)


# --- the ledger of a run, by which it is judged ----------------------------------------------------------------------


def ledger(**energies):
    """Columns of energies, 0 where not given."""
    return {f"energy_{name}": np.array(energies.get(name, [0.0, 0, 0])) for name in ENERGIES}


LIFTING = MohrCoulomb(**STRONG, dilation_angle=5)
LEDGER = ledger(external=[0, 4, -10], zones=[0, 3, -2], contacts_normal=[0, -2, 5], contacts_shear=[0, -1, 5])


def test_the_error_of_the_ledger_is_its_largest_gap_over_the_largest_work():
    assert energy_error(LEDGER) == pytest.approx(18 / 10)
    assert energy_error(LEDGER | ledger(external=[0, 4, 8], kinetic=[0, 2, 0], absorbed=[0, 2, 8])) == 0
    heated = ledger(external=[0, 0, 1], zones=[0, 3, 20], zones_thermal=[0, -2, -20])
    assert energy_error(heated) == pytest.approx(1 / 20)  # of heat


def test_an_energy_beside_a_large_work_is_rounding():
    """A thousand millionth of 100 J/m and less."""
    beside = SimpleNamespace(result=SimpleNamespace(curves=ledger(external=[0, 100, 0])))
    found = [gl.Laboratory.beyond_rounding(beside, energy) for energy in (0.9e-7, -0.9e-7, 1.1e-7, -1.1e-7)]
    assert found == [0, 0, 1.1e-7, -1.1e-7]


def test_energy_that_contacts_have_made_is_the_most_of_a_frame():
    frames = [SimpleNamespace(bonds={"made": np.array(made)}) for made in ([0, 0.0], [1, 1.0], [1, 0.0])]
    assert energy_made(LEDGER, frames, np.array([2, 1])) == pytest.approx(3 / 10)
    assert energy_made(LEDGER, frames, np.array([20, 1])) == 1  # more than all work
    assert energy_made(ledger(), frames[:1], np.ones(2)) == 0


@pytest.mark.parametrize(
    ("law", "works", "replaced", "expected"),
    [
        (Linear(**STIFF), [[1, 1], [1, 1]], False, 0.2),  # of the two courses the one that gives back most
        (Linear(**STIFF), [[1, -3], [0, -1]], False, 0.8),  # 3 and 1 J/m2 on 2 m
        (Linear(**STIFF), [[1, -3], [0, -1]], True, 0.2),
        (Linear(**STIFF), [[1, -3], [0, 2]], False, 0.6),
        (LIFTING, [[1, -3], [0, 2]], False, 0.3),  # together
        (LIFTING, [[1, -3], [0, 1]], False, 0.4),
    ],
)
def test_energy_that_contacts_have_given_back(law, works, replaced, expected):
    state = SimpleNamespace(
        model=SimpleNamespace(of_bonds=[law]), bonds=SimpleNamespace(work=np.array(works, float)),
        contact_lengths=np.array([1.0, 2.0]), replaced=np.array([replaced]),
    )  # fmt: skip
    assert energy_returned(LEDGER, state) == pytest.approx(expected)


# --- energy lost -----------------------------------------------------------------------------------------------------


def joint_after(law, *places, steps=400):
    """State of a joint taken straight from place to place (opening, slip), m."""
    specimen = blocks()
    state = state_of(specimen, law)
    upper = specimen.mesh.node_grain == 1
    start = np.zeros(2)
    for end in np.array(places):
        for way in np.linspace(start, end, steps)[1:]:
            nodal_forces(state, np.outer(upper, [-way[1], way[0]]))  # the joint's tangent runs to the left
        start = end
    return state


def lost_after(law, *places, steps=400):
    """(2,) J/m2 lost in opening and in slip."""
    found = balance(joint_after(law, *places, steps=steps))[0]
    assert found[:, 0] == pytest.approx(found[:, 1])
    return found[:, 0]


@pytest.mark.thorough
def test_a_softened_joint_gives_back_along_its_secant():
    law = Hillerborg(**STIFF, strength=13e6, energy=50)
    peak, last, opening = 13e6 / STIFF["kn"], 2 * 50 / 13e6, 4e-6
    left = 13e6 * (last - opening) / (last - peak)
    work = 13e6 * peak / 2 + (13e6 + left) / 2 * (opening - peak)
    expected = work - left * opening / 2
    assert lost_after(law, (opening, 0)) == pytest.approx([expected, 0], rel=1e-3, abs=1e-9)
    assert lost_after(law, (opening, 0), (0, 0)) == pytest.approx([expected, 0], rel=1e-3, abs=1e-9)
    assert lost_after(law, (opening, 0), (-1e-7, 0)) == pytest.approx([expected, 0], rel=1e-3, abs=1e-9)


@pytest.mark.thorough
@pytest.mark.parametrize("place", [(0.3e-6, 0), (0.15e-6, 0), (-1e-6, 0), (0, 0.8e-6), (0, -0.4e-6)])
def test_a_sound_joint_has_lost_nothing(place):
    """Also on the curved rise to the peak, in tension (to 0.34 um) and slip (0.83 um), and on a curved closure."""
    law = attrs.evolve(COHESIVE, closure=BandisClosure(maximum_closure=2e-6), pre_peak=PrePeak.AS_PRINTED)
    stored = gl.trace(law, np.linspace(0, place[0], 400), np.linspace(0, place[1], 400)).work[-1]
    assert stored > 0.1
    assert lost_after(law, place) == pytest.approx([0, 0], abs=0.01 * stored)


def test_before_the_peak_the_cohesive_crack_loses_what_lies_above_its_secant():
    peak, opening = np.e * 13e6 / STIFF["kn"], 0.2e-6
    x = opening / peak
    taken = STIFF["kn"] * peak**2 * (1 - (1 + x) * np.exp(-x))
    expected = taken - STIFF["kn"] * np.exp(-x) * opening**2 / 2
    assert lost_after(COHESIVE, (opening, 0)) == pytest.approx([expected, 0], rel=1e-3, abs=1e-9)


def test_a_contact_that_is_pressed_after_slip_has_made_energy_only_as_printed():
    """By hand: slip 0.8 um, press to 100 MPa, and it would give back what the stiffer branch holds, 11 J/m2 more."""

    def stored(peak):
        x = 0.8e-6 / peak
        return 9.45e13 * peak**2 * (1 - (1 + x) * np.exp(-x))

    strength = 29e6 + 100e6 * np.tan(np.radians(54))
    expected = stored(np.e * strength / 9.45e13) - stored(np.e * 29e6 / 9.45e13)
    places = (0, 0.8e-6), (-100e6 / STIFF["kn"], 0.8e-6)
    printed = attrs.evolve(COHESIVE, pre_peak=PrePeak.AS_PRINTED)
    assert balance(joint_after(printed, *places))[1] == pytest.approx([expected] * 2, rel=0.01)
    assert balance(joint_after(COHESIVE, *places))[1] == pytest.approx([0, 0], abs=1e-9)


@pytest.mark.parametrize("closure", [BandisClosure(maximum_closure=2e-6), BandisClosure(maximum_closure=1e-5)])
def test_a_closure_that_stiffens_makes_nothing(closure):
    law = attrs.evolve(COHESIVE, closure=closure)
    work = joint_after(law, (-1.5e-6, 0)).bonds.work.sum(axis=0)
    assert np.all(balance(joint_after(law, (-1.5e-6, 0)))[1] < 1e-4 * work)


@pytest.mark.thorough
def test_friction_loses_what_it_slides():
    law = Friction(**STIFF, friction_angle=30)
    pressure, slip = 10e6, 5e-6
    strength = pressure * np.tan(np.radians(30))
    pressed = -pressure / STIFF["kn"]
    expected = strength * (slip - strength / STIFF["ks"])  # to the step in which sliding begins
    assert lost_after(law, (pressed, 0), (pressed, slip)) == pytest.approx([0, expected], rel=1e-4, abs=1e-9)
    assert lost_after(law, (pressed, 0), (pressed, -slip)) == pytest.approx([0, expected], rel=1e-4, abs=1e-9)


@pytest.mark.thorough
def test_a_brittle_joint_loses_what_its_spring_held():
    law = MohrCoulomb(**STRONG)
    held = 13e6**2 / (2 * STIFF["kn"])
    assert lost_after(law, (1e-6, 0), steps=4000) == pytest.approx([held, 0], rel=1e-2, abs=1e-9)


@pytest.mark.thorough
def test_a_brittle_joint_that_slides_loses_its_spring_and_friction():
    """Charged to its strength, then friction over the rest of the way, whose spring is still charged."""
    law = MohrCoulomb(**STRONG | dict(residual_friction_angle=20))
    pressed, slip = -10e6 / STIFF["kn"], 40e-6
    strength, friction = 29e6 + 10e6 * np.tan(np.radians(54)), 10e6 * np.tan(np.radians(20))
    springs = (strength**2 - friction**2) / (2 * STIFF["ks"])
    expected = springs + friction * (slip - strength / STIFF["ks"])
    found = lost_after(law, (pressed, 0), (pressed, slip), steps=4000)
    assert found == pytest.approx([0, expected], rel=1e-2, abs=1e-9)


def test_a_joint_that_softens_as_it_slides_gives_back_what_friction_leaves():
    """On its way back the bond pulls along its secant and friction against it, until both are equal."""
    law = CamachoOrtiz(
        **STIFF, tensile_strength=13e6, cohesion=29e6, residual_friction_angle=30, mode_i_energy=150, mode_ii_energy=300
    )
    pressed, slip, peak, last = -10e6 / STIFF["kn"], 12e-6, 29e6 / STIFF["ks"], 2 * 300 / 29e6
    damage = (slip - peak) / (last - peak)
    bond, friction = (1 - damage) * 29e6, damage * 10e6 * np.tan(np.radians(30))
    work = 29e6 * peak / 2 + (29e6 + bond + friction) * (slip - peak) / 2
    equal, turned = slip * friction / bond, 2 * friction / STIFF["ks"]  # where; the way on which friction turns round
    given = bond * (slip**2 - equal**2) / (2 * slip) - friction * (slip - equal - turned)
    assert lost_after(law, (pressed, 0), (pressed, slip)) == pytest.approx([0, work - given], rel=5e-3, abs=1e-9)


@pytest.mark.thorough
def test_what_a_break_spends_leaves_out_closure_and_the_spring_of_friction():
    pressed, slip = -40e6 / STIFF["kn"], 10e-6
    state = joint_after(COHESIVE, (pressed, 0), (pressed, slip), steps=2000)
    state.note_breaks()
    path = gl.trace(COHESIVE, pressed, np.linspace(0, slip, 2000))  # closed from the start: without the work of closing
    assert path.damage[-1] == 1
    friction = 40e6 * np.tan(np.radians(5))
    assert state.broken_work == pytest.approx(path.work[-1] - friction**2 / (2 * STIFF["ks"]), rel=1e-4)


@pytest.mark.thorough
def test_a_joint_pulled_apart_has_spent_its_fracture_energy():
    result = gl.simulate(blocks(), COHESIVE, JointTension(loading=gl.Constant(speed=0.02)))
    measured = result.laboratory.properties
    assert measured["lost_opening"] == pytest.approx((150 + 3.14258) * 10e-3, rel=1e-3)
    assert measured["lost_tensile_cracks"] == pytest.approx(measured["lost_opening"], rel=1e-3)
    assert measured["lost_shear_cracks"] == measured["lost_unbroken"] == 0
    assert measured["lost_slip"] == pytest.approx(0, abs=1e-6)
    assert result.cracks.spent == pytest.approx([150 + 3.14258] * 2, rel=1e-3)
    assert result.laboratory.events.energy == pytest.approx([153.14258 * 10e-3], rel=1e-3)
    assert result.laboratory.events.breaks.tolist() == [2]
    assert measured["tensile_length"] == pytest.approx(10e-3)
    assert measured["fragments"] == 2


@pytest.mark.thorough
def test_a_joint_sheared_through_has_spent_its_fracture_energy():
    result = gl.simulate(blocks(2e-3), COHESIVE, DirectShear(normal_stress=0, loading=gl.Constant(speed=0.05)))
    measured = result.laboratory.properties
    assert measured["lost_slip"] == pytest.approx((150 + 17.3761) * 10e-3, rel=2e-3)
    assert measured["lost_shear_cracks"] == pytest.approx(measured["lost_slip"], rel=1e-2)
    assert measured["shear_length"] == pytest.approx(10e-3)
    assert result.cracks.spent == pytest.approx([150 + 17.3761] * 2, rel=1e-2)


# --- fragments, windows ----------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def parted():
    """Two rows of two bricks, the upper one taller, pulled apart along y."""
    corners = np.array([(0, 1, 4, 3), (1, 2, 5, 4), (3, 4, 7, 6), (4, 5, 8, 7)])
    vertices = np.array([(x, y) for y in (0, 10e-3, 26e-3) for x in (0, 4e-3, 10e-3)])
    grains = gl.Tessellation(rectangle(10e-3, 26e-3), vertices, corners.ravel(), np.arange(0, 17, 4))
    grains.check()
    law = MohrCoulomb(**STRONG)
    return gl.simulate(
        gl.Specimen(grains, ROCK), law, UniaxialTension(loading=gl.Constant(speed=0.1), stop_fraction=0.1)
    )


def test_bricks_pulled_apart_are_two_fragments(parted):
    found = parted.laboratory.fragments
    assert found.of_grain.tolist() == [1, 1, 0, 0]  # the taller row is the larger
    assert found.areas == pytest.approx([160e-6, 100e-6])
    assert found.grains.tolist() == [2, 2]
    whole = gl.fragments(parted, frame=0)
    assert len(whole) == 1
    assert whole.areas == pytest.approx([260e-6])
    assert parted.laboratory.properties["largest_fragment"] == pytest.approx(160 / 260)
    assert np.sin(parted.laboratory.plane.angle) == pytest.approx(0, abs=1e-4)
    assert parted.laboratory.plane.strength == pytest.approx(1, abs=1e-4)


def test_half_an_interface_holds(parted):
    frame = parted.frames[0]
    broken = frame.bonds["broken_time"].copy()
    broken[: len(broken) // 2] = 0.0  # the first points of all interfaces
    half = attrs.evolve(frame, bonds=frame.bonds | {"broken_time": broken})
    assert len(gl.fragments(attrs.evolve(parted, frames=[half]))) == 1
    none = attrs.evolve(frame, bonds=frame.bonds | {"broken_time": np.zeros(len(broken))})
    found = gl.fragments(attrs.evolve(parted, frames=[none]))
    assert found.areas == pytest.approx(np.array([96, 64, 60, 40]) * 1e-6)
    assert found.of_grain.tolist() == [3, 2, 1, 0]


def test_stress_in_a_window_is_weighted_by_area(parted):
    grains = parted.specimen.grains  # 4 x 10, 6 x 10, 4 x 16, 6 x 16 mm, centroids at x 2, 7 and y 5, 18 mm
    stress = np.array([[1.0, 0, 0], [2, 0, 0], [4, 0, 0], [8, 0, 0]])
    for window, mean in (
        (gl.within_rectangle((0, 0), (10e-3, 10e-3)), (40 * 1 + 60 * 2) / 100),
        (gl.within_rectangle((0, 0), (5e-3, 26e-3)), (40 * 1 + 64 * 4) / 104),
        (gl.within_circle((2e-3, 5e-3), 5.1e-3), (40 * 1 + 60 * 2) / 100),
        (gl.within_circle((2e-3, 5e-3), 4.9e-3), 1),
        (gl.within_polygon([(0, 26e-3), (10e-3, 26e-3), (10e-3, 0)]), 8),
        (gl.within_polygon([(10e-3, 0), (10e-3, 26e-3), (0, 26e-3)]), 8),
        (lambda points: points[:, 0] > 0, (40 * 1 + 60 * 2 + 64 * 4 + 96 * 8) / 260),
    ):
        assert window_mean(grains, stress, window) == pytest.approx([mean, 0, 0])
    assert np.isnan(gl.mean_stress(parted, gl.within_circle((1, 1), 0.1))).all()
    whole = gl.within_rectangle((0, 0), (1, 1))
    for frame in (0, 1, -1):
        mean = np.average(parted.frames[frame].stress, axis=0, weights=grains.areas)
        assert gl.mean_stress(parted, whole, frame) == pytest.approx(mean)
    assert gl.mean_stress(parted, whole) == pytest.approx(mean)  # at the last frame


# --- the report ------------------------------------------------------------------------------------------------------


@pytest.mark.thorough
def test_every_measure_is_explained_and_none_crashes(parted, tmp_path):
    slow = UniaxialCompression(loading=gl.Constant(speed=0.3), maximum_strain=1e-4, samples=20)
    rigid = small_sample(12, material=gl.Rigid(density=3100))
    results = [
        parted,
        gl.simulate(small_sample(12), Linear(**STIFF), slow),
        gl.simulate(rigid, MohrCoulomb(**STRONG), attrs.evolve(slow, maximum_strain=2e-3)),
        gl.simulate(
            blocks(2e-3), Friction(**STIFF, friction_angle=30), DirectShear(normal_stress=1e6, maximum_slip=1e-6)
        ),
    ]
    for result in results:
        assert list(result.laboratory.properties) == list(gl.MEASURES)
        exist = np.isfinite(list(result.laboratory.properties.values())).sum()
        leading = len(result.laboratory.to_pandas()) - len(gl.MEASURES)  # strength, E, nu ... of the test
        table, *doubts = str(result.laboratory).split("\ndoubt: ")
        assert tuple(doubts) == result.doubts
        assert len(table.splitlines()) == leading + exist + bool(result.laboratory.note)
        assert len(result.laboratory.growth["shear_length"]) == len(result.curves["time"])
        result.laboratory.plot().savefig(tmp_path / "report.png")
        assert (tmp_path / "report.png").stat().st_size > 20_000
    elastic = results[1].laboratory.properties
    for name in ("crack_damage", "crack_initiation_count", "damage_onset", "b_value", "failure_plane_angle"):
        assert np.isnan(elastic[name]), name
    assert elastic["fragments"] == 1
    assert elastic["lost_opening"] == pytest.approx(0, abs=1e-9)
    assert results[0].laboratory is parted.laboratory


def test_shear_waves_travel_through_the_slowest_mineral():
    assert blocks().shear_wave_speed == pytest.approx(2782.4, rel=1e-4)  # 60 GPa, 0.25, 3100 kg/m3
    grains = attrs.evolve(blocks().grains, phase=[0, 1])
    heavy = attrs.evolve(ROCK, density=4 * 3100)
    assert gl.Specimen(grains, {0: ROCK, 1: heavy}).shear_wave_speed == pytest.approx(2782.4 / 2, rel=1e-4)
    assert attrs.evolve(blocks(), material=gl.Rigid(density=3100)).shear_wave_speed == 0


def test_the_default_event_is_as_wide_as_two_grains(parted):
    """Grains of 65 mm2 on average, 16.1 mm for two: the 4 mm and the 6 mm half of the crack are one event or two."""
    size = 2 * np.sqrt(65e-6)
    for distance, duration in ((None, None), (size, size / 2782.4)):  # c_s of 60 GPa, 0.25, 3100 kg/m3
        events = gl.acoustic_events(parted, distance=distance, duration=duration)
        assert events.breaks.tolist() == gl.acoustic_events(parted).breaks.tolist()
    assert gl.acoustic_events(parted, distance=0, duration=1).breaks.tolist() == [1] * len(parted.cracks)
    assert gl.acoustic_events(parted, distance=1, duration=1).breaks.tolist() == [len(parted.cracks)]
    with pytest.raises(gl.ParameterError, match="thickness = -1 is not allowed"):
        gl.acoustic_events(parted, thickness=-1)
    with pytest.raises(gl.ParameterError, match="thickness = 0 is not allowed"):  # without moments all are of one kind
        gl.acoustic_events(parted, thickness=0)


@pytest.mark.parametrize("answer", [[True, False], [1.0, 0.0, 0.0, 0.0]])
def test_a_window_says_true_or_false_of_every_point(parted, answer):
    with pytest.raises(gl.ParameterError, match="it must be an array of n True or False"):
        gl.mean_stress(parted, lambda points: np.array(answer))
