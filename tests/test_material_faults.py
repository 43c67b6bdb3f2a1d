"""One small fault in a sound material for each property that the kit asks for: it must be found there."""

import re
from types import SimpleNamespace

import attrs
import numpy as np
import pytest
from every_material import GRAIN
from toy_materials import CUBIC, YIELDING, Cubic, Yielding

import grainlaw as gl
from grainlaw.workbench import material_properties
from grainlaw.workbench.material_bench import LAPS, MaterialBench
from grainlaw.workbench.material_properties import PROPERTIES

CALLS = []


class Softer(Cubic):
    """A first response below the declared stiffness."""

    def stress(self, exx, eyy, exy):
        return self.c11 * exx + self.c12 * eyy, self.c12 * exx + self.c11 * eyy, 1.96 * self.c44 * exy


class Stiffens(Cubic):
    """Twice as stiff in shear beyond a strain."""

    def stress(self, exx, eyy, exy):
        more = max(abs(exy) - 1e-3, 0.0) * (1 if exy > 0 else -1)
        return self.c11 * exx + self.c12 * eyy, self.c12 * exx + self.c11 * eyy, 2 * self.c44 * (exy + more)

    def energy(self, exx, eyy, exy):
        more = max(abs(exy) - 1e-3, 0.0)
        return 0.5 * self.c11 * (exx**2 + eyy**2) + self.c12 * exx * eyy + 2 * self.c44 * (exy**2 + more**2)


class Lopsided(Cubic):
    """One stress follows the other strain more than the reverse, beyond the first response."""

    def stress(self, exx, eyy, exy):
        sxx, syy, sxy = self.c11 * exx + self.c12 * eyy, self.c12 * exx + self.c11 * eyy, 2 * self.c44 * exy
        return sxx - 0.1 * self.c12 * max(eyy - 5e-4, 0.0), syy, sxy


class Flows(Yielding):
    """Yields backwards: each plastic step gives energy."""

    def stress(self, exx, eyy, exy, shifted):
        trial = 2 * self.c44 * (exy - shifted)
        shear = min(max(trial, -self.strength), self.strength)
        shifted = shifted - 0.5 * (trial - shear) / (2 * self.c44)
        return self.c11 * exx + self.c12 * eyy, self.c12 * exx + self.c11 * eyy, 2 * self.c44 * (exy - shifted), shifted

    def energy(self, exx, eyy, exy, shifted):
        return 0.5 * self.c11 * (exx**2 + eyy**2) + self.c12 * exx * eyy + 2 * self.c44 * (exy - shifted) ** 2


class Declares(Cubic):
    """Says that it stores more than the work."""

    def energy(self, exx, eyy, exy):
        return self.c11 * (exx**2 + eyy**2)


class Heals(Yielding):
    """Its plastic strain, a size, goes back: here it has the sign of the shear."""


class Counts(Cubic):
    """Depends on how often it was called."""

    def stress(self, exx, eyy, exy):
        CALLS.append(exx)
        factor = 1 + 1e-9 * len(CALLS)
        return self.c11 * exx + self.c12 * eyy, self.c12 * exx + self.c11 * eyy, 2 * self.c44 * exy * factor


class Divides(Cubic):
    """0/0 without strain."""

    def stress(self, exx, eyy, exy):
        return self.c11 * exx * exx / exx + self.c12 * eyy, self.c12 * exx + self.c11 * eyy, 2 * self.c44 * exy


class Stops(Cubic):
    """Raises: does not compile."""

    def stress(self, exx, eyy, exy):
        if exx > 1:
            raise ValueError("too far")
        return self.c11 * exx + self.c12 * eyy, self.c12 * exx + self.c11 * eyy, 2 * self.c44 * exy


@attrs.frozen(kw_only=True)
class Unitless(Cubic):
    """A number that is not declared."""

    factor: float = 1.0


FAULTS = {
    Softer: "stiffness", Stiffens: "stiffness", Lopsided: "symmetry", Flows: "energy", Declares: "symmetry",
    Heals: "memory", Counts: "no hidden state", Divides: "finite", Stops: "compiled", Unitless: "units",
}  # fmt: skip


@pytest.mark.thorough
@pytest.mark.parametrize("fault", FAULTS, ids=lambda fault: fault.__name__)
def test_the_kit_finds_the_fault(fault):
    values = {field.name: getattr(YIELDING, field.name) for field in attrs.fields(Yielding)}
    if not issubclass(fault, Yielding):
        values.pop("strength")
    report = gl.check_material(fault(**values))
    assert not report[FAULTS[fault]].passed, report
    assert report[FAULTS[fault]].found


@pytest.mark.thorough
def test_a_weak_material_is_as_objective_as_its_displacements_are_rounded():
    """Of stresses of a few Pa the rounding of a turned grain's strain, times its stiffness, is more than 1e-9."""
    values = {field.name: getattr(YIELDING, field.name) for field in attrs.fields(Yielding)}
    assert gl.check_material(Yielding(**values | {"strength": 100.0}))["objectivity"].passed


def asked(kind, name, **more):
    """What a property finds of a material, by itself."""
    values = {field.name: getattr(YIELDING, field.name) for field in attrs.fields(Yielding)}
    if not issubclass(kind, Yielding):
        values.pop("strength")
    bench = MaterialBench(kind(**values, **more))
    return bench, PROPERTIES[name](bench)


def test_what_breaks_a_property_is_told_by_its_size():
    """By hand: 2 % softer, twice as stiff, twice the stress at the eighth point; half of a stress is in the energy."""
    assert asked(Softer, "stiffness")[1].size == pytest.approx(0.02)
    assert asked(Stiffens, "stiffness")[1].size == pytest.approx(2.0)
    bench, found = asked(Declares, "symmetry")
    assert found.size == pytest.approx(YIELDING.c11 * 0.8 * bench.scale * 7 / 30, rel=1e-6)
    found = asked(Lopsided, "symmetry")[1]
    strain = float(re.search("yy ([^,]+),", found.text)[1])
    assert found.size == pytest.approx(0.05 * YIELDING.c12 * (strain - 5e-4), rel=1e-2)
    assert asked(Flows, "energy")[1].text.startswith("random path 2: gives")
    assert asked(Divides, "finite")[1].text.startswith("stress xx is nan at the strain xx 0, ")


@pytest.mark.parametrize(("work", "gives"), [(1.0, 0.0), (1.0, 0.3), (1e3, 1.9), (1e3, 2.1)])
def test_energy_that_is_given_is_judged_by_the_work_or_by_that_of_the_scale(work, gives):
    """The larger of both: 100 J/m3 of the scale allow 0.2 J/m3, 1,000 of work 2."""
    lost = np.array([0.0, gives, 0.0])
    trace = SimpleNamespace(
        work=np.array([0.0, gives, work]), stored=np.array([0.0, 0.0, work]), strain=np.zeros((3, 3))
    )
    bench = SimpleNamespace(traces={"a path": trace}, scale=1e-3, declared=np.full((3, 3), 1e8))
    found = PROPERTIES["energy"](bench)
    assert (found is not None) == (gives > max(0.2, 2e-3 * work))
    assert found is None or found.size == pytest.approx(lost.max())


def test_machine_code_that_answers_otherwise_is_told_by_how_much(monkeypatch):
    """By 30 Pa of 1,000, in the third of the nine points of the first lap."""
    path = np.arange(81.0).reshape(27, 3) * 1e-4

    def zone(*wrong):
        answers = np.tile([1000.0, -1000.0, 0.0, 5.0], (9, 1))
        answers[2, 1] += sum(wrong)
        return SimpleNamespace(run=lambda points: answers[: len(points)], names=())

    monkeypatch.setattr(material_properties, "Zone", lambda material, compiled: zone(30.0))
    bench = SimpleNamespace(material=None, zone=zone(), traces={"a path": SimpleNamespace(strain=path)}, scale=1e-9,
                            declared=np.ones((3, 3)))  # fmt: skip
    found = PROPERTIES["compiled"](bench)
    assert found.size == 30
    assert found.text.startswith("a path: stress yy -970 compiled, -1000 interpreted at the strain xx 0.0006, yy")


def test_strains_of_either_sign_up_to_a_tenth_are_tried():
    tried = []

    def run(points):
        tried.extend(points)
        return np.zeros((len(points), 4))

    assert PROPERTIES["finite"](SimpleNamespace(zone=SimpleNamespace(run=run, error=""), traces={})) is None
    for column in np.array(tried).T:
        for sign in (1, -1):
            sizes = sign * column[sign * column > 0]
            assert len(sizes) > 0.2 * len(column)
            assert 1e-9 < sizes.min() < 1e-7
            assert 0.01 < sizes.max() < 0.1
        assert 0.2 < np.mean(column == 0) < 0.4


@pytest.mark.parametrize(("largest", "slope"), [(0.0, 0.9), (0.0, 1.1), (1e6, 9.0), (1e6, 11.0)])
def test_an_energy_is_judged_by_the_stress_of_its_path_or_by_that_of_the_scale(largest, slope):
    """The larger of both: 0.1 MPa of the scale allow 1 Pa where there is none, 1 MPa of the path 10 Pa."""
    stress = np.array([[0.0, 0.0, 0.0], [0.0, largest, 0.0]])
    trace = SimpleNamespace(stress=stress, strain=np.zeros((2, 3)), memory={})
    zone = SimpleNamespace(energy=lambda strain, state: slope * strain[0])
    bench = SimpleNamespace(zone=zone, traces={"a path": trace}, scale=1e-3, declared=np.full((3, 3), 1e8))
    found = PROPERTIES["symmetry"](bench)
    assert (found is not None) == (slope > max(1, 1e-5 * largest))
    assert found is None or found.size == pytest.approx(slope)


def test_a_first_response_may_bend():
    class Bends(Cubic):
        def stress(self, exx, eyy, exy):
            xx, yy = exx * (1 + 5 * exx), eyy * (1 + 5 * eyy)
            return self.c11 * xx + self.c12 * eyy, self.c12 * exx + self.c11 * yy, 2 * self.c44 * exy

    bench, found = asked(Bends, "stiffness")
    assert found is None
    assert bench.scale == 1e-3  # nothing ends before


def test_the_scale_is_the_least_strain_of_either_sign_that_ends_the_first_response():
    """Crushed along x at 1e-4: there, eight points to a decade, the next one is 1 % off."""

    class Crushes(Cubic):
        def stress(self, exx, eyy, exy):
            exx = max(exx, -1e-4)
            return self.c11 * exx + self.c12 * eyy, self.c12 * exx + self.c11 * eyy, 2 * self.c44 * exy

    assert asked(Crushes, "units")[0].scale == pytest.approx(10 ** (-4 + 1 / 8))


@pytest.mark.parametrize(("values", "size"), [([0, 1, 1, 2.0], None), ([0, 2, 1, 3.0], 1.0), ([-0.5, 1, 2, 3.0], 0.5)])
def test_plastic_strain_never_falls_and_is_never_negative(values, size):
    trace = SimpleNamespace(memory={"plastic_strain": np.array(values)}, strain=np.zeros((4, 3)))
    found = PROPERTIES["memory"](SimpleNamespace(traces={"path": trace, "none": SimpleNamespace(memory={})}))
    assert (found and found.size) == size


def test_the_sound_ones_conform():
    assert gl.check_material(CUBIC).passed
    report = gl.check_material(YIELDING)  # but for its signed plastic strain
    assert [entry.name for entry in report if not entry.passed] == ["memory"]


def test_the_kit_finds_a_frame_that_does_not_turn(monkeypatch):
    """The engine is part of the check: without the turn of the stress a turned grain has a moment."""
    from grainlaw.engine.parts import every_zone

    original = every_zone.MaterialZones.states

    def fixed(self, displacement):
        stress, stored, lost = original(self, displacement)
        return stress * [1.0, 1.0, 1.001], stored, lost

    monkeypatch.setattr(every_zone.MaterialZones, "states", fixed)
    report = gl.check_material(CUBIC)
    assert "turned by" in report["objectivity"].found


def test_what_a_material_returns_is_checked():
    class Short(Cubic):
        def stress(self, exx, eyy, exy):
            return exx, eyy

    class Other(Cubic):
        def energy(self, exx, eyy, exy, damage):
            return 0.0

    values = {"c11": 9e10, "c12": 1e10, "c44": 5e9, "density": GRAIN["density"]}
    with pytest.raises(TypeError, match=r"Short.stress must return 3 numbers, stress xx, yy and xy and no memory"):
        gl.trace_material(Short(**values), 1e-3, 0, 0)
    with pytest.raises(
        gl.ParameterError, match=r"Other.energy takes the memory \(damage\), it must take that of stress"
    ):
        gl.trace_material(Other(**values), 1e-3, 0, 0)


@attrs.frozen(kw_only=True)
class Warm(Cubic):
    """A crystal that expands, and is softer when it is hot."""

    expansion: float = gl.parameter("1/K")
    softening: float = gl.parameter("1/K")

    def stress(self, exx, eyy, exy, temperature):
        left, free = 1 - self.softening * (temperature - 20), self.expansion * (temperature - 20)
        xx, yy = exx - free, eyy - free
        return left * (self.c11 * xx + self.c12 * yy), left * (self.c12 * xx + self.c11 * yy), left * 2 * self.c44 * exy

    def energy(self, exx, eyy, exy, temperature):
        sxx, syy, sxy = self.stress(exx, eyy, exy, temperature)
        free = self.expansion * (temperature - 20)
        return 0.5 * (sxx * (exx - free) + syy * (eyy - free)) + sxy * exy


class Ratchets(Warm):
    """Remembers the highest temperature and keeps half of the expansion there: heating and cooling close no loop."""

    def stress(self, exx, eyy, exy, temperature, hottest):
        hottest = max(hottest, temperature - 20)
        free = self.expansion * 0.5 * (temperature - 20 + hottest)
        xx, yy = exx - free, eyy - free
        return self.c11 * xx + self.c12 * yy, self.c12 * xx + self.c11 * yy, 2 * self.c44 * exy, hottest

    def energy(self, exx, eyy, exy, temperature, hottest):
        free = self.expansion * 0.5 * (temperature - 20 + hottest)
        xx, yy = exx - free, eyy - free
        return 0.5 * self.c11 * (xx**2 + yy**2) + self.c12 * xx * yy + 2 * self.c44 * exy**2


class StiffensHot(Warm):
    """Twice as stiff at 770 degrees."""

    def stress(self, exx, eyy, exy, temperature):
        more = 1 + (temperature - 20) / 750
        return (
            more * (self.c11 * exx + self.c12 * eyy),
            more * (self.c12 * exx + self.c11 * eyy),
            more * 2 * self.c44 * exy,
        )

    def energy(self, exx, eyy, exy, temperature):
        sxx, syy, sxy = self.stress(exx, eyy, exy, temperature)
        return 0.5 * (sxx * exx + syy * eyy) + sxy * exy


class StiffensCold(StiffensHot):
    """As stiff as declared at 20 degrees and above, twice as stiff at -100."""

    def stress(self, exx, eyy, exy, temperature):
        more = 1 + max(20 - temperature, 0) / 120
        xx, yy = more * (self.c11 * exx + self.c12 * eyy), more * (self.c12 * exx + self.c11 * eyy)
        return xx, yy, more * 2 * self.c44 * exy


STIFFER = "°C, stiffness: .* times as stiff as declared"


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("kind", "found"),
    [
        (Warm, ""),
        (Ratchets, "closes no loop"),
        (StiffensHot, f"at 800 {STIFFER}"),
        (StiffensCold, f"at -100 {STIFFER}"),
    ],
)
def test_the_kit_asks_at_other_temperatures(kind, found):
    values = {field.name: getattr(CUBIC, field.name) for field in attrs.fields(Cubic)}
    report = gl.check_material(kind(**values, expansion=1e-5, softening=5e-4))
    assert report["temperature"].passed == (not found), report
    assert re.search(found, report["temperature"].found)


@pytest.mark.thorough
def test_a_free_strain_and_a_stiffness_are_asked_for_at_other_temperatures():
    """By hand: half of the expansion of one kelvin; 1 + 780/750 times as stiff at 800, twice at -100 degrees."""
    warm = {"expansion": 1e-5, "softening": 5e-4}
    assert asked(Warm, "temperature", **warm)[1] is None
    found = asked(Ratchets, "temperature", **warm)[1]
    assert found.text.startswith("heated to 21 °C and cooled it keeps a free strain of 5e-06")
    assert found.size == pytest.approx(5e-6)

    class Elsewhere(Warm):
        """Free of stress without strain at 19 degrees."""

        def stress(self, exx, eyy, exy, temperature):
            free = self.expansion * (temperature - 19)
            xx, yy = exx - free, eyy - free
            return self.c11 * xx + self.c12 * yy, self.c12 * xx + self.c11 * yy, 2 * self.c44 * exy

        def energy(self, exx, eyy, exy, temperature):
            free = self.expansion * (temperature - 19)
            xx, yy = exx - free, eyy - free
            return 0.5 * self.c11 * (xx**2 + yy**2) + self.c12 * xx * yy + 2 * self.c44 * exy**2

    assert asked(Elsewhere, "temperature", **warm)[1] is None
    for known, found in (((-50.0, 20.5), "is known from -50 to 20.5 °C; runs begin at 20 °C"), ((0.0, 21.0), "")):
        near = type("Near", (Warm,), {"temperatures": property(lambda self, known=known: known)})
        told = asked(near, "temperature", **warm)[1]
        assert (told.text if told else "") == found
    cold = type("Cold", (StiffensCold,), {"temperatures": (-20.0, 21.0)})  # 40 of the 120 degrees to twice as stiff
    assert asked(cold, "temperature", **warm)[1].size == pytest.approx(4 / 3)
    for kind, ratio, where in ((StiffensHot, 2.04, "at 800 °C, stiffness"), (StiffensCold, 2, "at -100 °C, stiffness")):
        found = asked(kind, "temperature", **warm)[1]
        assert found.text.startswith(where)
        assert found.size == pytest.approx(ratio)


def test_paths_of_strain_are_what_their_names_say():
    """Closed laps, alike; who turns the axes does not swell, and who is pressed stays so while it is sheared."""
    bench = MaterialBench(YIELDING)
    scale, paths = bench.scale, bench.paths
    for path in paths.values():
        assert np.array_equal(path[[0, -1]], np.zeros((2, 3)))
        assert np.array_equal(path[: len(path) // LAPS], path[len(path) // LAPS : 2 * (len(path) // LAPS)])
    along, across = paths["stretch, release, compress"], paths["the same across"]
    assert np.array_equal(along[:, [1, 0, 2]], across)
    assert np.array_equal([along[:, 0].min(), along[:, 0].max()], np.array([-3.0, 3.0]) * scale)
    assert np.abs(paths["turn the axes"][:, :2].sum(axis=1)).max() < 1e-12 * scale
    assert set(np.sign(paths["turn the axes"][:, 0])) == {-1, 0, 1}
    assert [paths["turn the axes"][:, 2].min(), paths["turn the axes"][:, 2].max()] == [-0.8 * scale, 3 * scale]
    sheared = paths["shear while pressed"]
    assert np.all(sheared[sheared[:, 2] != 0, :2] < 0)
    reversed_ = paths["shear, reverse"]
    assert reversed_[:, 2].min() == -reversed_[:, 2].max() == -3 * scale
    a, b, corners = 0.8, 3.0, {name: path[::30] / scale for name, path in paths.items()}  # thirty steps to a leg
    expected = {
        "stretch, release, compress": [(a, 0, 0), (0, 0, 0), (b, 0, 0), (0, 0, 0), (-b, 0, 0)],
        "shear while pressed": [(-a, -a, 0), (-a, -a, b), (-a, -a, -b), (-b, -b, -b), (-b, -b, b)],
        "swell and shear": [(a, a, 0), (a, a, a), (b, b, b), (0, 0, b)],
        "press one way, then the other": [(-b, 1, 0), (0, 0, 0), (1, -b, 0)],
        "turn the axes": [(a, -a, 0), (0, 0, a), (-a, a, 0), (0, 0, -a), (b, -b, 0), (0, 0, b)],
    }
    for name, inner in expected.items():
        assert corners[name][: len(inner) + 2] == pytest.approx(np.array([(0, 0, 0), *inner, (0, 0, 0)]), abs=1e-12)
    half = len(paths["shear, reverse"]) // LAPS // 5  # of a lap of five legs, to the first turn and the second
    assert reversed_[half, 2] == -reversed_[2 * half, 2] == pytest.approx(0.8 * scale)
