"""What is refused, with which words; and what is told and kept when a run goes wrong."""

import math
import warnings

import attrs
import numpy as np
import pytest
import pyvista
from support import ROCK, STIFF, STRONG, small_sample

import grainlaw as gl
from grainlaw.engine.ledger import energies
from grainlaw.geometry import Hexagonal, Voronoi, rectangle
from grainlaw.laws import CohesiveCrack, Linear, MohrCoulomb
from grainlaw.protocols import UniaxialCompression
from grainlaw.results.vtk import VtkWriter

LINEAR = Linear(**STIFF)
PRESS = UniaxialCompression(loading=gl.Constant(speed=0.2), maximum_strain=5e-4, samples=50)
SQUARE = rectangle(1, 1)
RIGID = gl.Rigid(density=3100)


@pytest.fixture(autouse=True)
def no_warning_leaks():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        yield


def run(law=LINEAR, protocol=PRESS, specimen=None, **options):
    return gl.simulate(specimen or small_sample(5), law, protocol, **options)


REFUSED = {
    "negative": (lambda: Linear(kn=-1, ks=1), "Linear: kn = -1 Pa/m is not allowed, .* above 0"),
    "nan": (lambda: Linear(kn=math.nan, ks=1), "kn = nan Pa/m is not allowed, it must be a finite number"),
    "infinite": (lambda: Linear(kn=1, ks=math.inf), "ks = inf Pa/m is not allowed, it must be a finite number"),
    "one of many": (lambda: Linear(kn=np.array([1, -2.0]), ks=1), "kn = -2 Pa/m is not allowed"),
    "text": (lambda: Linear(kn="stiff", ks=1), "kn = 'stiff' is not allowed, it must be a finite number"),
    "friction": (lambda: MohrCoulomb(**STRONG | {"friction_angle": 90}), "friction_angle = 90 deg .* below 90"),
    "friction of CCM": (
        lambda: CohesiveCrack(**STRONG | {"friction_angle": 95}, mode_i_energy=1, mode_ii_energy=1),
        "CohesiveCrack: friction_angle = 95 deg is not allowed, .* at least 0 and below 90",
    ),
    "poisson": (lambda: attrs.evolve(ROCK, poissons_ratio=0.5), "poissons_ratio = 0.5 is not allowed, .* below 0.5"),
    "many grains": (lambda: Voronoi(grains=10**10).tessellate(SQUARE), "grains = 10000000000 .* memory"),
    "small grains": (lambda: Hexagonal(grain_size=1e-7).tessellate(SQUARE), "grain_size = 1e-07 m.*memory"),
    "no grains": (lambda: Voronoi(grains=0), "Voronoi: grains = 0 is not allowed, it must be a whole number"),
    "large grains": (
        lambda: Voronoi(grain_size=3).tessellate(SQUARE),
        "grain_size = 3 m .* at most 1 m, .* the region",
    ),
    "region": (lambda: rectangle(1, math.inf), "rectangle: height = inf m is not allowed"),
    "material": (
        lambda: gl.Specimen(small_sample(5).grains, None),
        "material = None is not allowed, it must be a Material or a Rigid or a mapping",
    ),
    "refinement": (lambda: small_sample(5, refinement=9), "refinement = 9 .* whole number from 0 to 6"),
    "law": (lambda: run(None), "law = None is not allowed, it must be a ContactLaw or a mapping"),
    "law's class": (lambda: run(Linear), "law = <class.*Linear'> is not allowed, it must be a ContactLaw"),
    "pairs": (
        lambda: run({0: LINEAR}),
        "the key 0 is not allowed, it must be a pair of phases by name or number",
    ),
    "missing pair": (lambda: run({"inside": LINEAR}), "no law is given for contacts between the phases 0 and 0"),
    "specimen": (lambda: gl.simulate(None, LINEAR, PRESS), "specimen = None is not allowed, it must be a Specimen"),
    "protocol": (lambda: run(protocol=None), "protocol = None is not allowed, it must be a LoadingProtocol"),
    "threads": (lambda: run(threads=0), "threads = 0 is not allowed, it must be a whole number from 1"),
    "step factor": (lambda: run(time_step_factor=math.nan), "time_step_factor = nan .* from 1e-06 to 1"),
    "mass scaling": (lambda: run(mass_scaling=0.5), "mass_scaling = 0.5 is not allowed, it must be from 1"),
    "frames": (lambda: run(frames=0), "simulate: frames = 0 is not allowed, it must be a whole number, at least 1"),
    "no laws": (lambda: gl.compare(small_sample(5), {}, PRESS), "compare: laws is empty"),
    "list of laws": (
        lambda: gl.compare(small_sample(5), [LINEAR], PRESS),
        r"laws = \[Linear.* from texts to ContactLaws",
    ),
    "compare threads": (lambda: gl.compare(small_sample(5), {"a": LINEAR}, PRESS, threads=-1), "threads = -1 is not"),
    "speed": (lambda: UniaxialCompression(loading=gl.Constant(speed=0)), "Constant: speed = 0 m/s is not allowed"),
    "samples": (lambda: UniaxialCompression(samples=2), "samples = 2 is not allowed, .* whole number, at least 10"),
    "integrator": (lambda: UniaxialCompression(integrator="fast"), "integrator = 'fast' .* Integrator such as"),
    "damping": (
        lambda: gl.integration.LocalDamping(fraction=1),
        "LocalDamping: fraction = 1 is not allowed, .* below 1",
    ),
    "burst": (
        lambda: gl.integration.DynamicRelaxation(burst=0),
        "DynamicRelaxation: burst = 0 .* whole number, at least 1",
    ),
    "axis": (
        lambda: gl.loads.Drive(boundary="top", axis=3, speed=1),
        r"Drive: axis = 3 .* 0 \(along x\) or 1 \(along y\)",
    ),
    "drive": (lambda: gl.loads.Drive(boundary="top", axis=1, speed=math.nan), "Drive: speed = nan is not allowed"),
    "stage": (
        lambda: gl.Stage(name="x", until=[], interval=1e-5),
        r"Stage 'x': until = \[\] .* at least one Condition",
    ),
}


@pytest.mark.parametrize(("attempt", "words"), REFUSED.values(), ids=REFUSED)
def test_refusals_name_parameter_value_and_what_is_allowed(attempt, words):
    with pytest.raises(gl.ParameterError, match=words) as caught:
        attempt()
    assert len(str(caught.value)) < 300
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("write", [lambda r, f: r.write_vtk(f), lambda r, f: gl.Comparison({"a": r}).write(f)])
def test_a_folder_that_cannot_be_written_is_named(write, tmp_path):
    (tmp_path / "taken").write_text("a file")
    result = run(protocol=attrs.evolve(PRESS, maximum_strain=1e-5, samples=10))
    for folder in ("taken", "taken/inside"):
        with pytest.raises(OSError, match=r"cannot write to the folder '.*taken"):
            write(result, tmp_path / folder)
    assert [file.name for file in tmp_path.iterdir()] == ["taken"]


# --- runs that go wrong ----------------------------------------------------------------------------------------------


SOFT_FOR = 50  #: calls, more than a law is asked before a run


@attrs.frozen(kw_only=True)
class Breaks(gl.ContactLaw):
    """Not a number from some closure on, once it has been asked for a while."""

    stiffness = (1e14, 1e14)

    def traction(self, opening, slip, asked):
        sound = opening > -2e-7 or asked < SOFT_FOR
        return 1e14 * (opening if sound else math.nan), 1e14 * slip, asked + 1


@attrs.frozen(kw_only=True)
class Stiffer(gl.ContactLaw):
    """Thirty times as stiff as it says, once it has been asked for a while."""

    stiffness = (1e14, 1e14)

    def traction(self, opening, slip, asked):
        return (1e14 if asked < SOFT_FOR else 3e15) * opening, 1e14 * slip, asked + 1


@attrs.frozen(kw_only=True)
class Hasty(gl.integration.Integrator):
    """Three times the stable step."""

    def step(self, force, change, velocity, mass, time_step):
        return velocity + force / mass * time_step, 0.0

    def stable_step(self, highest_frequency):
        return 3 * 2 / highest_frequency


PLACE = r"unstable at step \d+ \(t = [\d.e-]+ s, stage 'compression'\): .*contact point \d+ between grains \d+ and \d+"


@pytest.mark.parametrize("material", [ROCK, RIGID], ids=["elastic", "rigid"])
def test_a_law_that_returns_nan_is_named_with_its_place(material):
    words = PLACE + r" \(opening -2[.\d]+e-07 m, slip .* m\); look at this law with gl.trace"
    with pytest.raises(gl.InstabilityError, match=words) as caught:
        run(Breaks(), specimen=small_sample(20, material=material))
    assert "the law returned nan and" in str(caught.value)
    assert_good(caught.value.result)


HASTY = attrs.evolve(PRESS, integrator=Hasty())
RISING = attrs.evolve(HASTY, loading=gl.Constant(speed=0.2, ramp=1e-4))
EXPLOSIONS = {
    "linear": (LINEAR, HASTY, ROCK), "brittle": (MohrCoulomb(**STRONG), HASTY, ROCK), "rigid": (LINEAR, HASTY, RIGID),
    "long chunks": (LINEAR, attrs.evolve(HASTY, samples=10), ROCK),
    "ramp": (LINEAR, RISING, ROCK), "stiffness": (Stiffer(), PRESS, ROCK),
}  # fmt: skip


@pytest.mark.parametrize(("law", "protocol", "material"), EXPLOSIONS.values(), ids=EXPLOSIONS)
def test_a_step_that_is_too_long_is_named_with_its_place(law, protocol, material):
    with pytest.raises(gl.InstabilityError, match=PLACE) as caught:
        run(law, protocol, small_sample(20, material=material))
    assert "grain" in str(caught.value)
    assert_good(caught.value.result)


def assert_good(result):
    """Only what was before."""
    for name, column in result.curves.items():
        assert np.isfinite(column).all(), name
    assert np.abs(result.curves.get("stress", 0.0)).max() < 100e6
    assert np.isfinite(result.frames[-1].displacement).all()
    assert np.abs(result.frames[-1].displacement).max() < 1e-4
    assert len(result.curves.get("time", ())) == 0 or result.frames[-1].time == result.curves["time"][-1]


@pytest.mark.thorough
@pytest.mark.parametrize("ramp", [1e-4, 1e-5])
@pytest.mark.parametrize(
    "integrator",
    [gl.integration.CentralDifference(damping=gl.integration.Undamped()), gl.integration.DynamicRelaxation()],
    ids=lambda i: type(i).__name__,
)
def test_a_slow_start_sampled_at_every_step_is_no_instability(integrator, ramp):
    test = attrs.evolve(
        PRESS, loading=gl.Constant(speed=0.2, ramp=ramp), samples=1000, maximum_strain=5e-5, integrator=integrator
    )
    assert len(run(protocol=test).curves["time"]) > 30


@pytest.mark.thorough
def test_what_was_written_before_an_instability_stays_readable(tmp_path):
    with pytest.raises(gl.InstabilityError) as caught:
        run(Breaks(), specimen=small_sample(20), observers=[VtkWriter(tmp_path)])
    files = sorted(tmp_path.glob("grains_*.vtu"))
    assert len(files) > 3
    for file in files:
        mesh = pyvista.read(file)
        assert np.isfinite(mesh.cell_data["stress"]).all()
    caught.value.result.write_vtk(tmp_path / "again")
    assert (tmp_path / "again" / "grains.pvd").exists()


@attrs.frozen(kw_only=True)
class Wait(gl.LoadingProtocol):
    """For what never comes."""

    def stages(self, specimen):
        return [gl.Stage(name="wait", until=[gl.conditions.Reaches("kinetic", 1.0)], interval=1e-6, sample_limit=7)]

    def measure(self, state):
        return {"kinetic": energies(state)["kinetic"]}

    def summary(self, curves, specimen):
        return {"samples": len(curves["time"])}


def test_a_stage_that_does_not_end_is_stopped():
    with pytest.raises(gl.StageError, match=r"stage 'wait' did not end within 7 samples; .*Reaches.*kinetic") as caught:
        run(protocol=Wait())
    assert caught.value.result.summary["samples"] == 7
