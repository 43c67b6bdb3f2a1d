"""Contact at corners, at length: no energy from many frictionless collisions, no catching of a corner on a tip."""

import math

import numpy as np
import pytest
from bodies import GRAVITY, Motion, box, each, together
from scipy.spatial import ConvexHull

import grainlaw as gl
from grainlaw.geometry import block, moved
from grainlaw.laws import Friction

pytestmark = pytest.mark.slow
SMOOTH = Friction(kn=1e9, ks=1e9, friction_angle=0)


def test_many_collisions_keep_the_energy():
    changes = []
    for seed in range(200):
        generator = np.random.default_rng(seed)
        first, second = (p[ConvexHull(p).vertices] for p in generator.uniform(-0.5, 0.5, (2, 7, 2)))
        place = np.array([1.2, generator.uniform(-0.4, 0.4)])
        fields = generator.uniform((1, -1, -2, -2), (3, 1, 2, 2))
        motion = Motion(
            together(block(first), block(second + place)), SMOOTH, safety=0.3,
            velocity=each(fields[:3], (0, 0, fields[3])),
        )  # fmt: skip
        run = motion.run(0.8)
        changes.append(run["kinetic"][-1] / float(motion.state.freedoms.books.given[0]) - 1)
    changes = np.abs(changes)
    assert np.median(changes) < 1e-6
    assert np.quantile(changes, 0.98) < 1e-3
    assert changes.max() < 0.02  # acute corners that dig into each other, docs/theory.md


def test_a_corner_passes_over_the_tips_of_teeth():
    """Pulled slowly over teeth of 20 degrees: nowhere twice the weight times the slope (1.59 when written)."""
    slope = math.tan(math.radians(20))
    tooth = [(0, -0.5), (1, -0.5), (1, 0), (0.5, slope / 2), (0, 0)]
    teeth = [moved(block(tooth, f"tooth {k}"), by=(k, 0)) for k in range(4)]
    body = moved(box(0.6, 0.6, -0.3, -0.3), by=(1.0, 0.3 * math.sqrt(2)), turn=45)
    drive = gl.Drive(boundary="box", axis=0, speed=0.02, ramp=0.5)
    motion = Motion(
        together(*teeth, body), SMOOTH, gravity=(0, -GRAVITY), fixed=range(4), drives=[drive],
        detection=gl.Detection(damping=1.0), safety=0.3,
    )  # fmt: skip
    read = {
        "drag": lambda state: state.reaction("box")[0] / (2600 * 0.36 * GRAVITY * slope),
        "x": lambda state: state.moved("box")[0] % 1,
    }
    run = motion.run(40.0, 8000, **read)
    tip = np.abs(run["x"] - 0.5) < 0.1
    assert np.abs(run["drag"][tip]).max() < 2
