"""A contact driven in steps as fine as its tractions ask for.

A jump of a traction is a step that stays large however often it is halved. So the work is exact at a brittle drop too.
"""

from __future__ import annotations

import itertools
import math

import attrs
import numpy as np

from grainlaw.workbench.driver import Contact, work_done
from grainlaw.workbench.paths import Corners
from grainlaw.workbench.scale import Scale

COARSEST, FINEST = 1 / 12, 2.0**-22  #: steps, as shares of a leg
BEFORE_PEAK = 1e-4  #: the finest step over the displacement of the nearer peak, where the leg is far longer
MOST_JUMPS, MOST_STEPS = 12, 20_000  #: of a path; then it goes on in coarse steps


@attrs.frozen
class Jump:
    """A change of a traction (Pa) that does not get smaller with the step."""

    opening: float
    slip: float
    size: float
    kind: str  #: "normal" or "shear"


@attrs.frozen(eq=False)
class Response:
    """The answer along a path: arrays over its steps, and where each corner is among them."""

    name: str
    points: np.ndarray  #: (i, 2), opening and slip
    answers: np.ndarray  #: (i, 2 + m)
    corners: list[int]  #: as far as the answers are finite
    legs: int  #: number of legs requested
    jumps: list[Jump]

    @property
    def complete(self) -> bool:
        """Whether all answers were finite."""
        return len(self.corners) == self.legs + 1

    @property
    def work(self) -> np.ndarray:
        """J/m2 done on the contact since the start."""
        return work_done(*((self.points[:, mode], self.answers[:, mode]) for mode in (0, 1)))


def drive(contact: Contact, name: str, corners: Corners, scale: Scale) -> Response:
    """Drive a virgin contact through ``corners``, refining each step until the tractions change little or jump."""
    at, legs = corners[0], len(corners) - 1
    answer = contact.step(*at, contact.start)
    points, answers, reached = [at], [answer], [0]
    jumps: list[Jump] = []
    nearer = min(scale.tension.displacement, scale.shear.displacement)
    for start, end in itertools.pairwise(corners):
        x, h, finest = 0.0, COARSEST, min(FINEST, BEFORE_PEAK * nearer / (math.dist(start, end) or nearer))
        while x < 1:
            share = min(x + h, 1.0)
            trial = (start[0] + (end[0] - start[0]) * share, start[1] + (end[1] - start[1]) * share)
            new = contact.step(*trial, answer[2:])
            if not all(map(math.isfinite, new)):
                return Response(name, np.array(points), np.array(answers), reached, legs, jumps)
            limit = scale.pulled if trial[0] > 0 or points[-1][0] > 0 else scale.pressed
            normal, shear = abs(new[0] - answer[0]) / limit, abs(new[1] - answer[1]) / scale.sheared
            change = max(normal, shear)
            fine = len(jumps) < MOST_JUMPS and len(points) < MOST_STEPS
            if change > 1 and fine and h > finest:
                h /= 2
                continue
            if change > 1 and fine:
                size = abs(new[0] - answer[0]) if normal > shear else abs(new[1] - answer[1])
                jumps.append(Jump(*trial, size, "normal" if normal > shear else "shear"))
                h = COARSEST
            elif change < 0.5 or not fine:
                h = min(2 * h, COARSEST)
            x, answer = share, new
            points.append(trial)
            answers.append(new)
        reached.append(len(points) - 1)
    return Response(name, np.array(points), np.array(answers), reached, legs, jumps)
