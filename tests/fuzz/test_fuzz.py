"""Whatever is given is refused in one line, or runs: random calls and configurations, and those that once failed."""

import math

import numpy as np
import pytest
from fuzz import calls, configurations, files
from fuzz.limits import Case, fault_of

import grainlaw as gl
from grainlaw.geometry import Bricks, Empirical, LabelAgreement, Voronoi, block, disc, moved, polygon, rectangle, wall
from grainlaw.laws import EvansMarathe, HordijkSoftening
from grainlaw.materials import ALBITE, Thermal
from grainlaw.protocols import BiaxialCompression, Heating
from grainlaw.runs.elastic_properties import ElasticProperties


@pytest.fixture(autouse=True)
def drawn_into_files(monkeypatch, tmp_path):
    """Pictures are not shown, and a call that writes a file writes it here."""
    monkeypatch.setenv("MPLBACKEND", "agg")
    monkeypatch.chdir(tmp_path)


@pytest.mark.parametrize(
    ("draw", "count"), [(calls.cases, 150), (configurations.cases, 50), (files.cases, 90)],
    ids=["calls", "tests", "files"],
)  # fmt: skip
@pytest.mark.thorough
def test_a_few_random_cases_are_refused_or_run(draw, count):
    assert [fault for case in draw(1, count) if (fault := fault_of(case))] == []


@pytest.mark.slow
@pytest.mark.parametrize("seed", [2, 3, 4, 5, 6])
def test_random_calls_are_refused_or_run(seed):
    assert [fault for case in calls.cases(seed, 1000) if (fault := fault_of(case))] == []


@pytest.mark.slow
@pytest.mark.parametrize("seed", [2, 3, 4, 5])
def test_random_configurations_are_refused_or_run(seed):
    assert [fault for case in configurations.cases(seed, 500) if (fault := fault_of(case))] == []


@pytest.mark.slow
@pytest.mark.parametrize("seed", [2, 3])
def test_damaged_files_are_refused_or_read(seed):
    assert [fault for case in files.cases(seed, 700) if (fault := fault_of(case))] == []


def fits(confinement, peak):
    return lambda: (gl.fit_hoek_brown(confinement, peak), gl.fit_mohr_coulomb(confinement, peak))


def tried(*assignments):
    return lambda: configurations.run("uniaxial-compression", ["sample.grains=8", *assignments])


#: each of them once ended by another error, by a warning of numpy's, or not at all
REFUSED = {
    "trace: a number for the law": lambda: gl.trace(5, 1, 2),
    "trace: text": lambda: gl.trace(calls.BRITTLE, "x", 0),
    "trace: infinite": lambda: gl.trace(calls.BRITTLE, [0, math.inf], 0),
    "polygon: a number": lambda: polygon(3),
    "polygon: ragged": lambda: polygon([[1, 2], [3]]),
    "block: a number": lambda: block(math.nan),
    "region: names": lambda: gl.Region(calls.SQUARE, 5),
    "region: an array without a length": lambda: gl.Region(calls.SQUARE, np.array("x")),
    "crack_rose: bins": lambda: gl.crack_rose(calls.result().cracks, 10**30),
    "region: hole_sides": lambda: gl.Region(calls.SQUARE, "abcd", (), 0.5),
    "tessellation: a number": lambda: gl.Tessellation(rectangle(1, 1), 1, 2, 3),
    "moved: no grains": lambda: moved(5),
    "moved: infinite": lambda: moved(calls.specimen().grains, (0, math.inf)),
    "fit: unequal lengths": fits([0, 1, 2], [1, 2]),
    "fit: text": fits("ab", [1, 2]),
    "probe: a number": lambda: gl.Probe(points=5),
    "probe: places": lambda: gl.Probe(places=[1, 2, 3]),
    "window: text": lambda: gl.within_polygon(""),
    "events: an object": lambda: gl.acoustic_events(calls.result(), thickness=calls.ROCK),
    "fragments: half a frame": lambda: gl.fragments(calls.result(), 0.5),
    "laboratory: a number": lambda: gl.Laboratory(calls.result(), 5),
    "parameters: a number": lambda: gl.parameters(5),
    "stage: until": lambda: gl.Stage(name="x", until=0.5, interval=1),
    "softening: arrays": lambda: (HordijkSoftening(c1=[1, 2]), EvansMarathe(a=[1, 2])),
    "protocol: an array": lambda: BiaxialCompression(confinement=[1, 2]),
    "region: 1e300 m": lambda: rectangle(1e300, 1),
    "region: 1e14 m": lambda: rectangle(1e14, 1e14),
    "region: thin": lambda: rectangle(1e-9, 0.05),
    "relaxation for ever": lambda: Voronoi(grains=5, relaxation=10**9),
    "bricks: 1e30 rows": lambda: Bricks(rows=10**30),
    "wall: 5e8 courses": lambda: wall(4, 1e9, brick_width=1, brick_height=2),
    "wall: bricks of 1e-9 m": lambda: wall(2, 4, brick_width=1e-9, brick_height=1),
    "stop: a number": lambda: gl.Stop(0),
    "test.samples=[1,2]": tried("test.samples=[1,2]"),
    "rock.density=[]": tried("rock.density=[]"),
    "sample.width=1e-9": tried("sample.width=1e-9"),
    "sample.width=1e14": tried("sample.width=1e14"),
    "rock.youngs_modulus=1e300": tried("rock.youngs_modulus=1e300"),
    "law.kn=5e-324": tried("law.kn=5e-324"),
    "threads": tried("numerics.threads=129"),
    "rock.density=[1,2]": tried("rock.density=[1,2]"),
    "results: other names": lambda: (ElasticProperties(1, modules=2), LabelAgreement(label=1)),
    "grains of no area": lambda: Voronoi(grain_size=5e-324).tessellate(rectangle(1, 1)),
    "compress: text": lambda: gl.compress(calls.ROCK, ""),
    "compress: a list of confinements": lambda: gl.compress(calls.ROCK, 0.1, confinement=[0, 1]),
    "compress: 1e300": lambda: gl.compress(calls.ROCK, 1e300),
    "window: a class": lambda: gl.mean_stress(calls.result(), int),
    "a step of no time": lambda: gl.hold(calls.specimen(), calls.BRITTLE, 1e6, time_step_factor=5e-324),
    "no law": lambda: gl.certify(calls.specimen(), {}, calls.PRESS),
    "trace: time_step": lambda: gl.trace(calls.BRITTLE, 0, 0, time_step=calls.ROCK),
    "trace: 1e300 m": lambda: gl.trace(calls.BRITTLE, 1e300, 0),
    "polygon: no corners": lambda: polygon(np.zeros((0, 2))),
    "disc: 1e30 sides": lambda: disc(2, sides=10**30),
    "region: holes": lambda: gl.Region(calls.SQUARE, "abcd", range(3)),
    "heating: text": lambda: Heating(to=np.array("x")),
    "thermal: reference": lambda: Thermal(material=calls.ROCK, expansion=ALBITE, reference=np.full(3, 1e6)),
    "quantity: a name": lambda: gl.Quantity(5),
    "quantity: no name": lambda: gl.Quantity(unit="Pa"),
    "quantity: form": lambda: gl.Quantity("stress", form="4q"),
    "sizes: none": lambda: Empirical(diameters=None),
}


@pytest.fixture(scope="module", autouse=True)
def compiled():
    """The run that cases ask for is made before their time is taken."""
    calls.result()


@pytest.mark.parametrize("call", REFUSED.values(), ids=REFUSED)
def test_what_once_failed_is_refused(call):
    assert fault_of(Case("", call, "")) == ""
    with pytest.raises(gl.ParameterError):
        call()


def test_a_fault_is_found():
    """The harness tells another error, a message of two lines, a warning and a loop without end."""

    def wrong():
        raise gl.ParameterError("two\nlines")

    def endless():
        while True:
            pass

    assert "ZeroDivisionError" in fault_of(Case("", lambda: 1 / 0, ""))
    assert "two" in fault_of(Case("", wrong, ""))
    assert "RuntimeWarning" in fault_of(Case("", lambda: np.float64(1e300) * 1e300, ""))
    assert "no end" in fault_of(Case("", endless, ""), 0.2)
    assert fault_of(Case("", lambda: 1, "")) == ""
