"""Contact at corners, at length: no energy from many frictionless collisions, no catching of a corner on a tip."""

import numpy as np
import pytest
from scenes import SLOWLY, over_teeth, thrown_at_random

pytestmark = pytest.mark.slow


def test_many_collisions_keep_the_energy():
    changes = []
    for seed in range(200):
        run, given = thrown_at_random(seed)
        changes.append(abs(run["kinetic"][-1] / given - 1))
    assert np.median(changes) < 1e-6
    assert np.quantile(changes, 0.98) < 1e-3
    assert max(changes) < 0.02  # acute corners that dig into each other, docs/theory.md


def test_a_corner_passes_over_the_tips_of_teeth():
    """Pulled slowly over teeth of 20 degrees: nowhere twice the weight times the slope (1.6 when written)."""
    _, run = over_teeth(20, **SLOWLY)
    assert np.abs(run["drag"][np.abs(run["x"] - 0.5) < 0.1]).max() < 2
