"""A material on the bench: its scale and its answers along all paths, each found once for the properties that ask."""

from __future__ import annotations

import functools

import numpy as np

from grainlaw.material import Material
from grainlaw.workbench.paths import straight
from grainlaw.workbench.zone import MaterialTrace, Zone, alone_material

LAPS = 3  #: of every path, the last of them settled
STEPS = 30  #: of a leg
DIRECTIONS = ((1, 0, 0), (0, 1, 0), (1, 1, 0), (1, -1, 0), (0, 0, 1), (1, 0, 1), (0.3, -1, 0))  #: xx, yy, xy
LADDER = np.geomspace(1e-7, 1e-1, 49)  #: strains at which the end of the first response is looked for
FALLBACK = 1e-3  #: of a material whose first response does not end
SMALL = 1e-3  #: of the scale: strains of the first response


class MaterialBench:
    """A material with its scale and its answers along all paths."""

    def __init__(self, material: Material, zone: Zone | None = None) -> None:
        self.material = material
        self.zone: Zone = zone or alone_material(material)
        self.declared = self.zone.stiffness * [1.0, 1.0, 2.0]  #: Pa, over the components of the strain tensor

    @functools.cached_property
    def scale(self) -> float:
        """The least strain, in any direction and of either sign, at which the first response has ended by 1 %."""
        ends = [FALLBACK]
        for direction in (sign * np.array(d, dtype=float) for d in DIRECTIONS for sign in (1, -1)):
            expected = np.abs(self.declared @ direction).max()
            for size in LADDER.tolist():
                stress = np.array(self.zone.step((size * direction).tolist(), self.zone.start)[:3])
                if not np.abs(stress - size * self.declared @ direction).max() < 0.01 * size * expected:
                    ends.append(size)
                    break
        return min(ends)

    @functools.cached_property
    def paths(self) -> dict[str, np.ndarray]:
        """Laps of closed paths of strains (i, 3), scaled to the end of the first response."""
        a, b, n = 0.8 * self.scale, 3.0 * self.scale, 0.0
        corners = {
            "stretch, release, compress": [(a, n, n), (n, n, n), (b, n, n), (n, n, n), (-b, n, n)],
            "the same across": [(n, a, n), (n, n, n), (n, b, n), (n, n, n), (n, -b, n)],
            "shear, reverse": [(n, n, a), (n, n, -a), (n, n, b), (n, n, -b)],
            "shear while pressed": [(-a, -a, n), (-a, -a, b), (-a, -a, -b), (-b, -b, -b), (-b, -b, b)],
            "swell and shear": [(a, a, n), (a, a, a), (b, b, b), (n, n, b)],
            "press one way, then the other": [(-b, b / 3, n), (n, n, n), (b / 3, -b, n)],
            "turn the axes": [(a, -a, n), (n, n, a), (-a, a, n), (n, n, -a), (b, -b, n), (n, n, b)],
        }
        random = np.random.default_rng(7)
        for k in range(4):
            corners[f"random path {k}"] = [tuple(c) for c in random.normal(size=(5, 3)) * 1.5 * self.scale]
        shares = np.arange(STEPS)[:, None] / STEPS
        origin = (0.0, 0.0, 0.0)
        return {name: straight(np.array([origin, *inner] * LAPS + [origin]), shares) for name, inner in corners.items()}

    @functools.cached_property
    def traces(self) -> dict[str, MaterialTrace]:
        """Answers along ``paths``."""
        return {name: self.zone.trace(path) for name, path in self.paths.items()}


def at(strain: np.ndarray) -> str:
    """A strain in words."""
    return f"the strain xx {strain[0]:.4g}, yy {strain[1]:.4g}, xy {strain[2]:.4g}"
