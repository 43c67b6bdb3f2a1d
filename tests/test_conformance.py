"""The kit tells right from wrong: one small law for each fault, and sound ones."""

import re
from types import SimpleNamespace

import attrs
import pytest
from click.testing import CliRunner
from faulty_laws import FAULTS, Declared, Hillerborg, Joint, Jumps, Loose, TooTough
from support import STIFF

import grainlaw as gl
from grainlaw.cli.commands import main
from grainlaw.laws import Linear
from grainlaw.workbench import conformance
from grainlaw.workbench.properties import PROPERTIES

SOUND = [Hillerborg(), Hillerborg(energy=3.0, strength=1e6), Joint(), Linear(**STIFF)]


@pytest.mark.thorough
@pytest.mark.parametrize(("kind", "name"), FAULTS.items(), ids=lambda value: getattr(value, "__name__", value))
def test_a_seeded_fault_is_caught(kind, name):
    report = gl.check_law(kind(), compiled=name == "compiled")
    assert not report.passed
    assert not report[name].passed
    assert f"{name:<18} FAILS" in str(report)


def test_each_property_is_seen_to_fail():
    assert set(FAULTS.values()) == set(PROPERTIES)


@pytest.mark.parametrize("law", SOUND, ids=lambda law: type(law).__name__)
def test_a_sound_law_passes(law):
    report = gl.check_law(law)
    assert report.passed, str(report)
    assert [entry.name for entry in report] == list(PROPERTIES)
    assert str(report).splitlines()[0] == f"{type(law).__name__} conforms"


@pytest.mark.parametrize("law", [Hillerborg(kn=1e15, energy=200.0, strength=1e6)], ids=["breaks far beyond its peak"])
def test_a_sound_law_passes_whose_break_is_far_beyond_its_peak(law):
    """A rise that is a millionth of a leg is no jump."""
    report = gl.check_law(law, compiled=False)
    assert report.passed, str(report)


@pytest.mark.thorough
def test_every_scale_passes():
    """Paths follow the law: a clay and a diamond are tried like a rock."""
    for stiff, strong in ((1e-6, 1e-6), (1e3, 1e2), (1, 1e-4)):
        sizes = dict(kn=1e14 * stiff, ks=5e13 * stiff, strength=13e6 * strong, energy=50 * strong**2 / stiff)
        report = gl.check_law(Hillerborg(**sizes), compiled=False)
        assert report.passed, str(report)
        assert not gl.check_law(Jumps(**sizes), compiled=False)["continuity"].passed


def test_an_exception_is_shown_with_what_was_found():
    entry = gl.check_law(Declared(), compiled=False)["continuity"]
    assert entry.passed
    assert entry.size == pytest.approx(0.05 * 13e6, rel=0.05)
    assert "exception  declared: falls by a twentieth; pull, release, pull on: normal traction jumps by" in str(entry)


@pytest.mark.thorough
def test_the_path_is_told_in_numbers():
    report = gl.check_law(TooTough(), compiled=False)
    assert report["fracture energies"].size == pytest.approx(0.05 * 50 / 49.155, rel=0.02)
    assert "mode_i: 51.6" in str(report)
    assert "(+5.0" in str(report)
    assert gl.check_law(Loose(), compiled=False)["stiffness"].size == pytest.approx(0.02)
    assert "TooTough fails 1 of 11 properties" in str(report)


@pytest.mark.parametrize(
    ("wrong", "error", "said"),
    [
        (Hillerborg, gl.ParameterError, "law = <class .*Hillerborg.*> is not allowed, it must be a ContactLaw"),
        (None, gl.ParameterError, "law = None is not allowed"),
        (Hillerborg(strength=[1e6, 2e6]), ValueError, "give single numbers instead of arrays"),
    ],
)
def test_what_cannot_be_checked_is_refused(wrong, error, said):
    with pytest.raises(error, match=said):
        gl.check_law(wrong)


@attrs.frozen
class Short(gl.ContactLaw):
    stiffness = (1.0, 1.0)

    def traction(self, opening, slip, damage):
        return opening, slip


@pytest.mark.parametrize("answer", [(1.0, 2.0), (1.0, 2.0, 3.0, 4.0), 1.0, None, [1.0, 2.0, 3.0], (1.0, 2.0, None)])
def test_a_wrong_answer_is_told_with_what_is_missing(answer):
    @attrs.frozen
    class Answers(gl.ContactLaw):
        stiffness = (1.0, 1.0)

        def traction(self, opening, slip, damage):
            return answer

    said = "Answers.traction must return 3 numbers, normal and shear traction and damage, not " + re.escape(
        repr(answer)
    )
    for look in (gl.check_law, lambda law: gl.trace(law, 0, 0)):
        with pytest.raises(TypeError, match=said):
            look(Answers())


def test_a_wrong_number_of_results_is_told_by_the_compiler_too():
    with pytest.raises(TypeError, match=r"(?s)Short.traction .* must return 3 numbers on every path"):
        gl.trace(Short(), 0, 0, compiled=True)


def test_unknown_names_are_told():
    class Misnamed(Hillerborg):
        fracture_energies = property(lambda self: {"tension": 1.0})

    report = gl.check_law(Misnamed(), compiled=False)
    assert "fracture_energies has tension, it may have mode_i and mode_ii" in str(report)
    with pytest.raises(KeyError, match="no property 'strength', only units, stiffness"):
        report["strength"]


FILE = """
import attrs
import grainlaw as gl
from helper import HALF

@attrs.frozen(kw_only=True)
class Spring(gl.ContactLaw):
    k: float = gl.parameter("Pa/m")
    stiffness = property(lambda self: (self.k, HALF * self.k))

    def traction(self, opening, slip):
        return self.k * opening, HALF * self.k * slip

@attrs.frozen(kw_only=True)
class Ready(Spring):
    k: float = gl.parameter("Pa/m", default=1e14)

@attrs.frozen(kw_only=True)
class Soft(Ready):
    stiffness = property(lambda self: (self.k, self.k))

@attrs.frozen(kw_only=True)
class Refuses(Ready):
    k: float = gl.parameter("Pa/m", default=1e14)
    def __attrs_post_init__(self):
        raise gl.ParameterError("no")

spring = Spring(k=1e14)
many = Spring(k=[1e14, 2e14])
number = 3
"""


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    folder = tmp_path_factory.mktemp("laws")
    (folder / "helper.py").write_text("HALF = 0.5\n")
    (folder / "mylaw.py").write_text(FILE)
    (folder / "broken.py").write_text("x = 1\ny = z\n")
    (folder / "unfinished.py").write_text("x = (\n")
    return folder / "mylaw.py"


def check(reference):
    return CliRunner().invoke(main, ["check", str(reference)])


@pytest.mark.thorough
@pytest.mark.parametrize("name", ["spring", "Ready"])
def test_command_prints_the_report(file, name):
    result = check(f"{file}:{name}")
    assert result.exit_code == 0, result.output
    assert f"{'Spring' if name == 'spring' else name} conforms\n  units              holds\n" in result.output
    assert "compiled           holds" in result.output
    assert "fracture energies  holds      none declared" in result.output


def test_command_fails_with_the_law(file):
    result = check(f"{file}:Soft")
    assert result.exit_code == 1
    assert "stiffness          FAILS      shear response 5e+13 Pa/m at" in result.output


@pytest.mark.parametrize(
    ("reference", "said"),
    [
        ("mylaw.py:Raedy", "there is no 'Raedy' in * did you mean 'Ready'? (laws in *: Spring, Ready, Soft"),
        ("mylaw.py:number", "'number' in * is no contact law but a value of type int"),
        ("mylaw.py:gl", "'gl' in * is no contact law but a value of type module"),
        ("mylaw.py:Spring", "Spring needs k: put an instance in the file, law = Spring(k=...), and name it, *:law"),
        ("mylaw.py:many", "give single numbers instead of arrays"),
        ("mylaw.py:Refuses", "Refuses() cannot be made: no"),
        ("mylaw.py", "name the law, as in *mylaw.py:Spring"),
        ("mylow.py:Spring", "there is no file *mylow.py"),
        ("broken.py:Law", "broken.py:2 does not run: NameError: name 'z' is not defined"),
        ("unfinished.py:Law", "unfinished.py does not run: SyntaxError"),
    ],
)
def test_command_refuses_a_bad_reference(file, reference, said):
    result = check(file.parent / reference)
    assert result.exit_code == 2
    assert re.search(".*".join(map(re.escape, said.split("*"))), " ".join(result.output.split()))


def test_a_number_that_a_law_does_not_use_is_told():
    @attrs.frozen(kw_only=True)
    class Forgets(Hillerborg):
        cohesion: float = gl.parameter("Pa", default=1e7)

    assert str(gl.check_law(Forgets(), compiled=False)["units"]).endswith("no code of the law reads cohesion")
    assert gl.check_law(Hillerborg(), compiled=False)["units"].found == ""


def test_what_is_said_of_a_property_that_holds(monkeypatch):
    monkeypatch.setattr(conformance, "PROPERTIES", dict.fromkeys(("fracture energies", "energy"), lambda bench: None))

    def said(name, energies, exceptions):
        law = SimpleNamespace(fracture_energies=energies, exceptions=exceptions)
        return conformance._entry(name, SimpleNamespace(law=law)).found

    assert said("fracture energies", (), {}) == "none declared"
    assert said("fracture energies", (1.0, 2.0), {}) == ""
    assert said("energy", (), {}) == ""
    excused = sorted(conformance.EXCUSABLE)[0]
    monkeypatch.setitem(conformance.PROPERTIES, excused, lambda bench: None)
    assert said(excused, (1.0,), {excused: "as it is"}) == "not met on these paths"
