"""The engine against the law: two blocks with one joint answer as the law does alone."""

import attrs
import numpy as np
import pytest
from support import ROCK, STRONG

import grainlaw as gl
from grainlaw.geometry import Bricks, rectangle
from grainlaw.laws import CohesiveCrack, MohrCoulomb
from grainlaw.protocols import UniaxialTension

COHESIVE = CohesiveCrack(**STRONG, mode_i_energy=150, mode_ii_energy=300)


@attrs.define
class Watch(gl.Observer):
    """What the contact points of the joint did."""

    rows: list = attrs.field(factory=list)

    def observe(self, state, curves, stage, progress):
        self.rows.append(np.array([state.opening, state.slip, state.normal, state.shear]))


@attrs.frozen(kw_only=True)
class Shear(gl.LoadingProtocol):
    """Press two blocks together, then slide the upper one over the lower one, and back."""

    closure: float
    slip: float
    speed: float = 0.02

    def stages(self, specimen):
        def drives(x, y):
            held = [gl.Drive(boundary="bottom", axis=axis, speed=0) for axis in (0, 1)]
            return [*held, gl.Drive(boundary="top", axis=0, speed=x), gl.Drive(boundary="top", axis=1, speed=y)]

        rest = self.closure / self.speed
        return [
            gl.Stage(name="press", drives=drives(0, -self.speed), until=[gl.Reaches("time", rest)], interval=rest / 20),
            gl.Stage(
                name="slide", drives=drives(self.speed, 0), until=[gl.Reaches("x", self.slip)],
                interval=self.slip / self.speed / 200,
            ),
            gl.Stage(  # every step is watched: between samples the trace would miss the farthest slip
                name="turn", drives=drives(-self.speed, 0), until=[gl.Reaches("back", self.slip / 30)], interval=1e-9,
            ),
            gl.Stage(
                name="back", drives=drives(-self.speed, 0), until=[gl.Reaches("back", self.slip / 2)],
                interval=self.slip / self.speed / 200,
            ),
        ]  # fmt: skip

    def measure(self, state):
        x = state.moved("top")[0]
        return {"x": x, "back": self.slip - x}

    def summary(self, curves, specimen):
        return {}


def blocks(height):
    return gl.Specimen(Bricks(rows=2, columns=1).tessellate(rectangle(10e-3, height)), ROCK)


def follow(law, watch):
    """Tractions (samples, p) of the joint's contact points, and of the law alone along their paths."""
    opening, slip, normal, shear = np.array(watch.rows).transpose(1, 0, 2)
    paths = [gl.trace(law, np.r_[0, o], np.r_[0, s]) for o, s in zip(opening.T, slip.T, strict=True)]
    return normal, shear, np.array([p.normal[1:] for p in paths]).T, np.array([p.shear[1:] for p in paths]).T


@pytest.mark.parametrize("law", [COHESIVE, MohrCoulomb(**STRONG)], ids=lambda law: type(law).__name__)
def test_joint_in_tension_follows_the_law(law):
    watch = Watch()
    test = UniaxialTension(speed=0.01, maximum_strain=3.2e-3, stop_fraction=0.0, samples=2000)
    result = gl.simulate(blocks(10e-3), law, test, observers=[watch])
    normal, _, alone, _ = follow(law, watch)
    assert np.abs(normal - alone).max() < 0.01 * law.tensile_strength
    if law is COHESIVE:
        assert result.summary["peak_stress"] == pytest.approx(13e6, rel=0.01)
        work = result.curves["energy_contacts_normal"][-1] / 10e-3
        assert work == pytest.approx(150 + 3.14258, rel=0.01)  # fracture energy and pre-peak work, J/m2


def test_joint_in_shear_follows_the_law_and_its_reversal():
    watch = Watch()
    gl.simulate(blocks(4e-3), COHESIVE, Shear(closure=8e-7, slip=30e-6), observers=[watch])
    normal, shear, alone_normal, alone = follow(COHESIVE, watch)
    strength = STRONG["cohesion"] + np.abs(normal).max() * np.tan(np.radians(54))
    assert np.abs(normal - alone_normal).max() < 0.01 * np.abs(normal).max()
    assert np.abs(shear - alone).max() < 0.01 * strength
    way = -shear  # the lower block is A, its upper edge runs to the left
    assert way.max() > 0.95 * strength
    friction = normal[-1] * np.tan(np.radians(5))  # has followed the reversal
    assert way[-1].sum() == pytest.approx(friction.sum(), rel=1e-3)


def test_joint_in_tension_holds_its_strength_on_both_platens():
    result = gl.simulate(blocks(10e-3), COHESIVE, UniaxialTension(speed=0.01, maximum_strain=1e-3))
    assert result.summary["platen_imbalance"] < 0.02
    assert result.summary["energy_error"] < 0.005
