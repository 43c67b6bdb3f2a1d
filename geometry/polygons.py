"""Grains drawn elsewhere, as polygons."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from grainlaw.arguments import checked, is_number
from grainlaw.fields import ParameterError, checked_number, checked_points
from grainlaw.geometry.cells.assembling import checked_merge, tessellation_of
from grainlaw.geometry.cells.shared_edges import joined
from grainlaw.messages import refusal
from grainlaw.polygon import areas_and_centroids
from grainlaw.region import Region
from grainlaw.tessellation import Tessellation

CLOSE = 1e-6  #: of the median grain size: tolerance if none is given


@checked
def from_polygons(
    polygons: Any, phases: Any = None, region: Region | None = None, *, tolerance: float | None = None,
    holes: bool = False, merge: float = 0.0,
) -> Tessellation:  # fmt: skip
    """Grains from polygons (n, 2) m, clockwise or not, that fill a region side by side.

    A corner of one polygon on an edge of its neighbour becomes a corner of both; points nearer than ``tolerance`` (m, a
    millionth of the grain size unless given) become one. A concave polygon is cut into convex cells of one grain
    (``parent`` has the numbers of the polygons). Without ``region`` it is the outline of them all: the sides of an
    upright rectangle are bottom, right, top and left, those of another shape "boundary", and with ``holes`` the gaps
    between polygons are holes of it. Edges shorter than ``merge`` grain sizes, the root of the mean area, vanish where
    grains stay convex, and slivers with them. ``phases`` has a number or a name for each polygon::

        grains = from_polygons([[(0, 0), (2, 0), (2, 1), (0, 1)], [(0, 1), (2, 1), (1, 2)]], ["quartz", "mica"])

    Raises :class:`~grainlaw.fields.ParameterError`, with numbers and place, for polygons that cross themselves,
    overlap, leave gaps, lie apart or touch at a corner only.
    """
    rings = _rings(polygons)
    first = np.cumsum([0, *map(len, rings)])
    points = np.concatenate(rings)
    if tolerance is None:
        tolerance = CLOSE * float(np.median(np.sqrt(abs(areas_and_centroids(points, first)[0]))))
    else:
        tolerance = checked_number("from_polygons: tolerance", tolerance, "m", at_least=0)
    phase, names = phases_of("from_polygons", phases, len(rings))
    merge = checked_merge("from_polygons", merge)
    fixed = np.zeros((0, 2)) if region is None else region.start
    made = joined("from_polygons", points, first, tolerance, fixed)
    return tessellation_of(
        "from_polygons", made, tolerance=tolerance, region=region, holes=holes, phase=phase, phase_names=names,
        merge=merge,
    )  # fmt: skip


def _rings(polygons: Any) -> list[np.ndarray]:
    try:
        rings = [checked_points(f"from_polygons: polygon {p}", ring) for p, ring in enumerate(polygons)]
    except TypeError:
        raise refusal("from_polygons: polygons", polygons, "a list of polygons (n, 2)") from None
    if not rings:
        raise refusal("from_polygons: polygons", polygons, "at least one polygon")
    rings = [ring[:-1] if len(ring) > 1 and (ring[0] == ring[-1]).all() else ring for ring in rings]
    for p, ring in enumerate(rings):
        if len(ring) < 3:
            raise ParameterError(f"from_polygons: polygon {p} has {len(ring)} corners, it must have at least 3")
    return rings


def phases_of(where: str, phases: Any, count: int) -> tuple[np.ndarray | None, tuple[str, ...]]:
    """Phase numbers (p,) and names, from one number or one name for each polygon.

    Raises :class:`~grainlaw.fields.ParameterError`.
    """
    if phases is None:
        return None, ()
    sized = isinstance(phases, (Sequence, np.ndarray)) and not isinstance(phases, str) and len(phases) == count
    given = list(phases) if sized else []
    if sized and all(isinstance(each, str) for each in given):
        names = tuple(dict.fromkeys(given))
        return np.array([names.index(each) for each in given]), names
    if sized and all(is_number(each) and float(each).is_integer() and each >= 0 for each in given):
        return np.array(given, dtype=np.int64), ()
    raise refusal(f"{where}: phases", phases, f"a name or a whole number from 0 for each of the {count} polygons")
