"""What every exported law must do, with every reading of the cohesive crack model and every part."""

import enum
import itertools
import math

import attrs
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import grainlaw.laws
from grainlaw.contact import ContactLaw, trace
from grainlaw.laws import (
    BandisClosure,
    CohesiveCrack,
    EvansMarathe,
    Linear,
    LinearClosure,
    LinearSoftening,
    MohrCoulomb,
    OtherMode,
    PrePeak,
    Residual,
    SofteningLength,
    TensionShear,
)
from grainlaw.laws.closure import Closure
from grainlaw.laws.softening import Softening

STIFF = {"kn": 1.05e14, "ks": 9.45e13}
STRONG = {**STIFF, "tensile_strength": 13e6, "cohesion": 29e6, "friction_angle": 54, "residual_friction_angle": 20}
CCM = CohesiveCrack(**STRONG, mode_i_energy=15, mode_ii_energy=30)  # breaks at 3 um: short paths
PARTS = {"softening": [EvansMarathe(), LinearSoftening()],
         "closure": [LinearClosure(), BandisClosure(maximum_closure=5e-6)]}  # fmt: skip
READINGS = {"softening_length": SofteningLength, "other_mode": OtherMode, "residual": Residual,
            "tension_shear": TensionShear, "pre_peak": PrePeak}  # fmt: skip
um = 1e-6


def label(value):
    return value.name if isinstance(value, enum.Enum) else type(value).__name__


COMBINED = {
    "-".join(map(label, values)): attrs.evolve(CCM, **dict(zip(READINGS, values, strict=True)))
    for values in itertools.product(*READINGS.values())
}
VARIED = {
    f"CohesiveCrack-{label(value)}": attrs.evolve(CCM, **{name: value})
    for name, values in (READINGS | PARTS).items()
    for value in list(values)[1:]
}
LAWS = {
    "Linear": Linear(**STIFF),
    "MohrCoulomb": MohrCoulomb(**STRONG),
    "MohrCoulomb-residual": MohrCoulomb(
        **STRONG, residual_tensile_strength=1e6, residual_cohesion=5e6, dilation_angle=15
    ),
    "CohesiveCrack": CCM,
    **VARIED,
    "CohesiveCrack-frictionless": attrs.evolve(CCM, friction_angle=0, residual_friction_angle=0),
}
COHESIVE = {name: law for name, law in (LAWS | COMBINED).items() if isinstance(law, CohesiveCrack)}
every_law = pytest.mark.parametrize("law", LAWS.values(), ids=LAWS)
every_combination = pytest.mark.parametrize("law", [*LAWS.values(), *COMBINED.values()], ids=[*LAWS, *COMBINED])


def polyline(corners, steps):
    """Opening and slip (m) along straight lines through ``corners`` (um), ``steps`` points each."""
    corners = np.array(corners) * um
    shares = np.arange(steps)[:, None] / steps
    legs = [a + (b - a) * shares for a, b in itertools.pairwise(corners)]
    return np.concatenate([*legs, corners[-1:]]).T


#: Closed paths of (opening, slip) in um that catch what random paths miss.
PATHS = {
    "pull, release": [(0, 0), (0.3, 0), (0, 0), (1, 0), (0, 0), (5, 0), (0, 0)],
    "pull, release, press, shear": [(0, 0), (0.8, 0), (0, 0), (-1, 0), (-1, 3), (-1, 0), (0, 0)],
    "shear under pressure, reverse": [(0, 0), (-0.4, 0), (-0.4, 2), (-0.4, -2), (-0.4, 8), (-0.4, 0), (0, 0)],
    "open, slide, close": [(0, 0), (4, 0), (4, 5), (-1, 5), (-1, 9), (0, 9), (0, 0)],
    "slip, press, slip back, release": [(0, 0), (0, 1.5), (-1, 1.5), (-1, 0), (0, 0)],
    "slip far, press, slip back, release": [(0, 0), (0, 4), (-1, 4), (-1, 0), (0, 0)],
    "slip, pull, slip back": [(0, 0), (0, 0.7), (0.6, 0.7), (0.6, 0), (0, 0), (0, 1), (0, 0)],
    "pull, slip, release": [(0, 0), (0.3, 0), (0.3, 1), (0, 1), (0, 0)],
    "both at once": [(0, 0), (1, 1), (0.3, -1), (-0.5, 1), (2, 4), (-1, -4), (0, 0)],
}


def random_path(seed, points=400):
    """A walk of correlated steps about the peaks, into pressure and out to the break."""
    steps = np.random.default_rng(seed).normal(size=(2, points)) * 0.15 * um
    return np.cumsum(steps, axis=1)


def test_the_list_is_what_the_package_exports():
    exported = {name: getattr(grainlaw.laws, name) for name in grainlaw.laws.__all__}
    laws = {kind for kind in exported.values() if issubclass(kind, ContactLaw)}
    assert laws == {type(law) for law in LAWS.values()}
    readings = {kind for kind in exported.values() if issubclass(kind, enum.Enum)}
    assert readings == set(READINGS.values())
    used = {type(getattr(law, name)) for law in LAWS.values() if isinstance(law, CohesiveCrack) for name in PARTS}
    parts = {kind for kind in exported.values() if issubclass(kind, (Softening, Closure)) and attrs.has(kind)}
    assert parts <= used
    fields = {f.name for f in attrs.fields(CohesiveCrack) if f.name not in STRONG and not f.name.endswith("energy")}
    assert fields == set(READINGS) | set(PARTS)


@every_law
def test_fields_declare_their_unit(law):
    for field in attrs.fields(type(law)):
        value = getattr(law, field.name)
        assert isinstance(value, enum.Enum) or attrs.has(type(value)) or field.metadata["unit"]


@every_combination
def test_first_response_is_the_stiffness(law):
    kn, ks = law.stiffness
    start = [0.0] * (len(trace(law, 0, 0).memory))
    for size in (1e-13, -1e-13):
        assert law.traction(size, 0.0, *start)[0] == pytest.approx(kn * size, rel=1e-6)
        assert law.traction(0.0, size, *start)[1] == pytest.approx(ks * size, rel=1e-6)


@every_combination
def test_odd_in_slip(law):
    for opening, slip in [*(polyline(c, 6) for c in PATHS.values()), random_path(0, 100)]:
        there, mirrored = trace(law, opening, slip), trace(law, opening, -slip)
        assert np.array_equal(there.normal, mirrored.normal)
        assert np.array_equal(there.shear, -mirrored.shear)


@every_combination
def test_damage_never_heals(law):
    for opening, slip in [*(polyline(c, 15) for c in PATHS.values()), random_path(1), random_path(2)]:
        t = trace(law, opening, slip)
        for name in {"damage", "mode"} & set(t.memory):
            assert np.all((t.memory[name] >= 0) & (t.memory[name] <= 1))
        assert np.all(np.diff(t.memory.get("damage", [0.0])) >= 0)


def test_the_paths_reach_what_they_are_for():
    reached = {name: trace(CCM, *polyline(c, 100)) for name, c in PATHS.items()}
    assert any(np.any((t.damage > 0.05) & (t.damage < 0.95)) for t in reached.values())
    assert sum(t.damage[-1] == 1 for t in reached.values()) >= 4
    modes = np.concatenate([t.mode[t.damage > 0] for t in reached.values()])
    assert {0.0, 1.0} <= set(modes)
    assert np.any((modes > 0.1) & (modes < 0.9))


def declared_gain(law):
    """J/m2, the size in the law's declared exception, over the range of pressures of the paths."""
    return 0.24 * law.ks * law.peak_slip(law.shear_strength(0.0, 0.0)) ** 2 if "energy" in law.exceptions else 0.0


def brittle_error(t):
    """J/m2, of the trapezoid at the step in which a brittle contact fails."""
    fails = np.flatnonzero(np.diff(t.memory.get("damage", [0.0])) == 1)
    return sum(
        abs(np.diff(t.normal)[i] * np.diff(t.opening)[i]) + abs(np.diff(t.shear)[i] * np.diff(t.slip)[i]) for i in fails
    )


@every_combination
def test_closed_paths_never_create_energy(law):
    """From a virgin contact the work is what is stored and lost; it cannot be negative, nor can a settled cycle's."""
    steps = 600 if isinstance(law, MohrCoulomb) else 40
    for name, corners in PATHS.items():
        t = trace(law, *polyline(corners * 3, steps))
        tolerance = 2e-3 * np.max(np.abs(t.work)) + declared_gain(law) + brittle_error(t)
        lap = len(t.work) // 3
        assert np.min(t.work) >= -tolerance, name
        assert t.work[-1] - t.work[-1 - lap] >= -tolerance, name


@every_law
def test_random_closed_paths_never_create_energy(law):
    random = np.random.default_rng(11)
    for _ in range(12):
        corners = [(0, 0), *random.normal(size=(7, 2)) * (1, 2), (0, 0)]
        t = trace(law, *polyline(corners * 2, 400 if isinstance(law, MohrCoulomb) else 60))
        tolerance = 2e-3 * np.max(np.abs(t.work)) + declared_gain(law) + brittle_error(t)
        assert np.min(t.work) >= -tolerance


@every_combination
def test_the_declared_energy_exception_is_real(law):
    opening, slip = polyline([(0, 0), (0, 0.25), (-1, 0.25), (-1, 0), (0, 0)], 400)
    gain = -trace(law, opening, slip).work[-1]
    assert (gain > 0.1) == ("energy" in law.exceptions)


@pytest.mark.parametrize("law", COHESIVE.values(), ids=COHESIVE)
def test_fracture_energies_as_declared(law):
    dissipated = law.length / law.softening.length
    far = np.linspace(0, 1, 1001)
    rise = (1 - 2 / math.e) if law.pre_peak == PrePeak.EXPONENTIAL else 0.5
    tension = trace(law, far * law.breaking_opening * 1.01, 0)
    assert tension.work[-1] == pytest.approx(rise * law.kn * law.peak_opening**2 + 15 * dissipated, rel=1e-4)
    shear = trace(law, 0, far * law.breaking_slip(29e6) * 1.01)
    assert shear.work[-1] == pytest.approx(rise * law.ks * law.peak_slip(29e6) ** 2 + 30 * dissipated, rel=1e-4)
    assert tension.damage[-1] == shear.damage[-1] == 1
    if law.softening_length == SofteningLength.ENERGY:
        assert dissipated == 1
    elif isinstance(law.softening, EvansMarathe):
        assert dissipated == pytest.approx(1.1589, abs=5e-5)


def largest_jump(law, corners, steps):
    t = trace(law, *polyline(corners, steps))
    return max(np.max(np.abs(np.diff(t.normal))), np.max(np.abs(np.diff(t.shear))))


@every_law
def test_no_jump(law):
    """Ten times finer steps make ten times smaller increments, on every path or else as declared."""
    shrink = [largest_jump(law, c, 800) / largest_jump(law, c, 80) for c in PATHS.values()]
    if "continuity" in law.exceptions:
        assert max(shrink) > 0.5
    else:
        assert max(shrink) < 0.15


@every_law
@settings(max_examples=60, deadline=None)
@given(st.lists(st.tuples(st.floats(-1, 1), st.floats(-1, 1)), min_size=1, max_size=6))
def test_finite_for_any_finite_input(law, points):
    opening, slip = zip(*points, strict=True)
    t = trace(law, opening, slip)
    assert np.all(np.isfinite([t.normal, t.shear, *t.memory.values()]))
    if "damage" in t.memory:
        assert np.all((t.damage >= 0) & (t.damage <= 1))


@every_law
def test_compiled_equals_interpreted(law):
    for opening, slip in [*(polyline(c, 20) for c in PATHS.values()), random_path(3), random_path(4) * 5]:
        here, there = trace(law, opening, slip), trace(law, opening, slip, compiled=True)
        for name in ("normal", "shear", *here.memory):
            a, b = getattr(here, name), getattr(there, name)
            np.testing.assert_allclose(b, a, rtol=1e-12, atol=1e-12 * np.max(np.abs(a), initial=1e-30), err_msg=name)
