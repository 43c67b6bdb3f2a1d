"""Short edges removed by merging their two vertices, wherever all grains stay convex."""

from __future__ import annotations

import attrs
import numpy as np

from grainlaw.geometry.cells.sides import Sides, region_sides
from grainlaw.geometry.cells.tiling import Tiling, without_repetition
from grainlaw.polygon import areas_and_centroids

FLATTEST = 1e-3  #: sine of the smallest turn that a merge may leave at a corner, clear of rounding
STRAIGHT = 1e-10  #: sine of the largest turn, to either side, that is none: less than a tessellation's check allows


@attrs.frozen(eq=False)
class Merges:
    """Edges and where each would end as one vertex; shortest first. Index letter ``m``."""

    keep: np.ndarray  #: (m,) vertex, the one held by more sides of the region
    drop: np.ndarray  #: (m,) vertex
    place: np.ndarray  #: (m, 2) m

    def __len__(self) -> int:
        return len(self.keep)

    def __getitem__(self, which: np.ndarray) -> Merges:
        return Merges(self.keep[which], self.drop[which], self.place[which])


def merge_short_edges(
    tiling: Tiling, limit: float | np.ndarray, smallest: float = 0.0, lines: Sides | None = None,
    flattest: float = FLATTEST,
) -> Tiling:  # fmt: skip
    """Merge the vertices of edges shorter than ``limit`` (m) until none is left or none can be merged.

    Where seeds have limits of their own (n,), the least of the grains at both vertices holds.

    A merge is made only where every touched grain keeps three corners and stays convex: with the sum of the areas
    round the edge unchanged, the grains then still tile the region. Triangles below ``smallest`` (m2) may vanish.
    Vertices stay on their side, corners of the region stay in place. Merges that share a grain wait for each other,
    the shorter edge first.

    With ``lines`` of which ``tiling.on`` has the numbers, as many for each vertex as there are columns, vertices stay
    on these too, and where they cross. Corners may then be straight, as where the cells of a neighbour end at an edge.
    A polygon that is thinner than ``flattest`` times its length loses no edge.
    """
    sides, straight = lines or region_sides(tiling.region), lines is not None
    while True:
        tiling = _without_idle(tiling)
        vanish = _may_vanish(tiling, smallest)
        merges = _possible(tiling, sides, *_short_edges(tiling, limit), vanish, straight, flattest)
        if len(merges):
            tiling = _merged(tiling, merges[_first_in_all_grains(tiling, merges)])
            continue
        specks = _specks(tiling, limit, vanish)
        made = next(filter(None, (_without_speck(tiling, g, flattest, straight) for g in specks)), None)
        if made is None:
            return tiling
        tiling = made


def _without_idle(tiling: Tiling) -> Tiling:
    """Drop vertices inside a side of the region where only one grain has a corner: nothing turns or meets there.

    They are left by cuts whose pieces were joined again.
    """
    times = np.bincount(tiling.corners, minlength=len(tiling.vertices))
    idle = ((times == 1) & (tiling.on[:, 0] >= 0) & (tiling.on[:, 1] < 0))[tiling.corners]
    if not idle.any():
        return tiling
    first = np.concatenate([[0], np.cumsum(~idle)])[tiling.first]
    return attrs.evolve(tiling, corners=tiling.corners[~idle], first=first, kind=tiling.kind[~idle])


def _short_edges(tiling: Tiling, limit: float | np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Vertices to keep and to drop of the edges that the sides of the region allow to merge."""
    start, end = tiling.corners, tiling.corners[tiling.next]
    length = np.hypot(*(tiling.vertices[end] - tiling.vertices[start]).T)
    if isinstance(limit, np.ndarray):
        least = np.full(len(tiling.vertices), np.inf)
        np.minimum.at(least, tiling.corners, limit[tiling.owner][tiling.grain])
        limit = np.minimum(least[start], least[end])
    short = np.flatnonzero(length < limit)
    short = short[np.argsort(length[short], kind="stable")]
    low, high = np.minimum(start, end)[short], np.maximum(start, end)[short]
    once = np.sort(np.unique(low * len(tiling.vertices) + high, return_index=True)[1])
    low, high = low[once], high[once]
    into_low, into_high = _within(tiling.on[high], tiling.on[low]), _within(tiling.on[low], tiling.on[high])
    keep, drop = np.where(into_low, low, high), np.where(into_low, high, low)
    return keep[into_low | into_high], drop[into_low | into_high]


def _within(on: np.ndarray, others: np.ndarray) -> np.ndarray:
    """Whether a vertex lies on no other sides than another one."""
    return ((on < 0) | (on[:, :, None] == others[:, None]).any(axis=2)).all(axis=1)


def _may_vanish(tiling: Tiling, smallest: float) -> np.ndarray:
    """(g,) whether each grain is a triangle so small that it need not stay."""
    if smallest == 0:
        return np.zeros(len(tiling.first) - 1, dtype=bool)
    areas = areas_and_centroids(tiling.vertices[tiling.corners], tiling.first)[0]
    return (np.diff(tiling.first) == 3) & (areas < smallest)


def _possible(
    tiling: Tiling, sides: Sides, keep: np.ndarray, drop: np.ndarray, vanish: np.ndarray, straight: bool,
    flattest: float,
) -> Merges:  # fmt: skip
    """Merges that leave the grains convex, into the middle of the edge or else into either end."""
    ends = np.column_stack([keep, drop])
    corner, which = tiling.corners_at(ends.ravel())
    which //= 2
    a, b = tiling.vertices[keep], tiling.vertices[drop]
    place, found = np.empty_like(a), np.zeros(len(keep), dtype=bool)
    for target in ((a + b) / 2, a, b):
        fixed = tiling.on[keep, 1] >= 0
        target = np.where(fixed[:, None], a, sides.hold(target, np.where(fixed[:, None], -1, tiling.on[keep, :2])))
        convex = ~_beyond_its_side(tiling, keep, target)
        convex[which[~_stays_convex(tiling, corner, ends[which], target[which], vanish, straight, flattest)]] = False
        place[convex & ~found] = target[convex & ~found]
        found |= convex
    return Merges(keep, drop, place)[found]


def _beyond_its_side(tiling: Tiling, vertex: np.ndarray, target: np.ndarray) -> np.ndarray:
    """(n,) whether a vertex on one side of the region would come to lie on its line past the end.

    No grain that stays would tell it, where a triangle between this end and the vertex vanishes.
    """
    side, region = tiling.on[vertex, 0], tiling.region
    one = (side >= 0) & (side < len(region.start)) & (tiling.on[vertex, 1] < 0)
    side = np.where(one, side, 0)
    along = region.end[side] - region.start[side]
    share = ((target - region.start[side]) * along).sum(axis=1) / (along**2).sum(axis=1)
    return one & ((share < 0) | (share > 1))


def _specks(tiling: Tiling, limit: float | np.ndarray, vanish: np.ndarray) -> list[int]:
    """Grains that may vanish and have short edges alone, which no merge of one edge removes: next to a corner, say."""
    along = tiling.vertices[tiling.corners[tiling.next]] - tiling.vertices[tiling.corners]
    longest = np.maximum.reduceat(np.hypot(*along.T), tiling.first[:-1])
    return np.flatnonzero(
        vanish & (longest < (limit[tiling.owner] if isinstance(limit, np.ndarray) else limit))
    ).tolist()


def _without_speck(tiling: Tiling, g: int, flattest: float, straight: bool) -> Tiling | None:
    """A triangle shrunk into the corner that most sides hold, where the grains round it stay convex."""
    corners = tiling.corners[tiling.first[g] : tiling.first[g + 1]]
    keep = corners[(tiling.on[corners] >= 0).sum(axis=1).argmax()]
    drop = corners[corners != keep]
    if not _within(tiling.on[drop], np.broadcast_to(tiling.on[keep], (2, tiling.on.shape[1]))).all():
        return None
    place = np.broadcast_to(tiling.vertices[keep], (2, 2))
    made = _without_idle(_merged(tiling, Merges(np.repeat(keep, 2), drop, place)))
    touched = np.isin(made.grain, made.grain[made.corners == keep])
    a, b, c = (
        made.vertices[made.corners[at[touched]]] for at in (made.previous, np.arange(len(made.corners)), made.next)
    )
    return made if _turns_left(a, b, c, straight, flattest).all() else None


def _first_in_all_grains(tiling: Tiling, merges: Merges) -> np.ndarray:
    corner, which = tiling.corners_at(np.column_stack([merges.keep, merges.drop]).ravel())
    which //= 2
    grain = tiling.grain[corner]
    first = np.full(len(tiling.first) - 1, len(merges))
    np.minimum.at(first, grain, which)
    ready = np.ones(len(merges), dtype=bool)
    ready[which[first[grain] < which]] = False
    return ready


def _stays_convex(
    tiling: Tiling, corner: np.ndarray, ends: np.ndarray, target: np.ndarray, vanish: np.ndarray, straight: bool,
    flattest: float,
) -> np.ndarray:  # fmt: skip
    """Whether the grain of each corner stays convex or may vanish when the edge with these ends shrinks to the target.

    A triangle that would lose an edge does not stay convex: what is left of it turns back on itself.
    """
    before, after = tiling.previous[corner], tiling.next[corner]
    ahead = (tiling.corners[after, None] == ends).any(axis=1)
    behind = (tiling.corners[before, None] == ends).any(axis=1)
    after, before = np.where(ahead, tiling.next[after], after), np.where(behind, tiling.previous[before], before)
    p, q = tiling.vertices[tiling.corners[before]], tiling.vertices[tiling.corners[after]]
    pp = tiling.vertices[tiling.corners[tiling.previous[before]]]
    qq = tiling.vertices[tiling.corners[tiling.next[after]]]
    lost = (ahead | behind) & vanish[tiling.grain[corner]]
    ways = ((pp, p, target), (p, target, q), (target, q, qq))
    return lost | np.logical_and.reduce([_turns_left(a, b, c, straight, flattest) for a, b, c in ways])


def _turns_left(a: np.ndarray, b: np.ndarray, c: np.ndarray, straight: bool, flattest: float) -> np.ndarray:
    """Whether the way from a by b to c turns left at b, or, if that is allowed, goes straight on."""
    ab, bc = b - a, c - b
    turn = ab[:, 0] * bc[:, 1] - ab[:, 1] * bc[:, 0]
    scale = np.hypot(*ab.T) * np.hypot(*bc.T)
    left = turn > flattest * scale
    return left | ((abs(turn) <= STRAIGHT * scale) & ((ab * bc).sum(axis=1) > 0)) if straight else left


def _merged(tiling: Tiling, merges: Merges) -> Tiling:
    vertices, number = tiling.vertices.copy(), np.arange(len(tiling.vertices))
    vertices[merges.keep] = merges.place
    number[merges.drop] = merges.keep
    corners = number[tiling.corners]
    stay, first, wide = without_repetition(corners, tiling.first)
    return attrs.evolve(
        tiling, vertices=vertices, corners=corners[stay], first=first, owner=tiling.owner[wide], kind=tiling.kind[stay]
    )
