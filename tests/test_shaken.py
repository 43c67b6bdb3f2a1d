"""Bricks that are shaken without damping: contacts open, close, rub and break, and give back no more than they took."""

import attrs
import pytest
from scenes import UNDAMPED, Shaken, bricks, taken
from support import STIFF
from test_laws_properties import LAWS

import grainlaw as gl
from grainlaw.laws import Friction, MohrCoulomb
from grainlaw.results.certificate import doubts, fails
from grainlaw.units import MPa, mm

#: laws without an energy behind them, which make some in any step
LOSSLESS = {name: law for name, law in LAWS.items() if "energy" not in law.exceptions}


@pytest.mark.thorough
@pytest.mark.parametrize("law", LOSSLESS.values(), ids=LOSSLESS)
def test_contacts_take_more_than_they_give(law):
    result = gl.simulate(bricks(), law, Shaken(), frames=1)
    assert taken(result).min() > -1e-4
    assert not fails("energy_returned", result.summary["energy_returned"])
    assert result.summary["energy_error"] < 1e-4


def test_a_step_too_long_for_contacts_that_open_is_told():
    """Without friction nothing takes energy: what is in motion and in springs grows, and the ledger closes."""
    law = Friction(kn=1e15, ks=1e15, friction_angle=0)
    long, usual = (
        gl.simulate(bricks(), law, Shaken(integrator=integrator), frames=1)
        for integrator in (attrs.evolve(UNDAMPED, safety=0.9), UNDAMPED)
    )
    assert taken(long).min() < -0.1
    assert long.summary["energy_error"] < 1e-4
    assert long.summary["energy_returned"] == pytest.approx(-taken(long).min(), rel=0.5)
    assert any("open and close within a step" in words for words in doubts(long))
    assert taken(usual).min() > -1e-4


@pytest.mark.thorough
def test_a_bar_that_is_torn_breaks_into_as_many_pieces_with_half_the_step():
    law = MohrCoulomb(**STIFF, tensile_strength=13 * MPa, cohesion=29 * MPa, friction_angle=40)
    bar = bricks(1, 200, (200 * mm, 1 * mm))
    counts = [
        int(gl.simulate(bar, law, Shaken(apart=True, speed=30.0, duration=2e-4), frames=1, time_step_factor=factor)
            .curves["tensile_cracks"][-1])
        for factor in (1.0, 0.5)
    ]  # fmt: skip
    assert counts[0] == pytest.approx(counts[1], rel=0.02)
    assert 10 < counts[0] < 2 * 199
