"""Where contact points lie as lines: the half of an interface that belongs to each, on the deformed specimen."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from grainlaw.results.result import Result


def contact_segments(place: np.ndarray, interfaces: np.ndarray) -> np.ndarray:
    """(2c, 2, 2) m, start and end of each contact point's half interface, midway between its two grains.

    ``place`` (i, 2) m are the places of the nodes, ``interfaces`` (c, 4) their numbers as in ``Result.interfaces``.
    The contact points c at the start of all interfaces come first, then those at their end.
    """
    ends = place[interfaces]
    start, end = (ends[:, 0] + ends[:, 2]) / 2, (ends[:, 1] + ends[:, 3]) / 2
    middle = (start + end) / 2
    return np.stack([np.concatenate([start, middle]), np.concatenate([middle, end])], axis=1)


def crack_segments(result: Result, frame: int) -> np.ndarray:
    """(k, 2, 2) m of :meth:`Result.crack_segments`."""
    moment = result.frame("crack_segments", frame)
    time = moment.bonds["broken_time"]
    broken = np.flatnonzero(~np.isnan(time))
    in_order = broken[np.argsort(time[broken], kind="stable")]  # that of Result.cracks
    return contact_segments(result.mesh.nodes + moment.displacement, result.interfaces)[in_order]
