"""The engine against the law: two blocks with one joint answer as the law does alone."""

import attrs
import numpy as np
import pytest
from click.testing import CliRunner
from joint import verify
from support import ROCK, STIFF, STRONG, small_sample

import grainlaw as gl
from grainlaw.geometry import Bricks, rectangle
from grainlaw.laws import (
    BandisClosure,
    BartonBandis,
    BilinearMixedMode,
    CamachoOrtiz,
    CohesiveCrack,
    Friction,
    MohrCoulomb,
    MunjizaJoint,
    XuNeedleman,
)
from grainlaw.protocols import Cyclic, DirectShear, JointTension, UniaxialTension

TOUGH = {"mode_i_energy": 150, "mode_ii_energy": 300}
EVEN = {name: value for name, value in STRONG.items() if name != "friction_angle"}
COHESIVE = CohesiveCrack(**STRONG, **TOUGH)
BONDED = [
    COHESIVE, MohrCoulomb(**STRONG), MunjizaJoint(**STRONG, **TOUGH), CamachoOrtiz(**EVEN, **TOUGH),
    BilinearMixedMode(**EVEN, **TOUGH), XuNeedleman(**EVEN),
]  # fmt: skip
ROUGH = BartonBandis(**STIFF, friction_angle=40, dilation_angle=10, closure=BandisClosure(maximum_closure=5e-6))
FRICTION = Friction(**STIFF, friction_angle=30)


@attrs.define
class Watch(gl.Observer):
    """What the contact points of the joint did."""

    rows: list = attrs.field(factory=list)

    def observe(self, state, curves, stage, progress):
        self.rows.append(np.array([state.opening, state.slip, state.normal, state.shear]))


def blocks(height):
    return gl.Specimen(Bricks(rows=2).tessellate(rectangle(10e-3, height)), ROCK)


def label(law):
    return type(law).__name__


def deviation(law, watch):
    """Largest differences (Pa) of normal and shear tractions from the law alone along the same paths."""
    opening, slip, normal, shear = np.array(watch.rows).transpose(1, 0, 2)
    paths = [gl.trace(law, np.r_[0, o], np.r_[0, s]) for o, s in zip(opening.T, slip.T, strict=True)]
    alone = np.array([[p.normal[1:], p.shear[1:]] for p in paths])
    return np.abs(alone[:, 0].T - normal).max(), np.abs(alone[:, 1].T - shear).max()


@pytest.mark.thorough
@pytest.mark.parametrize("law", BONDED, ids=label)
def test_joint_in_tension_follows_the_law(law):
    watch = Watch()  # of every step: between samples the law alone would miss how far it has been
    test = JointTension(loading=gl.Constant(speed=0.05), resolution=1e-12, maximum_opening=6e-6, unload_at=2e-6)
    result = gl.simulate(blocks(4e-3), law, test, observers=[watch])
    assert deviation(law, watch)[0] < 0.01 * law.tensile_strength
    found, curves = result.summary, result.curves
    assert found["strength"] == pytest.approx(law.tensile_strength, rel=0.01)
    assert found["energy_error"] < 1e-6
    assert curves["normal"].min() == pytest.approx(-test.closing_pressure, rel=0.1)
    assert curves["opening"][-1] == pytest.approx(test.unload_at, rel=0.05)  # pulled again
    assert curves["normal"][-1] < 0.9 * law.tensile_strength  # it remembers


@pytest.mark.thorough
def test_joint_in_tension_spends_the_fracture_energy():
    curves = gl.simulate(blocks(4e-3), COHESIVE, JointTension(loading=gl.Constant(speed=0.02))).curves
    broken = int(np.argmax(curves["broken"] >= 1))
    for end in ("stress_top", "stress_bottom", "stress"):  # they carry what the joint carries
        assert curves[end][:broken].mean() == pytest.approx(curves["normal"][:broken].mean(), rel=0.02)
    work = curves["energy_contacts_normal"] / 10e-3
    assert work[broken] == pytest.approx(150 + 3.14258, rel=1e-3)  # fracture energy and work before the peak, J/m2
    assert work[-1] == pytest.approx(work[broken], rel=1e-3)  # closing and opening again gives back what it takes
    assert curves["opening"][broken] == pytest.approx(3.02052e-5, rel=2e-3)
    assert np.abs(curves["normal"][broken:][curves["opening"][broken:] > 0]).max() == 0  # nothing holds it any more


@pytest.mark.thorough
@pytest.mark.parametrize("law", [*BONDED, ROUGH, FRICTION], ids=label)
def test_joint_in_shear_follows_the_law_and_its_reversal(law):
    watch = Watch()
    test = DirectShear(
        normal_stress=40e6, loading=gl.Constant(speed=0.05), resolution=1e-12, maximum_slip=6e-6, reverse_to=0.5
    )
    result = gl.simulate(blocks(2e-3), law, test, observers=[watch])
    normal, shear = deviation(law, watch)
    assert normal < 0.01 * 40e6
    assert shear < 0.01 * max(result.summary["largest_stress"], 29e6)
    held = result.curves["normal_stress"][result.curves["displacement"] > 1e-7]
    assert held.mean() == pytest.approx(40e6, rel=1e-3)
    assert held == pytest.approx(np.full(len(held), 40e6), rel=0.05)  # a brittle drop shakes the platen
    assert result.summary["energy_error"] < 1e-4


@pytest.mark.thorough
@pytest.mark.parametrize(("law", "tangent"), [(FRICTION, np.tan(np.radians(30))), (COHESIVE, np.tan(np.radians(5)))])
def test_friction_holds_what_it_should_and_follows_the_reversal(law, tangent):
    test = DirectShear(normal_stress=40e6, loading=gl.Constant(speed=0.02), maximum_slip=40e-6, reverse_to=0.5)
    result = gl.simulate(blocks(2e-3), law, test)
    assert result.summary["residual_stress"] == pytest.approx(40e6 * tangent, rel=0.02)
    assert result.curves["shear"][-1] == pytest.approx(-40e6 * tangent, rel=2e-3)


@pytest.mark.thorough
def test_a_rough_joint_rises_and_hardens_under_constant_stiffness():
    """Dilation of 10 deg: it rises by tan(10 deg) times the slip, which a spring answers with stress."""
    free = DirectShear(normal_stress=10e6, loading=gl.Constant(speed=0.02), maximum_slip=20e-6)
    stiff = attrs.evolve(free, normal_stiffness=5e12)
    runs = [gl.simulate(blocks(2e-3), ROUGH, test).curves for test in (free, stiff)]
    late = [np.flatnonzero(c["displacement"] > 5e-6) for c in runs]
    slope = np.polyfit(runs[0]["slip"][late[0]], runs[0]["dilation"][late[0]], 1)[0]
    assert slope == pytest.approx(np.tan(np.radians(10)), rel=0.01)
    stress, rise = runs[1]["normal_stress"][late[1]], runs[1]["dilation"][late[1]]
    assert np.polyfit(rise, stress, 1)[0] == pytest.approx(5e12, rel=0.02)
    assert runs[1]["shear"][-1] > 1.5 * runs[0]["shear"][-1]
    assert runs[1]["shear"][-1] / -runs[1]["normal"][-1] == pytest.approx(np.tan(np.radians(40)), rel=2e-3)


@pytest.mark.parametrize("reverse_to", [-0.5, 1.0], ids=["reversed", "cyclic"])
def test_a_spring_goes_on_where_a_joint_is_sheared_back(reverse_to):
    """Its force follows from the dilation since it began, whatever stages there are."""
    test = DirectShear(
        normal_stress=10e6, normal_stiffness=5e12, loading=gl.Constant(speed=0.05), maximum_slip=20e-6,
        resolution=4e-7, reverse_to=reverse_to,
    )  # fmt: skip
    if reverse_to == 1.0:
        test = Cyclic(test=test, levels=(10e-6,), displacement="displacement", load="shear_stress")
    curves = gl.simulate(blocks(2e-3), ROUGH, test).curves
    sheared = np.flatnonzero(curves["stage"] > 0)
    assert curves["stage"][-1] == (2 if reverse_to < 1 else 3)
    rise = curves["dilation"][sheared] - curves["dilation"][sheared[0] - 1]
    assert np.ptp(rise) > 2e-6
    assert curves["normal_stress"][sheared] == pytest.approx(10e6 + 5e12 * rise, rel=0.03)


def test_the_residual_stress_is_that_at_the_end_of_shearing():
    once = DirectShear(normal_stress=10e6, loading=gl.Constant(speed=0.05), maximum_slip=40e-6, resolution=4e-7)
    cyclic = Cyclic(test=once, levels=(10e-6,), displacement="displacement", load="shear_stress")
    soft = MohrCoulomb(**STRONG | {"kn": 5e12, "ks": 2.5e12})
    for test in (once, attrs.evolve(once, reverse_to=0.0), cyclic):
        result = gl.simulate(blocks(2e-3), soft, test)
        assert result.summary["residual_stress"] == pytest.approx(10e6 * np.tan(np.radians(5)), rel=0.02), test


def test_a_joint_that_opens_while_it_slides_makes_no_energy():
    """What closes and what shears it is not given back twice: let go of one, it slides and has less of the other."""
    test = DirectShear(normal_stress=10e6, loading=gl.Constant(speed=0.05), maximum_slip=20e-6, resolution=4e-7)
    result = gl.simulate(blocks(2e-3), ROUGH, test)
    assert np.ptp(result.curves["dilation"]) > 3e-6
    assert result.summary["energy_made"] < 1e-9


def test_loops_of_a_joint_that_is_sheared_back_are_refused():
    test = DirectShear(normal_stress=1e6, reverse_to=-1)
    with pytest.raises(gl.ParameterError, match=r"last stage, here 'reverse', raises the displacement"):
        Cyclic(test=test, levels=(1e-5,), displacement="displacement", load="shear_stress").stages(blocks(2e-3))


@pytest.mark.thorough
def test_joint_in_tension_holds_its_strength_on_both_platens():
    result = gl.simulate(blocks(10e-3), COHESIVE, UniaxialTension(loading=gl.Constant(speed=0.01), maximum_strain=1e-3))
    assert result.summary["imbalance"] < 0.02
    assert result.summary["energy_error"] < 0.005


@pytest.mark.parametrize("test", [JointTension(), DirectShear(normal_stress=1e6)], ids=label)
def test_more_than_one_joint_is_refused(test):
    with pytest.raises(gl.ParameterError, match=rf"{label(test)}: the specimen has 40 grains, it must have two"):
        gl.simulate(small_sample(), COHESIVE, test)
    beside = gl.Specimen(Bricks(rows=1, columns=2).tessellate(rectangle(10e-3, 4e-3)), ROCK)
    with pytest.raises(gl.ParameterError, match=rf"{label(test)}: .*one on the other"):
        gl.simulate(beside, COHESIVE, test)


def test_bad_tests_are_refused():
    with pytest.raises(gl.ParameterError, match=r"unload_at = 6e-05 .* below maximum_opening = 5e-05"):
        JointTension(unload_at=60e-6)
    with pytest.raises(gl.ParameterError, match=r"normal_stress = -1"):
        DirectShear(normal_stress=-1)


@pytest.mark.thorough
def test_verify_agrees_with_theory_within_one_percent(tmp_path):
    done = CliRunner().invoke(verify, ["--out", str(tmp_path)])
    assert done.exit_code == 0, done.output
    rows = [line.rsplit(maxsplit=5) for line in done.output.splitlines() if line.endswith("%")]
    assert len(rows) == 22
    assert all(abs(float(row[-2])) < 1 for row in rows)
    theory = {row[0].strip(): float(row[2]) for row in rows}
    # The numbers of the published model, as worked out elsewhere: um, MPa, J/m2.
    published = {
        "peak tension (MPa)": 13, "at an opening of (um)": 0.336549, "tension at 10 um (MPa)": 7.028180,
        "broken at, exact L (um)": 30.2052, "work beyond the rise, L = 3 (J/m2)": 173.838,
        "peak shear (MPa)": 29, "at a slip of (um)": 0.834182, "shear at 20 um (MPa)": 6.598505,
        "residual shear (MPa)": 3.49955,
    }  # fmt: skip
    for name, value in published.items():
        assert theory[name] == pytest.approx(value, abs=1.1e-4, rel=5e-6), name
    assert {file.name for file in tmp_path.iterdir()} == {
        "verify_tension.png", "verify_shear.png", "verify.json",
    }  # fmt: skip
