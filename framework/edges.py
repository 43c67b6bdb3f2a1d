"""The edges of grains."""

from __future__ import annotations

import attrs
import numpy as np


@attrs.frozen(eq=False)
class Edges:
    """All edges of a tessellation, each once; index letter ``e``."""

    start: np.ndarray  #: (e,) vertex; start to end runs counter-clockwise round the left grain
    end: np.ndarray  #: (e,) vertex
    left: np.ndarray  #: (e,) grain
    right: np.ndarray  #: (e,) grain, -1 on the boundary
    side: np.ndarray  #: (e,) number into ``boundary_names``, -1 inside (and where no side of the region is)
    kind: np.ndarray  #: (e,) number into the tessellation's ``kinds``: between two grains, inside of one, or a joint
    left_corners: np.ndarray  #: (e, 2) positions in ``corners`` of start and end, in the left grain
    right_corners: np.ndarray  #: (e, 2) positions in ``corners`` of start and end, in the right grain; -1 without
    length: np.ndarray  #: (e,) m
    boundary_names: tuple[str, ...]

    def __len__(self) -> int:
        return len(self.start)
