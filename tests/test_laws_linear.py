import pytest

from grainlaw.laws import Linear
from grainlaw.workbench.driver import trace


@pytest.mark.parametrize("compiled", [False, True])
def test_two_springs(compiled):
    t = trace(Linear(kn=2e11, ks=1e11), [0, 1e-5, -3e-5], [0, 2e-5, -1e-5], compiled=compiled)
    assert t.normal == pytest.approx([0, 2e6, -6e6])
    assert t.shear == pytest.approx([0, 2e6, -1e6])
    assert t.work == pytest.approx([0, 1e6 * 1e-5 + 1e6 * 2e-5, 90 + 5])  # the last is k u^2/2 of both
