"""Coulomb's limit with dashpots: it applies to the whole normal force, that of the spring and that of the dashpot."""

import numpy as np
import pytest
from bodies import RIGID, SOFT, gap
from scenes import RUBBING, TAN_30, grazed, thrown_at_floor


@pytest.mark.thorough
@pytest.mark.parametrize("material", [RIGID, SOFT], ids=["rigid", "deformable"])
@pytest.mark.parametrize("law", RUBBING.values(), ids=RUBBING)
@pytest.mark.parametrize("degrees", [0, 20])
@pytest.mark.parametrize("damping", [0.3, 1.0])
def test_shear_is_at_most_friction_times_the_whole_normal_force(law, material, degrees, damping):
    """An oblique impact: the dashpot first adds to the force of the spring, then takes from it."""
    forces, run = thrown_at_floor(law, material, degrees, damping)
    pressure, shear = forces.T
    assert len(forces) > 20
    assert pressure.min() >= -1e-12 * pressure.max()  # the dashpot does not pull
    assert (shear <= TAN_30 * pressure + 1e-9 * shear.max()).all()
    assert np.count_nonzero((shear > 0.99 * TAN_30 * pressure) & (pressure > 0)) >= 10  # and it reaches the limit
    energy = run["kinetic"][0]
    assert gap(run).max() < 1e-3 * energy
    assert min(run["damping"].min(), run["contacts_shear"].min()) >= -1e-9 * energy
    assert run["kinetic"].max() <= energy * (1 + 1e-6)


@pytest.mark.parametrize("damping", [0.1, 0.5, 1.0])
def test_an_impact_that_slides_all_the_time_has_coulombs_ratio_of_impulses(damping):
    """Where a contact slides from first to last its impulses are as its forces: tan(phi), whatever the restitution."""
    assert grazed(damping) == pytest.approx(TAN_30, rel=2e-3)
