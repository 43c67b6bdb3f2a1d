"""Fragments: groups of grains that are still bonded."""

from __future__ import annotations

import attrs
import numpy as np

from grainlaw.arguments import Checked, checked
from grainlaw.polygon import linked
from grainlaw.results.result import Result


@attrs.frozen(eq=False)
class Fragments(metaclass=Checked):
    """Groups of grains that are still bonded, the largest first."""

    of_grain: np.ndarray  #: (g,) number of the fragment each grain belongs to
    areas: np.ndarray  #: (f,) m2, undeformed
    grains: np.ndarray  #: (f,) number of grains

    def __len__(self) -> int:
        return len(self.areas)

    @property
    def _facts(self) -> dict[str, str]:
        """How many, how large the largest, and how many are of one grain."""
        if not len(self):
            return {"fragments": "0"}
        share = f"{100 * self.areas[0] / self.areas.sum():.4g} % of the area"
        return {
            "fragments": str(len(self)), "largest": f"{self.grains[0]} grains, {share}",
            "single grains": str(int(np.count_nonzero(self.grains == 1))),
        }  # fmt: skip


@checked
def fragments(result: Result, frame: int = -1) -> Fragments:
    """Groups of grains connected by ties, or by bonds with at least one unbroken contact point, at one of the frames.

    Fragments of equal area are in the order of their first grain. Under a law without damage all grains stay connected.
    """
    broken = ~np.isnan(result.frame("fragments", frame).bonds["broken_time"].reshape(2, -1))
    mesh = result.mesh
    ends = np.concatenate([result.interfaces[~broken.all(axis=0)], mesh.ties])
    a, b = mesh.node_grain[ends[:, [0, 2]]].T
    areas = result.specimen.grains.areas
    label = linked(len(areas), a, b)
    first = np.unique(label, return_index=True)[1]
    order = np.lexsort((first, -np.bincount(label, areas)))
    of_grain = np.argsort(order)[label]
    return Fragments(of_grain, np.bincount(of_grain, areas), np.bincount(of_grain))
