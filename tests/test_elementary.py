import math

import numpy as np
import pytest

from grainlaw.vector_math import exp_bounded, exp_unit


@pytest.mark.parametrize(
    ("exp", "lowest"), [(exp_unit, -1.0), (exp_bounded, -0.1), (exp_bounded, -3.29), (exp_bounded, -8.0)]
)
def test_exp_against_the_library(exp, lowest):
    for x in np.linspace(lowest, 0.0, 2001):
        assert exp(float(x)) == pytest.approx(math.exp(x), rel=1e-14, abs=0)


@pytest.mark.parametrize("exp", [exp_unit, exp_bounded])
def test_exp_of_nothing_is_exactly_one(exp):
    assert exp(0.0) == 1.0
    assert exp(-0.0) == 1.0
