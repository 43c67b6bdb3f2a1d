"""An opening excavated in a rock that is under stress."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import attrs
import numpy as np

from grainlaw.columns import TIME, Panel
from grainlaw.conditions import AtRest, Curves
from grainlaw.engine.state import State
from grainlaw.fields import IN_SITU, optional, parameter, part, whole_number
from grainlaw.integration import CentralDifference, Integrator
from grainlaw.loads import Drive, Traction, require_hole
from grainlaw.protocol import LoadingProtocol
from grainlaw.quantity import Quantity
from grainlaw.specimen import Specimen
from grainlaw.stage import Load, Stage
from grainlaw.units import MPa

PASSAGES, RIGID = 6, 2e-4  #: of a shear wave through the rock, in which the rim is let go; s where no waves run
MOST = 20  #: times that, in which the rock must come to rest
BESIDE = 10.0  #: degrees: how far from an axis the rim is taken for its end


@attrs.frozen(kw_only=True)
class Excavation(LoadingProtocol):
    """A rock comes under a stress, with an opening as if it were still full; then what held its rim is let go slowly.

    The specimen's region has the opening as a hole, such as :func:`~grainlaw.geometry.plate_with_hole` makes. At first
    tractions of the ``stress`` are on all boundaries, so that the rock is in equilibrium; then those on the rim of the
    opening fall to zero in the time ``release``, slowly: with twice the time it should close and crack alike.
    Displacements count from there. The rock around goes on with the same stress on its other boundaries, or with these
    ``held`` where they are: what is far from the opening is between. Where nothing is held the whole rock may move a
    little, for local damping does not conserve its momentum.
    """

    #: stress of the rock along x, tension positive
    xx: float = parameter("Pa", default=-20 * MPa, above=-np.inf, usual=IN_SITU)
    yy: float = parameter("Pa", default=-60 * MPa, above=-np.inf, usual=IN_SITU)  #: along y
    xy: float = parameter("Pa", default=0.0, above=-np.inf)  #: shear stress
    opening: str = "hole"  #: name of the boundary that is excavated
    held: bool = part(bool, False)  #: whether the other boundaries stay where they are while the rim is let go
    #: time in which the forces on its rim are let go; unless given, six passages of a shear wave through the rock
    release: float | None = optional("s", above=0)
    rest: float = parameter("1", default=1e-4)  #: ratio at which the rock counts as at rest
    #: in the time release; in a twentieth of that of six passages where this is longer
    samples: int = whole_number(default=100, at_least=10)
    integrator: Integrator = part(Integrator, CentralDifference())  #: the time integration, with its damping

    quantities = (
        Quantity("width", "mm", words="change of width", meaning="of the opening"),
        Quantity("height", "mm", words="change of height", meaning="of the opening"),
        Quantity("closure_x", "mm", is_main=True),
        Quantity("closure_y", "mm", is_main=True),
        Quantity(TIME, "ms", meaning="since the start"),
    )
    panels = (Panel(TIME, ["width", "height"], "change of the size of the opening"),)

    def stages(self, specimen: Specimen) -> Sequence[Stage]:
        require_hole("Excavation", specimen, self.opening)
        sides = [name for name in specimen.mesh.boundaries if name != self.opening]
        slowly = PASSAGES * specimen.longest_passage or RIGID
        release = self.release or slowly
        sampled = max(release, slowly / MOST)  # a rim that is let go at once needs no samples in that time
        limit = MOST * math.ceil(self.samples * max(1.0, slowly / sampled))
        stress, interval = (self.xx, self.yy, self.xy), sampled / self.samples
        rising = [Traction(boundary=name, stress=stress, ramp=release) for name in (*sides, self.opening)]
        far: list[Load] = [Traction(boundary=name, stress=stress) for name in sides]
        if self.held:
            far = [Drive(boundary=name, axis=axis, speed=0.0) for name in sides for axis in (0, 1)]
        rim = Traction(boundary=self.opening, stress=stress, factor=0.0, start=1.0, ramp=release)
        end = [AtRest(self.rest)]
        return [
            Stage(
                name="stress", loads=rising, until=end, interval=interval, integrator=self.integrator, static=True,
                sample_limit=limit,
            ),
            Stage(
                name="excavate", loads=[*far, rim], until=end, interval=interval, integrator=self.integrator,
                expected=2 * self.samples, sample_limit=limit,
            ),
        ]  # fmt: skip

    def measure(self, state: State) -> dict[str, float]:
        """``width`` and ``height`` (m): how much wider and higher the opening is than undeformed.

        From the means over the rim within 10 degrees of its horizontal and its vertical axis; where no node is so near,
        as at a side of a square between two corners, between those beside the axis.
        """
        mesh = state.mesh
        nodes = mesh.boundaries[self.opening]
        place, moved = mesh.nodes[nodes], state.displacement[nodes]
        x, y = (place - (place.min(axis=0) + place.max(axis=0)) / 2).T
        angle = np.degrees(np.arctan2(y, x))
        right, left, top, bottom = (_at((angle - towards + 180) % 360 - 180, moved) for towards in (0, 180, 90, -90))
        return {"width": float(right[0] - left[0]), "height": float(top[1] - bottom[1])}

    def summary(self, curves: Curves, specimen: Specimen) -> dict[str, Any]:
        """By how much the opening has closed (m) along x and y since it was full."""
        full = int(np.flatnonzero(curves["stage"] == 0)[-1])
        closed = {axis: float(curves[of][full] - curves[of][-1]) for axis, of in (("x", "width"), ("y", "height"))}
        return {f"closure_{axis}": value for axis, value in closed.items()}


def _at(beside: np.ndarray, moved: np.ndarray) -> np.ndarray:
    """(2,) m, how far the rim has moved at an axis, of nodes (n, 2) m that lie ``beside`` it (n,) degrees."""
    near = np.abs(beside) <= BESIDE
    if near.any():
        return np.asarray(moved[near].mean(axis=0))
    order = np.argsort(beside)
    return np.array([np.interp(0.0, beside[order], moved[order, axis]) for axis in (0, 1)])
