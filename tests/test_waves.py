"""Waves: speeds, quiet boundaries that take them in, ends that send them back; tractions; the energy of all of it."""

import attrs
import numpy as np
import pytest
from bars import GLUED, P_SPEED, ROCK, S_SPEED, bar, bell
from hypothesis import given, settings
from hypothesis import strategies as st
from support import STIFF, advance, impose, small_sample, state_of, with_quiet

import grainlaw as gl
from grainlaw.columns import ENERGY, SPENT
from grainlaw.engine.parts.quiet import _dashpots
from grainlaw.geometry import Bricks, block, from_polygons, moved, polygon, rectangle
from grainlaw.laws import Linear
from grainlaw.materials import TransverselyIsotropic
from grainlaw.protocols import PlaneWave, Wave

LENGTH, MIDDLE = 0.6, 0.3  # m, of the bar, and its gauge
SPEEDS = {Wave.P: P_SPEED, Wave.S: S_SPEED}
LONG = {Wave.P: 44e-6, Wave.S: 76e-6}  # s: of 200 mm, twenty bricks
BAR = bar(60)


def wave(kind, **options):
    """What a gauge in the middle of a bar sees of a pulse of 1 MPa, there and back."""
    test = PlaneWave(
        stress=bell(LONG[kind], -1e6), wave=kind, gauges=(MIDDLE,), samples=600,
        duration=1.5 * LENGTH / SPEEDS[kind] + LONG[kind], **options,
    )  # fmt: skip
    return gl.simulate(BAR, GLUED, test, frames=1)


def there_and_back(result, kind):
    """Velocities of largest size at the gauge: as the pulse passes, and after it has."""
    passed = (LENGTH - MIDDLE) / SPEEDS[kind] + LONG[kind] * 1.1
    time, velocity = result.curves["time"], result.curves["velocity_0"]
    parts = velocity[time < passed], velocity[time >= passed]
    return [part[np.argmax(np.abs(part))] for part in parts]


def ledger_gap(result):
    """What the ledger does not account for, over the largest work."""
    supplied = result.curves["energy_external"]
    return np.abs(supplied - sum(result.curves[ENERGY + kind] for kind in SPENT)).max() / np.abs(supplied).max()


@pytest.mark.thorough
@pytest.mark.parametrize("kind", [Wave.P, Wave.S])
def test_a_quiet_end_takes_a_wave_in(kind):
    """The velocity is stress over impedance; less than 1 % of it comes back, and the energy is booked as absorbed."""
    result = wave(kind)
    there, back = there_and_back(result, kind)
    impedance = ROCK.density * SPEEDS[kind]
    assert there == pytest.approx(1e6 / impedance, rel=0.01)  # pushed to the right; an S wave as its stress, downwards
    assert abs(back / there) < 0.01
    carried = (1e6**2 / impedance) * LONG[kind] * 3 / 8 * 10e-3  # of sin^4, through the section
    assert result.curves["energy_external"][-1] == pytest.approx(carried, rel=0.02)
    assert result.curves["energy_absorbed"][-1] == pytest.approx(carried, rel=0.02)
    assert ledger_gap(result) < 1e-6


@pytest.mark.thorough
@pytest.mark.parametrize("kind", [Wave.P, Wave.S])
def test_a_free_end_sends_a_wave_back(kind):
    """With its velocity doubled there, so -1 of its stress."""
    result = wave(kind, quiet=())
    there, back = there_and_back(result, kind)
    assert back / there == pytest.approx(1.0, abs=0.01)
    assert result.curves["energy_absorbed"].max() == 0
    assert ledger_gap(result) < 1e-6


@pytest.mark.thorough
def test_half_of_a_stress_enters_through_a_quiet_end():
    result = wave(Wave.P, quiet=("left", "right"))
    there, back = there_and_back(result, Wave.P)
    assert there == pytest.approx(0.5e6 / (ROCK.density * P_SPEED), rel=0.01)
    assert abs(back / there) < 0.01
    assert ledger_gap(result) < 1e-6


@pytest.mark.thorough
def test_a_wave_enters_as_a_velocity():
    test = PlaneWave(velocity=bell(44e-6, 0.1), gauges=(MIDDLE,), duration=1e-4)
    found = gl.simulate(BAR, GLUED, test, frames=1).summary
    assert found["peak_velocity_0"] == pytest.approx(0.1, rel=0.01)
    assert found["peak_stress_0"] == pytest.approx(-0.1 * ROCK.density * P_SPEED, rel=0.01)
    assert found["peak_time_0"] == pytest.approx(22e-6 + MIDDLE / P_SPEED, rel=0.02)


@pytest.mark.thorough
def test_a_quiet_end_lets_a_slow_motion_through_too():
    """A traction that stays moves it at stress over impedance, the displacement grows; nothing is lost."""
    result = gl.simulate(
        BAR, GLUED, PlaneWave(stress=[(0, 0), (40e-6, -1e6)], gauges=(MIDDLE,), duration=4e-4, samples=100), frames=1
    )
    assert result.curves["velocity_0"][-1] == pytest.approx(1e6 / (ROCK.density * P_SPEED), rel=0.005)
    assert ledger_gap(result) < 1e-6


@pytest.mark.thorough
def test_speeds_of_the_rock_as_a_whole():
    """Joints as soft as the bricks: waves are slower by the root of 2, and a quiet end made for that takes them in."""
    soft = Linear(kn=P_SPEED**2 * ROCK.density / 10e-3, ks=1e13)
    speed = P_SPEED / np.sqrt(2)

    @attrs.frozen(kw_only=True)
    class AsWhole(PlaneWave):
        def stages(self, specimen):
            (stage,) = super().stages(specimen)
            quiet = [gl.loads.Quiet(boundary="right", p_speed=speed, s_speed=speed / 2)]
            return [with_quiet(stage, *quiet)] if self.samples > 300 else [stage]

    back = {}
    for samples in (301, 300):
        test = AsWhole(stress=bell(88e-6, -1e6), gauges=(MIDDLE,), duration=4.2e-4, samples=samples)
        curves = gl.simulate(BAR, soft, test, frames=1).curves
        passed = MIDDLE / speed + 88e-6 * 1.4
        first, after = (
            np.abs(curves["velocity_0"][part]).max() for part in (curves["time"] < passed, curves["time"] >= passed)
        )
        back[samples] = after / first
    assert back[301] < 0.015
    assert back[300] == pytest.approx((1 - np.sqrt(0.5)) / (1 + np.sqrt(0.5)), rel=0.1)  # of the impedances


@pytest.mark.thorough
def test_a_layer_of_rock_between_steel_bars():
    """A blow goes on in the second bar as by the closed form of a layer, frequency by frequency."""
    steel = gl.Elastic(youngs_modulus=200e9, poissons_ratio=0.29, density=7850)
    grains = Bricks(rows=1, columns=100).tessellate(rectangle(1.0, 10e-3))
    between = (np.arange(100) >= 49) & (np.arange(100) < 51)
    bars = gl.Specimen(attrs.evolve(grains, phase=between.astype(int)), {0: steel, 1: ROCK})
    blow = [(0, 0), (40e-6, -50e6), (80e-6, -50e6), (120e-6, 0)]
    test = PlaneWave(stress=blow, wave=Wave.BAR, gauges=[0.24, 0.5, 0.76], duration=260e-6)
    shot = gl.simulate(bars, GLUED, test, frames=1)
    time = np.arange(0, 4e-3, 1e-7)
    speeds = [np.sqrt(one.youngs_modulus / (1 - one.poissons_ratio**2) / one.density) for one in (steel, ROCK)]
    ratio = steel.density * speeds[0] / (ROCK.density * speeds[1])
    angle = 2 * np.pi * np.fft.rfftfreq(len(time), 1e-7) * 0.02 / speeds[1]
    through = 1 / (np.cos(angle) + 0.5j * (ratio + 1 / ratio) * np.sin(angle))
    exact = np.fft.irfft(np.fft.rfft(np.interp(time, *np.transpose(blow))) * through)
    expected = np.interp(shot.curves["time"], time + 0.74 / speeds[0], exact, left=0)
    assert np.abs(expected - shot.curves["stress_2"]).max() < 0.05 * 50e6
    assert shot.summary["peak_stress_1"] == pytest.approx(shot.summary["peak_stress_2"], rel=0.01)


@pytest.mark.thorough
@pytest.mark.parametrize("speed", [1.0, 1e5, 1e9])
def test_dashpots_of_any_size_leave_the_stable_step_as_it_is(speed):
    """With the whole stable step; a dashpot far too stiff holds the end, one far too soft frees it."""

    @attrs.frozen(kw_only=True)
    class Dashpots(PlaneWave):
        def stages(self, specimen):
            (stage,) = super().stages(specimen)
            quiet = [gl.loads.Quiet(boundary=side, p_speed=speed, s_speed=speed) for side in ("right", "top")]
            whole = gl.integration.CentralDifference(damping=gl.integration.Undamped(), safety=1.0)
            return [attrs.evolve(with_quiet(stage, *quiet), integrator=whole)]

    result = gl.simulate(small_sample(12), Linear(**STIFF), Dashpots(stress=bell(5e-6, -1e6), duration=4e-5), frames=1)
    assert ledger_gap(result) < 1e-6
    right = result.mesh.boundaries["right"]
    moved = np.abs(result.frames[-1].displacement[right]).max() / np.abs(result.frames[-1].displacement).max()
    assert moved < 1e-3 if speed == 1e9 else moved > 0


@pytest.mark.thorough
@settings(max_examples=50)
@given(
    angle=st.floats(0, 360), young=st.floats(1e9, 1e11), ratio=st.floats(0.2, 5.0), foliation=st.floats(0, 180),
)  # fmt: skip
def test_dashpots_are_the_root_of_density_times_acoustic_tensor(angle, young, ratio, foliation):
    """Positive definite for any material and side; along a principal wave the impedance is density times its speed."""
    material = TransverselyIsotropic(
        youngs_modulus=young, youngs_modulus_across=young * ratio, poissons_ratio=0.2,
        poissons_ratio_across=0.2 * min(ratio, 1), shear_modulus_across=young / 3, foliation_angle=foliation,
        density=2700,
    )  # fmt: skip
    specimen = gl.Specimen(_turned_block(angle), material)
    state = state_of(specimen, Linear(**STIFF))
    impose(state, [gl.loads.Quiet(boundary="side")])
    a = state.quiet.arrays
    found = np.array([[a.xx[0], a.xy[0]], [a.xy[0], a.yy[0]]]) / 0.5  # half a side of 1 m for each of its nodes
    edge = specimen.mesh.boundary_edges["side"][0]
    along = np.subtract(*specimen.mesh.nodes[edge[::-1]])
    x, y = along[1], -along[0]
    operator = np.array([[x, 0], [0, y], [y, x]])
    tensor = operator.T @ specimen.zone_stiffness[0] @ operator
    assert found @ found == pytest.approx(2700 * tensor, rel=1e-9, abs=1e-9 * young)
    assert np.linalg.eigvalsh(found).min() > 0


def _turned_block(angle):
    return moved(block([(0, 0), (1, 0), (1, 1), (0, 1)], ["side", "other", "other", "other"]), turn=angle)


@pytest.mark.thorough
def test_waves_are_the_same_for_any_number_of_threads():
    test = PlaneWave(stress=bell(5e-6, -1e6), duration=1.2e-5, quiet=("left", "right"), samples=6)
    specimen = small_sample(12)
    runs = [gl.simulate(specimen, Linear(**STIFF), test, threads=threads) for threads in (1, 2, 3)]
    for run in runs[1:]:
        for name, curve in runs[0].curves.items():
            assert np.array_equal(curve, run.curves[name], equal_nan=True), name
    assert runs[0].curves["energy_absorbed"][-1] > 0


@pytest.mark.parametrize("kind", [Wave.P, Wave.S])
def test_a_new_stage_closes_the_ledger_too(kind):
    """Tractions and quiet ends of two stages that meet as the wave passes, and a change of the time step there."""

    @attrs.frozen(kw_only=True)
    class Twice(PlaneWave):
        def stages(self, specimen):
            (stage,) = super().stages(specimen)
            slower = attrs.evolve(self.integrator, safety=0.5)
            push = [gl.loads.Traction(boundary="right", stress=(0, 0, 1e6), factor=[(0, 0), (1e-5, 1)])]
            more = [gl.loads.Quiet(boundary="left"), *stage.of(gl.loads.Quiet), *push, *stage.of(gl.loads.Drive)]
            later = [gl.conditions.Reaches("time", 2 * self.duration)]
            return [
                stage,
                attrs.evolve(stage, name="on", loads=more, integrator=slower, until=later),
            ]

    test = Twice(stress=bell(44e-6, -1e6), wave=kind, gauges=(MIDDLE,), duration=30e-6, samples=30)
    result = gl.simulate(BAR, GLUED, test, frames=1)
    assert result.curves["energy_absorbed"][-1] > 0
    assert ledger_gap(result) < 1e-6


# --- tractions -------------------------------------------------------------------------------------------------------


def test_a_uniform_stress_all_round_is_in_equilibrium():
    """On every side of any polygon: no resultant and no moment; inside it is the stress."""
    specimen, stress = small_sample(15), (3e6, -8e6, 2e6)
    state = state_of(specimen, Linear(**STIFF))
    sides = [gl.loads.Traction(boundary=name, stress=stress) for name in specimen.mesh.boundaries]
    state.begin(gl.Stage(name="s", loads=sides, until=[gl.conditions.Reaches("time", 1.0)], interval=1e-6))
    advance(state)
    a = state.tractions.arrays
    force, place = np.stack([a.force_x, a.force_y], axis=1), specimen.mesh.nodes[a.node]
    scale = 1e7 * 20e-3
    assert np.abs(force.sum(axis=0)).max() < 1e-12 * scale
    assert abs(np.sum(place[:, 0] * force[:, 1] - place[:, 1] * force[:, 0])) < 1e-12 * scale * 20e-3
    area = specimen.grains.areas.sum()
    found = place.T @ force / area  # mean stress of forces on a rim
    assert found == pytest.approx(np.array([[3e6, 2e6], [2e6, -8e6]]), rel=1e-9)


@given(turn=st.floats(-180, 180), stress=st.tuples(*[st.floats(-50e6, 50e6)] * 3))
@settings(deadline=None, max_examples=20)
def test_a_uniform_stress_turns_no_specimen_over(turn, stress):
    """However it lies, and stretched: the stress beyond it does not turn, so it has no moment; its mean is inside."""
    specimen, angle = small_sample(15), np.radians(turn)
    state = state_of(specimen, Linear(**STIFF))
    impose(state, [gl.loads.Traction(boundary=name, stress=stress) for name in specimen.mesh.boundaries])
    x, y = specimen.mesh.nodes.T
    place = np.array([np.cos(angle) * 1.1 * x - np.sin(angle) * y, np.sin(angle) * 1.1 * x + np.cos(angle) * y])
    state.nodes.arrays.displacement[:] = place - (x, y)
    advance(state)
    a = state.tractions.arrays
    force, on = np.stack([a.force_x, a.force_y]), place[:, a.node]
    scale = 1e8 * 20e-3
    assert np.abs(force.sum(axis=1)).max() < 1e-9 * scale
    assert abs(np.sum(on[0] * force[1] - on[1] * force[0])) < 1e-9 * scale * 20e-3
    xx, yy, xy = stress
    mean = on @ force.T / (1.1 * specimen.grains.areas.sum())
    assert mean == pytest.approx(np.array([[xx, xy], [xy, yy]]), rel=1e-9, abs=1e-9 * 1e8)


@attrs.frozen(kw_only=True)
class Stressed(gl.LoadingProtocol):
    """A specimen that is brought under a stress by tractions on all of its sides."""

    stress: tuple = (-10e6, -30e6, 4e6)
    static: bool = True

    def stages(self, specimen):
        sides = [
            gl.loads.Traction(boundary=name, stress=self.stress, ramp=0.0 if self.static else 5e-5)
            for name in specimen.mesh.boundaries
        ]
        return [
            gl.Stage(name="load", loads=sides, until=[gl.conditions.AtRest(1e-4)], interval=2e-6, static=self.static)
        ]

    def measure(self, state):
        areas = state.specimen.grains.areas
        mean = areas @ state.grain_stress() / areas.sum()
        return dict(zip(("xx", "yy", "xy"), mean, strict=True))

    def summary(self, curves, specimen):
        return {name: curves[name][-1] for name in ("xx", "yy", "xy")}


@pytest.mark.parametrize("static", [True, False])
@pytest.mark.parametrize("material", [ROCK, gl.Rigid(density=2700)], ids=["elastic", "rigid"])
def test_a_specimen_comes_under_a_stress(static, material):
    result = gl.simulate(small_sample(20, material=material), Linear(**STIFF), Stressed(static=static), frames=1)
    found = result.summary
    assert [found[name] for name in ("xx", "yy", "xy")] == pytest.approx([-10e6, -30e6, 4e6], rel=2e-3)
    assert found["energy_error"] < 1e-3


# --- what is refused -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: gl.loads.Traction(boundary="left", stress=(1, 2)), "Traction: stress = .* three finite numbers"),
        (
            lambda: gl.loads.Traction(boundary="left", stress=(1, 2, np.nan)),
            "Traction: stress = .* three finite numbers",
        ),
        (lambda: gl.loads.Quiet(boundary="left", p_speed=4000.0), "p_speed and s_speed must be given together"),
        (lambda: gl.loads.Quiet(boundary="left", p_speed=0.0, s_speed=1.0), "Quiet: p_speed = 0"),
        (lambda: PlaneWave(stress=[(0, 0), (1, 1)], velocity=1.0), "stress and velocity are both given"),
        (lambda: PlaneWave(gauges=(9.0,)).stages(BAR), "gauges = 9 m is not in the specimen, 0 to 0.6 m"),
        (lambda: PlaneWave(velocity=1.0, quiet=("left", "right")), "the left end moves by the velocity"),
        (lambda: PlaneWave(gauges=3.0), "PlaneWave: gauges = 3.0 is not allowed"),
    ],
)
def test_bad_values_are_refused(make, words):
    with pytest.raises(gl.ParameterError, match=words):
        make()


def test_rigid_grains_have_no_quiet_boundary():
    with pytest.raises(gl.ParameterError, match="Quiet: boundary = 'right' is of rigid grains"):
        gl.loads.Quiet(boundary="right").check_specimen(bar(4, material=gl.Rigid(density=2700)))


def test_unknown_boundaries_are_refused():
    with pytest.raises(gl.ParameterError, match="Quiet: the specimen has no boundary named lid"):
        gl.loads.Quiet(boundary="lid").check_specimen(bar(4))


def test_gauges_are_at_the_quarter_points():
    """Where none are given: far from both ends."""
    test = PlaneWave(velocity=bell(44e-6, 0.1), duration=1e-4)
    assert test._gauges(BAR) == pytest.approx((np.array([0.25, 0.75]) * np.ptp(BAR.mesh.nodes[:, 0])).tolist())


@pytest.mark.parametrize("slant", [0.0, 0.3, 1.0, -2.0])
def test_dashpots_are_the_impedances_along_and_across_the_normal(slant):
    """By hand, and for an isotropic rock the same without speeds: rho cp along n, rho cs across it."""
    outline = [(0.0, 0.0), (2.0, 0.0), (2.0, 1.0 + max(0.0, -2 * slant)), (0.0, 1.0 + max(0.0, 2 * slant))]
    specimen = gl.Specimen(from_polygons([outline], region=polygon(outline, ["b", "r", "slant", "l"])), ROCK)
    edges = specimen.mesh.boundary_edges["slant"]
    along = specimen.mesh.nodes[edges[0, 1]] - specimen.mesh.nodes[edges[0, 0]]
    along /= np.hypot(*along)
    normal = np.array([along[1], -along[0]])
    for speeds in ({"p_speed": 5000.0, "s_speed": 2000.0}, {}):
        p, s = ROCK.density * np.array([*speeds.values()] if speeds else [P_SPEED, S_SPEED])
        length, dashpots = _dashpots(specimen, edges, gl.loads.Quiet(boundary="slant", **speeds))
        assert length.sum() == pytest.approx(2 * np.hypot(1, slant))
        for xx, yy, xy in dashpots:
            matrix = np.array([[xx, xy], [xy, yy]])
            assert matrix @ normal == pytest.approx(p * normal, abs=1e-9 * p)
            assert matrix @ along == pytest.approx(s * along, abs=1e-9 * p)
