"""Where the strain of a specimen is measured, as with gauges in the laboratory."""

from __future__ import annotations

import numpy as np

from grainlaw.mesh import Mesh
from grainlaw.once import once_each
from grainlaw.specimen import Specimen


@once_each
def points_on(mesh: Mesh, boundary: str, count: int, share: float = 1.0) -> np.ndarray:
    """(k,) nodes of a boundary nearest to ``count`` places, spread evenly along the middle ``share`` of it."""
    nodes = mesh.boundaries[boundary]
    place = mesh.nodes[nodes]
    along = place[:, np.argmax(np.ptp(place, axis=0))]
    wanted = along.min() + np.ptp(along) * (0.5 + share * ((np.arange(count) + 0.5) / count - 0.5))
    return nodes[np.abs(along[:, None] - wanted).argmin(axis=0)]


def lateral_strain(specimen: Specimen, displacement: np.ndarray, points: int = 12) -> float:
    """Change of width over width, from 12 points on the left and 12 on the right side (24, as in the paper).

    They lie in the middle half of the height, as strain gauges do, where the platens have little influence.
    ``displacement`` is (i, 2) m.
    """
    low, high = specimen.grains.region.bounds
    left, right = (displacement[points_on(specimen.mesh, side, points, 0.5), 0].mean() for side in ("left", "right"))
    return float(right - left) / float(high[0] - low[0])
