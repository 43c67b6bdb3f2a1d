"""Ends of bars and the split Hopkinson bar: the exact series of waves, a meshed bar, balance, rates, strength."""

import re
import tomllib
from pathlib import Path

import attrs
import numpy as np
import pytest
from bars import ROCK as WHOLE
from bars import bar
from support import STIFF, STRONG, small_sample, state_of

import grainlaw as gl
from grainlaw.cli.configuration import configured
from grainlaw.columns import ENERGY, SPENT
from grainlaw.geometry import Bricks, Voronoi, between_platens, disc, rectangle, semi_disc
from grainlaw.laws import Linear, MohrCoulomb
from grainlaw.protocols import (
    BiaxialCompression,
    Brazilian,
    Moving,
    PlaneWave,
    Platens,
    SemiCircularBend,
    SplitHopkinson,
    UniaxialCompression,
    UniaxialTension,
)
from grainlaw.protocols.bending import toughness
from grainlaw.protocols.measures import size
from grainlaw.results.figures.curves import plot_report_curves

DOCS = Path(__file__).parents[1] / "docs"
ROCK = gl.Elastic(youngs_modulus=60e9, poissons_ratio=0.0, density=2700)  # a plane wave is that of a thin bar
STEEL = gl.Elastic(youngs_modulus=200e9, poissons_ratio=0.0, density=7850)
HEIGHT, SIZE = 40e-3, 100e6  # m, Pa of the waves
SPEED = np.sqrt(60e9 / 2700)
ACROSS = HEIGHT / SPEED  # s, that a wave takes through the rock
OF_ROCK, OF_BARS = 2700 * SPEED, np.sqrt(200e9 * 7850)  # Pa s/m
R = (OF_BARS - OF_ROCK) / (OF_BARS + OF_ROCK)  # of a wave in the rock, at an end


def column(rows, columns=1):
    """Bricks as wide as high, and bonds so stiff that they add 1e-5 to their compliance."""
    size = HEIGHT / rows
    grains = Bricks(rows=rows, columns=columns).tessellate(rectangle(columns * size, HEIGHT))
    stiffness = 1e5 * 60e9 / size
    return gl.Specimen(grains, ROCK), Linear(kn=stiffness, ks=stiffness)


def bell(duration):
    """sin^4, which begins and ends with three derivatives of zero; as points."""
    t = np.linspace(0, duration, 401)
    return gl.TimeSeries(t, -SIZE * np.sin(np.pi * t / duration) ** 4)


def mean(wave, begin, end):
    return (wave.integral(end) - wave.integral(begin)) / (end - begin)


def series(wave, time, terms=80):
    """(2, t) Pa, means over samples of the stresses at both ends of an elastic bar between others: the exact series.

    A wave in the rock comes back from each end R times as large, with its sign: under a step the stress at the ends
    after n passages is 1 - R^(n + 1), at the first end for even, at the second for odd n.
    """
    begin = np.append(0.0, time[:-1])
    found = np.zeros((2, len(time)))
    for n in range(terms):
        gain = 1 - R if n == 0 else R ** (n - 1) - R ** (n + 1)
        found[n % 2] += gain * mean(wave, begin - n * ACROSS, time - n * ACROSS)
    return found


def errors(rows):
    """Largest difference of the end stresses from the series, over the size of the wave; and the root of its mean."""
    specimen, law = column(rows)
    wave = bell(40e-6)
    curves = gl.simulate(specimen, law, SplitHopkinson(wave=wave, duration=60e-6), frames=1).curves
    found = np.array([curves["incident"] + curves["reflected"], curves["transmitted"]])
    apart = (found - series(wave, curves["time"])) / SIZE
    return np.abs(apart).max(), np.sqrt((apart**2).mean())


pytestmark = pytest.mark.filterwarnings("ignore:.*normal stiffness.*:grainlaw.UnitWarning")  # bricks as if of a piece


@pytest.mark.thorough
def test_the_waves_of_an_elastic_specimen_are_the_exact_series():
    """To 0.1 % with 20 bricks (a wave of 10 per millimetre of height), with an error of second order."""
    coarse, fine = errors(10), errors(20)
    assert fine[0] < 1e-3
    assert np.log2(coarse[1] / fine[1]) > 1.6


@pytest.mark.thorough
def test_under_a_step_the_ends_come_into_balance_passage_by_passage():
    """In the middle of each passage n the stress at the end it has met is 1 - R^(n + 1): closed form to 2 %."""
    specimen, law = column(60)
    step = gl.TimeSeries([0, 1e-6], [0, -SIZE])
    test = SplitHopkinson(wave=step, duration=6 * ACROSS, samples=600)
    curves = gl.simulate(specimen, law, test, frames=1).curves
    ends = np.array([curves["incident"] + curves["reflected"], curves["transmitted"]]) / -SIZE
    passage = curves["time"] / ACROSS
    for n in range(1, 6):
        flat = (passage > n + 0.3) & (passage < n + 0.9)
        last, before = 1 - R ** (n + 1), 1 - R**n
        assert ends[n % 2][flat].mean() == pytest.approx(last, rel=0.02)
        assert ends[1 - n % 2][flat].mean() == pytest.approx(before, rel=0.02)
        difference = 2 * (last - before) / (last + before)
        assert curves["end_difference"][flat].mean() == pytest.approx(difference, abs=0.02 * 2)


@pytest.mark.thorough
def test_rates_are_those_of_the_ends_and_the_energy_that_of_the_waves():
    specimen, law = column(20)
    test = SplitHopkinson(wave=gl.pulse(-SIZE, rise=60e-6), duration=150e-6)
    result = gl.simulate(specimen, law, test, frames=1)
    curves = result.curves
    time = curves["time"]
    interval = np.diff(time, prepend=0.0)
    strain = np.cumsum(curves["strain_rate"] * interval)  # at the ends of samples; ``strain`` is a mean over them
    assert np.abs((strain + np.append(0, strain[:-1])) / 2 - curves["strain"]).max() < 2e-3 * strain.max()
    apart = curves["strain_rate_one_wave"] - curves["strain_rate"]  # by what the forces on the ends differ
    assert apart * OF_BARS * HEIGHT == pytest.approx(curves["stress_bottom"] - curves["stress_top"], abs=1e-6 * SIZE)
    carried = curves["incident"] ** 2 - curves["reflected"] ** 2 - curves["transmitted"] ** 2
    width = np.ptp(specimen.mesh.nodes[:, 0])
    supplied = np.cumsum(carried * interval) * width / OF_BARS
    assert np.abs(supplied - curves["energy_external"]).max() < 2e-3 * supplied.max()
    spent = sum(curves[ENERGY + kind] for kind in SPENT)
    assert np.abs(spent - curves["energy_external"]).max() < 1e-6 * supplied.max()


@pytest.mark.thorough
@pytest.mark.parametrize("width", [None, 5e-3])
def test_an_end_of_a_bar_is_as_a_meshed_bar(width):
    """Rock between two bars of 300 bricks of steel, and between two ends: the same stress beyond it, to 1 %."""
    size, wave = 2e-3, gl.pulse(-SIZE, rise=20e-6)
    scale = 1.0 if width is None else width / size  # a bar of another section: as one of another density and modulus
    steel = attrs.evolve(STEEL, youngs_modulus=200e9 * scale, density=7850 * scale)
    grains = Bricks(rows=1, columns=320).tessellate(rectangle(320 * size, size))
    rock = (np.arange(320) >= 150) & (np.arange(320) < 170)
    whole = gl.Specimen(attrs.evolve(grains, phase=rock.astype(int)), {0: steel, 1: ROCK})
    glued = Linear(kn=1e4 * 200e9 / size, ks=1e4 * 200e9 / size)
    beyond = PlaneWave(stress=wave, gauges=(485 * size / 2,), duration=220e-6, samples=1100)
    meshed = gl.simulate(
        whole, glued, attrs.evolve(beyond, stress=gl.pulse(-SIZE * scale, rise=20e-6)), frames=1
    ).curves

    @attrs.frozen(kw_only=True)
    class Ends(PlaneWave):
        def stages(self, specimen):
            (stage,) = super().stages(specimen)
            known = {"axis": 0, "impedance": OF_BARS, "width": width}
            presses = gl.pulse(SIZE, rise=20e-6)  # at the left along x
            ends = [
                gl.loads.BarEnd(boundary="left", stress=presses, **known),
                gl.loads.BarEnd(boundary="right", **known),
            ]
            return [attrs.evolve(stage, loads=[*stage.of(gl.loads.Drive), *ends])]

        def measure(self, state):
            return {"stress": -state.reaction("right")[0] / (width or size)}

        def summary(self, curves, specimen):
            return {}

    alone = gl.Specimen(Bricks(rows=1, columns=20).tessellate(rectangle(20 * size, size)), ROCK)
    found = gl.simulate(alone, glued, Ends(duration=120e-6, samples=1100), frames=1).curves
    late = (150 + 485 / 2 - 170) * size / np.sqrt(200e9 / 7850)
    same = np.interp(found["time"] + late, meshed["time"], meshed["stress_0"])
    assert np.abs(same / scale + found["stress"]).max() < 0.01 * SIZE


# --- strength --------------------------------------------------------------------------------------------------------


@pytest.mark.thorough
def test_a_slow_wave_finds_the_strength_of_the_joints():
    """Bricks on end, pulled by a wave that rises in 150 passages: the tensile strength of their joints, to 1 %."""
    specimen = gl.Specimen(Bricks(rows=4, columns=1).tessellate(rectangle(5e-3, 20e-3)), ROCK)
    pull = SplitHopkinson(test=UniaxialTension(), wave=[(0, 0), (600e-6, 20e6)], duration=600e-6, samples=2000)
    found = gl.simulate(specimen, MohrCoulomb(**STRONG), pull, frames=1).summary
    assert found["strength"] == pytest.approx(13e6, rel=0.01)
    assert found["end_difference"] < 0.05
    assert found["stress_rate"] == pytest.approx(20e6 / 600e-6, rel=0.03)
    assert not {"kinetic_ratio", "imbalance"} & set(found)


@pytest.mark.thorough
def test_what_was_not_damaged_has_no_strength():
    """The load of an elastic specimen falls with the wave: no failure."""
    specimen, law = column(10)
    wave = gl.pulse(-SIZE, rise=30e-6)
    result = gl.simulate(specimen, law, SplitHopkinson(wave=wave), frames=1)
    ends = -series(wave, result.curves["time"]).mean(axis=0)
    assert np.isnan(result.summary["strength"])
    assert np.isnan(result.summary["failure_strain"])
    assert result.summary["largest_stress"] == pytest.approx(ends.max(), rel=2e-3)
    assert result.summary["failure_time"] == pytest.approx(result.curves["time"][ends.argmax()], rel=0.01)


DISC = gl.Specimen(Voronoi(grains=120, seed=1).tessellate(disc(30e-3)), WHOLE)
HALF = gl.Specimen(
    Voronoi(grains=120, seed=1).tessellate(
        semi_disc(40e-3, notch_depth=9e-3, notch_width=1e-3, span=24e-3, bearing=3e-3)
    ), WHOLE,
)  # fmt: skip


@pytest.mark.thorough
def test_a_disc_is_split_by_a_wave():
    """In balance the stress in its middle is that of the static test; the strength by its formula."""
    test = SplitHopkinson(test=Brazilian(), wave=gl.pulse(-60e6, rise=120e-6), width=30e-3, samples=1600)
    result = gl.simulate(DISC, MohrCoulomb(**STRONG), test, frames=1)
    found, curves = result.summary, result.curves
    slow = gl.simulate(DISC, MohrCoulomb(**STRONG), Brazilian(), frames=1)
    half = np.argmax(curves["stress"] > found["strength"] / 2)
    same = np.argmax(slow.curves["stress"] > slow.summary["strength"] / 2)
    ratio = curves["middle_across"][half] / curves["stress"][half]
    assert ratio == pytest.approx(slow.curves["middle_across"][same] / slow.curves["stress"][same], rel=0.05)
    assert found["failure_force"] == pytest.approx(found["strength"] * np.pi * size(DISC)[0] / 2, rel=1e-9)
    upper, lower = curves["stress_top"], curves["stress_bottom"]
    at = np.argmax(curves["time"] >= found["failure_time"])
    assert found["end_difference"] == pytest.approx(2 * abs((upper - lower) / (upper + lower))[at], rel=1e-9)


@pytest.mark.thorough
def test_a_notched_half_disc_stands_on_two_halves_of_a_bar():
    test = SplitHopkinson(test=SemiCircularBend(), wave=gl.pulse(-15e6, rise=150e-6), width=40e-3, samples=1600)
    result = gl.simulate(HALF, MohrCoulomb(**STRONG), test, frames=1)
    found, curves = result.summary, result.curves
    assert found["toughness"] == pytest.approx(toughness(found["failure_force"], HALF), rel=1e-12)
    assert found["toughness_rate"] == pytest.approx(found["force_rate"] * toughness(1.0, HALF), rel=1e-9)
    assert np.abs(curves["transmitted"] * -40e-3 - curves["force_bottom"]).max() < 1e-9 * curves["force_bottom"].max()
    assert "strain_rate" not in curves


@pytest.mark.thorough
def test_platens_of_their_own_lie_between_bars_and_rock():
    grains = between_platens(Bricks(rows=4, columns=2).tessellate(rectangle(20e-3, 20e-3)), 5e-3, 2e-3)
    specimen = gl.Specimen(grains, {0: ROCK, 1: STEEL})
    law = {(0, 0): Linear(**STIFF), (1, 1): Linear(**STIFF), (0, 1): Linear(**STIFF)}
    wave = gl.pulse(-20e6, rise=200e-6)
    found = gl.simulate(specimen, law, SplitHopkinson(wave=wave, duration=400e-6, width=24e-3), frames=1)
    assert found.summary["largest_stress"] == pytest.approx(20e6 * 24 / 20, rel=0.03)  # of the rock's own section
    assert found.summary["mean_end_difference"] < 0.05


# --- stages, threads, refusals ---------------------------------------------------------------------------------------


def test_a_file_puts_a_disc_between_bars():
    """As docs/waves.md shows it."""
    text = re.search(r"^```toml\n(# disc.toml.*?)^```", (DOCS / "waves.md").read_text("utf-8"), re.M | re.S)[1]
    made = configured("split-hopkinson", tomllib.loads(text), quick=True)
    wave = gl.TimeSeries([0, 150e-6], [0, -60e6])
    assert made.protocol == SplitHopkinson(test=Brazilian(), wave=wave, width=50e-3)
    assert configured("split-hopkinson", made.sections, quick=True).protocol == made.protocol
    assert [end.boundary for end in made.protocol.stages(made.specimen)[0].of(gl.loads.BarEnd)] == ["top", "bottom"]


@pytest.fixture(scope="module")
def struck():
    test = SplitHopkinson(wave=gl.pulse(-300e6, rise=10e-6), duration=30e-6, samples=60)
    return gl.simulate(small_sample(20), MohrCoulomb(**STRONG), test)


@pytest.mark.thorough
def test_a_report_draws_the_waves_and_says_where_the_ends_were_not_in_balance(struck, tmp_path):
    (panel,) = [axes for axes in plot_report_curves({"a": struck}).axes if "waves" in axes.get_ylabel()]
    assert panel.get_ylabel() == "stress of the waves in the bars (MPa)"
    assert [line.get_label() for line in panel.lines] == ["incident", "reflected", "transmitted"]
    assert panel.lines[0].get_ydata() == pytest.approx(struck.curves["incident"] / 1e6)
    for value, words in ((0.049, "pass"), (0.051, "FAIL")):
        result = attrs.evolve(struck, summary=struck.summary | {"end_difference": value})
        result.write_report(tmp_path / "report.html")
        page = (tmp_path / "report.html").read_text("utf-8")
        assert ("were not in balance at failure" in page) == (words == "FAIL")
        assert f"{100 * value:.2f} {words}" in page


@pytest.mark.parametrize("moving", Moving)
def test_bars_stand_where_the_test_moves_and_holds(moving):
    press = UniaxialCompression(platens=Platens.ROUGH, moving=moving)
    (stage,) = SplitHopkinson(test=press, wave=-5e6, width=0.03).stages(small_sample())
    known = {"axis": 1, "impedance": OF_BARS, "width": 0.03}
    assert stage.of(gl.loads.BarEnd) == [
        gl.loads.BarEnd(boundary="top", stress=-5e6, **known), gl.loads.BarEnd(boundary="bottom", stress=0.0, **known)
    ]  # fmt: skip
    assert {(drive.boundary, drive.axis, drive.speed) for drive in stage.of(gl.loads.Drive)} == {
        ("top", 0, 0.0), ("bottom", 0, 0.0)
    }  # fmt: skip
    assert stage.moved_by.damping == gl.integration.Undamped()


def test_it_ends_at_the_failure_where_its_test_does():
    press = UniaxialCompression(until=gl.Until.FAILURE)
    (stage,) = SplitHopkinson(test=press, duration=1e-3).stages(small_sample())
    assert stage.until == [gl.conditions.Reaches("time", 1e-3), gl.conditions.Fails("stress", "strain")]


def test_two_supports_share_a_bar():
    (stage,) = SplitHopkinson(test=SemiCircularBend(), width=0.03).stages(HALF)
    ends = stage.of(gl.loads.BarEnd)
    assert [end.boundary for end in ends] == ["load", "support_left", "support_right"]
    assert [end.width for end in ends] == [0.03, 0.015, 0.015]
    assert all(end.roller for end in ends)


@pytest.mark.thorough
def test_waves_between_bars_are_the_same_for_any_number_of_threads():
    test = SplitHopkinson(wave=gl.pulse(-300e6, rise=10e-6), duration=30e-6, samples=20)
    runs = [gl.simulate(small_sample(20), MohrCoulomb(**STRONG), test, threads=threads) for threads in (1, 2, 3)]
    for run in runs[1:]:
        for name, curve in runs[0].curves.items():
            assert np.array_equal(curve, run.curves[name], equal_nan=True), name
    assert runs[0].curves["tensile_cracks"][-1] > 0


@pytest.mark.filterwarnings("ignore::grainlaw.UnitWarning")
@pytest.mark.parametrize("modulus", [1e2, 1e18])
def test_bars_of_any_stiffness_leave_the_stable_step_as_it_is(modulus):
    """The dashpot acts on the mean velocity of a step. With the whole stable step the ledger closes."""
    specimen, law = column(4)
    whole = gl.integration.CentralDifference(damping=gl.integration.Undamped(), safety=1.0)
    wave = gl.pulse(-SIZE, rise=5e-6)
    test = SplitHopkinson(wave=wave, youngs_modulus=modulus, duration=20e-6, samples=50, integrator=whole)
    result = gl.simulate(specimen, law, test, frames=1)
    assert result.summary["energy_error"] < 1e-5
    if modulus == 1e18:  # a wall that is as good as still: it moves by 2 sigma / Z
        moved = 2 * float(wave.integral(np.array(20e-6))) / np.sqrt(modulus * 7850)
        assert result.curves["strain"].max() <= -1.01 * moved / HEIGHT


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: gl.loads.BarEnd(boundary="top", axis=1, impedance=0.0), "BarEnd: impedance = 0 Pa s/m is not allowed"),
        (lambda: gl.loads.BarEnd(boundary="top", axis=2, impedance=4e7), "BarEnd: axis = 2"),
        (
            lambda: gl.loads.BarEnd(boundary="top", axis=1, impedance=4e7, width=-1.0),
            "BarEnd: width = -1.0 m is not allowed",
        ),
        (lambda: SplitHopkinson(width=0.0), "SplitHopkinson: width = 0.0 m is not allowed"),
        (lambda: SplitHopkinson(test=SplitHopkinson()), "SplitHopkinson: test = .* another test"),
        (lambda: SplitHopkinson(wave="fast"), "SplitHopkinson: wave = 'fast' is not allowed"),
        (lambda: SplitHopkinson(test=BiaxialCompression(confinement=1e6)).stages(small_sample()), "one stage"),
        (lambda: SplitHopkinson(test=PlaneWave()).stages(bar(4)), "test = .* must have one stage"),
        (lambda: SplitHopkinson(test=Brazilian()).stages(small_sample()), "the specimen is no disc"),
        (
            lambda: SplitHopkinson(test=UniaxialTension()).stages(small_sample()),
            "wave of -300 MPa is not allowed, it presses and the test UniaxialTension pulls",
        ),
        (
            lambda: SplitHopkinson(wave=gl.pulse(60e6, rise=60e-6)).stages(small_sample()),
            "wave of 60 MPa is not allowed, it pulls and the test UniaxialCompression presses",
        ),
        (lambda: gl.pulse(1.0, rise=0.0), "pulse: rise = 0.0 s is not allowed"),
        (lambda: _stage(static=True), "a static stage has no waves"),
        (
            lambda: _stage(gl.loads.Drive(boundary="top", axis=1, speed=1.0)),
            "boundary = 'top' has a BarEnd and a Drive",
        ),
        (lambda: _stage(gl.loads.Quiet(boundary="top")), "is quiet and has a platen under a force"),
        (
            lambda: state_of(small_sample(), Linear(**STIFF)).check(_stage(boundary="lid")),
            "BarEnd: .* no boundary named lid",
        ),
    ],
)
def test_bad_values_are_refused(make, words):
    with pytest.raises(gl.ParameterError, match=words):
        make()


def _stage(*more, boundary="top", static=False):
    end = gl.loads.BarEnd(boundary=boundary, axis=1, impedance=4e7)
    return gl.Stage(
        name="s", loads=[end, *more], until=[gl.conditions.Reaches("time", 1.0)], interval=1e-6, static=static
    )


def test_a_pulse_rises_holds_and_falls():
    wave = gl.pulse(2.0, rise=4.0, hold=3.0)
    assert [wave(t) for t in (0.0, 2.0, 4.0, 7.0, 9.0, 11.0, 20.0)] == pytest.approx([0, 1, 2, 2, 1, 0, 0], abs=1e-12)
    assert float(wave.integral(np.array(11.0))) == pytest.approx(2 * (4 + 3), rel=1e-9)
