"""Length and orientation of the cracks of each mode."""

from __future__ import annotations

import attrs
import numpy as np

from grainlaw.arguments import Checked, checked
from grainlaw.fields import checked_whole_number
from grainlaw.results.result import Cracks, Result
from grainlaw.short_form import rounded


def _cracks(of: Result | Cracks) -> Cracks:
    return of.cracks if isinstance(of, Result) else of


@checked
def crack_lengths(of: Result | Cracks, times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Length (t,) m of tensile and of shear cracks, those of a result or some, that had broken by each time (s)."""
    cracks = _cracks(of)

    def grown(some: Cracks) -> np.ndarray:
        lengths = np.concatenate([[0.0], np.cumsum(some.length)])
        return lengths[np.searchsorted(some.time, times, side="right")]

    return grown(cracks[cracks.tensile]), grown(cracks[~cracks.tensile])


MOST_BINS = 18_000  #: a hundredth of a degree each


@attrs.frozen(eq=False)
class Rose(metaclass=Checked):
    """Length of cracks by orientation."""

    edges: np.ndarray  #: (n + 1,) rad from the x axis, 0 to pi
    tensile: np.ndarray  #: (n,) m
    shear: np.ndarray  #: (n,) m

    @property
    def _facts(self) -> dict[str, str]:
        """Length by mode, and the bin with the most of it."""
        both = self.tensile + self.shear
        facts = {
            name: rounded(float(row.sum()), "m") for name, row in (("tensile", self.tensile), ("shear", self.shear))
        }
        if both.any():
            k = int(np.argmax(both))
            low, high = np.degrees(self.edges[k : k + 2])
            facts["most"] = f"{low:.4g} to {high:.4g} deg, {100 * both[k] / both.sum():.3g} %"
        return {**facts, "bins": str(len(both))}


@checked
def crack_rose(of: Result | Cracks, bins: int = 18) -> Rose:
    """Histogram of the orientation of cracks on the deformed specimen, weighted by length, in equal bins.

    Of all cracks of a result, or of some.
    """
    cracks = _cracks(of)
    edges = np.linspace(0, np.pi, checked_whole_number("crack_rose: bins", bins, at_least=1, at_most=MOST_BINS) + 1)
    parts = (cracks[chosen] for chosen in (cracks.tensile, ~cracks.tensile))
    return Rose(edges, *(np.histogram(some.orientation, edges, weights=some.length)[0] for some in parts))


@attrs.frozen
class FailurePlane(metaclass=Checked):
    """Mean direction of cracks; nan where there are none."""

    angle: float  #: rad from the x axis, in [0, pi)
    strength: float  #: from 0, where the directions cancel and the angle has no meaning, to 1, where all are equal

    @property
    def _facts(self) -> dict[str, str]:
        if np.isnan(self.angle):
            return {"cracks": "0"}
        return {"angle": f"{np.degrees(self.angle):.1f} deg from the x axis", "alignment": f"{self.strength:.2f}"}


@checked
def failure_plane(of: Result | Cracks) -> FailurePlane:
    """Mean axis of the cracks of a result, or of some as ``cracks[~cracks.tensile]``, weighted by length.

    Angles are doubled before they are averaged, so that 1 and 179 deg give 0 (Mardia and Jupp 2000, ch. 9,
    doi:10.1002/9780470316979). The strength is the length of the mean unit vector. Two conjugate sets give the
    bisector of the acute angle between them.
    """
    cracks = _cracks(of)
    if not len(cracks):
        return FailurePlane(float("nan"), float("nan"))
    mean = np.average(np.exp(2j * cracks.orientation), weights=cracks.length)
    return FailurePlane(float(np.angle(mean) / 2 % np.pi), float(abs(mean)))
