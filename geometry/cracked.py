"""Initial cracks: contacts between grains that have no bond before a test begins."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import attrs
import numpy as np

from grainlaw.arguments import checked
from grainlaw.edge_keys import CRACKS
from grainlaw.fields import ParameterError, parameter, whole_number
from grainlaw.messages import refusal
from grainlaw.region import Region
from grainlaw.tessellation import BETWEEN, INSIDE, Edges, Tessellation, Tessellator


def _pairs(value: Any) -> tuple[tuple[int | str, int | str], ...] | None:
    if value is None:
        return None
    if not isinstance(value, Sequence) or isinstance(value, str) or not len(value):
        raise refusal("Cracked: between", value, "a list of pairs of phases, or None for all")
    for pair in value:
        named = isinstance(pair, Sequence) and not isinstance(pair, str) and len(pair) == 2
        if not named or not all(isinstance(phase, (int, str)) for phase in pair):
            raise refusal("Cracked: between", pair, "a pair of phases by name or number, such as ('quartz', 'mica')")
    return tuple((a, b) for a, b in value)


@attrs.frozen
class Cracked(Tessellator):
    """The grains of another tessellator, some of whose contacts are cracked before the test.

    ``Cracked(Voronoi(grains=755), share=0.1)``: edges between grains are drawn at random until they have a share of the
    length of all that are asked for, to half an edge. They are ``joints`` of the tessellation, by the ``name`` that
    laws know them by: ``{"initial cracks": Friction(kn=..., ks=..., friction_angle=30), ...: law}`` closes and rubs
    without tension and cohesion.

    Asked for may be the edges ``between`` pairs of phases, those at least as long as ``least`` grain sizes, and those
    whose direction is ``within`` an angle of ``direction``. The same seed draws the same edges first, whatever the
    share. Joints of the tessellator stay what they are. Raises ParameterError where no edge is asked for.
    """

    tessellator: Tessellator  #: makes the grains
    share: float = parameter("1", above=0, at_most=1)  #: of the length of the edges that are asked for
    between: Any = attrs.field(default=None, converter=_pairs)  #: pairs of phases; None: all
    least: float = parameter("grain sizes", default=0.0, at_least=0)  #: shorter edges stay whole
    direction: float = parameter("deg", default=0.0, at_least=-180, at_most=180)  #: from the x axis, counter-clockwise
    within: float = parameter("deg", default=90.0, above=0, at_most=90)  #: of it; 90: all directions
    seed: int = whole_number(at_least=0, default=1)  #: of the random numbers
    name: str = attrs.field(default=CRACKS)  #: of the joint

    def __attrs_post_init__(self) -> None:
        if not isinstance(self.name, str) or self.name in (BETWEEN, INSIDE, ""):
            raise refusal("Cracked: name", self.name, f"a text, not {BETWEEN} or {INSIDE}")

    @checked
    def tessellate(self, region: Region) -> Tessellation:
        """Fill a region and draw the edges."""
        grains = self.tessellator.tessellate(region)
        if self.name in grains.joints:
            raise ParameterError(f"Cracked: name = '{self.name}' is not allowed, the grains have joints of this name")
        edges = grains.edges
        asked = np.flatnonzero(self._asked(grains, edges))
        if not len(asked):
            raise ParameterError(f"Cracked: no edge of the {grains.count} grains is asked for by {self._words()}")
        asked = np.random.default_rng(self.seed).permutation(asked)
        length = edges.length[asked]
        count = np.searchsorted(np.cumsum(length) - length / 2, self.share * length.sum(), side="right")
        drawn = asked[: max(int(count), 1)]
        ends = np.column_stack([edges.start[drawn], edges.end[drawn]])
        return attrs.evolve(grains, joints={**grains.joints, self.name: ends})

    def _asked(self, grains: Tessellation, edges: Edges) -> np.ndarray:
        """(e,) whether an edge may be drawn."""
        x, y = (grains.vertices[edges.end] - grains.vertices[edges.start]).T
        turned = np.degrees(np.arctan2(y, x)) - self.direction
        apart = np.abs((turned + 90) % 180 - 90)  # of lines, from 0 to 90 degrees
        asked = (edges.right >= 0) & (edges.kind == 0) & (edges.length >= self.least * grains.grain_size)
        asked &= apart <= self.within * (1 + 1e-12)
        if self.between is None:
            return asked
        phases = np.sort(grains.phase[np.stack([edges.left, edges.right])], axis=0)
        found = np.zeros(len(asked), dtype=bool)
        for pair in self.between:
            numbers = [grains.phase_number(phase) for phase in pair]
            if None in numbers or not set(numbers) <= set(grains.phase.tolist()):
                known = ", ".join(map(grains.phase_name, np.unique(grains.phase).tolist()))
                raise ParameterError(f"Cracked: between: there is no pair {pair!r} (phases: {known})")
            found |= (phases == np.sort(np.array(numbers, dtype=int))[:, None]).all(axis=0)
        return asked & found

    def _words(self) -> str:
        between = "" if self.between is None else f"between = {self.between!r}, "
        return f"{between}least = {self.least:g}, direction = {self.direction:g}, within = {self.within:g}"
