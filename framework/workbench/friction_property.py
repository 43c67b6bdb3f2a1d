"""What :func:`grainlaw.check_law` asks of friction: more pressure holds no less, and shear opposes slip."""

from __future__ import annotations

import functools
import itertools
from collections.abc import Iterator

import numpy as np

from grainlaw.workbench.bench import Bench
from grainlaw.workbench.finding import Finding, place, words
from grainlaw.workbench.paths import even_steps
from grainlaw.workbench.refined import Response, drive
from grainlaw.workbench.scale import Scale


def friction(bench: Bench) -> Finding | None:
    """Shear strength, intact or broken, does not fall as the pressure rises; friction opposes slip."""
    scale = bench.scale
    moved = creep(bench)
    if moved:
        return moved
    histories = {"shear": [(0.0, 0.0)], "break by pulling, shear": [(0.0, 0.0), (1.1 * scale.tension.breaking, 0.0)]}
    for history, before in histories.items():
        runs = []
        for closure in scale.closures:
            corners = [*before, (-closure, 0.0), (-closure, scale.far), (-closure, 0.0), (-closure, -scale.far)]
            run = drive(bench.contact, history, corners, scale)
            if not run.complete:
                return Finding(f"{history}: no finite answer beyond {place(run.points[-1])}")
            runs.append(run)
        for finding in itertools.chain(
            weakening(runs, scale, history), map(functools.partial(driven_by_shear, scale), runs)
        ):
            if finding:
                return finding
    return pressed_while_sliding(bench)


def creep(bench: Bench) -> Finding | None:
    """Shear traction that goes on changing while nothing moves, as where plastic slip stops short of the strength."""
    scale = bench.scale
    for closure, peak in zip(scale.closures, scale.sheared_under, strict=True):
        path = even_steps([(0.0, 0.0), (-closure, 0.0), (-closure, 1.5 * peak.displacement)], 20)
        answers = bench.contact.run([point for point in path for _ in range(2)])[:, 1]
        change = np.abs(answers[1::2] - answers[::2])
        i = int(np.argmax(change > 0.01 * scale.shear.strength))
        if change[i] > 0.01 * scale.shear.strength:
            text = f"shear traction goes on from {words(answers[2 * i], 'Pa')} to {words(answers[2 * i + 1], 'Pa')}"
            return Finding(f"press, shear: {text} at rest, at {place(path[i])}", float(change[i]))
    return None


def weakening(runs: list[Response], scale: Scale, history: str) -> Iterator[Finding | None]:
    """Peak and last shear traction against pressure."""
    allowed = 1e-3 * scale.shear.strength
    for what, value in (("shear strength", largest_shear), ("shear traction after long slip", last_shear)):
        tractions = [value(run) for run in runs]
        for (p, a), (q, b) in itertools.pairwise(zip(scale.pressures, tractions, strict=True)):
            if b < a - allowed:
                text = f"{history}: {what} falls from {words(a, 'Pa')} under {words(p, 'Pa')} pressure"
                yield Finding(f"{text} to {words(b, 'Pa')} under {words(q, 'Pa')}", a - b)


def largest_shear(run: Response) -> float:
    return float(run.answers[run.corners[-4] : run.corners[-3] + 1, 1].max())


def last_shear(run: Response) -> float:
    return float(run.answers[run.corners[-3], 1])


def driven_by_shear(scale: Scale, run: Response) -> Finding | None:
    """Where shear drives the slip it should oppose: while slip grows, or goes back beyond its start."""
    allowed = 1e-3 * scale.shear.strength
    out = slice(run.corners[-4], run.corners[-3] + 1)
    back = slice(run.corners[-2], run.corners[-1] + 1)
    for part, sign, when in ((out, 1, "slip grows"), (back, -1, "slip goes back beyond its start")):
        wrong = -sign * run.answers[part, 1]
        i = int(np.argmax(wrong))
        if wrong[i] > allowed:
            text = f"{run.name}: shear traction {words(run.answers[part, 1][i], 'Pa')} drives the contact while {when}"
            return Finding(f"{text}, at {place(run.points[part][i])}", float(wrong[i]))
    return None


def pressed_while_sliding(bench: Bench) -> Finding | None:
    """A contact that slides does not lose shear traction when it is pressed harder and slides on."""
    scale = bench.scale
    s, (low, high) = scale.shear.displacement, scale.closures[1::2]
    corners = [(0.0, 0.0), (-low, 0.0), (-low, scale.far), (-high, scale.far + 2 * s), (-high, 2 * scale.far + 4 * s)]
    run = drive(bench.contact, "slide, press, slide on", corners, scale)
    if not run.complete:
        return Finding(f"{run.name}: no finite answer beyond {place(run.points[-1])}")
    before, after = run.answers[run.corners[2], 1], run.answers[-1, 1]
    if after < before - 1e-3 * scale.shear.strength:
        text = f"{run.name}: shear traction falls from {words(before, 'Pa')} to {words(after, 'Pa')}"
        return Finding(f"{text} at {place(run.points[-1])}", float(before - after))
    return None
