"""The conformance kit over every exported law, with every reading of the cohesive crack model and every part."""

import enum
import itertools
import math

import attrs
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import grainlaw as gl
import grainlaw.laws
from grainlaw.contact import ContactLaw
from grainlaw.laws import (
    BandisClosure,
    BartonBandis,
    BilinearMixedMode,
    CamachoOrtiz,
    CohesiveCrack,
    Coupling,
    EvansMarathe,
    ExponentialGrowth,
    ExponentialSoftening,
    Friction,
    HordijkSoftening,
    JohnsonCook,
    Linear,
    LinearClosure,
    LinearSoftening,
    MohrCoulomb,
    MunjizaJoint,
    OtherMode,
    PeterssonSoftening,
    PrePeak,
    RateDependent,
    Residual,
    SofteningLength,
    StaticFatigue,
    TensionShear,
    Unloading,
    Viscous,
    XuNeedleman,
)
from grainlaw.laws.closure import Closure
from grainlaw.laws.softening import Softening
from grainlaw.workbench.driver import trace
from grainlaw.workbench.properties import Bench

STIFF = {"kn": 1.05e14, "ks": 9.45e13}
STRONG = {**STIFF, "tensile_strength": 13e6, "cohesion": 29e6, "friction_angle": 54, "residual_friction_angle": 20}
ENERGIES = {"mode_i_energy": 15, "mode_ii_energy": 30}  # a break at 3 um: short paths
BRITTLE = MohrCoulomb(**STRONG)
CCM = CohesiveCrack(**STRONG, **ENERGIES)
JOINT = MunjizaJoint(**STRONG, **ENERGIES)
EVEN = {name: value for name, value in STRONG.items() if name != "friction_angle"}  # whatever the pressure
ELLIPSES = CamachoOrtiz(**EVEN, **ENERGIES)
BILINEAR = BilinearMixedMode(**EVEN, **ENERGIES)
EXPONENTIAL = XuNeedleman(**EVEN)
ROUGH = BartonBandis(**STIFF, friction_angle=40, dilation_angle=15, closure=BandisClosure(maximum_closure=5e-6))
PARTS = {"softening": [EvansMarathe(), LinearSoftening(), ExponentialSoftening(), HordijkSoftening(),
                       PeterssonSoftening()],
         "closure": [LinearClosure(), BandisClosure(maximum_closure=5e-6)]}  # fmt: skip
READINGS = {"softening_length": SofteningLength, "other_mode": OtherMode, "residual": Residual,
            "tension_shear": TensionShear, "pre_peak": PrePeak}  # fmt: skip


def label(value):
    return value.name if isinstance(value, enum.Enum) else type(value).__name__


COMBINED = {
    "-".join(map(label, values)): attrs.evolve(CCM, **dict(zip(READINGS, values, strict=True)))
    for values in itertools.product(*READINGS.values())
}
VARIED = {
    f"CohesiveCrack-{name}-{label(value)}": attrs.evolve(CCM, **{name: value})
    for name, values in (READINGS | PARTS).items()
    for value in list(values)[1:]
}
LAWS = {
    "Linear": Linear(**STIFF),
    "Friction": Friction(**STIFF, friction_angle=30),
    "Friction-Bandis": Friction(**STIFF, friction_angle=30, closure=BandisClosure(maximum_closure=5e-6)),
    "MohrCoulomb": BRITTLE,
    "MohrCoulomb-residual": MohrCoulomb(
        **STRONG, residual_tensile_strength=1e6, residual_cohesion=5e6, dilation_angle=15
    ),
    "CohesiveCrack": CCM,
    **VARIED,
    "CohesiveCrack-frictionless": attrs.evolve(
        CCM, friction_angle=0, residual_friction_angle=0, pre_peak=PrePeak.AS_PRINTED
    ),
    "MunjizaJoint": JOINT,
    "MunjizaJoint-retraced": attrs.evolve(JOINT, unloading=Unloading.RETRACED),
    "MunjizaJoint-linear": attrs.evolve(JOINT, softening=LinearSoftening()),
    "MunjizaJoint-Bandis": attrs.evolve(JOINT, closure=BandisClosure(maximum_closure=5e-6)),
    "MunjizaJoint-frictionless": attrs.evolve(JOINT, friction_angle=0, residual_friction_angle=0),
    "CamachoOrtiz": ELLIPSES,
    "CamachoOrtiz-Bandis": attrs.evolve(ELLIPSES, closure=BandisClosure(maximum_closure=5e-6)),
    "CamachoOrtiz-frictionless": attrs.evolve(ELLIPSES, residual_friction_angle=0),
    "BilinearMixedMode": BILINEAR,
    "BilinearMixedMode-roots": attrs.evolve(BILINEAR, eta=0.75),
    "BilinearMixedMode-brittle-shear": attrs.evolve(BILINEAR, mode_i_energy=150),
    "BilinearMixedMode-Bandis": attrs.evolve(BILINEAR, closure=BandisClosure(maximum_closure=5e-6)),
    "XuNeedleman": EXPONENTIAL,
    "XuNeedleman-POTENTIAL": attrs.evolve(EXPONENTIAL, coupling=Coupling.POTENTIAL),
    "XuNeedleman-repulsive": attrs.evolve(EXPONENTIAL, coupling=Coupling.POTENTIAL, cohesion=40e6),
    "XuNeedleman-Bandis": attrs.evolve(EXPONENTIAL, closure=BandisClosure(maximum_closure=5e-6)),
    "BartonBandis": ROUGH,
    "BartonBandis-end": attrs.evolve(ROUGH, dilation_end=2e-6),
    "BartonBandis-steep": attrs.evolve(ROUGH, dilation_angle=40),
    "BartonBandis-linear": attrs.evolve(ROUGH, dilation_angle=0, closure=LinearClosure()),
    "RateDependent": RateDependent(law=CCM),
    "RateDependent-logarithm": RateDependent(law=BRITTLE, effect=JohnsonCook()),
    "Viscous": Viscous(law=JOINT, retardation=1e-7),
    "StaticFatigue": StaticFatigue(law=CCM, rate=1.0),
    "StaticFatigue-exponential": StaticFatigue(law=ELLIPSES, rate=1.0, growth=ExponentialGrowth()),
    "StaticFatigue-brittle": StaticFatigue(law=BRITTLE, rate=1.0),
    "three": Viscous(law=RateDependent(law=StaticFatigue(law=BRITTLE, rate=1.0)), retardation=1e-7),
}
COHESIVE = {name: law for name, law in (LAWS | COMBINED).items() if isinstance(law, CohesiveCrack)}
every_law = pytest.mark.parametrize("law", LAWS.values(), ids=LAWS)


@pytest.mark.parametrize(
    "law",
    [pytest.param(law, id=name, marks=pytest.mark.thorough if "-" in name else ()) for name, law in LAWS.items()],
)
def test_law_conforms(law):
    conforms(law, gl.check_law(law))


@pytest.mark.thorough
@pytest.mark.parametrize("law", COMBINED.values(), ids=COMBINED)
def test_readings_conform_together(law):
    """Compiled are only the single readings, which take turns in every branch."""
    conforms(law, gl.check_law(law, compiled=False))


def conforms(law, report):
    """All properties hold; what the law declares to break is really broken, and by no more than it says."""
    assert report.passed, str(report)
    for name, reason in law.exceptions.items():
        assert report[name].exception == reason
        assert report[name].size > 0
    if isinstance(law, CohesiveCrack) and "energy" in law.exceptions:
        assert 0.1 < report["energy"].size < 0.24 * law.ks * law.peak_slip(law.shear_strength(0.0, 0.0)) ** 2


@pytest.mark.parametrize("law", [CCM, LAWS["MohrCoulomb"]], ids=label)
def test_the_paths_reach_what_they_are_for(law):
    runs = Bench(law).drives
    ends = [run.answers[-1, 2] for run in runs]
    assert sum(end == 1 for end in ends) >= 8
    damage, mode = np.concatenate([run.answers[:, 2:4] for run in runs]).T
    assert {0.0, 1.0} <= set(mode[damage > 0])
    if isinstance(law, CohesiveCrack):
        assert np.any((damage > 0.05) & (damage < 0.95))
        assert np.any((mode > 0.1) & (mode < 0.9))


def test_the_list_is_what_the_package_exports():
    exported = {name: getattr(grainlaw.laws, name) for name in grainlaw.laws.__all__}
    laws = {kind for kind in exported.values() if issubclass(kind, ContactLaw)}
    assert laws == {type(law) for law in LAWS.values()}
    options = {repr(option) for kind in exported.values() if issubclass(kind, enum.Enum) for option in kind}
    values = [value for law in LAWS.values() for value in attrs.asdict(law, recurse=False).values()]
    assert options == {repr(value) for value in values if isinstance(value, enum.Enum)}
    used = {type(getattr(law, name)) for law in LAWS.values() if isinstance(law, CohesiveCrack) for name in PARTS}
    parts = {kind for kind in exported.values() if issubclass(kind, (Softening, Closure)) and attrs.has(kind)}
    assert parts <= used
    fields = {f.name for f in attrs.fields(CohesiveCrack) if f.name not in STRONG and not f.name.endswith("energy")}
    assert fields == set(READINGS) | set(PARTS)


@pytest.mark.parametrize("law", COHESIVE.values(), ids=COHESIVE)
def test_fracture_energies_as_declared(law):
    dissipated = law.length / law.softening.length
    far = np.linspace(0, 1, 1001)
    rise = (1 - 2 / math.e) if law.pre_peak != PrePeak.LINEAR else 0.5
    tension = trace(law, far * law.breaking_opening * 1.01, 0)
    assert tension.work[-1] == pytest.approx(rise * law.kn * law.peak_opening**2 + 15 * dissipated, rel=1e-4)
    shear = trace(law, 0, far * law.breaking_slip(29e6) * 1.01)
    assert shear.work[-1] == pytest.approx(rise * law.ks * law.peak_slip(29e6) ** 2 + 30 * dissipated, rel=1e-4)
    assert tension.damage[-1] == shear.damage[-1] == 1
    if law.softening_length == SofteningLength.ENERGY:
        assert dissipated == 1
    elif isinstance(law.softening, EvansMarathe):
        assert dissipated == pytest.approx(1.1589, abs=5e-5)


@every_law
@settings(max_examples=60)
@given(st.lists(st.tuples(st.floats(-1, 1), st.floats(-1, 1)), min_size=1, max_size=6))
def test_finite_for_any_finite_input(law, points):
    opening, slip = zip(*points, strict=True)
    t = trace(law, opening, slip)
    assert np.all(np.isfinite([t.normal, t.shear, *t.memory.values()]))
    if "damage" in t.memory:
        assert np.all((t.damage >= 0) & (t.damage <= 1))
