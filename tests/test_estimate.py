"""What is said before a run that would take very long, or more memory than there is."""

import warnings
from types import SimpleNamespace

import attrs
import numpy as np
import psutil
import pytest
from support import ROCK, STIFF, STRONG, small_sample

import grainlaw as gl
from grainlaw.contact import memory_names
from grainlaw.engine.model import Model
from grainlaw.geometry import Bricks, rectangle
from grainlaw.laws import Linear, MohrCoulomb
from grainlaw.protocols import UniaxialCompression
from grainlaw.runs import estimate
from grainlaw.runs.estimate import CostWarning, check_memory, expected_steps, expected_work, in_words, warn_if_long
from grainlaw.runs.stopping import Stop, Stopped
from grainlaw.units import mm

BRITTLE = MohrCoulomb(**STRONG)


def begun(specimen, test):
    """Begin a run, and stop it as soon as it steps."""
    stop = Stop()
    stop.ask("enough")
    with pytest.raises(Stopped):
        gl.simulate(specimen, BRITTLE, test, stop=stop)


def test_a_very_slow_test_is_said_to_take_hours():
    with pytest.warns(
        CostWarning, match=r"about .* steps, .*: stage 'compression' lasts 400 s at a speed of 1e-06 m/s"
    ):
        begun(small_sample(), UniaxialCompression(loading=gl.Constant(speed=1e-6)))


def test_a_test_of_seconds_says_nothing():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        begun(small_sample(), UniaxialCompression(loading=gl.Constant(speed=0.05)))


def test_a_probe_is_scaled_to_all_steps(monkeypatch):
    """Of 2,000 zones; the first step warms up and does not count."""
    done, clock = [], iter([3.0, 5.0])
    monkeypatch.setattr(estimate.time, "perf_counter", lambda: next(clock))
    found = estimate.estimate(1e6, 2000, done.append)
    assert done == [1, count := int(estimate.PROBE / 2000)]
    assert (found.steps, found.seconds) == (1e6, pytest.approx(1e6 * 2.0 / count))


def test_a_probe_leaves_no_trace(monkeypatch):
    run = (
        small_sample(),
        BRITTLE,
        UniaxialCompression(loading=gl.Constant(speed=1.0), maximum_strain=1e-3, samples=20),
    )
    without = gl.simulate(*run)
    monkeypatch.setattr(estimate, "QUICK", 0)
    probed = []
    monkeypatch.setattr(estimate, "warn_if_long", lambda found, *_: probed.append(found))
    with_probe = gl.simulate(*run)
    assert all(np.array_equal(row, with_probe.curves[name], equal_nan=True) for name, row in without.curves.items())
    assert probed[0].steps == pytest.approx(without.summary["steps"], rel=0.05)


def test_steps_are_those_of_the_stages_whose_length_is_known():
    stage = gl.Stage(name="load", until=[gl.conditions.Reaches("time", 1)], interval=1e-3, expected=50)
    unknown = attrs.evolve(stage, expected=None)
    assert expected_steps([stage, unknown, stage], 1e-5, 1e4) == 2 * 50 * 100
    assert expected_steps([attrs.evolve(stage, interval=1e-6)], 1e-5, 1e4) == 50  # a sample is at least one step


def stages(specimen, **loading):
    return UniaxialCompression(loading=gl.Constant(**loading)).stages(specimen)


def test_what_rules_the_length_is_named():
    found = estimate.Estimate(1e8, 1e5)
    plain = small_sample()
    with pytest.warns(CostWarning, match=r"27.8 h: the ramp of 3 s is long"):
        warn_if_long(found, stages(plain, ramp=3.0, speed=1.0), plain, 1e-7, 1e4)
    with pytest.warns(CostWarning, match=r"it has 40 grains, \d+ zones; use fewer"):
        warn_if_long(found, stages(plain, speed=1.0), plain, 1e-7, 1e4)
    thin = gl.Specimen(Bricks(rows=200, columns=2).tessellate(rectangle(300 * mm, 2 * mm)), ROCK)
    assert np.hypot(*thin.mesh.interface_edges.T).min() < 0.02e-3
    with pytest.warns(CostWarning, match=r"time step of 1e-07 s is that of an edge of .* m between the grains \d+ and"):
        warn_if_long(found, stages(thin, speed=1.0), thin, 1e-7, 1e4)


def test_more_memory_than_is_free_is_said(monkeypatch):
    specimen = small_sample()
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_memory(specimen, 30)
    free = psutil.virtual_memory()._replace(available=100_000)
    monkeypatch.setattr(estimate.psutil, "virtual_memory", lambda: free)
    with pytest.warns(CostWarning, match=r"GB are free: 40 grains, refinement = 0, frames = 30; fewer frames help"):
        check_memory(specimen, 30)


def test_memory_grows_by_zones_and_frames(monkeypatch):
    """A zone to a corner, four times as many with each refinement; warned above a share of what is free."""
    specimen = gl.Specimen(Bricks(rows=2).tessellate(rectangle(4 * mm, 8 * mm)), ROCK, refinement=3)
    needed = 8 * 4**3 * (estimate.PER_ZONE + 2 * estimate.PER_FRAME)
    for share, warned in ((0.99, True), (1.01, False)):
        free = SimpleNamespace(available=share * needed / estimate.MOST)
        monkeypatch.setattr(estimate.psutil, "virtual_memory", lambda free=free: free)
        with warnings.catch_warnings(record=True) as told:
            warnings.simplefilter("always")
            check_memory(specimen, 2)
        assert len(told) == warned


@pytest.mark.parametrize(
    ("seconds", "words"), [(30, "30 s"), (600, "10 min"), (8 * 3600, "8 h"), (3 * 86400, "3 days"), (1e9, "31.7 years")]
)
def test_times_are_said_as_people_say_them(seconds, words):
    assert in_words(seconds) == words


def work(specimen, law, test):
    return expected_work(Model(specimen, law), test.stages(specimen))


@pytest.mark.thorough
def test_runs_are_put_in_the_order_in_which_they_take_long():
    """What is expected, over the steps of a run to the end, is about the same for very unlike samples."""
    short = UniaxialCompression(loading=gl.Constant(speed=2.0), maximum_strain=5e-4, samples=20)
    law = Linear(**STIFF)
    samples = (small_sample(10), small_sample(60, seed=3), small_sample(20, material=gl.Rigid(density=3100)))
    shares = []
    for specimen in samples:
        steps = gl.simulate(specimen, law, short, detection=None).summary["steps"]
        shares.append(work(specimen, law, short)[0] / (steps * len(specimen.mesh.zones)))
    assert max(shares) < 1.15 * min(shares)
    stiff = attrs.evolve(law, kn=100 * law.kn, ks=100 * law.ks)
    phases = attrs.evolve(samples[0].grains, phase=np.arange(10) % 2)
    mixed = gl.Specimen(phases, ROCK)
    for laws in ({(0, 0): law, ...: stiff}, {(0, 0): stiff, ...: law}):  # the stiffest rules the steps
        assert work(mixed, laws, short)[0] == pytest.approx(work(mixed, stiff, short)[0])
        assert work(mixed, {(0, 0): law, ...: BRITTLE}, short)[2] == len(memory_names(BRITTLE))  # law remembers none
    slow = attrs.evolve(short, loading=gl.Constant(speed=1.0))
    assert work(samples[0], law, slow)[0] == pytest.approx(2 * work(samples[0], law, short)[0], rel=0.02)
    assert work(samples[0], law, short) > work(samples[0], BRITTLE, short)  # nothing breaks: it goes on to the end
    quick = attrs.evolve(short, loading=gl.Adaptive())
    assert work(samples[0], law, quick) < work(samples[0], BRITTLE, quick)  # and does so quickly
