"""Regular grains: rectangles in rows."""

from __future__ import annotations

import attrs
import numpy as np

from grainlaw.fields import ParameterError, whole_number
from grainlaw.region import Region
from grainlaw.tessellation import Tessellation, Tessellator


@attrs.frozen(kw_only=True)
class Bricks(Tessellator):
    """Equal bricks in straight rows and columns, for an upright rectangle; two rows are two blocks with one joint."""

    rows: int = whole_number(default=2, at_least=1, at_most=10_000)  #: bricks on top of each other
    columns: int = whole_number(default=1, at_least=1, at_most=10_000)  #: bricks beside each other

    def tessellate(self, region: Region) -> Tessellation:
        """Fill an upright rectangle, row by row from below. Raises ParameterError for another region."""
        low, high = region.bounds
        if len(region.start) != 4 or not ((region.outline == low) | (region.outline == high)).all():
            raise ParameterError("Bricks: region is not allowed, it must be an upright rectangle")
        x = np.linspace(low[0], high[0], self.columns + 1)
        y = np.linspace(low[1], high[1], self.rows + 1)
        at = np.arange(len(x) * len(y)).reshape(len(y), len(x))
        corners = np.stack([at[:-1, :-1], at[:-1, 1:], at[1:, 1:], at[1:, :-1]], axis=-1).ravel()
        vertices = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
        return Tessellation(region, vertices, corners, np.arange(0, len(corners) + 1, 4))
