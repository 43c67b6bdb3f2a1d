"""Phases dealt to grains by area, and grains swapped until as much boundary as wanted is between like ones.

Index letters: ``g`` grain, ``p`` phase.
"""

from __future__ import annotations

import numpy as np

FINE = 2e-4  #: of the whole area: shares need not be met closer
LOOSE = 8e-4  #: of the whole area: how far from their shares swaps may bring them
SWAPS = 1000  #: at most, to meet the shares
ANY = 200  #: grains, of which any two are tried; of more, only those near in area
TRIALS = 400  #: for each grain, to reach the wanted arrangement
CLOSE = 2e-3  #: of the wanted share of like boundary: near enough
FEW = 1000  #: grains, of which all trials are made
IDLE = 5e-4  #: of the wanted share: a round of trials that gains less is the last


def dealt(areas: np.ndarray, shares: np.ndarray, random: np.random.Generator) -> np.ndarray:
    """(g,) phases: grains in random order, the first of them to the first phase until its share is met, and so on."""
    order = random.permutation(len(areas))
    middle = np.cumsum(areas[order]) - areas[order] / 2
    phase = np.empty(len(areas), dtype=np.int64)
    phase[order] = np.searchsorted(np.cumsum(shares)[:-1] * areas.sum(), middle)
    return phase


def _excess(phase: np.ndarray, areas: np.ndarray, shares: np.ndarray) -> np.ndarray:
    """(p,) by how much of the whole area each phase has too much."""
    return np.bincount(phase, areas, len(shares)) / areas.sum() - shares


def refined(phase: np.ndarray, areas: np.ndarray, shares: np.ndarray, random: np.random.Generator) -> np.ndarray:
    """(g,) phases with single grains swapped, or given, between the phases farthest from their shares."""
    phase, total = phase.copy(), areas.sum()
    for _ in range(SWAPS):
        excess = _excess(phase, areas, shares)
        if abs(excess).max() <= FINE:
            break
        much, little = int(excess.argmax()), int(excess.argmin())
        giver, taker = np.flatnonzero(phase == much), np.flatnonzero(phase == little)
        wanted = (excess[much] - excess[little]) / 2 * total
        ordered = np.append(-1, taker[np.argsort(areas[taker], kind="stable")])  # -1: nothing is given back
        sizes = np.append(0.0, areas[ordered[1:]])
        after = np.searchsorted(sizes, areas[giver] - wanted)
        pairs = [(giver, np.clip(after - k, 0, len(sizes) - 1)) for k in (0, 1)]
        one, other = (np.concatenate(rows) for rows in zip(*pairs, strict=True))
        miss = abs(areas[one] - sizes[other] - wanted)
        good = np.flatnonzero(miss < max(miss.min() * 1.000001, FINE * total / 4))
        chosen = random.choice(good)
        if miss[chosen] >= wanted * (1 - 1e-9):  # nothing would be gained: grains are too large
            break
        phase[one[chosen]] = little
        if ordered[other[chosen]] >= 0:
            phase[ordered[other[chosen]]] = much
    return phase


def expected_share(phase: np.ndarray) -> float:
    """Share of the boundary between like grains, on average over all arrangements of these grains' phases."""
    count, numbers = len(phase), np.bincount(phase)
    return float((numbers * (numbers - 1)).sum() / (count * (count - 1))) if count > 1 else 1.0


def shuffled_share(phase: np.ndarray, pairs: np.ndarray, lengths: np.ndarray) -> float:
    """Share of the boundary between like grains, on average over grains that change places, with their phases.

    A grain meets the others in proportion to their boundary, ``pairs`` (e, 2) of grains with ``lengths`` (e,) m. For
    grains that all have as much it is :func:`expected_share`.
    """
    own = np.bincount(pairs.ravel(), np.repeat(lengths, 2), len(phase))
    itself = (own**2).sum()
    other = own.sum() ** 2 - itself
    return float(((np.bincount(phase, own) ** 2).sum() - itself) / other) if other > 0 else 1.0


def carried(before: np.ndarray, after: np.ndarray, areas: np.ndarray, random: np.random.Generator) -> np.ndarray:
    """(g,) areas when phases (g,) have changed places: a phase keeps those it has, and its grains that stay theirs."""
    areas, old = areas.copy(), areas
    for p in np.unique(before):
        areas[(after == p) & (before != p)] = random.permutation(old[(before == p) & (after != p)])
    return areas


def like_share(phase: np.ndarray, pairs: np.ndarray, lengths: np.ndarray) -> float:
    """Share of the boundary, between ``pairs`` (e, 2) of grains with ``lengths`` (e,) m, that has like grains."""
    return float(lengths[phase[pairs[:, 0]] == phase[pairs[:, 1]]].sum() / lengths.sum()) if len(pairs) else 1.0


def rearranged(
    phase: np.ndarray, pairs: np.ndarray, lengths: np.ndarray, areas: np.ndarray, shares: np.ndarray, wanted: float,
    random: np.random.Generator,
) -> tuple[np.ndarray, float]:  # fmt: skip
    """Phases of which the wanted share of the boundary is between like grains, and the share that is reached.

    Two grains that are near in area are swapped at random, and stay so if that brings the share nearer to what is
    wanted and none of the fractions farther off than it may be.
    """
    count, total = len(phase), lengths.sum()
    mine: list[list[tuple[int, float]]] = [[] for _ in range(count)]
    for (a, b), length in zip(pairs.tolist(), (lengths / total).tolist(), strict=True):
        mine[a].append((b, length))
        mine[b].append((a, length))
    now, parts = phase.tolist(), (areas / areas.sum()).tolist()
    excess = _excess(phase, areas, shares).tolist()
    most = max(LOOSE, *map(abs, excess))
    order = np.argsort(areas, kind="stable").tolist()
    share, reach = like_share(phase, pairs, lengths), max(count // 8, min(count, ANY))
    for _ in range(TRIALS):
        before = share
        first, step = random.integers(count, size=count).tolist(), random.integers(1, reach + 1, size=count).tolist()
        for i, s in zip(first, step, strict=True):
            if abs(share - wanted) <= CLOSE * wanted:
                return np.array(now), share
            a, b = order[i], order[(i + s) % count]
            p, q = now[a], now[b]
            if p == q:
                continue
            more = parts[a] - parts[b]
            if max(abs(excess[q] + more), abs(excess[p] - more)) > most:
                continue
            gain = sum(length * ((now[c] == q) - (now[c] == p)) for c, length in mine[a] if c != b)
            gain += sum(length * ((now[c] == p) - (now[c] == q)) for c, length in mine[b] if c != a)
            if abs(share + gain - wanted) < abs(share - wanted):
                now[a], now[b] = q, p
                share += gain
                excess[q] += more
                excess[p] -= more
        if count > FEW and abs(share - before) < IDLE * wanted:
            break
    return np.array(now), share
