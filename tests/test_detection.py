"""Bodies find each other by the law that is given, stop when they overlap too deeply, and refuse what cannot be."""

import attrs
import numpy as np
import pytest
from bodies import FACES, box, each, together

import grainlaw as gl
from grainlaw.engine.model import Model
from grainlaw.geometry import Bricks, rectangle
from grainlaw.laws import Friction, MohrCoulomb, WeibullField


@attrs.frozen(kw_only=True)
class Crash(gl.LoadingProtocol):
    """A block thrown at another."""

    speed: float = gl.parameter("m/s")

    def stages(self, specimen):
        thrown = each(*[(self.speed, 0)] * (specimen.grains.count - 1), (0, 0))
        return [gl.Stage(name="crash", until=[gl.conditions.Reaches("time", 0.05)], interval=1e-3,
                         integrator=gl.integration.CentralDifference(damping=gl.integration.Undamped(), safety=0.9),
                         loads=[gl.loads.InitialVelocity(velocity=thrown(specimen))])]  # fmt: skip

    def measure(self, state):
        return {"speed": float(state.velocity[0, 0])}

    def summary(self, curves, specimen):
        return {"speed": curves["speed"][-1]}


TWO = gl.Specimen(together(box(1, 1), box(1, 1, 1.05, 0.2, "other")), gl.Rigid(density=2600))


def test_too_deep_an_overlap_stops_with_the_pair_and_keeps_the_result():
    with pytest.raises(
        gl.OverlapError, match=r"grains 0 and 1 overlap by .* allowed \(largest_overlap = 0.002"
    ) as info:
        gl.simulate(TWO, FACES, Crash(speed=2.0), detection=gl.Detection(largest_overlap=2e-3))
    assert 0.02 < info.value.result.curves["time"][-1] < 0.03


def test_without_detection_bodies_pass_through_each_other():
    assert gl.simulate(TWO, FACES, Crash(speed=5.0), detection=None).summary["speed"] == 5.0
    assert gl.simulate(TWO, FACES, Crash(speed=5.0)).summary["speed"] < 1


@pytest.mark.parametrize(
    ("name", "value"),
    [("skin", 0), ("skin", 1.5), ("hand_over", 0), ("hand_over", 2), ("largest_overlap", 0), ("largest_overlap", 0.6),
     ("damping", -0.1), ("damping", 1.1), ("skin", float("nan")), ("law", "friction"), ("law", {(0, 0): 3})],
)  # fmt: skip
def test_detection_refuses(name, value):
    with pytest.raises(gl.ParameterError, match=name):
        gl.Detection(**{name: value})


def test_a_missing_law_is_refused_before_any_work():
    grains = together(box(1, 1), attrs.evolve(box(1, 1, 1.05, 0.2, "other"), phase=np.array([1])))
    specimen = gl.Specimen(grains, gl.Rigid(density=2600))
    laws = {(0, 0): FACES, (1, 1): FACES}
    with pytest.raises(gl.ParameterError, match=r"no law is given for contacts between the phases 0 and 1"):
        gl.simulate(specimen, laws, Crash(speed=1.0))
    met = gl.simulate(specimen, laws | {(0, 1): FACES}, Crash(speed=5.0))
    assert met.summary["speed"] < 1
    given_apart = gl.simulate(specimen, laws, Crash(speed=5.0), detection=gl.Detection(law=FACES))
    assert given_apart.summary["speed"] == met.summary["speed"]


def test_laws_of_contacts_are_those_of_pairs_of_phases_that_can_meet():
    """All but a phase with itself that only one grain has."""
    grains = together(*(box(1, 1, 1.5 * k, name=f"rim {k}") for k in range(4)))
    specimen = gl.Specimen(attrs.evolve(grains, phase=np.array([0, 1, 1, 2])), gl.Rigid(density=2600))
    own = Friction(kn=2e9, ks=2e9, friction_angle=20)
    model = Model(specimen, {(1, 1): own}, gl.Detection(law={(0, 1): FACES, (0, 2): FACES, (1, 2): FACES}))
    assert {pair: group.law for pair, group in model.contacts.items()} == {
        (0, 1): FACES, (0, 2): FACES, (1, 1): own, (1, 2): FACES,
    }  # fmt: skip


def test_a_law_that_differs_from_contact_to_contact_meets_with_its_mean():
    """Random strength of the bonds (Weibull): contacts take the law with its means."""
    bonded = MohrCoulomb(
        kn=1e9, ks=1e9, tensile_strength=1e5, cohesion=4e5, friction_angle=40, residual_friction_angle=30
    )
    grains = together(Bricks(rows=2).tessellate(rectangle(1, 1)), box(1, 1, 1.05, 0.2, "other"))
    specimen = gl.Specimen(grains, gl.Rigid(density=2600))
    varied = WeibullField(modulus=5).scatter(bonded, specimen)
    assert np.ndim(varied.tensile_strength) == 1
    met, uniform = (gl.simulate(specimen, law, Crash(speed=2.0)).summary["speed"] for law in (varied, bonded))
    assert met == pytest.approx(uniform, rel=1e-6)
    assert met < 1.9
