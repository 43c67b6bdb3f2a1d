"""The kit tells right from wrong: one small law for each fault, and sound ones."""

import re

import attrs
import pytest
from click.testing import CliRunner
from support import STIFF

import grainlaw as gl
from grainlaw.cli import main
from grainlaw.laws import Linear
from grainlaw.properties import PROPERTIES


@attrs.frozen(kw_only=True)
class Hillerborg(gl.ContactLaw):
    """Linear tension softening over the fracture energy; elastic in shear. The faulty ones change one thing."""

    kn: float = gl.parameter("Pa/m", default=1e14)
    ks: float = gl.parameter("Pa/m", default=5e13)
    strength: float = gl.parameter("Pa", default=13e6)
    energy: float = gl.parameter("J/m2", default=50.0)
    stiffness = property(lambda self: (self.kn, self.ks))
    fracture_energies = property(lambda self: {"mode_i": self.energy - self.strength**2 / (2 * self.kn)})

    def traction(self, opening, slip, damage, widest):
        return self.softened(opening, slip, damage, max(widest, opening), self.energy)

    def softened(self, opening, slip, damage, widest, energy):
        peak, last = self.strength / self.kn, 2 * energy / self.strength
        damage = min(max(widest - peak, 0.0) / (last - peak), 1.0)
        secant = self.strength * (1 - damage) / max(widest, peak)
        return (secant if opening > 0 else self.kn) * opening, self.ks * slip, damage, widest


class Heals(Hillerborg):
    """Damage follows the opening back."""

    def traction(self, opening, slip, damage, widest):
        return self.softened(opening, slip, damage, opening, self.energy)


class Overshoots(Hillerborg):
    """Damage passes 1."""

    def traction(self, opening, slip, damage, widest):
        normal, shear, damage, widest = self.softened(opening, slip, damage, max(widest, opening), self.energy)
        return normal, shear, 1.001 * damage, widest


class TooTough(Hillerborg):
    """The softening area is 5 % too large."""

    def traction(self, opening, slip, damage, widest):
        return self.softened(opening, slip, damage, max(widest, opening), 1.05 * self.energy)


class Jumps(Hillerborg):
    """The softening branch starts 5 % below the peak."""

    def traction(self, opening, slip, damage, widest):
        normal, shear, damage, widest = self.softened(opening, slip, damage, max(widest, opening), self.energy)
        return normal * (0.95 if damage > 0 and opening > 0 else 1.0), shear, damage, widest


class JumpsFar(Hillerborg):
    """A tenth of the shear strength is lost where a damaged contact closes."""

    def traction(self, opening, slip, damage, widest):
        normal, shear, damage, widest = self.softened(opening, slip, damage, max(widest, opening), self.energy)
        return normal, shear * (0.9 if damage > 0 and opening < 0 else 1.0), damage, widest


class Declared(Jumps):
    """The same, which says so."""

    @property
    def exceptions(self):
        return {"continuity": "falls by a twentieth", "stiffness": "no excuse is taken for this"}


class Loose(Hillerborg):
    """A first response that is 2 % below its stiffness."""

    def traction(self, opening, slip, damage, widest):
        normal, shear, damage, widest = self.softened(opening, slip, damage, max(widest, opening), self.energy)
        return normal, 0.98 * shear, damage, widest


class Undefined(Hillerborg):
    """The fresh closed contact that has once been torn open is 0/0."""

    def traction(self, opening, slip, damage, widest):
        normal, shear, damage, widest = self.softened(opening, slip, damage, max(widest, opening), self.energy)
        return normal if damage < 1 or opening > 0 else float("nan"), shear, damage, widest


class Divides(Hillerborg):
    """Stops at no opening."""

    def traction(self, opening, slip, damage, widest):
        normal, shear, damage, widest = self.softened(opening, slip, damage, max(widest, opening), self.energy)
        return normal / opening * opening, shear, damage, widest


class Lopsided(Hillerborg):
    """Softer in slip to one side."""

    def traction(self, opening, slip, damage, widest):
        normal, shear, damage, widest = self.softened(opening, slip, damage, max(widest, opening), self.energy)
        return normal, shear if slip < 1e-7 else shear - 0.01 * self.ks * (slip - 1e-7), damage, widest


class Gives(Hillerborg):
    """Pressure stiffens the shear spring at rest: slip, press, slip back, release gives energy."""

    def traction(self, opening, slip, damage, widest):
        normal, shear, damage, widest = self.softened(opening, slip, damage, max(widest, opening), self.energy)
        return normal, shear * (1 + min(max(-opening, 0.0) * 1e7, 1.0)), damage, widest


SEEN = []


class Remembers(Hillerborg):
    """Counts in a global how often it was called."""

    def traction(self, opening, slip, damage, widest):
        SEEN.append(opening)
        normal, shear, damage, widest = self.softened(opening, slip, damage, max(widest, opening), self.energy)
        return normal, shear * (1 + 1e-9 * len(SEEN)), damage, widest


@attrs.define(kw_only=True)
class Keeps(gl.ContactLaw):
    """Keeps the widest opening in an attribute of its own, for all contacts."""

    kn: float = gl.parameter("Pa/m", default=1e14)
    widest: float = gl.parameter("m", default=0.0, at_least=0)
    stiffness = property(lambda self: (self.kn, self.kn))

    def traction(self, opening, slip, damage):
        self.widest = max(self.widest, opening)
        damage = min(self.widest / 1e-6, 1.0)
        return self.kn * opening * (1 - damage if opening > 0 else 1.0), self.kn * slip, damage


@attrs.frozen(kw_only=True)
class Joint(gl.ContactLaw):
    """A cohesive joint with Coulomb friction; no tension beyond 1 um."""

    kn: float = gl.parameter("Pa/m", default=1e14)
    ks: float = gl.parameter("Pa/m", default=5e13)
    friction: float = gl.parameter("1", default=0.6)
    stiffness = property(lambda self: (self.kn, self.ks))
    exceptions = property(lambda self: {"continuity": "no tension beyond 1 um"})

    def traction(self, opening, slip, plastic):
        return self.slid(opening, slip, plastic, 5e6 + self.friction * self.kn * max(-opening, 0.0))

    def slid(self, opening, slip, plastic, strength, sign=1.0):
        trial = self.ks * (slip - plastic)
        plastic = plastic + sign * (trial - min(max(trial, -strength), strength)) / self.ks
        return self.kn * opening if opening < 1e-6 else 0.0, self.ks * (slip - plastic), plastic


class Backwards(Joint):
    """Plastic slip of the wrong sign."""

    def traction(self, opening, slip, plastic):
        return self.slid(opening, slip, plastic, 5e6 + self.friction * self.kn * max(-opening, 0.0), -1.0)


class Weakens(Joint):
    """Friction that falls with pressure."""

    def traction(self, opening, slip, plastic):
        return self.slid(opening, slip, plastic, max(50e6 - 0.1 * self.kn * max(-opening, 0.0), 1e6))


@attrs.frozen(kw_only=True)
class WeakensBroken(Hillerborg):
    """Broken, its friction falls with pressure; sound, it does not slip."""

    def traction(self, opening, slip, damage, widest):
        normal, shear, damage, widest = self.softened(opening, slip, damage, max(widest, opening), self.energy)
        limit = max(40e6 + 0.5 * normal, 0.0) if opening < 0 else 0.0
        free = min(max(shear, -limit), limit)
        return normal, damage * free + (1 - damage) * shear, damage, widest


@attrs.frozen(kw_only=True)
class Unitless(Hillerborg):
    """A number that is not declared."""

    factor: float = 1.0


@attrs.frozen(kw_only=True)
class Stops(Hillerborg):
    """Does not compile."""

    def traction(self, opening, slip, damage, widest):
        if opening > 1:
            raise ValueError("too far")
        return self.softened(opening, slip, damage, max(widest, opening), self.energy)


@attrs.frozen(kw_only=True)
class Overflows(Hillerborg):
    """A whole number beyond 64 bits, which only the interpreter has."""

    def traction(self, opening, slip, damage, widest):
        normal, shear, damage, widest = self.softened(opening, slip, damage, max(widest, opening), self.energy)
        return normal, shear * (1 + 0.01 * (int(abs(slip) * 1e32) % 3)), damage, widest


FAULTS = {
    Heals: "damage",
    Overshoots: "damage",
    TooTough: "fracture energies",
    Jumps: "continuity",
    JumpsFar: "continuity",
    Loose: "stiffness",
    Undefined: "finite",
    Divides: "finite",
    Lopsided: "odd in slip",
    Gives: "energy",
    Remembers: "no hidden state",
    Keeps: "no hidden state",
    Backwards: "friction",
    Weakens: "friction",
    WeakensBroken: "friction",
    Unitless: "units",
    Stops: "compiled",
    Overflows: "compiled",
}
SOUND = [Hillerborg(), Hillerborg(energy=3.0, strength=1e6), Joint(), Linear(**STIFF)]


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


def test_the_path_is_told_in_numbers():
    report = gl.check_law(TooTough(), compiled=False)
    assert report["fracture energies"].size == pytest.approx(0.05 * 50 / 49.155, rel=0.02)
    assert "mode_i: 51.6" in str(report)
    assert "(+5.0" in str(report)
    assert gl.check_law(Loose(), compiled=False)["stiffness"].size == pytest.approx(0.02)
    assert "TooTough fails 1 of 10 properties" in str(report)


@pytest.mark.parametrize(
    ("wrong", "error", "said"),
    [
        (Hillerborg, TypeError, "takes an instance of an attrs class that is a gl.ContactLaw"),
        (None, TypeError, "not None"),
        (Hillerborg(strength=[1e6, 2e6]), ValueError, "give single numbers instead of arrays"),
    ],
)
def test_what_cannot_be_checked_is_refused(wrong, error, said):
    with pytest.raises(error, match=said):
        gl.check_law(wrong)


def test_a_wrong_number_of_results_is_told():
    @attrs.frozen
    class Short(gl.ContactLaw):
        stiffness = (1.0, 1.0)

        def traction(self, opening, slip, damage):
            return opening, slip

    with pytest.raises(TypeError, match=r"Short.traction must return 3 numbers, .* traction and damage, not \("):
        gl.check_law(Short())


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
        ("mylaw.py:Spring", "Spring needs k: put an instance in the file, law = Spring(k=...), and check *:law"),
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
