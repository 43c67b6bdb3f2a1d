"""Steel platens between a specimen and what loads it."""

from __future__ import annotations

from typing import Any

import attrs
import numpy as np

from grainlaw.arguments import checked
from grainlaw.fields import checked_whole_number
from grainlaw.geometry.bodies import renamed, side_by_side
from grainlaw.geometry.bricks import Bricks
from grainlaw.geometry.region import check_sizes
from grainlaw.region import Region
from grainlaw.tessellation import Tessellation


@checked
def between_platens(
    grains: Tessellation, thickness: float, overhang: float = 0.0, phase: int = 1, columns: int = 1, rigid: bool = False
) -> Tessellation:
    """Grains between two platens (m) that touch the box round it, above and below, as bodies of their own.

    Boundaries top and bottom become the outer sides of the platens, so that tests load through them; those of the
    grains are then rock_top and rock_bottom. The inner sides of the platens are platen_top and platen_bottom, their
    ends platen_side: such platens bend and shorten, as only their outer sides are driven. A ``rigid`` platen has all
    its sides in the boundary top, or bottom, so that its whole rim is driven and keeps its shape; only the middles of
    its bricks are free. Platens are as wide as the grains and an ``overhang`` on either side, each of ``columns``
    bonded bricks, and of a mineral phase of their own. Steel and rock meet by the law between their phases::

        grains = Voronoi(grains=500).tessellate(rectangle(0.05, 0.1))
        specimen = gl.Specimen(between_platens(grains, 0.02, columns=4), {0: rock, 1: steel})
        bond = gl.laws.Linear(kn=1e14, ks=1e14)
        law = {(0, 0): bond, (0, 1): gl.laws.Friction(kn=1e14, ks=1e14, friction_angle=10), (1, 1): bond}

    Raises :class:`~grainlaw.fields.ParameterError`.
    """
    check_sizes("between_platens", thickness=thickness)
    check_sizes("between_platens", zero=True, overhang=overhang)
    phase = checked_whole_number("between_platens: phase", phase, at_least=0)
    low = np.min([region.bounds[0] for region in grains.regions], axis=0)
    high = np.max([region.bounds[1] for region in grains.regions], axis=0)
    left, right = low[0] - overhang, high[0] + overhang

    def platen(bottom: float, top: float, outer: str, *sides: str) -> Tessellation:
        sides = (outer,) * 4 if rigid else sides
        region = Region(np.array([(left, bottom), (right, bottom), (right, top), (left, top)]), sides)
        made: Any = Bricks(rows=1, columns=columns).tessellate(region)
        return attrs.evolve(made, phase=np.full(made.count, phase))

    return side_by_side(
        renamed(grains, {"top": "rock_top", "bottom": "rock_bottom"}),
        platen(high[1], high[1] + thickness, "top", "platen_top", "platen_side", "top", "platen_side"),
        platen(low[1] - thickness, low[1], "bottom", "bottom", "platen_side", "platen_bottom", "platen_side"),
    )
