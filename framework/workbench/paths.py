"""Paths of opening and slip, scaled to a law: designed ones and random ones."""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np

from grainlaw.workbench.scale import Scale

Corners = Sequence[tuple[float, float]]  #: (opening, slip) in m


def designed_paths(scale: Scale) -> dict[str, Corners]:
    """Closed paths that find the faults which random paths miss."""
    t, s = scale.tension.displacement, scale.shear.displacement
    to, so = scale.tension.broken, scale.shear.broken
    th, sh = scale.tension.half_broken, scale.shear.half_broken
    c, d, far = scale.closures[1], scale.closures[3], scale.far
    paths: dict[str, Corners] = {
        "pull, release, pull on": [(0, 0), (0.8 * t, 0), (0, 0), (th, 0), (0, 0), (to, 0), (0, 0)],
        "pull beyond the peak, release": [(0, 0), (1.05 * t, 0), (0, 0)],
        "shear beyond the peak, slip back": [(0, 0), (0, 1.05 * s), (0, 0)],
        "shear, reverse": [(0, 0), (0, 0.8 * s), (0, -0.8 * s), (0, sh), (0, -sh), (0, so), (0, -so), (0, 0)],
        "shear under pressure, reverse": [(0, 0), (-c, 0), (-c, sh), (-c, -sh), (-c, far), (-c, 0), (0, 0)],
        "shear under high pressure": [(0, 0), (-d, 0), (-d, far), (-d, -far), (-d, 0), (0, 0)],
        "pull, release, press, shear": [(0, 0), (th, 0), (0, 0), (-c, 0), (-c, far), (-c, 0), (0, 0)],
        "open, slide, close": [(0, 0), (to, 0), (to, so), (-c, so), (-c, far + so), (0, far + so), (0, 0)],
        "press, slip, open": [(0, 0), (-c, 0), (-c, sh), (to, sh), (0, sh), (0, 0)],
        "slip, press, slip back, release": [(0, 0), (0, 0.8 * s), (-c, 0.8 * s), (-c, 0), (0, 0)],
        "slip, press hard, slip back, release": [(0, 0), (0, s), (-d, s), (-d, 0), (0, 0)],
        "slip far, press, slip back, release": [(0, 0), (0, sh), (-c, sh), (-c, 0), (0, 0)],
        "slip, pull, slip back": [(0, 0), (0, 0.5 * s), (0.8 * t, 0.5 * s), (0.8 * t, 0), (0, 0), (0, s), (0, 0)],
        "pull far, slip, close, slip back": [(0, 0), (th, 0), (th, s), (0, s), (0, 0)],
        "pull, slip, release": [(0, 0), (0.8 * t, 0), (0.8 * t, s), (0, s), (0, 0)],
        "pull, release, shear to the end": [(0, 0), (th, 0), (0, 0), (0, so), (0, 0)],
        "shear, slip back, pull to the end": [(0, 0), (0, sh), (0, 0), (to, 0), (0, 0)],
        "all directions": [(0, 0), (th, s), (0.3 * t, -s), (-c, s), (2 * t, so), (-c, -far), (0, 0)],
    }
    for share in (0.25, 0.5, 0.75):
        a, b = share, 1 - share
        mixed = [(0, 0), (a * t, b * s), (0, 0), (a * th, b * sh), (0, 0), (to, so * b / a), (0, 0)]
        paths[f"mixed, {a:g} opening to {b:g} slip"] = mixed
    return paths


def random_paths(scale: Scale, count: int) -> dict[str, Corners]:
    """Closed paths of random corners about the peaks, the same at every call."""
    random = np.random.default_rng(11)
    size = np.array([2 * scale.tension.displacement, 3 * scale.shear.displacement])
    corners = random.normal(size=(count, 5, 2)) * size
    corners[..., 0] = np.maximum(corners[..., 0], -scale.closures[2])
    return {f"random path {k}": [(0, 0), *map(tuple, c.tolist()), (0, 0)] for k, c in enumerate(corners)}


def even_steps(corners: Corners, steps: int) -> list[tuple[float, float]]:
    """Points (opening, slip) along straight lines through ``corners``, ``steps`` to a leg."""
    points = straight(np.array(corners, dtype=float), np.arange(steps)[:, None] / steps)
    return [(float(o), float(s)) for o, s in points]


def straight(corners: np.ndarray, shares: np.ndarray) -> np.ndarray:
    """Points along straight lines through corners, at shares of each leg, and the last corner."""
    legs = [a + (b - a) * shares for a, b in itertools.pairwise(corners)]
    return np.concatenate([*legs, corners[-1:]])
