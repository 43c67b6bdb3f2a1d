"""A stage that waits for rest ends where the closed form says that the specimen comes to rest, not on the way there."""

import attrs
import numpy as np
import pytest
from support import ROCK

import grainlaw as gl
from grainlaw.conditions import AtRest, ComesTo, FailsTo, FallsTo, Lasts, Reaches
from grainlaw.geometry import Bricks, Voronoi, plate_with_hole, rectangle
from grainlaw.integration import CentralDifference, DynamicRelaxation, Integrator
from grainlaw.laws import Linear
from grainlaw.loads import Drive, Hold, InitialVelocity
from grainlaw.protocols import Excavation

STRESS, HEIGHT, ROWS, KN = 1e6, 80e-3, 40, 1e14


@attrs.frozen(kw_only=True)
class Rest(gl.LoadingProtocol):
    """A column stands on its bottom and is loaded until it rests: from above, or by the joints' shear."""

    ramp: float
    ratio: float
    axis: int = 1
    interval: float = 5e-6
    drift: float = 0.0
    integrator: Integrator = CentralDifference()

    def stages(self, specimen):
        load = Hold(boundary="top", axis=self.axis, stress=-STRESS, ramp=self.ramp)
        held = [Drive(boundary="bottom", axis=axis, speed=0.0) for axis in {1, self.axis}]
        if self.axis == 0:
            held.append(Drive(boundary="top", axis=1, speed=0.0))
        drift = InitialVelocity(velocity=np.tile([self.drift, 0.0], (len(specimen.mesh.nodes), 1)))
        return [gl.Stage(name="rest", loads=[load, *held, drift], until=[AtRest(self.ratio)], interval=self.interval,
                         integrator=self.integrator, sample_limit=5000)]  # fmt: skip

    def measure(self, state):
        return {"moved": -float(state.displacement[state.mesh.boundaries["top"], self.axis].mean()),
                "slip": float(state.slip.mean())}  # fmt: skip

    def summary(self, curves, specimen):
        return {}


def column(rows, width):
    return gl.Specimen(Bricks(rows=rows, columns=1).tessellate(rectangle(width, HEIGHT)), ROCK)


@pytest.mark.thorough
@pytest.mark.parametrize("integrator", [CentralDifference(), DynamicRelaxation()], ids=["damped", "relaxed"])
@pytest.mark.parametrize("ramp", [1e-5, 1e-3])
def test_a_long_column_is_at_rest_where_it_is_shortened(ramp, integrator):
    """By forces alone it was at rest 11 % too early where relaxation is slow, and 97 % while the load still rose."""
    shortened = STRESS * (HEIGHT * (1 - ROCK.poissons_ratio**2) / ROCK.youngs_modulus + (ROWS - 1) / KN)
    test = Rest(ramp=ramp, ratio=1e-3, integrator=integrator)
    curves = gl.simulate(column(ROWS, 2e-3), Linear(kn=KN, ks=KN), test).curves
    assert curves["moved"][-1] == pytest.approx(shortened, rel=0.01)
    assert curves["time"][-1] > ramp
    assert curves["time"][-1] < ramp + 1e-3


@pytest.mark.thorough
def test_a_joint_is_at_rest_where_its_spring_is():
    """Stress over stiffness; by forces alone the slip was 42 % short of it."""
    ks = 1e11
    curves = gl.simulate(column(2, 40e-3), Linear(kn=KN, ks=ks), Rest(axis=0, ramp=2e-3, ratio=2e-4)).curves
    assert abs(curves["slip"][-1]) == pytest.approx(STRESS / ks, rel=2e-3)


def test_a_specimen_that_drifts_as_a_whole_is_at_rest():
    law, test = Linear(kn=KN, ks=KN), Rest(ramp=1e-5, ratio=1e-3)
    still, drifting = (gl.simulate(column(ROWS, 2e-3), law, attrs.evolve(test, drift=v)).curves for v in (0, 1e-2))
    assert drifting["moved"][-1] == pytest.approx(still["moved"][-1], rel=0.02)
    assert drifting["time"][-1] < 3 * still["time"][-1]


def test_a_rock_without_stress_is_at_rest():
    """An opening in it, and a fluid that is pumped into the opening, need not wait for what never comes."""
    plate = gl.Specimen(Voronoi(grains=20, seed=1).tessellate(plate_with_hole(0.1, 0.1, 0.04, sides=8)), ROCK)
    curves = gl.simulate(plate, Linear(kn=KN, ks=KN), Excavation(xx=0.0, yy=0.0, samples=10)).curves
    assert not curves["width"].any()
    assert np.count_nonzero(curves["stage"] == 0) == 3
    assert not curves["unbalanced"].any()


def rest(unbalanced, motion, ratio=0.1):
    count = len(unbalanced)
    return AtRest(ratio).progress({"time": np.arange(count), "unbalanced": np.array(unbalanced),
                                      "motion": np.array(motion)})  # fmt: skip


def test_forces_and_motion_must_both_stay_small():
    low, high = [0.05] * 5, [0.05, 0.05, 0.3, 0.05, 0.05]  # where it turns round, or passes its place of rest
    assert rest(low, low) == 1
    assert rest(low[:2], low[:2]) == 0
    assert rest(low, high) == rest(high, low) == pytest.approx(1 / 3)
    assert rest([*high, 0.05], low + low[:1]) == 1
    assert rest([0, 0, 0], [0, 0, 0]) == 1


def test_how_far_a_stage_is_by_hand():
    def progress(condition, *values):
        return condition.progress({"load": np.array(values, dtype=float)})

    assert progress(Reaches("load", 4.0), 9, 3, 1) == 0.25
    for end, start in ((60.0, 20.0), (-20.0, 20.0), (20.0, -20.0)):
        assert progress(ComesTo("load", end), start, 7.0, (start + end) / 2) == pytest.approx(0.5)
        assert progress(ComesTo("load", end), start, start) == 0
        assert progress(ComesTo("load", end), start, end) == 1
    assert progress(ComesTo("load", 20.0), 20.0, 25.0) == 1  # it was there
    for values, falls in (((0, 8, 4), 1), ((0, 8, 4.1), 0), ((8, 2, 9), 0), ((-1, -4), 0), ((0, 0), 0), ((4, 8), 0)):
        assert progress(FallsTo("load", 0.5), *values) == falls


@pytest.mark.parametrize("share", [(1, 0), (0, 1), (1, 1)], ids=["in tension", "in shear", "in both"])
def test_a_fall_is_a_failure_if_a_contact_has_broken_in_this_stage(share):
    def progress(cracks, stage):
        columns = {"load": [8, 9, 4], "stage": [stage] * 3}
        columns |= {
            kind: np.array(cracks) * k for kind, k in zip(("tensile_cracks", "shear_cracks"), share, strict=True)
        }
        return FailsTo("load", 0.5).progress({name: np.array(column) for name, column in columns.items()})

    assert [progress(cracks, 0) for cracks in ([0, 0, 0], [0, 0, 1], [1, 1, 1])] == [0, 1, 1]
    assert [progress(cracks, 1) for cracks in ([2, 2, 2], [2, 2, 3])] == [0, 1]


def test_a_stage_lasts_from_its_own_begin():
    """The first sample of a stage is one interval after it began, and it ends with the first that is late enough."""

    @attrs.frozen(kw_only=True)
    class PullAndHold(Rest):
        def stages(self, specimen):
            held, pulled = Drive(boundary="bottom", axis=1, speed=0.0), Drive(boundary="top", axis=1, speed=0.01)
            still = attrs.evolve(pulled, speed=0.0)
            weight = Hold(boundary="top", axis=1, stress=STRESS)
            return [
                gl.Stage(name="weigh", loads=[held, weight], until=[AtRest(1e-3)], interval=5e-6, static=True),
                gl.Stage(name="pull", loads=[held, pulled], until=[Lasts(2e-5)], interval=5e-6),
                gl.Stage(name="hold", loads=[held, still], until=[Lasts(duration=1e-5)], interval=2e-6),
            ]

    curves = gl.simulate(column(3, 2e-3), Linear(kn=KN, ks=KN), PullAndHold(ramp=0.0, ratio=1.0)).curves
    ends = [curves["time"][curves["stage"] == stage][-1] for stage in range(3)]
    pulled, held = np.diff(ends)
    assert 2e-5 <= pulled < 2.5e-5
    assert 1e-5 <= held < 1.2e-5
    assert "stage_time" not in curves
