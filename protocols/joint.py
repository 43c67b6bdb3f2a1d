"""The joint of two blocks: whether a specimen has one, and means over it."""

from __future__ import annotations

import numpy as np

from grainlaw.engine.state import State
from grainlaw.fields import ParameterError
from grainlaw.protocols.between_platens import require_platens
from grainlaw.protocols.measures import is_rock
from grainlaw.specimen import Specimen


def require_joint(specimen: Specimen, test: str) -> None:
    """Raise ParameterError unless the specimen is two blocks, one upon the other, with or without platens."""
    require_platens(specimen, test)
    rock = is_rock(specimen)
    count, heights = int(rock.sum()), specimen.grains.centroids[rock, 1]
    if count != 2 or np.ptp(heights) == 0 or not _in_joint(specimen).any():
        raise ParameterError(
            f"{test}: the specimen has {count} grains, it must have two, one on the other, such as Bricks(rows=2) makes"
        )


def _in_joint(specimen: Specimen) -> np.ndarray:
    """(c,) whether an interface belongs to the joint; the others lie inside the platens."""
    return is_rock(specimen)[specimen.mesh.interface_grains].all(axis=1)


def joint_means(state: State) -> dict[str, float]:
    """Means over the joint: ``opening``, ``slip`` (m, of the upper block to the right), ``normal`` and ``shear`` (Pa).

    ``broken`` is the share of the joint that has broken.
    """
    lengths = state.contact_lengths * np.tile(_in_joint(state.specimen)[state.bonds.order], 2)
    share = lengths / lengths.sum()
    return {
        "opening": float(share @ state.opening),
        "slip": -float(share @ state.slip),  # the tangent runs counter-clockwise round the first block
        "normal": float(share @ state.normal),
        "shear": -float(share @ state.shear),
        "broken": float(share @ (state.memory("damage") >= 1)),
    }
