"""Numbers that are far from what is usual are told; a certificate that cannot be computed has failed."""

import importlib
import re
import subprocess
import sys
import warnings

import attrs
import pytest
from command_line import SMALL, invoke
from support import BRITTLE, ROCK, STRONG, small_sample

import grainlaw as gl
from grainlaw.geometry import Voronoi, block, rectangle, together
from grainlaw.laws import MohrCoulomb
from grainlaw.materials import Thermal
from grainlaw.protocols import BiaxialCompression, HydraulicFracturing, Saturated, SplitHopkinson, UniaxialCompression
from grainlaw.results.certificate import warnings_of
from grainlaw.runs import progress
from grainlaw.units import MPa
from grainlaw.workbench import driver

PRESS = UniaxialCompression(loading=gl.Constant(speed=0.2), maximum_strain=2e-5, samples=10)


def told(call, category=gl.UnitWarning):
    """What is warned of."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        call()
    return [str(each.message) for each in caught if issubclass(each.category, category)]


def run(law=BRITTLE, test=PRESS):
    return gl.simulate(small_sample(12), law, test)


def test_numbers_in_other_units_are_told_with_the_usual_range():
    young, density = told(lambda: gl.Elastic(youngs_modulus=60, poissons_ratio=0.2, density=2.7))
    assert young == "Elastic: youngs_modulus = 60 Pa is unusual, usual are 1e+08 to 1e+12 Pa: is the unit right?"
    assert "density = 2.7 kg/m3 is unusual, usual are 500 to 20000 kg/m3" in density
    assert told(lambda: attrs.evolve(ROCK, density=2700)) == []


@pytest.mark.parametrize(
    "make",
    [
        lambda: gl.Elastic(youngs_modulus=60, poissons_ratio=0.2, density=2700),
        lambda: HydraulicFracturing(xx=20e6),
        lambda: attrs.evolve(HydraulicFracturing(), xx=20e6),
    ],
)
def test_a_warning_names_the_line_of_the_user(make):
    with pytest.warns(gl.UnitWarning) as caught:
        make()
    assert (caught[0].filename, caught[0].lineno) == (__file__, make.__code__.co_firstlineno)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: HydraulicFracturing(bulk_modulus=2.2), "HydraulicFracturing: bulk_modulus = 2.2 Pa is unusual"),
        (
            lambda: HydraulicFracturing(viscosity=1e-3, residual_aperture=2),
            "HydraulicFracturing: residual_aperture = 2 m is unusual",
        ),
        (lambda: SplitHopkinson(density=7.85), "SplitHopkinson: density = 7.85 kg/m3 is unusual"),
        (lambda: SplitHopkinson(youngs_modulus=200), "SplitHopkinson: youngs_modulus = 200 Pa is unusual"),
        (
            lambda: Thermal(material=ROCK, expansion=1e-5, conductivity=3, heat_capacity=0.8),
            "Thermal: heat_capacity = 0.8 J/kg/K is unusual",
        ),
        (lambda: SplitHopkinson(width=20).stages(small_sample(12)), "SplitHopkinson: width = 20 m is unusual"),
    ],
)  # fmt: skip
def test_numbers_of_fluids_bars_and_heat_are_told_too(make, words):
    assert told(make)[0].startswith(words)


def staged(*loads):
    """Stages under these loads, one after the other."""

    class Test(gl.LoadingProtocol):
        def stages(self, specimen):
            ends = {"until": [gl.conditions.Lasts(2e-7)], "interval": 1e-7}
            return [gl.Stage(name="abc"[k], loads=each, **ends) for k, each in enumerate(loads)]

        def measure(self, state):
            return {}

        def summary(self, curves, specimen):
            return {}

    return Test()


def pressed(value, **more):
    return [gl.loads.Pressure(boundary=side, pressure=value * MPa, **more) for side in ("left", "right")]


HELD = [gl.loads.Drive(boundary="left", axis=0, speed=0.0), gl.loads.Drive(boundary="right", axis=0, speed=0.0)]


@pytest.mark.parametrize(
    ("first", "second", "words"),
    [
        (pressed(2, ramp=1e-7), pressed(2, ramp=1e-7), "stage 'b': Pressure on the boundary left begins with 0, where"),
        (
            pressed(2, ramp=1e-7), [],
            "stage 'b': Pressure on the boundary left begins with 0, where stage 'a' ends with 2e+06",
        ),
        (pressed(2, ramp=1e-7), pressed(2), ""),
        (pressed(2, ramp=1e-7), pressed(3, start=2 * MPa, ramp=1e-7), ""),
        (pressed(2, ramp=1e-7), HELD, ""),  # the sides stay where they are
        (pressed(-2), pressed(-2), "stage 'a': a pressure of -2e+06 Pa on the boundary left pulls: is the sign right?"),
        (
            [gl.loads.Drive(boundary="top", axis=1, speed=-50.0)], HELD,
            "the boundary top moves at 50 m/s, which is unusual: at most",
        ),
    ],
)  # fmt: skip
def test_loads_of_stages_of_ones_own_are_told(first, second, words):
    found = [each for each in told(lambda: run(test=staged(first, second)), UserWarning) if "holds" not in each]
    assert bool(found) == bool(words)
    assert not words or found[0].startswith(words)


def test_a_wave_in_megapascals_is_told():
    struck = SplitHopkinson(wave=gl.pulse(-300, rise=5e-6), duration=1e-6, samples=10)
    assert any(
        "300 Pa on the boundary top is unusual in this specimen" in words for words in told(lambda: run(test=struck))
    )


def test_contacts_too_soft_for_their_grains_are_told():
    soft, *_ = told(lambda: run(MohrCoulomb(**STRONG | {"kn": 105, "ks": 95})))
    assert "MohrCoulomb: a normal stiffness of 105 Pa/m is unusual between grains of" in soft
    assert "usual are 9e+10 to 9e+15 Pa/m" in soft  # 1e-2 and 1e3 times 72 GPa (uniaxial strain) over 8.2 mm
    rigid = small_sample(12, material=gl.Rigid(density=3000))
    wide, *_ = told(lambda: gl.simulate(rigid, MohrCoulomb(**STRONG | {"kn": 1e9, "ks": 1e9}), PRESS))
    assert "open by 0.013 m before they break are unusual" in wide  # 13 MPa over 1 GPa/m
    assert told(run) == []
    large = Voronoi(grains=12, seed=1).tessellate(rectangle(20, 40))  # mm for m
    stiff, *_ = told(lambda: gl.simulate(gl.Specimen(large, ROCK), MohrCoulomb(**STRONG), PRESS))
    assert "Pa/m is unusual between grains of 8.2 m" in stiff


def test_an_angle_of_friction_in_radians_is_told():
    (words,) = told(lambda: MohrCoulomb(**STRONG | {"friction_angle": 0.7, "residual_friction_angle": 0}))
    assert words.startswith("MohrCoulomb: friction_angle = 0.7 deg is unusual, usual are 2 to 90 deg")
    assert told(lambda: MohrCoulomb(**STRONG | {"residual_friction_angle": 0})) == []


@pytest.mark.parametrize("test", [BiaxialCompression(confinement=1e-3), Saturated(pressure=1e-3)])
def test_a_pressure_that_rounding_swallows_is_refused(test):
    with pytest.raises(
        gl.ParameterError, match=r"0\.001 Pa on the boundary \w+ is not allowed, .* 0 or at least 0\.01 Pa"
    ):
        run(test=test)


def test_a_speed_near_that_of_waves_is_told_and_the_certificate_has_failed():
    fast = attrs.evolve(PRESS, loading=gl.Constant(speed=1e9))
    results = []
    (speed,) = told(lambda: results.append(run(test=fast)))
    assert "moves at 1e+09 m/s, which is unusual: at most" in speed
    lines = list(warnings_of({"law": results[0]}))
    assert sum("cannot be computed, so the test has failed its certificate" in line for line in lines) == 3


@pytest.mark.thorough
def test_the_report_shows_a_certificate_that_cannot_be_computed_as_failed(tmp_path):
    run(test=attrs.evolve(PRESS, loading=gl.Constant(speed=1e9))).write_report(tmp_path / "report.html")
    assert (tmp_path / "report.html").read_text("utf-8").count("cannot be computed FAIL") == 3


def test_one_filter_silences_all():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        warnings.simplefilter("ignore", gl.UnitWarning)
        gl.Elastic(youngs_modulus=60, poissons_ratio=0.2, density=2.7)
        run(MohrCoulomb(**STRONG | {"kn": 105, "ks": 95}))


@pytest.mark.thorough
def test_the_command_line_tells_it_in_one_line(tmp_path):
    done = invoke("test", "uniaxial-compression", *SMALL, "--set", "rock.density=2.7", "--out", tmp_path)
    assert done.exit_code == 0
    lines = [line for line in done.stderr.splitlines() if line.startswith("Warning: ")]
    assert "Warning: Elastic: density = 2.7 kg/m3 is unusual, usual are 500 to 20000 kg/m3: is the unit right?" in lines
    assert ".py" not in "".join(lines)


def test_a_wrong_number_of_threads_leaves_nothing_behind(tmp_path):
    for command in (["test", "uniaxial-compression"], ["compare"], ["envelope"]):
        done = invoke(*command, "--quick", "--threads", 129, "--out", tmp_path / "out")
        assert done.exit_code == 2
        assert "threads = 129 is not allowed" in done.output
    assert not list(tmp_path.iterdir())


LAWS = """
import sys, random, attrs
import grainlaw as gl
from grainlaw.runs import progress
@attrs.frozen(kw_only=True)
class Chance(gl.ContactLaw):
    stiffness = (1e14, 1e14)
    def traction(self, opening, slip):
        return 1e14 * opening * random.random(), 1e14 * slip
@attrs.frozen(kw_only=True)
class NoStiffness(gl.ContactLaw):
    @property
    def stiffness(self):
        raise RuntimeError("no idea")
    def traction(self, opening, slip):
        return 1e14 * opening, 1e14 * slip
"""


def test_law_files_that_end_python_or_play_dice_are_refused(tmp_path):
    (tmp_path / "quits.py").write_text("import sys\nsys.exit('bye')\n")
    (tmp_path / "laws.py").write_text(LAWS)
    for law, words in (
        ("quits.py:law", "quits.py:2 does not run: it ends Python"),
        ("laws.py:Chance", "without chance or the clock"),
        ("laws.py:NoStiffness", "NoStiffness.stiffness cannot be found: RuntimeError: no idea"),
    ):
        done = invoke("test", "uniaxial-compression", "--law", tmp_path / law, "--out", tmp_path / "out")
        assert done.exit_code == 2, done.output
        assert words in done.output
        assert invoke("check", tmp_path / law).exit_code == (1 if "Chance" in law else 2)  # it is asked and fails
    assert not (tmp_path / "out").exists()


@pytest.mark.thorough
def test_a_backend_that_does_not_exist_is_no_matter(tmp_path, monkeypatch):
    monkeypatch.setenv("MPLBACKEND", "bogus")
    command = [sys.executable, "-m", "grainlaw", "law", "linear", "--out", str(tmp_path)]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


def test_what_nobody_has_thought_of_is_one_line(monkeypatch):
    monkeypatch.setattr(importlib.import_module("grainlaw.cli.law"), "characteristics", lambda law: 1 // 0)
    done = invoke("law", "linear")
    assert done.exit_code == 1
    assert "a fault of grainlaw (ZeroDivisionError at test_plausibility.py:" in done.output
    assert "Traceback" not in done.output


@attrs.frozen(kw_only=True)
class Endless(gl.ContactLaw):
    """Counts down, which takes long: 1e10 steps for a slip of 0.1 m."""

    stiffness = (1e14, 1e14)

    def traction(self, opening, slip):
        rest = abs(slip) * 1e11
        while rest > 1:
            rest = rest - 1.0 - 1e-300 * opening
        return 1e14 * opening + 0 * rest, 1e14 * slip


@attrs.frozen(kw_only=True)
class Loops(gl.ContactLaw):
    stiffness = (1e14, 1e14)

    def traction(self, opening, slip):
        total = 0.0
        for _ in range(3):
            total = total + 1e14 * opening / 3
        return total, 1e14 * slip


def test_a_loop_that_does_not_end_is_refused_with_its_place(monkeypatch):
    monkeypatch.setattr(driver, "SECONDS", 0.3)
    for ask in (gl.check_law, gl.characteristics, lambda law: gl.simulate(small_sample(4), law, PRESS)):
        with pytest.raises(
            gl.ParameterError, match=r"Endless: at opening 0 m, slip .* did not return within 0.3 s: a loop"
        ):
            ask(Endless())


def test_a_compiled_trace_asks_for_endless_loops_too(monkeypatch):
    """An interpreted one can be interrupted."""
    asked, law = [], gl.laws.Linear(kn=1e14, ks=1e14)
    monkeypatch.setattr(driver, "refuse_endless", asked.append)
    for compiled in (False, True):
        gl.trace(law, 1e-9, 0.0, compiled=compiled)
    assert asked == [law]


@pytest.mark.thorough
def test_a_loop_that_ends_runs_in_a_thread_of_its_own_with_the_same_numbers():
    from grainlaw.compiler.batch import compile_law

    straight = gl.laws.Linear(kn=1e14, ks=1e14)
    assert compile_law(Loops()).loops
    assert not compile_law(straight).loops
    one, other = (gl.simulate(small_sample(6), law, PRESS).curves["stress"] for law in (Loops(), straight))
    assert one == pytest.approx(other, rel=1e-9, abs=1e-3)


def test_boundaries_of_one_name_do_not_move_each_other():
    square = [(0, 0), (1, 0), (1, 1), (0, 1)]
    sides = ["bottom", "right", "top", "left"]
    grains = together(
        block(square, sides),
        block([(x + 2, y) for x, y in square], sides),
        block([(x, y + 2) for x, y in square], "left_2"),
    )
    assert grains.boundary_names == (*sides, *(f"{side}_2" for side in sides), "left_2_2")


@pytest.mark.thorough
def test_the_terminal_says_what_of_the_certificate_fails(tmp_path):
    result = invoke(
        "test", "uniaxial-compression", *SMALL, "--set", "test.loading={type='constant', speed=1e9}", "--out", tmp_path
    )
    assert result.exit_code == 0, result.output
    words = " ".join(result.output.split())
    assert "Warning: the boundary top moves at 1e+09 m/s, which is unusual" in words
    assert "the kinetic ratio cannot be computed, so the test has failed its certificate" in words


@pytest.mark.thorough
def test_without_a_terminal_a_line_of_progress_is_written_now_and_then(tmp_path, monkeypatch):
    monkeypatch.setattr(progress, "SILENCE", 0.0)
    result = invoke("test", "uniaxial-compression", *SMALL, "--out", tmp_path)
    assert re.search(r"^uniaxial-compression: \d+%, compression, [\d.]+ %, [\d.]+ MPa", result.output, re.M)
