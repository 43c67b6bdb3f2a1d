"""Seeds moved so that a boundary of cells begins in every corner of more than 180 degrees: both are then convex."""

from __future__ import annotations

import math

import attrs
import numpy as np
from scipy.spatial import cKDTree

from grainlaw.geometry.cells.convex import Point
from grainlaw.geometry.cells.cutting import Cutter, Reentrant

FURTHEST = 0.5  #: grain sizes that a seed may be moved
NEAREST = 0.2  #: grain sizes that a moved seed keeps from all others
CANDIDATES = 12  #: nearest seeds, among which the two in sight of a corner are looked for
ROUNDS = 8  #: of choosing pairs again, where moved seeds have changed which are the nearest
STEPS = 8  #: of Newton's method, which doubles the digits in each


@attrs.frozen
class Pair:
    """Two seeds, the boundary of whose cells is to begin in a corner, and to run along ``turned`` if that is given."""

    corner: Point
    seeds: tuple[int, int]
    turned: Point | None = attrs.field(eq=False)


def settled(seeds: np.ndarray, cutter: Cutter, size: float) -> np.ndarray:
    """Seeds (g, 2) m of grains of a ``size`` (m), moved where they are near reentrant corners.

    Where the two nearest seeds in sight are equally far from a corner, the boundary of their cells ends in it. Left
    alone are all but one of the corners with the same two seeds, and those that would move a seed too far, out of sight
    or onto another.
    """
    if not cutter.reentrant or len(seeds) < 2:
        return seeds
    refused: set[Pair] = set()
    moved = seeds
    for _ in range(ROUNDS):
        pairs = [pair for pair in _pairs(moved, cutter) if pair not in refused]
        then = _equally_far(moved, pairs)
        stray = np.hypot(*(then - seeds).T) > FURTHEST * size
        stray |= cKDTree(then).query(then, 2)[0][:, 1] < NEAREST * size
        touched = np.flatnonzero((then != moved).any(axis=1) & ~stray)
        stray[[g for g in touched if not cutter.sees(seeds[g], then[g : g + 1])[0]]] = True
        wrong = {pair for pair in pairs if stray[list(pair.seeds)].any()}
        if not wrong:
            if np.allclose(then, moved, rtol=0, atol=1e-3 * cutter.near):
                return then
            moved = then
        refused |= wrong
    return moved


def _pairs(seeds: np.ndarray, cutter: Cutter) -> list[Pair]:
    """For each reentrant corner the two nearest seeds in sight."""
    corners = list(cutter.reentrant.values())
    near = cKDTree(seeds).query([found.corner for found in corners], min(CANDIDATES, len(seeds)))[1]
    pairs: dict[tuple[int, int], Pair] = {}
    for found, around in zip(corners, near, strict=True):
        # From a little inside: seen from the corner itself, the sides that meet there could hide seeds by rounding.
        eye = np.array(found.corner) + 1e3 * cutter.near * np.array(found.bisector)
        seen = tuple(sorted(around[cutter.sees(eye, seeds[around])][:2].tolist()))
        if len(seen) == 2:
            pairs.setdefault(seen, Pair(found.corner, seen, _turned(found, seeds[list(seen)])))
    return list(pairs.values())


def _turned(found: Reentrant, seeds: np.ndarray) -> Point | None:
    """Direction, if need be, that the boundary must be turned into to leave less than 180 degrees on either side."""
    rays = seeds - np.array(found.corner)
    (ax, ay), (bx, by) = rays / np.maximum(np.hypot(*rays.T), np.finfo(float).tiny)[:, None]
    (u, v), ex, ey = found.bisector, by - ay, ax - bx  # the boundary is perpendicular to the line between the seeds
    skew = math.remainder(math.atan2(u * ey - v * ex, u * ex + v * ey), math.pi)
    if abs(skew) < 0.9 * found.play:
        return None
    angle = math.copysign(0.8 * found.play, skew)
    return u * math.cos(angle) - v * math.sin(angle), u * math.sin(angle) + v * math.cos(angle)


def _equally_far(seeds: np.ndarray, pairs: list[Pair]) -> np.ndarray:
    """Seeds moved as little as makes those of each pair equally far from its corner."""
    seeds = seeds.copy()
    if not pairs:
        return seeds
    used, place = np.unique([pair.seeds for pair in pairs], return_inverse=True)
    one, other = place.reshape(-1, 2).T
    corners, row = np.array([pair.corner for pair in pairs]), np.arange(len(pairs))
    bent = np.array([i for i, pair in enumerate(pairs) if pair.turned], dtype=int)
    turned = np.array([pairs[i].turned for i in bent]).reshape(-1, 2)
    for _ in range(STEPS):
        a, b = seeds[used[one]] - corners, seeds[used[other]] - corners
        slopes = np.zeros((len(pairs) + len(bent), len(used), 2))
        slopes[row, one], slopes[row, other] = 2 * a, -2 * b
        slopes[len(pairs) + np.arange(len(bent)), one[bent]] = turned
        slopes[len(pairs) + np.arange(len(bent)), other[bent]] = -turned
        excess = np.concatenate([(a * a - b * b).sum(axis=1), ((a - b)[bent] * turned).sum(axis=1)])
        step = np.linalg.lstsq(slopes.reshape(len(excess), -1), -excess, rcond=None)[0]
        seeds[used] += step.reshape(-1, 2)
    return seeds
