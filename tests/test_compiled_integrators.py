"""Integrators compiled: the same numbers as interpreted, the same bits however freedoms are split."""

import attrs
import numpy as np
import pytest
from support import STIFF, small_sample

import grainlaw as gl
from grainlaw.compiler.batch import compile_integrator
from grainlaw.compiler.structure import other_numbers, structure
from grainlaw.integration import CentralDifference, DynamicRelaxation, Integrator, LocalDamping, MassDamping, Undamped
from grainlaw.laws import Linear
from grainlaw.protocols import UniaxialTension


@attrs.frozen(kw_only=True)
class Free(Integrator):
    """The example of the interface's docstring."""

    def step(self, force, change, velocity, mass, time_step):
        return velocity + force / mass * time_step, 0.0

    def stable_step(self, highest_frequency):
        return 0.9 * 2 / highest_frequency


@attrs.frozen(kw_only=True)
class Drifting(Free):
    """One that moves by a rule of its own, with a number of its own."""

    drift: float = gl.parameter("m/s", default=0.5)

    def move(self, displacement, velocity, time_step):
        return displacement + (velocity + self.drift) * time_step


def advance(integrator, cuts=(), count=40):
    """One step of ``count`` freedoms, driven and free, in the pieces between ``cuts``."""
    import ctypes

    compiled = compile_integrator(integrator)
    rng = np.random.default_rng(2)
    arrays = [rng.normal(size=count) for _ in range(8)]
    arrays[4] = np.abs(arrays[4]) + 1
    arrays[5] = (arrays[5] > 0).astype(float)
    arrays[6] *= 1 - arrays[5]
    parameters = np.append(compiled.numbers, 0.25)
    call = ctypes.CFUNCTYPE(None, *(ctypes.c_int64,) * 10)(compiled.address)
    before = [a.copy() for a in arrays]
    for part in np.split(np.arange(count), list(cuts)):
        call(parameters.ctypes.data, *(a.ctypes.data + 8 * int(part[0]) for a in arrays), len(part))
    return before, arrays


INTEGRATORS = [
    Free(), Drifting(), CentralDifference(), CentralDifference(damping=Undamped()),
    CentralDifference(damping=MassDamping(coefficient=0.3)), CentralDifference(damping=LocalDamping()),
    DynamicRelaxation(),
]  # fmt: skip


@pytest.mark.thorough
@pytest.mark.parametrize("integrator", INTEGRATORS, ids=lambda i: f"{type(i).__name__}")
def test_integrators_compiled_are_interpreted(integrator):
    before, after = advance(integrator)
    assert np.array_equal(after[1], before[0])  # the force is that of the step before for the next
    for force, earlier, v, u, mass, free, imposed, loss, new_v, new_u, new_loss in zip(
        *before, after[2], after[3], after[7], strict=True
    ):
        expected, damping = integrator.step(force, force - earlier, v, mass, 0.25)
        expected = expected if free else imposed
        assert new_v == pytest.approx(expected, rel=1e-12)
        drift = 0.5 if isinstance(integrator, Drifting) else 0.0
        assert new_u == pytest.approx(u + 0.25 * (expected + drift), rel=1e-12, abs=1e-14)
        assert new_loss == pytest.approx(loss - free * damping * 0.125 * (v + expected), rel=1e-12, abs=1e-14)


@pytest.mark.parametrize("integrator", INTEGRATORS, ids=lambda i: f"{type(i).__name__}")
def test_integrators_split_unevenly_give_the_same_bits(integrator):
    whole = np.array(advance(integrator)[1])
    for n in range(1, 40):
        assert np.array_equal(np.array(advance(integrator, [n])[1]), whole)


def test_an_integrator_of_ones_own_runs():
    test = UniaxialTension(maximum_strain=2e-5, samples=20, integrator=Free())
    own = gl.simulate(small_sample(12), Linear(**STIFF), test)
    undamped = attrs.evolve(test, integrator=CentralDifference(damping=Undamped()))
    theirs = gl.simulate(small_sample(12), Linear(**STIFF), undamped)
    assert own.summary["steps"] == theirs.summary["steps"]
    assert np.allclose(own.curves["stress"], theirs.curves["stress"], rtol=1e-6)


@attrs.frozen(kw_only=True)
class Switched(Free):
    """One whose flag is a constant of its code."""

    reverse: bool = False
    limit: float = gl.parameter("N", default=1.0)

    @property
    def strict(self):
        return self.limit > 5

    def step(self, force, change, velocity, mass, time_step):
        if self.reverse or self.strict:
            return velocity - force / mass * time_step, self.limit
        return velocity + force / mass * time_step, 0.0


OTHERS = {
    "a number": (Drifting(), Drifting(drift=2.0), True),
    "a number of a part": (
        DynamicRelaxation(),
        DynamicRelaxation(damping=MassDamping(coefficient=3)),
        True,
    ),
    "nothing": (Drifting(), Drifting(), True),
    "a class": (Free(), Drifting(), False),
    "the class of a part": (
        CentralDifference(),
        CentralDifference(damping=Undamped()),
        False,
    ),
    "a flag": (Switched(), Switched(reverse=True), False),
    "a flag that follows from a number": (Switched(), Switched(limit=6.0), False),
}


@pytest.mark.parametrize("case", OTHERS)
def test_numbers_go_into_the_code_of_an_integrator_that_differs_in_nothing_else(case):
    one, other, same = OTHERS[case]
    found = other_numbers(structure(one, "step", "move"), other)
    assert found == (numbers_of(structure(other, "step", "move")) if same else None)


def numbers_of(struct):
    return [getattr(part.component, name) for part in struct for name in part.numbers]


@pytest.mark.thorough
@pytest.mark.parametrize("case", OTHERS)
def test_an_integrator_with_other_numbers_takes_the_code_of_the_one_before(case):
    one, other, same = OTHERS[case]
    before, anew = compile_integrator(one), compile_integrator(other)
    found = compile_integrator(other, before)
    assert (found.key, found.address, found.numbers.tolist()) == (anew.key, anew.address, anew.numbers.tolist())
    assert (found.structure is before.structure) == same
