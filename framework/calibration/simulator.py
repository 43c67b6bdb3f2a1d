"""Who answers what a rock with some parameters would do in the laboratory: a study of simulated tests, or a formula."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping, Sequence

import attrs
import numpy as np

from grainlaw.arguments import Checked

Values = dict[str, np.ndarray]  #: of each quantity (n, seeds), nan where a test failed


@attrs.frozen
class Failure:
    """A test that gave no value."""

    point: int
    seed: int
    test: str
    reason: str


class Simulator(metaclass=Checked):
    """Answers points of parameters. A whole one, a rock whose strengths are those of its contacts::

    class Formula(Simulator):
        def values(self, points, quantities, seeds, scales):
            strength = np.array([point["tensile_strength"] for point in points])
            scatter = np.random.default_rng(seeds).normal(1, 0.05, (len(points), len(seeds)))
            return {name: strength[:, None] * scatter for name in quantities}
    """

    failures: Sequence[Failure] = ()  #: of all that was asked so far
    cpu: float = 0.0  #: s, of all that was asked so far

    @abstractmethod
    def values(
        self, points: Sequence[Mapping[str, float]], quantities: Sequence[str], seeds: Sequence[int],
        scales: np.ndarray,
    ) -> Values:  # fmt: skip
        """Quantities (SI) of points on specimens of these seeds.

        ``scales`` tells of each point how many times stronger the rock is for which it stands: that rock is tested
        under confinement, and values with the dimension of a stress are those of the rock over the scale.
        """
