"""The outline of polygons side by side, and the proof that they cover what it encloses once.

How often polygons cover a point changes only across a loose edge, one that no second polygon runs along the other way.
If no two polygons run along an edge the same way, and the loose edges form one loop counter-clockwise and others
clockwise that do not cross, they cover the inside of the first without the others exactly once.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from grainlaw.fields import ParameterError
from grainlaw.geometry.cells.shared_edges import Polygons, crossing, place
from grainlaw.polygon import cross, enclosed, near_sides, ring_area
from grainlaw.region import Region

BOX = ("bottom", "right", "top", "left")  #: sides of an upright rectangle
Names = Mapping[tuple[int, int], str]  #: of boundaries, by the two vertices of an edge, the lower first


def outline(where: str, polygons: Polygons, *, holes: bool) -> list[np.ndarray]:
    """Loops of vertices round what polygons cover, that round them all first.

    Raises ParameterError, with numbers and place, for polygons that overlap, lie apart or touch at a corner only, and
    for gaps between them; ``holes`` takes gaps for holes of the region.
    """
    _refuse_doubled(where, polygons)
    loose = polygons.loose
    _refuse_crossing(where, polygons, loose)
    loops = _loops(where, polygons, loose)
    rings = [polygons.corners[loop] for loop in loops]
    areas = [ring_area(polygons.vertices[ring]) for ring in rings]
    order = sorted(range(len(loops)), key=lambda k: -areas[k])
    around = polygons.vertices[rings[order[0]]]
    for k in order[1:]:
        who, point = _who(polygons, loops[k]), place(polygons.vertices[rings[k]].mean(axis=0))
        s = "" if who.startswith("polygons") else "s"
        if areas[k] > 0 and enclosed(_inside(polygons.vertices[rings[k]]), around, np.roll(around, -1, axis=0))[0]:
            raise ParameterError(f"{where}: {who} overlap{s} others near {point}, by {areas[k]:.3g} m2")
        if areas[k] > 0:
            raise ParameterError(f"{where}: {who} lie{s} apart from the others, at {point}")
        if not holes:
            raise ParameterError(
                f"{where}: there is a gap of {-areas[k]:.3g} m2 between {who} near {point}"
                " (holes=True takes it for a hole of the region)"
            )
    for k in order:
        twice = np.flatnonzero(np.bincount(rings[k]) > 1)
        if len(twice):
            who = _who(polygons, loops[k][rings[k] == twice[0]])
            raise ParameterError(f"{where}: {who} touch at a corner only, at {place(polygons.vertices[twice[0]])}")
    return [rings[k] for k in order]


def _who(polygons: Polygons, positions: np.ndarray) -> str:
    numbers = np.unique(polygons.owner[positions]).tolist()
    if len(numbers) == 1:
        return f"polygon {numbers[0]}"
    shown = ", ".join(map(str, numbers[:-1][:6])) + (", ..." if len(numbers) > 7 else "")
    return f"polygons {shown} and {numbers[-1]}"


def _inside(ring: np.ndarray) -> np.ndarray:
    """(1, 2) m, a point just left of the longest edge of a loop that runs counter-clockwise."""
    along = np.roll(ring, -1, axis=0) - ring
    k = np.hypot(*along.T).argmax()
    return ring[k : k + 1] + along[k] / 2 + 1e-6 * np.array([-along[k, 1], along[k, 0]])


def _refuse_doubled(where: str, polygons: Polygons) -> None:
    run = polygons.corners * len(polygons.vertices) + polygons.next
    order = np.argsort(run, kind="stable")
    same = np.flatnonzero(run[order][1:] == run[order][:-1])
    if len(same):
        at = order[same[0] : same[0] + 2]
        middle = polygons.vertices[[polygons.corners[at[0]], polygons.next[at[0]]]].mean(axis=0)
        raise ParameterError(f"{where}: {_who(polygons, at)} overlap at the edge with the middle {place(middle)}")


def _refuse_crossing(where: str, polygons: Polygons, loose: np.ndarray) -> None:
    a, b = polygons.vertices[polygons.corners[loose]], polygons.vertices[polygons.next[loose]]
    i, j = near_sides(a, b)
    apart = cross(b[i] - a[i], a[j] - a[i]) * cross(b[i] - a[i], b[j] - a[i]) < 0
    apart &= cross(b[j] - a[j], a[i] - a[j]) * cross(b[j] - a[j], b[i] - a[j]) < 0
    ends = np.column_stack([polygons.corners[loose], polygons.next[loose]])
    apart &= ~(ends[i][:, :, None] == ends[j][:, None, :]).any(axis=(1, 2))
    if apart.any():
        i, j = i[apart.argmax()], j[apart.argmax()]
        point = crossing(a[i], b[i], a[j], b[j])
        raise ParameterError(f"{where}: {_who(polygons, loose[[i, j]])} overlap near {place(point)}")


def _loops(where: str, polygons: Polygons, loose: np.ndarray) -> list[np.ndarray]:
    """Positions of loose edges in the order of each loop, the polygons on the left."""
    after, waiting, loops = _followers(where, polygons, loose), dict.fromkeys(loose.tolist()), []
    while waiting:
        at, loop = next(iter(waiting)), []
        while at in waiting:
            del waiting[at]
            loop.append(at)
            at = after[at]
        loops.append(np.array(loop))
    return loops


def _followers(where: str, polygons: Polygons, loose: np.ndarray) -> dict[int, int]:
    """The loose edge that follows each round what no polygon covers.

    Counter-clockwise round a vertex edges that end and begin there take turns, or polygons overlap between them.
    """
    follow, points = polygons.next, polygons.vertices
    rays: dict[int, list[tuple[bool, int]]] = {}
    for at in loose.tolist():
        rays.setdefault(int(polygons.corners[at]), []).append((True, at))
        rays.setdefault(int(follow[at]), []).append((False, at))
    after = {}
    for vertex, here in rays.items():
        if len(here) > 2:
            other = [follow[at] if begins else polygons.corners[at] for begins, at in here]
            away = points[other] - points[vertex]
            here = [here[k] for k in np.arctan2(away[:, 1], away[:, 0]).argsort(kind="stable")]
        for (begins, at), (begins_too, onward) in zip(here, here[1:] + here[:1], strict=True):
            if begins == begins_too:
                who = _who(polygons, np.array([at, onward]))
                raise ParameterError(f"{where}: {who} overlap at the corner {place(points[vertex])}")
            if not begins:
                after[at] = onward
    return after


def region_of(vertices: np.ndarray, rings: list[np.ndarray], names: Names, tolerance: float) -> Region:
    """The region inside loops of vertices, that round all first; corners that do not turn are left out.

    ``names`` has boundaries by the two vertices of an edge; where it has none, the sides of an upright rectangle are
    bottom, right, top and left, others "boundary", and those of holes "hole".
    """
    box = _box_names(vertices[rings[0]], tolerance)
    named = []
    for k, ring in enumerate(rings):
        other = "hole" if k else "boundary"
        sides = []
        for n, (i, j) in enumerate(zip(ring.tolist(), np.roll(ring, -1).tolist(), strict=True)):
            sides.append(names.get((min(i, j), max(i, j)), box[n] if box and not k else other))
        named.append(_straightened(vertices[ring], sides))
    return Region(
        named[0][0], tuple(named[0][1]), [ring for ring, _ in named[1:]], [tuple(sides) for _, sides in named[1:]]
    )


def _box_names(ring: np.ndarray, tolerance: float) -> list[str]:
    """Names of the edges of an upright rectangle; none for another shape."""
    low, high = ring.min(axis=0), ring.max(axis=0)
    off = abs(np.column_stack([ring[:, 1] - low[1], ring[:, 0] - high[0], ring[:, 1] - high[1], ring[:, 0] - low[0]]))
    on = (off <= tolerance) & (np.roll(off, -1, axis=0) <= tolerance)
    return [BOX[k] for k in on.argmax(axis=1)] if on.any(axis=1).all() else []


def _straightened(ring: np.ndarray, sides: list[str]) -> tuple[np.ndarray, list[str]]:
    """Without the corners inside a side of one name: they lie on the line between their neighbours to rounding."""
    rounding = 4 * np.finfo(float).eps * abs(ring).max()
    kept: list[int] = []
    for k in range(len(ring)):
        before, after = ring[kept[-1] if kept else k - 1], ring[(k + 1) % len(ring)]
        along = (after - before) / np.hypot(*(after - before))
        bent = abs(cross(along, ring[k] - before)) > rounding or (ring[k] - before) @ along < 0
        if bent or sides[k - 1] != sides[k]:
            kept.append(k)
    return ring[kept], [sides[k] for k in kept]
