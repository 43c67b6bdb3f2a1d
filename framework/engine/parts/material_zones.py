"""Zones of grains whose material is compiled, in groups of one material. Index letters: ``z`` zone, ``g`` group."""

from __future__ import annotations

import attrs
import numpy as np

from grainlaw.columns import THERMAL
from grainlaw.compiler.batch import Compiled, compile_material
from grainlaw.compiler.entry import compiled
from grainlaw.engine.parts.laws import LANES
from grainlaw.engine.parts.material_passes import (
    FRAME,
    STORED,
    STRAIN,
    STRESS,
    MaterialArrays,
    forces_of_zones,
    strains_at,
)
from grainlaw.engine.parts.part import Part, Split
from grainlaw.engine.stability import shape_functions
from grainlaw.material import Material
from grainlaw.memory import ROOM
from grainlaw.specimen import Specimen


@attrs.frozen(eq=False)
class ZoneGroup:
    """Zones ``first`` to ``last`` of one material, whose places in the mesh are ``zones``."""

    material: Material
    stress: Compiled
    energy: Compiled
    zones: np.ndarray
    first: int
    last: int
    conducts: bool  #: whether each zone has a temperature of its own

    @property
    def memory(self) -> tuple[str, ...]:
        """Names of the memory."""
        return self.stress.memory

    @property
    def knows_temperature(self) -> bool:
        """Whether the material knows the temperature."""
        return self.conducts or "temperature" in (*self.stress.scalars, *self.energy.scalars)

    @property
    def rows(self) -> int:
        """Rows of the memory: that of the material, and the temperature of each zone where it conducts."""
        return len(self.memory) + self.conducts

    @property
    def keeps(self) -> bool:
        """Whether the work on its zones is kept."""
        return bool(self.memory) or self.knows_temperature


class MaterialZones(Part):
    """The zones of grains whose material is not :class:`~grainlaw.Elastic`; rigid grains have none."""

    def __init__(self, specimen: Specimen) -> None:
        mesh, groups = specimen.mesh, _groups(specimen)
        self.groups, values, numbers, places = _with_common_numbers(groups)
        chosen = [group.zones for group in self.groups]
        self.chosen = np.concatenate([np.zeros(0, dtype=np.int64), *chosen])  #: zones of the mesh, in this order
        count = len(self.chosen)
        self._before = np.zeros((len(self.groups), len(mesh.first_zone)), dtype=np.int64)
        for g, group in enumerate(self.groups):
            self._before[g] = group.first + np.searchsorted(group.zones, mesh.first_zone)
        gradients = shape_functions(mesh.nodes, mesh.zones)[[0, 1, 3, 4, 6]][:, self.chosen]
        self._count = len(mesh.zones)
        kept = count if any(group.keeps for group in self.groups) else 0
        address = np.array([(g.stress.address, g.energy.address) for g in self.groups], dtype=np.int64).reshape(-1, 2)
        told = [(len(g.memory) if g.conducts else -1, g.keeps, g.knows_temperature) for g in self.groups]
        row, keeps, knows = np.array(told, dtype=np.int64).reshape(-1, 3).T.copy()
        warm = count if any(group.conducts for group in self.groups) else 0
        corner = np.ascontiguousarray(mesh.zones[self.chosen].T, dtype=np.int32)
        rows = [np.ascontiguousarray(row) for row in gradients]
        rows += [address, numbers, values, places, row]
        rows += [np.full(2, ROOM), np.zeros(warm), np.ones(warm), keeps, knows]
        rows.append(_in_one([(group, group.stress.rows) for group in self.groups], count))
        rows.append(_in_one([(group, group.energy.rows) for group in self.groups], count))
        rows.append(np.zeros((max((group.rows for group in self.groups), default=0), count)))
        rows += [np.zeros((3, kept)), np.zeros((3, kept)), np.zeros(kept), np.zeros(kept)]
        rows += [
            np.zeros((STORED + 2, count)),
            np.zeros((0, 0, LANES)),
            np.zeros((len(self.groups), 2), dtype=np.int64),
        ]
        self.arrays = MaterialArrays(corner, *rows)
        for group in self.groups:  # where a grain is not free of stress at first, heat has stored its energy
            if group.conducts:
                self.arrays.memory[len(group.memory), group.first : group.last] = ROOM
            if group.knows_temperature:
                (stored,) = group.energy.batch(*np.zeros((3, group.last - group.first)), self._memory(group))
                self.arrays.thermal[group.first : group.last] = -stored

    def share(self, split: Split) -> np.ndarray:
        return np.ascontiguousarray(self._before[:, split.grain])

    def shared(self, split: Split) -> MaterialArrays:
        a = self.arrays
        rows = max(len(a.fields), len(a.others)) + len(a.memory) + STORED
        return a._replace(few=np.zeros((split.threads, rows, 1 if split.alone else LANES)), share=self.share(split))

    def energy(self, time_step: float) -> dict[str, float]:
        if not len(self.arrays.thermal):
            return {}
        return {THERMAL: float(np.sum(self.arrays.thermal * self.arrays.area))}

    def take_temperature(self, temperature: float) -> None:
        """Tell the materials the temperature (°C) at which they are asked between steps."""
        places = self.arrays.temperature_place[self.arrays.temperature_place >= 0]
        self.arrays.values[places] = temperature

    @property
    def temperatures(self) -> np.ndarray:
        """(z,) °C at the last forces, of zones that conduct, in the order of ``chosen``; empty where none does."""
        found = np.empty(len(self.arrays.base))
        for group in self.groups if len(found) else ():
            found[group.first : group.last] = self.arrays.memory[len(group.memory), group.first : group.last]
        return found

    def warm(self, to: np.ndarray) -> None:
        """Let zones that conduct go from their temperatures to others (z,) °C, in the order of the mesh."""
        self.arrays.base[:] = self.temperatures
        self.arrays.rise[:] = to[self.chosen] - self.arrays.base

    def force_per_kelvin(self, displacement: np.ndarray, temperature: float, by: float) -> np.ndarray:
        """(2, i) N/K on nodes at (2, i) m: the change of the zones' forces by a change ``by`` (K), over it."""
        a, force = self.arrays, np.zeros_like(displacement)
        compiled(strains_at)(a, displacement)
        a.scratch[STRESS:STORED] = 0.0
        for group in self.groups:
            own = slice(group.first, group.last)
            found = []
            for at in (temperature + by, temperature):
                self.take_temperature(at)
                memory = self._memory(group)
                if group.conducts:
                    memory[len(group.memory)] = at
                found.append(np.stack(group.stress.batch(*a.scratch[STRAIN:STRESS, own], memory)))
            a.scratch[STRESS:STORED, own] = (found[0] - found[1]) / by
        compiled(forces_of_zones)(a, force)
        return force

    def memory(self, name: str) -> np.ndarray:
        """(z,) one variable of the materials' memory, in the order of the mesh; zero where there is none."""
        values = np.zeros(self._count)
        for group in self.groups:
            if name in group.memory:
                values[group.zones] = self.arrays.memory[group.memory.index(name), group.first : group.last]
        return values

    def _memory(self, group: ZoneGroup) -> np.ndarray:
        """(m, z) memory of a group, a copy; one row without use where it has none."""
        rows = self.arrays.memory[: group.rows, group.first : group.last]
        return rows.copy() if group.rows else np.zeros((1, group.last - group.first))

    def states(self, displacement: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Stress (z, 3) Pa, stored energy and energy dissipated so far (z,) J/m3 at (2, i) m, that of the last forces.

        In the order of ``chosen``; the stress as xx, yy, xy in the fixed axes.
        """
        a = self.arrays
        compiled(strains_at)(a, displacement)
        stress, stored, lost = np.empty((3, len(self.chosen))), np.empty(len(self.chosen)), np.zeros(len(self.chosen))
        for group in self.groups:
            own = slice(group.first, group.last)
            memory = self._memory(group)
            strain = (a.strain if group.keeps else a.scratch[STRAIN:STRESS])[:, own]
            stress[:, own] = a.stress[:, own] if group.keeps else group.stress.batch(*strain, memory)
            (stored[own],) = group.energy.batch(*strain, memory)
            if group.memory:
                lost[own] = a.work[own] - a.thermal[own] - stored[own]
        (p, q, t), cs, sn = stress, a.scratch[FRAME], a.scratch[FRAME + 1]
        fixed = cs**2 * p + sn**2 * q - 2 * cs * sn * t, sn**2 * p + cs**2 * q + 2 * cs * sn * t
        return np.stack([*fixed, cs * sn * (p - q) + (cs**2 - sn**2) * t], axis=1), stored, lost


def _in_one(rows: list[tuple[ZoneGroup, np.ndarray]], count: int) -> np.ndarray:
    """(r, count) rows of all groups, each where its zones are."""
    found = np.zeros((max((len(own) for _, own in rows), default=0), count))
    for group, own in rows:
        found[: len(own), group.first : group.last] = own
    return found


def _with_common_numbers(groups: list[ZoneGroup]) -> tuple[list[ZoneGroup], np.ndarray, np.ndarray, np.ndarray]:
    """The groups with their numbers in one array, that array, addresses in it (g, 3), places of temperatures (g, 3).

    The numbers of the energy are there twice, for the temperatures before and after a step.
    """
    each = [one for group in groups for one in (group.stress, group.energy, group.energy)]
    ends = np.cumsum([0, *(len(one.numbers) for one in each)])
    values = np.concatenate([np.zeros(0), *(one.numbers for one in each)])
    places = [
        end - len(one.scalars) + one.scalars.index("temperature") if "temperature" in one.scalars else -1
        for one, end in zip(each, ends[1:].tolist(), strict=True)
    ]
    joined = []
    for k, group in enumerate(groups):
        a, b, c = ends[3 * k : 3 * k + 3]
        stress = attrs.evolve(group.stress, numbers=values[a:b])
        joined.append(attrs.evolve(group, stress=stress, energy=attrs.evolve(group.energy, numbers=values[b:c])))
    address = values.ctypes.data + 8 * ends[:-1].astype(np.int64)
    return joined, values, address.reshape(-1, 3), np.array(places, dtype=np.int64).reshape(-1, 3)


def _groups(specimen: Specimen) -> list[ZoneGroup]:
    """The materials that are compiled, with their zones."""
    found: list[ZoneGroup] = []
    owner, first = specimen.mesh.zone_grain, 0
    for material, grains in specimen.materials:
        if not isinstance(material, Material) or specimen.is_elastic[grains[0]]:
            continue
        zones = np.flatnonzero(np.isin(owner, grains))
        each = np.searchsorted(grains, owner[zones])
        stress, energy = (
            attrs.evolve(one, rows=np.ascontiguousarray(one.rows[:, each]))
            for one in compile_material(material, len(grains), ("temperature",) if specimen.conducts else ())
        )
        last = first + len(zones)
        found.append(ZoneGroup(material, stress, energy, zones, first, last, specimen.conducts))
        first = last
    return found
