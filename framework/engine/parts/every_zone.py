"""The zones of all grains in the order of the mesh, whichever part they are in: what may be read of them."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from grainlaw.engine.parts.material_zones import MaterialZones
from grainlaw.engine.parts.zones import Zones
from grainlaw.specimen import Specimen

States = tuple[np.ndarray, np.ndarray, np.ndarray]  #: stress, stored energy, dissipated energy


class EveryZone:
    """Zones (z) of elastic grains and of other materials; none where grains are rigid."""

    def __init__(self, specimen: Specimen, elastic: Zones, materials: MaterialZones) -> None:
        self._specimen, self._elastic, self._materials = specimen, elastic, materials
        self.known: tuple[int, States] | None = None  #: at which step they were found
        self.areas = specimen.mesh.zone_areas[: 0 if specimen.is_rigid else None]  #: (z,) m2

    def states(self, step: int, displacement: Callable[[], np.ndarray]) -> States:
        """Stress (z, 3) Pa, stored energy and energy dissipated so far (z,) J/m3, at the (2, i) m of the last forces.

        The stress as xx, yy, xy in the fixed axes. They are found once for each ``step``.
        """
        if self.known is None or self.known[0] != step:
            self.known = step, self._find(displacement())
        return self.known[1]

    def _find(self, displacement: np.ndarray) -> States:
        stress, stored = self._elastic.stress_and_energy(displacement)
        lost, chosen = np.zeros(len(self.areas)), self._materials.chosen
        if not len(chosen):
            return stress, stored, lost
        every, energy = np.empty((len(lost), 3)), np.empty(len(lost))
        every[self._elastic.chosen], energy[self._elastic.chosen] = stress, stored
        every[chosen], energy[chosen], lost[chosen] = self._materials.states(displacement)
        return every, energy, lost

    def mean_stress(self, stress: np.ndarray) -> np.ndarray:
        """(g, 3) Pa, means over grains of the stress (z, 3) of their zones."""
        grains, mesh = self._specimen.grains, self._specimen.mesh
        rows = stress.T * self.areas
        sums = [np.bincount(mesh.zone_grain, row, grains.count) for row in rows]
        return np.stack(sums, axis=1) / grains.areas[:, None]
