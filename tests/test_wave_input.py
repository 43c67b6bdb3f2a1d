"""What waves and loads that change with time refuse, and what tells their runs apart."""

import attrs
import numpy as np
import pytest
from bars import GLUED, bar

import grainlaw as gl
from grainlaw.engine.model import Model
from grainlaw.protocols import PlaneWave, Saturated
from grainlaw.runs import record

WAVE = PlaneWave(duration=6e-5)


@attrs.frozen(kw_only=True)
class Moves(gl.LoadingProtocol):
    """Holds drives in a list."""

    drives: list = attrs.field()

    def stages(self, specimen):
        return [gl.Stage(name="move", loads=self.drives, until=[gl.conditions.Reaches("time", 1e-5)], interval=1e-6)]

    def measure(self, state):
        return {}

    def summary(self, curves, specimen):
        return {}


@pytest.mark.thorough
def test_a_wave_after_a_stage_lasts_as_long_as_it_should():
    """Its duration counts from its own beginning; the stage before it takes longer, and is damped until it rests."""
    alone, wet = (
        gl.simulate(bar(20), GLUED, test, frames=1).summary["peak_stress_0"]
        for test in (WAVE, Saturated(test=WAVE, pressure=1.0))
    )
    assert wet == pytest.approx(alone, rel=0.01)


@pytest.mark.parametrize(
    ("loads", "words"),
    [
        ([gl.loads.Quiet(boundary="top")] * 2, "boundary = 'top' is quiet twice"),
        (
            [gl.loads.Quiet(boundary="top"), gl.loads.Hold(boundary="top", axis=1, stress=0.0)],
            "boundary = 'top' is quiet and has a platen",
        ),
    ],
)
def test_a_quiet_boundary_is_so_once_and_free(loads, words):
    with pytest.raises(gl.ParameterError, match=words):
        gl.Stage(name="wave", until=[gl.conditions.Reaches("time", 1e-5)], interval=1e-6, loads=loads)


def test_waves_need_grains_that_deform_and_their_own_mass():
    rigid = gl.Specimen(bar(4).grains, gl.Rigid(density=2700))
    with pytest.raises(gl.ParameterError, match="grains that are Rigid carry no waves"):
        gl.simulate(rigid, GLUED, PlaneWave(quiet=()))
    with pytest.raises(gl.ParameterError, match="mass_scaling = 2 is not allowed with quiet boundaries"):
        gl.simulate(bar(4), GLUED, PlaneWave(), mass_scaling=2)


def test_what_is_imposed_is_known_before_anything_runs():
    for name in ("rigth", "top"):
        with pytest.raises(
            gl.ParameterError, match=f"quiet = '{name}' is not allowed, it must be one of the ends left"
        ):
            PlaneWave(quiet=(name,))
    with pytest.raises(gl.ParameterError, match="finite number and at least 0"):
        gl.loads.FluidPressure(boundary="left", pressure=lambda time: -5e6).course(np.zeros(1), np.ones(1))


def test_a_function_in_a_list_is_part_of_the_key_of_a_run():
    def key(speed):
        test = Moves(drives=[gl.loads.Drive(boundary="top", axis=1, speed=speed)])
        return record.described_run(Model(bar(4), GLUED), test, {})["key"]

    assert key(lambda time: 1e-3 * time) != key(lambda time: 2e-3 * time)
