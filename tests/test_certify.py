"""The quasi-static limit of a strength from two speeds."""

import json

import attrs
import pytest
from command_line import invoke
from support import ROCK, STRONG

import grainlaw as gl
from grainlaw.geometry import Bricks, rectangle
from grainlaw.laws import MohrCoulomb
from grainlaw.protocols import Cyclic, DirectShear, FreeMotion, UniaxialCompression
from grainlaw.runs.certify import QuasiStaticLimit, slower
from grainlaw.units import MPa, mm, um


def test_the_limit_is_richardsons():
    """A peak of 100 with an excess of 8 at the speed and 4 at half of it."""
    found = QuasiStaticLimit(name="strength", strength=108 * MPa, slower=104 * MPa)
    assert found.limit == pytest.approx(100 * MPa)
    assert found.error == pytest.approx(4 * MPa)
    assert "8.0% off" in str(found)
    wild = QuasiStaticLimit(name="strength", strength=2 * MPa, slower=1 * MPa)
    assert str(wild).endswith("too far apart to tell a quasi-static limit")


@pytest.mark.thorough
def test_a_joint_tends_to_its_strength():
    blocks = gl.Specimen(Bricks(rows=2).tessellate(rectangle(10 * mm, 4 * mm)), ROCK)
    test = DirectShear(normal_stress=5 * MPa, maximum_slip=15 * um, loading=gl.Constant(speed=0.2))
    found = gl.certify(blocks, MohrCoulomb(**STRONG), test)
    strength = 29 * MPa + 5 * MPa * 1.3763819204711735  # cohesion and friction of 54 degrees
    assert found.limit == pytest.approx(strength, rel=0.01)
    assert found.strength != found.slower


def test_half_the_speed_of_every_loading():
    quick, steady = gl.Adaptive(rate=0.002), gl.Constant(speed=0.1, ramp=1e-4)
    assert slower(UniaxialCompression(loading=quick)).loading == attrs.evolve(quick, rate=0.001)
    inner = slower(Cyclic(test=UniaxialCompression(loading=steady), levels=(1e-3,))).test
    assert inner.loading == gl.Constant(speed=0.05, ramp=2e-4)
    with pytest.raises(gl.ParameterError, match="certify: FreeMotion has no loading"):
        slower(FreeMotion(duration=1.0))


@pytest.mark.thorough
def test_the_command_says_what_a_strength_tends_to(tmp_path):
    result = invoke("test", "direct-shear", "--certify", "--out", tmp_path, "--law", "mohr-coulomb",
                    "--set", "test.normal_stress=5 MPa", "--set", "test.maximum_slip=10 um")  # fmt: skip
    assert result.exit_code == 0, result.output
    assert "quasi-static limit" in result.output
    found = json.loads((tmp_path / "certificate.json").read_text())
    assert found["limit"] == pytest.approx(2 * found["slower"] - found["strength"])
