"""What tests of two blocks with one joint measure on the joint itself."""

from __future__ import annotations

import numpy as np

from grainlaw.parameter import ParameterError
from grainlaw.specimen import Specimen
from grainlaw.state import State


def require_joint(specimen: Specimen, test: str) -> None:
    """Raise ParameterError unless the specimen is two blocks, one on the other."""
    missing = {"top", "bottom"} - set(specimen.mesh.boundaries)
    if missing:
        raise ParameterError(f"{test}: the specimen has no boundary named {' or '.join(sorted(missing))}")
    level = specimen.grains.count == 2 and np.ptp(specimen.grains.centroids[:, 1]) > 0
    if not level or not len(specimen.mesh.interfaces):
        raise ParameterError(
            f"{test}: the specimen has {specimen.grains.count} grains, it must have two, one on the other, such as "
            "Bricks(rows=2) makes"
        )


def joint_means(state: State) -> dict[str, float]:
    """Means over the joint: ``opening``, ``slip`` (m, of the upper block to the right), ``normal`` and ``shear`` (Pa).

    ``broken`` is the share of the joint that has broken.
    """
    share = state.contact_lengths / state.contact_lengths.sum()
    return {
        "opening": float(share @ state.opening),
        "slip": -float(share @ state.slip),  # the tangent runs counter-clockwise round the first block
        "normal": float(share @ state.normal),
        "shear": -float(share @ state.shear),
        "broken": float(share @ (state.memory("damage") >= 1)),
    }
