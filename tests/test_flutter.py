"""A sample held without damping: quiet where the contacts keep an energy, fluttering where they make some."""

import importlib
import math
from types import SimpleNamespace

import attrs
import click
import numpy as np
import pytest
from click.testing import CliRunner
from support import ROCK, STRONG, small_sample

import grainlaw as gl
from grainlaw.cli.commands import main
from grainlaw.cli.default_rock import LAWS
from grainlaw.conditions import FailsTo
from grainlaw.engine.stepping import InstabilityError
from grainlaw.geometry import Bricks, Voronoi, rectangle
from grainlaw.laws import Friction, MohrCoulomb, PrePeak
from grainlaw.runs import flutter
from grainlaw.runs.flutter import Flutter, _HeldStill
from grainlaw.units import MPa, mm
from grainlaw.workbench.conformance import Entry, Report

check = importlib.import_module("grainlaw.cli.check")
PRINTED = attrs.evolve(LAWS["cohesive-crack"], pre_peak=PrePeak.AS_PRINTED)
QUIET = {name: law for name, law in LAWS.items() if name != "munjiza"} | {
    "friction": Friction(kn=1.05e14, ks=9.45e13, friction_angle=35),
    "linear-rise": attrs.evolve(LAWS["cohesive-crack"], pre_peak=PrePeak.LINEAR),
}
UNBONDED = ("friction", "barton-bandis")


def sample():
    return gl.Specimen(Voronoi(grains=120, seed=1).tessellate(rectangle(20 * mm, 50 * mm)), ROCK)


@pytest.mark.thorough
@pytest.mark.parametrize("name", QUIET)
def test_a_law_that_keeps_an_energy_is_quiet(name):
    held = gl.hold(sample(), QUIET[name], 58 * MPa, confined=name in UNBONDED)
    assert not held.flutters
    assert held.rate == 0
    assert held.stress == pytest.approx(58 * MPa, rel=0.05)
    assert held.kinetic.max() < 1e-9
    assert len(held.time) == 200
    assert "does not flutter: held at 5" in str(held)


@pytest.mark.thorough
@pytest.mark.parametrize("law", [PRINTED, LAWS["munjiza"]], ids=["printed", "munjiza"])
def test_a_law_whose_rise_follows_the_pressure_flutters(law):
    """At more pressure it flutters faster, and no contact is damaged while it grows."""
    rates = []
    for stress in (58 * MPa, 87 * MPa):
        held = gl.hold(sample(), law, stress)
        rates.append(held.rate)
        grown = held.kinetic[held.damaged == held.damaged[0]]
        assert grown[-1] > 1e3 * grown[0]
        assert f"grows tenfold in {math.log(10) / held.rate * 1e6:.3g} us" in str(held)
    assert 1e4 < 2 * rates[0] < rates[1] < 1e6


@pytest.mark.thorough
def test_flutter_does_not_come_from_the_time_step():
    """With half the step, alike in time: an instability of the integration would depend on it."""
    rates = []
    for factor in (1.0, 0.5):
        rates.append(gl.hold(sample(), PRINTED, 58 * MPa, time_step_factor=factor).rate)
    assert rates[1] == pytest.approx(rates[0], rel=0.15)


def test_the_rate_of_a_known_growth():
    time = np.linspace(0, 1e-3, 200)
    kinetic = 1e-12 + 1e-12 * np.exp(2e4 * time)
    flutter = Flutter(1e6, time, kinetic, np.zeros(200), 1e-7)
    assert flutter.rate == pytest.approx(2e4, rel=0.02)
    wobbling = Flutter(1e6, time, 1e-12 * (2 + np.sin(1e5 * time)), np.zeros(200), 1e-7)
    assert wobbling.rate == 0
    breaks = np.where(time > 5e-4, 1e-3, 1e-12)  # what a break sets free is no flutter
    assert Flutter(1e6, time, breaks, np.where(time > 5e-4, 1, 0), 1e-7).rate == 0


def test_the_rate_is_that_from_the_root_of_ten_on_up_to_the_first_damage():
    """Level, then a growth that wobbles, then a burst at a break; less than tenfold is none."""
    time = np.linspace(0, 1e-3, 201)
    kinetic = 2e-12 * np.exp(2e4 * np.maximum(time - 4e-4, 0.0))
    kinetic *= np.exp(0.1 * (-1.0) ** np.arange(201))
    damaged = np.where(time > 8.2e-4, 3, 1)
    held = Flutter(1e6, time, np.where(damaged > 1, 1e9, kinetic), damaged, 1e-7)
    assert held.rate == pytest.approx(2e4, rel=0.01)
    assert held.flutters
    assert not Flutter(1e6, time[:102], kinetic[:102], np.ones(102), 1e-7).flutters  # 8 times
    late = np.array([1.0, 1.0, 1.0, 1.0, 100.0])  # between the last two alone
    assert Flutter(1e6, np.arange(5.0), late, np.zeros(5), 1e-7).rate == pytest.approx(np.log(100))
    assert "its kinetic energy grows tenfold in 11" in str(held)


def test_a_specimen_is_pressed_brought_to_rest_and_held_by_hand():
    """4 mm wide and 8 mm high, of one grain size; at 4 km/s a wave takes 2 us along it."""
    specimen = gl.Specimen(Bricks(rows=2).tessellate(rectangle(4e-3, 8e-3)), ROCK)
    test = _HeldStill(stress=50e6, modulus=50e9, wave_speed=4e3, duration=4e-4, confined=True)
    press, rest, calm, hold = test.stages(specimen)

    def drives(speed=0.0, ramp=0.0):
        sides = [gl.loads.Drive(boundary=side, axis=0, speed=0.0) for side in ("left", "right")]
        top = gl.loads.Drive(boundary="top", axis=1, speed=-speed, ramp=ramp)
        return [top, gl.loads.Drive(boundary="bottom", axis=1, speed=0.0), *sides]

    assert list(press.loads) == drives(1e-3 * 8e-3 / 16e-6, 2e-6)
    assert list(rest.loads) == list(calm.loads) == list(hold.loads[:-1]) == drives()
    assert [stage.interval for stage in (press, rest, calm, hold)] == pytest.approx([8e-8, 3e-6, 1e-6, 2e-6])
    assert press.until == [gl.conditions.Reaches("stress", 50e6), FailsTo("stress", 0.5)]
    assert press.sample_limit == 25 * 10 * 8
    assert [stage.until[0].progress({"time": np.zeros(5)}) for stage in (rest, calm, hold)] == [0.5, 0.5, 5 / 200]
    size = specimen.grains.grain_size
    assert calm.integrator.damping.coefficient == pytest.approx(0.3 * 4e3 / size)
    assert hold.loads[-1].velocity.std() == pytest.approx(2e-10 * 4e3, rel=0.5)
    assert len(attrs.evolve(test, confined=False).stages(specimen)[0].loads) == 2
    state = SimpleNamespace(mesh=specimen.mesh, reaction={"top": (0, -9e3), "bottom": (0, 7e3)}.get)
    assert test.measure(state) == {"stress": pytest.approx(2e6)}


@pytest.mark.parametrize(
    ("pressed", "fails"), [([30, 51, 50, 46, 40], False), ([30, 49, 49, 48, 40], True), ([30, 51, 50, 44, 40], True)]
)
def test_what_was_held_is_told_from_the_moment_without_damping(monkeypatch, pressed, fails):
    """Less than nine tenths of the stress that is left at rest is a failure, and so is less than the stress before."""
    asked = {}
    curves = {
        "stage": np.array([0, 1, 2, 3, 3]), "stress": np.array(pressed) * 1e6, "damaged": np.array([0, 0, 1, 2, 3]),
        "time": np.array([0, 1, 2, 3, 5.0]), "energy_kinetic": np.array([9, 9, 9, 1, 2.0]),
    }  # fmt: skip

    def simulate(specimen, law, test, **options):
        asked.update(duration=test.duration, modulus=test.modulus, **options)
        return SimpleNamespace(curves=curves, summary={"time_step": 1e-8})

    monkeypatch.setattr(flutter, "simulate", simulate)
    monkeypatch.setattr(flutter, "scales", lambda model: (5e10, 4e3, 2e-3))
    if fails:
        with pytest.raises(
            gl.StageError, match=rf"it reached {max(pressed)} MPa and holds {pressed[3]} MPa; stress = 50"
        ):
            gl.hold(small_sample(4), PRINTED, 50e6)
        return
    found = gl.hold(small_sample(4), PRINTED, 50e6)
    assert (found.stress, found.step) == (46e6, 1e-8)
    assert (found.time.tolist(), found.kinetic.tolist(), found.damaged.tolist()) == ([0, 2], [1, 2], [2, 3])
    assert asked["duration"] == pytest.approx(1300 * 2e-3 / 4e3)
    gl.hold(small_sample(4), PRINTED, 50e6, duration=1e-3)
    assert asked["duration"] == 1e-3


@pytest.mark.thorough
def test_a_sample_that_fails_before_is_refused_with_its_strength():
    with pytest.raises(
        gl.StageError, match=r"it reached \d+\.?\d* MPa and holds .* MPa; stress = 300 MPa must be lower"
    ) as failed:
        gl.hold(sample(), MohrCoulomb(**STRONG), 300 * MPa)
    assert failed.value.result.summary["tensile_cracks"] > 0
    with pytest.raises(gl.ParameterError, match="stress = -1"):
        gl.hold(small_sample(), PRINTED, -1.0)


HELD = MohrCoulomb(
    kn=1e14, ks=5e13, tensile_strength=10e6, cohesion=20e6, friction_angle=45, residual_friction_angle=45
)


def held_by_check(monkeypatch, law, *ends):
    """What the command holds, each time with another end; and whether it says that the law flutters."""
    held, ends = [], iter(ends)

    def hold(specimen, law, stress, confined):
        held.append((specimen, stress, confined))
        if isinstance(end := next(ends), Exception):
            raise end
        return SimpleNamespace(flutters=end, rate=1.0)

    monkeypatch.setattr(check, "hold", hold)
    with click.Context(click.Command("check")):
        return check._held(law), held


def test_check_holds_grains_that_suit_the_law(monkeypatch):
    """Under twice the strength of 20 MPa, with 1000 times as much stiffness and kn size / E as of granite."""
    flutters, [(specimen, stress, confined)] = held_by_check(monkeypatch, HELD, True)
    assert (flutters, confined) == (True, False)
    assert stress == pytest.approx(40e6, rel=0.05)  # it is probed in coarse steps
    assert specimen.material.youngs_modulus == pytest.approx(1000 * stress)
    assert (specimen.material.poissons_ratio, specimen.material.density) == (0.25, 3000)
    assert specimen.grains.count == 120
    width, height = np.ptp(specimen.grains.vertices, axis=0)
    assert height == pytest.approx(2.5 * width)
    assert 1e14 * np.sqrt(width * height / 120) / (1000 * stress) == pytest.approx(5.25)
    assert held_by_check(monkeypatch, Friction(kn=1e14, ks=1e14, friction_angle=35), False)[1][0][2]


def test_check_holds_what_fails_under_less(monkeypatch, capsys):
    failed = gl.StageError("it fails")
    flutters, held = held_by_check(monkeypatch, HELD, failed, failed, True)
    assert flutters
    full, *less = (stress for _, stress, _ in held)
    assert less == pytest.approx([full / 2, full / 4])
    assert held_by_check(monkeypatch, HELD, failed, failed, failed)[0] is False
    assert f"of 120 grains fails under {full / 4e6:.3g} MPa: it was not held" in capsys.readouterr().out
    assert held_by_check(monkeypatch, HELD, InstabilityError("it blew up"))[0] is False
    assert "a specimen of 120 grains: it blew up" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("passed", "flutters", "exceptions", "code"),
    [(True, False, (), 0), (True, True, (), 1), (True, True, ("energy",), 0), (False, False, (), 1)],
)
def test_the_exit_code_of_check(passed, flutters, exceptions, code, monkeypatch):
    monkeypatch.setattr(check, "law_or_file", lambda name: SimpleNamespace(exceptions=exceptions))
    monkeypatch.setattr(check, "check_law", lambda law: Report("mine", (Entry("energy", passed),)))
    monkeypatch.setattr(check, "_held", lambda law: flutters)
    assert CliRunner().invoke(main, ["check", "mine"]).exit_code == code


@pytest.mark.thorough
def test_check_tells_of_flutter(tmp_path):
    file = tmp_path / "mine.py"
    file.write_text(
        "import attrs\nfrom grainlaw.laws import PrePeak\nfrom grainlaw.cli.default_rock import LAWS\n"
        "printed = attrs.evolve(LAWS['cohesive-crack'], pre_peak=PrePeak.AS_PRINTED)\n"
    )
    for law in (f"{file}:printed", "munjiza"):
        done = CliRunner().invoke(main, ["check", law])
        assert done.exit_code == 0  # both declare that they make energy
        assert "a specimen of 120 grains of 0.0029 m flutters: held at 58" in done.output
        assert "its kinetic energy grows tenfold in" in done.output
    done = CliRunner().invoke(main, ["check", "mohr-coulomb"])
    assert done.exit_code == 0
    assert "does not flutter" in done.output


@pytest.mark.slow
@pytest.mark.parametrize("stress", [51 * MPa, 99 * MPa])
def test_the_sample_of_the_paper_is_quiet_under_the_default_and_flutters_as_printed(stress):
    """12,000 undamped steps of 755 grains, as in docs/flutter.md."""
    rock = gl.Specimen(Voronoi(grains=755, seed=1).tessellate(rectangle(50 * mm, 125 * mm)), ROCK)
    held = gl.hold(rock, LAWS["cohesive-crack"], stress, duration=12_000 * 7.6e-8)
    assert held.time[-1] / held.step > 11_900
    assert held.kinetic.max() < 1e-8
    assert held.damaged.max() == 0
    assert gl.hold(rock, PRINTED, stress).kinetic.max() > 1e-4
