"""Quantities that change with time: points in time and functions; a boundary moves by the integral of its speed."""

import itertools
import json
import math

import attrs
import numpy as np
import pytest
from command_line import invoke
from hypothesis import assume, given
from hypothesis import strategies as st
from support import ROCK, STIFF

import grainlaw as gl
from grainlaw.conditions import AtRest
from grainlaw.geometry import Bricks, rectangle
from grainlaw.laws import Linear
from grainlaw.protocols import Cyclic, PlaneWave, UniaxialCompression
from grainlaw.time_series import rise

TRIANGLE = gl.TimeSeries([0, 2e-6, 4e-6], [0.0, 0.5, 0.0])
NEVER = gl.conditions.Reaches("time", 1.0)


@attrs.frozen(kw_only=True)
class Moves(gl.LoadingProtocol):
    """The top of a block is moved for a time; where it is."""

    speed: object
    lasts: float = 6e-6
    kind: type = gl.loads.Drive

    def stages(self, specimen):
        imposed = gl.loads.Drive(boundary="top", axis=1, speed=self.speed)
        return [
            gl.Stage(name="move", loads=[imposed], until=[gl.conditions.Reaches("time", self.lasts)], interval=1e-7)
        ]

    def measure(self, state):
        return {"moved": float(state.displacement[state.mesh.boundaries["top"], 1].mean()), "exact": state.time}

    def summary(self, curves, specimen):
        return {"moved": curves["moved"][-1]}


class Pulse:
    """A callable that is no function."""

    def __call__(self, time):
        return 0.1


def block(material=ROCK):
    return gl.Specimen(Bricks(rows=1, columns=1).tessellate(rectangle(4e-3, 4e-3)), material)


def moved(speed, **options):
    return gl.simulate(block(), Linear(**STIFF), Moves(speed=speed, **options), frames=1)


def test_a_series_is_straight_between_its_points_and_level_beyond_them():
    series = gl.TimeSeries([1, 3, 4, 4, 8], [5.0, 9.0, 2.0, 6.0, -2.0])
    times, values = [0.0, 1, 1.5, 3, 3.25, 4, 5, 7, 8, 9], [5.0, 5, 6, 9, 7.25, 6, 4, 0, -2, -2]
    assert [series(time) for time in times] == pytest.approx(values)


def test_a_ramp_is_smooth_by_hand():
    """6 x^5 - 15 x^4 + 10 x^3: at a quarter (6 - 60 + 160) / 1024."""
    times = np.array([-1.0, 0.0, 0.5, 1.0, 2.0, 5.0])
    assert rise(times, 2.0, 10.0, 14.0) == pytest.approx([10, 10, 10 + 4 * 106 / 1024, 12, 14, 14], rel=1e-12)
    assert rise(times, 0.0, 10.0, 14.0).tolist() == [14] * 6


def test_a_boundary_moves_by_the_integral_of_its_speed():
    """Half of 4 us times 0.5 m/s, to rounding, although no point of the table is at a step."""
    for speed in (TRIANGLE, [(0, 0), (2e-6, 0.5), (4e-6, 0)]):
        assert moved(speed).summary["moved"] == pytest.approx(1e-6, rel=1e-12)


def test_on_the_way_too():
    curves = moved(gl.TimeSeries([0, 1e-4], [0, 1e2])).curves  # m/s that grow by 1 m/s in 1 us: t^2 / 2 of 1e6 m/s2
    assert curves["moved"] == pytest.approx(1e6 * curves["time"] ** 2 / 2, rel=1e-9)


def test_a_jump_between_two_steps_counts_as_long_as_it_lasts():
    series = gl.TimeSeries([0, 1.2345e-6, 1.2345e-6], [0.3, 0.3, 0.0])
    assert moved(series).summary["moved"] == pytest.approx(0.3 * 1.2345e-6, rel=1e-12)


def test_a_function_of_time_moves_it_by_its_integral():
    """Gauss points: of fourth order in the step."""
    result = moved(lambda time: 0.2 * math.sin(1e6 * time))
    exact = 0.2e-6 * (1 - np.cos(1e6 * result.curves["time"][-1]))
    assert result.summary["moved"] == pytest.approx(exact, rel=1e-7)


@pytest.mark.thorough
@given(
    steps=st.lists(st.floats(0, 1), min_size=2, max_size=8),
    values=st.lists(st.floats(-1e3, 1e3), min_size=9, max_size=9),
    ends=st.tuples(st.floats(-1, 8), st.floats(-1, 8)),
)
def test_integral_of_a_series_is_that_of_its_lines(steps, values, ends):
    """Against the trapezoidal rule between all points and both ends; a jump has no width."""
    times = np.concatenate([[0.0], np.cumsum(steps)])
    assume(times[-1] > 0 and all(step == 0 or step > 1e-6 for step in steps))
    series = gl.TimeSeries(times, values[: len(times)])
    low, high = sorted(ends)
    first, last = series.integral(np.array([low, high]))
    inner = [t for t in dict.fromkeys(times.tolist()) if low < t < high]
    pieces = [low, *inner, high]
    exact = 0.0
    for a, b in itertools.pairwise(pieces):
        middle = series((a + b) / 2)  # a straight line's mean is its value in the middle
        exact += middle * (b - a)
    assert last - first == pytest.approx(exact, abs=1e-9 * 1e3 * 10)


@given(st.integers(1, 40), st.floats(1e-3, 1))
def test_means_over_steps_add_up(count, step):
    series = gl.TimeSeries([0, 0.3, 0.3, 2.0, 7.0], [1.0, 5.0, -2.0, 3.0, 3.0])
    drive = gl.loads.Drive(boundary="top", axis=1, speed=series)
    end = step * (1 + np.arange(count))
    sum_of_steps = float(np.sum(drive.course(end - step, end) * step))
    assert sum_of_steps == pytest.approx(
        float(np.diff(series.integral(np.array([0.0, end[-1]])))[0]), rel=1e-9, abs=1e-9
    )


def test_a_force_gives_its_integral_as_momentum():
    """A block under a traction of a triangle, with nothing else: its mean velocity is impulse over mass."""

    @attrs.frozen(kw_only=True)
    class Pushed(Moves):
        def stages(self, specimen):
            push = gl.loads.Traction(boundary="top", stress=(0, 0, 1e6), factor=self.speed)
            free = gl.integration.CentralDifference(damping=gl.integration.Undamped())
            end = gl.conditions.Reaches("time", self.lasts)
            return [gl.Stage(name="push", loads=[push], until=[end], interval=1e-7, integrator=free)]

        def measure(self, state):
            return {
                "moved": float(state.specimen.node_masses @ state.velocity[:, 0] / state.specimen.node_masses.sum())
            }

    result = gl.simulate(block(gl.Rigid(density=3100)), Linear(**STIFF), Pushed(speed=TRIANGLE), frames=1)
    assert result.summary["moved"] == pytest.approx(1e6 * 1e-6 * 4e-3 / (3100 * 16e-6), rel=1e-9)  # it turns a little


# --- what is refused -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("speed", "words"),
    [
        ("fast", "Drive: speed = 'fast' is not allowed, it must be a finite number"),
        (math.nan, "Drive: speed = nan is not allowed"),
        ([(0, 1)], "times has 1 entries and values has 1, they must have equal numbers of at least 2"),
        ([0, 1, 2], "a list of points .time, value."),
        ([(0, 1), (-1, 2)], r"times = \[0.0, -1.0\] is not allowed, it must be times \(s\) that do not fall"),
        ([(1, 1), (1, 2)], r"Drive: speed: TimeSeries: times = .* do not fall, the last after the first"),
        (Pulse(), r"Drive: speed = .*Pulse.* is not allowed, it must be .* a function of time \(def or lambda\)"),
        (lambda time: "much", "Drive: speed: the function gives 'much' at 0 s"),
    ],
)
def test_bad_series_are_refused(speed, words):
    with pytest.raises(gl.ParameterError, match=words):
        gl.loads.Drive(boundary="top", axis=1, speed=speed)


def test_a_function_may_give_an_array_without_axes():
    drive = gl.loads.Drive(boundary="top", axis=1, speed=lambda time: np.array(2.0 * time))
    assert drive.course(np.array([1.0]), np.array([2.0])) == pytest.approx([3.0])  # its mean over the step
    with pytest.raises(gl.ParameterError, match=r"the function gives array\(\[2\.\]\) at 0 s"):
        gl.loads.Drive(boundary="top", axis=1, speed=lambda time: np.array([2.0]))


@pytest.mark.parametrize(
    ("pressure", "words"),
    [
        (-1.0, r"FluidPressure: pressure = -1\.0 is not allowed, it must be a finite number and at least 0 \(Pa\)"),
        ([(0, 0), (1, -2)], r"FluidPressure: pressure = -2\.0 is not allowed, it must be .* at least 0 \(Pa\) at all"),
        (lambda time: -3.0, r"FluidPressure: pressure: the function gives -3\.0 at 0 s, .* at least 0"),
    ],
)
def test_bounds_hold_for_numbers_series_and_functions(pressure, words):
    with pytest.raises(gl.ParameterError, match=words):
        gl.loads.FluidPressure(boundary="top", pressure=pressure)
    later = gl.loads.FluidPressure(boundary="top", pressure=lambda time: 1.0 - time)
    with pytest.raises(gl.ParameterError, match=r"FluidPressure of top: pressure: the function gives -1\.\d+ at 2\."):
        later.course(np.array([2.0]), np.array([3.0]))


@pytest.mark.parametrize("stress", ["123", (1, 2), (1, 2, math.inf), (1, 2, "3"), 5.0])
def test_the_stress_of_a_traction_is_three_numbers(stress):
    with pytest.raises(gl.ParameterError, match=r"Traction: stress = .* three finite numbers"):
        gl.loads.Traction(boundary="top", stress=stress)
    assert gl.loads.Traction(boundary="top", stress=np.array([1, 2, 3])).stress == (1.0, 2.0, 3.0)


def test_a_function_that_fails_later_says_when():
    with pytest.raises(gl.ParameterError, match=r"Drive of top: speed: the function gives nan at 1\.\d+e-06 s"):
        moved(lambda time: math.nan if time > 1e-6 else 0.1)


def test_a_ramp_beside_a_series_is_refused():
    with pytest.raises(gl.ParameterError, match="start = 0 and ramp = 1e-05 s are not allowed beside"):
        gl.loads.Pressure(boundary="top", pressure=TRIANGLE, ramp=1e-5)


def test_a_loading_needs_speeds_that_are_numbers():
    drive = gl.loads.Drive(boundary="top", axis=1, speed=TRIANGLE)
    with pytest.raises(gl.ParameterError, match="that of the boundary top changes with time by itself"):
        gl.Stage(name="s", loads=[drive], loading=gl.Adaptive(), until=[NEVER], interval=1e-6, expected=10)


def test_to_wait_for_rest_under_a_function_is_refused():
    push = gl.loads.Pressure(boundary="top", pressure=lambda time: 1e6)
    with pytest.raises(gl.ParameterError, match=r"AtRest needs loads .* top is a function of time"):
        gl.Stage(name="s", loads=[push], until=[AtRest()], interval=1e-6)


def test_a_test_in_loops_cannot_reverse_a_series():
    @attrs.frozen(kw_only=True)
    class Other(UniaxialCompression):
        def stages(self, specimen):
            (stage,) = super().stages(specimen)
            drives = [attrs.evolve(drive, speed=TRIANGLE) for drive in stage.loads]
            return [attrs.evolve(stage, loads=drives, loading=None)]

    with pytest.raises(gl.ParameterError, match=r"Drive: speed = TimeSeries.* is not allowed here"):
        Cyclic(test=Other(), levels=(1e-4,)).stages(block())


# --- files -----------------------------------------------------------------------------------------------------------


@pytest.mark.thorough
def test_a_series_is_written_in_toml_as_a_list_of_pairs(tmp_path):
    config = tmp_path / "wave.toml"
    config.write_text(
        '[sample]\nwidth = "40 mm"\ncolumns = 10\n'
        '[law]\ntype = "linear"\nkn = "1e15 Pa/m"\nks = "1e15 Pa/m"\n'
        '[test]\nduration = "12 us"\nsamples = 40\nvelocity = [[0, 0], ["3 us", "20 mm/s"], ["6 us", 0]]\n'
    )
    first = invoke("test", "plane-wave", "--config", config, "--out", tmp_path / "a")
    assert first.exit_code == 0, first.output
    made = json.loads((tmp_path / "a" / "run.json").read_text())["configuration"]["test"]["velocity"]
    assert made == [["0 s", "0 m/s"], ["3 us", "20 mm/s"], ["6 us", "0 m/s"]]
    again = invoke("test", "plane-wave", "--config", tmp_path / "a" / "config.toml", "--out", tmp_path / "b")
    assert again.exit_code == 0, again.output
    assert (tmp_path / "a" / "curves.csv").read_text() == (tmp_path / "b" / "curves.csv").read_text()
    wrong = invoke("test", "plane-wave", "--set", 'test.velocity=[[0, 0], ["3 mm", 1]]', "--out", tmp_path / "c")
    assert wrong.exit_code == 2
    assert "'mm' is not one of s" in wrong.output


def test_the_record_of_a_run_tells_functions_apart(tmp_path):
    keys = []

    def falling(time):
        return -1e6  # the same, but for its words

    for number, function in enumerate([lambda time: -1e6, lambda time: -2e6, falling]):
        test = PlaneWave(stress=function, duration=1e-6, samples=2)
        specimen = gl.Specimen(Bricks(rows=1, columns=4).tessellate(rectangle(8e-3, 2e-3)), ROCK)
        gl.simulate(specimen, Linear(**STIFF), test, checkpoint=tmp_path / str(number))
        record = json.loads((tmp_path / str(number) / "run.json").read_text())
        assert record["protocol"]["stress"].startswith("function test_the_record")
        keys.append(record["key"])
    assert len(set(keys)) == 3
