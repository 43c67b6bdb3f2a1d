"""A law in numbers and pictures: closed forms of the cohesive crack, Mohr-Coulomb by hand, laws without a strength."""

import attrs
import numpy as np
import pytest
from faulty_laws import Divides
from support import STIFF, STRONG, Hillerborg

import grainlaw as gl
from grainlaw.laws import BandisClosure, BartonBandis, CamachoOrtiz, CohesiveCrack, Friction, Linear, MohrCoulomb
from grainlaw.workbench.characteristics import envelope
from grainlaw.workbench.driver import Contact
from grainlaw.workbench.shear_box import sheared

COHESIVE = CohesiveCrack(**STRONG, mode_i_energy=150, mode_ii_energy=300)
BRITTLE = MohrCoulomb(**STRONG)
TAN, RESIDUAL = np.tan(np.radians(54)), np.tan(np.radians(5))


@pytest.fixture(scope="module")
def cohesive():
    return gl.characteristics(COHESIVE)


def close(value):
    return pytest.approx(value, rel=1e-3)


def test_tension_of_the_cohesive_crack_is_its_closed_form(cohesive):
    mode = cohesive.tension
    assert (mode.peak, mode.displacement, mode.breaking) == (close(13e6), close(3.36549e-7), close(3.02052e-5))
    assert (mode.work_after_peak, mode.work) == (close(150), close(153.14258))
    assert mode.residual == 0
    assert np.isnan(mode.pressure)


def test_shear_of_the_cohesive_crack_is_its_closed_form(cohesive):
    mode = cohesive.shear[0]
    assert (mode.peak, mode.displacement, mode.breaking) == (close(29e6), close(8.34182e-7), close(2.76129e-5))
    assert (mode.work_after_peak, mode.work) == (close(300), close(317.3761))


@pytest.mark.parametrize("at", [1, 2, 3])
def test_shear_under_pressure_is_eqs_5_7_9(cohesive, at):
    mode = cohesive.shear[at]
    assert mode.pressure == (0, 14.5e6, 29e6, 58e6)[at]  # half, one and two times the cohesion
    strength = 29e6 + mode.pressure * TAN
    assert mode.peak == close(strength)
    assert mode.displacement == close(np.e * strength / 9.45e13)
    assert mode.residual == close(mode.pressure * RESIDUAL)


def test_mohr_coulomb_breaks_at_its_peak_and_takes_what_its_springs_hold():
    found = gl.characteristics(BRITTLE)
    assert found.stiffness == (1.05e14, 9.45e13)
    for mode, strength, stiffness in [
        (found.tension, 13e6, 1.05e14), *((m, 29e6 + m.pressure * TAN, 9.45e13) for m in found.shear),
    ]:  # fmt: skip
        assert mode.peak == close(strength)
        assert mode.displacement == close(strength / stiffness)
        assert mode.breaking == close(strength / stiffness)
        assert mode.work == close(strength**2 / (2 * stiffness))
        assert mode.work_after_peak == 0
    assert [mode.residual for mode in found.shear] == close([m.pressure * RESIDUAL for m in found.shear])


def test_pressure_is_held_while_a_contact_dilates():
    law = attrs.evolve(BRITTLE, residual_friction_angle=30, dilation_angle=10)
    for mode in gl.characteristics(law).shear[1:]:
        assert mode.residual == close(mode.pressure * np.tan(np.radians(30)))  # closure held, it would grow on
    run = sheared(Contact(law), -5e6, np.linspace(0, 1e-5, 500))
    lifted = run.opening[-1] - run.opening[0]
    slid = run.slip[-1] - run.shear[-1] / law.ks
    assert run.normal[-1] == pytest.approx(-5e6)
    assert lifted == pytest.approx(slid * np.tan(np.radians(10)), rel=1e-6)


@pytest.mark.thorough
def test_a_rough_joint_lifts_under_a_held_pressure_and_never_breaks():
    law = BartonBandis(**STIFF, friction_angle=54, dilation_angle=24.5, closure=BandisClosure(maximum_closure=5e-6))
    for mode in gl.characteristics(law).shear[1:]:
        assert (mode.peak, mode.residual) == (close(mode.pressure * TAN), close(mode.pressure * TAN))
        assert np.isnan([mode.breaking, mode.work]).all()


def test_tension_is_held_until_the_contact_fails():
    run = sheared(Contact(BRITTLE), 6.5e6, np.linspace(0, 1e-6, 1001))
    assert run.normal == pytest.approx(np.full(len(run.normal), 6.5e6))
    assert run.shear[-1] == pytest.approx(29e6 - 6.5e6 * TAN, rel=0.005)  # a step of slip is 0.5 % of it
    assert run.damage[-1] == 0


@pytest.mark.thorough
@pytest.mark.parametrize("law", [BRITTLE, COHESIVE], ids=["brittle", "cohesive"])
def test_the_envelope_is_a_straight_line_with_a_cut_off(law):
    found = envelope(law, pressure=100e6)
    assert (found.normal[0], found.normal[-1]) == (close(13e6), -100e6)
    assert found.peak == close(29e6 - found.normal * TAN)
    pressed = found.normal <= 0
    assert found.residual[pressed] == close(-found.normal[pressed] * RESIDUAL)
    assert np.isnan(found.residual[~pressed]).all()


def test_the_envelope_of_an_effective_traction_is_an_ellipse():
    law = CamachoOrtiz(**STIFF, tensile_strength=13e6, cohesion=29e6, residual_friction_angle=5, mode_i_energy=15,
                       mode_ii_energy=30)  # fmt: skip
    found = envelope(law)
    tension = found.normal[found.normal >= 0]
    assert tension[0] == close(13e6)
    assert found.peak[: len(tension)] == pytest.approx(29e6 * np.sqrt(1 - (tension / 13e6) ** 2), rel=5e-3, abs=29e4)


def test_a_law_that_never_fails_has_no_strength():
    found = gl.characteristics(Linear(**STIFF))
    for mode in (found.tension, *found.shear):
        assert np.isnan([mode.peak, mode.displacement, mode.breaking, mode.work, mode.residual]).all()
    assert len(envelope(Linear(**STIFF)).normal) == 0
    assert str(found).splitlines()[3].split() == ["tension", *"-" * 7]


def test_friction_holds_no_tension_and_never_breaks():
    found = gl.characteristics(Friction(**STIFF, friction_angle=30))
    assert found.tension.peak == found.shear[0].peak == 0
    for mode in found.shear[1:]:
        strength = mode.pressure * np.tan(np.radians(30))
        assert (mode.peak, mode.residual) == (close(strength), close(strength))
        assert mode.displacement == close(strength / 9.45e13)
        assert np.isnan([mode.breaking, mode.work]).all()


def test_a_user_s_law_is_known_by_its_own_hand_computed_numbers():
    mode = gl.characteristics(Hillerborg(**STIFF, strength=13e6, energy=50)).tension
    assert (mode.peak, mode.breaking, mode.work) == (close(13e6), close(100 / 13e6), close(50))


def test_the_table_shows_numbers_and_what_is_declared(cohesive):
    lines = str(cohesive).splitlines()
    assert lines[0] == "CohesiveCrack: first stiffness 1.05e+14 Pa/m normal, 9.45e+13 Pa/m shear"
    assert lines[3].split() == ["tension", "13", "0.3365", "30.21", "0", "153.1", "150", "150"]
    assert lines[4].split()[-4:] == ["0", "317.4", "300", "300"]
    assert lines[-1].split()[:4] == ["shear", "under", "58", "MPa"]
    assert lines[-1].endswith("-")
    assert len({len(line) for line in lines[1:]}) == 1


def test_what_cannot_be_looked_at_is_refused():
    with pytest.raises(gl.ParameterError, match="ContactLaw"):
        gl.characteristics(CohesiveCrack)
    with pytest.raises(gl.ParameterError, match="law of one contact"):
        gl.plot_law(attrs.evolve(BRITTLE, tensile_strength=np.full(4, 13e6)))


LAWS = [
    BRITTLE, COHESIVE, Linear(**STIFF), Friction(**STIFF, friction_angle=30),
    Hillerborg(**STIFF, strength=13e6, energy=50), attrs.evolve(COHESIVE, closure=BandisClosure(maximum_closure=1e-6)),
]  # fmt: skip


@pytest.mark.thorough
@pytest.mark.parametrize("law", LAWS, ids=lambda law: type(law).__name__)
def test_every_law_can_be_drawn(law):
    figure = gl.plot_law(law)
    assert len(figure.axes) == 6
    figure.canvas.draw()


def test_a_law_without_an_answer_at_rest_is_drawn():
    """At no opening it divides by zero: it cannot be sheared without pressure, and is pulled in vain."""
    pull, _, _, shear, *_ = gl.plot_law(Divides()).axes
    assert [text.get_text() for text in pull.texts] == ["nothing is held"]
    assert [len(line.get_xdata()) > 0 for line in shear.lines[1:]] == [False, True, True, True]


@pytest.mark.thorough
def test_the_picture_shows_the_strengths_of_the_law():
    pull, closure, strength, shear, normal, tangential = gl.plot_law(COHESIVE).axes

    def tops(axes):
        return sorted(float(np.nanmax(line.get_ydata())) for line in axes.lines if line.get_label()[0] != "_")

    def longest(axes):
        return max(axes.lines, key=lambda line: len(line.get_xdata()))

    assert longest(pull).get_ydata().max() == pytest.approx(13, rel=1e-3)
    assert longest(pull).get_xdata().max() > 30.2  # beyond the break
    assert pull.child_axes[0].get_xlim()[1] == pytest.approx(3 * 0.336549, rel=1e-3)  # the peak, magnified
    assert tops(shear) == pytest.approx([29, *(29 + p * TAN for p in (14.5, 29, 58))], rel=1e-2)
    assert tops(strength)[-1] == pytest.approx(29 + 58 * TAN, rel=1e-3)
    assert len(tops(normal)) == len(tops(tangential)) == 4
    slope = np.diff(longest(closure).get_ydata()) / np.diff(longest(closure).get_xdata())
    assert slope == pytest.approx(np.full(len(slope), 105), rel=1e-6)  # MPa/um
