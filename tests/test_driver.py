"""One contact driven alone: its work by hand, compiled as interpreted, and what happens to errors."""

import math

import attrs
import numpy as np
import pytest
from support import STIFF, Hillerborg

import grainlaw as gl
from grainlaw.compiler.batch import compile_law
from grainlaw.laws import Linear
from grainlaw.workbench.driver import Contact, alone, run_together, work_done

LAW = Hillerborg(**STIFF, strength=13e6, energy=50)
POINTS = [(0.0, 0.0), (2e-6, 1e-6), (1e-6, -1e-6), (-1e-7, 0.0)]


@attrs.frozen(kw_only=True)
class Inverse(gl.ContactLaw):
    """The opening over itself."""

    k: float = gl.parameter("Pa/m")
    stiffness = property(lambda self: (self.k, self.k))

    def traction(self, opening, slip):
        return self.k * opening * (opening / opening), self.k * slip


def test_work_is_the_area_under_a_polygon():
    displacement, traction = np.array([0.0, 1.0, 3.0, 2.0]), np.array([0.0, 4.0, 2.0, 6.0])
    assert work_done((displacement, traction)).tolist() == [0, 2, 8, 4]  # triangle, trapezium 6, and 4 given back
    # The second mode, read backwards: 8/2 for 1, 6/2 for -2, 4/2 for -1.
    assert work_done((displacement, traction), (displacement[::-1], traction[::-1])).tolist() == [0, 2 + 4, 2 + 4, 0]


def test_work_of_springs_is_half_k_u_squared():
    run = gl.trace(Linear(**STIFF), [0, 1e-6, 2e-6], [0, 0, 3e-6])
    assert run.work == pytest.approx([0, 1.05e14 * 0.5e-12, 1.05e14 * 2e-12 + 9.45e13 * 4.5e-12])


@pytest.mark.parametrize("compiled", [False, True])
def test_a_contact_answers_in_steps_as_along_a_path(compiled):
    contact = Contact(LAW, compiled=compiled)
    state, rows = contact.start, []
    for opening, slip in POINTS:
        rows.append(contact.step(opening, slip, state))
        state = rows[-1][2:]
    run = contact.trace(POINTS)
    assert np.array_equal(contact.run(POINTS), rows)
    assert np.array_equal(np.stack([run.normal, run.shear, run.damage, run.widest], axis=1), rows)
    assert rows[1][0] == pytest.approx(13e6 * (1 - (2e-6 - 13e6 / 1.05e14) / (100 / 13e6 - 13e6 / 1.05e14)))


def test_contacts_answer_together_as_each_alone():
    points = np.array([POINTS, POINTS[::-1], [(5e-6, 0.0)] * 4])
    together = run_together(compile_law(LAW), points)
    assert together.shape == (3, 4, 4)
    for path, answers in zip(points, together, strict=True):
        assert answers == pytest.approx(Contact(LAW).run(path.tolist()), rel=1e-12)


def test_an_error_of_the_law_becomes_nan_or_goes_through():
    contact = Contact(Inverse(k=1e14))
    assert np.isnan(contact.run([(0.0, 0.0)])).all()
    assert contact.error == "ZeroDivisionError: float division by zero"
    with pytest.raises(ZeroDivisionError):
        gl.trace(Inverse(k=1e14), 0.0, 0.0)
    assert math.isnan(gl.trace(Inverse(k=1e14), 0.0, 0.0, compiled=True).normal[0])


def test_a_trace_has_the_names_of_its_memory_and_no_other():
    run = gl.trace(LAW, [0, 1e-6], [0, 0])
    assert run.damage is run.memory["damage"]
    with pytest.raises(AttributeError, match="opening, slip, normal, shear, work and damage, widest; not gap"):
        _ = run.gap
    assert not hasattr(run, "_repr_latex_")  # which a notebook asks for


def test_a_path_without_points_has_an_answer_without_points():
    run = gl.trace(LAW, [], [])
    lengths = {len(values) for values in (run.opening, run.slip, run.normal, run.work, *run.memory.values())}
    assert lengths == {0}


@pytest.mark.parametrize(("opening", "slip"), [([0, 1e-6], [0, 0, 0]), ([[0, 1e-6]], 0.0)])
def test_what_is_no_path_is_refused(opening, slip):
    with pytest.raises(gl.ParameterError, match=r"trace: opening of shape .* and slip of shape .* are not allowed"):
        gl.trace(LAW, opening, slip)


class Bare(gl.ContactLaw):
    """A law that is no attrs class."""

    stiffness = (1.0, 1.0)

    def traction(self, opening, slip):
        return opening, slip


@attrs.frozen
class Numbers:
    """An attrs class that is no law."""

    kn: float = 1.0


@pytest.mark.parametrize("law", [Bare(), Numbers(), "linear", None], ids=lambda law: type(law).__name__)
def test_what_is_no_law_has_no_contact(law):
    with pytest.raises(
        gl.ParameterError, match=r"this takes an instance of an attrs class that is a gl\.ContactLaw, not"
    ):
        alone(law)


def test_a_law_of_many_contacts_has_no_single_one():
    with pytest.raises(gl.ParameterError, match="Linear: give the law of one contact, and give single numbers"):
        alone(Linear(kn=np.array([1e14, 2e14]), ks=1e14))
    with pytest.raises(gl.ParameterError, match="Linear: give the law of one contact, and give single numbers"):
        gl.trace(Linear(kn=np.array([1e14, 2e14]), ks=1e14), [0, 1e-6], 0.0)
