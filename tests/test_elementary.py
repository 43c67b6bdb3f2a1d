import math

import numpy as np
import pytest

from grainlaw.elementary import exp_bounded


@pytest.mark.parametrize("lowest", [-0.1, -1.0, -3.29, -8.0])
def test_exp_bounded_against_the_library(lowest):
    for x in np.linspace(lowest, 0.0, 2001):
        assert exp_bounded(float(x)) == pytest.approx(math.exp(x), rel=1e-14, abs=0)


def test_exp_of_nothing_is_exactly_one():
    assert exp_bounded(0.0) == 1.0
    assert exp_bounded(-0.0) == 1.0
