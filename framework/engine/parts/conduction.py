"""Heat that flows through grains and across their contacts: an implicit step for the temperatures of nodes.

Between two steps of heat the zones go evenly from their temperatures to the next ones, step by step of the motion.

Index letters: ``i`` node, ``z`` zone, ``p`` contact point, ``e`` edge of the rim.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import scipy

from grainlaw.columns import COLDEST, HEAT_STORED, HEAT_SUPPLIED, HEAT_TIME, HOTTEST
from grainlaw.conditions import StageError
from grainlaw.engine.factors import Factors
from grainlaw.engine.parts.bonds import Bonds
from grainlaw.engine.parts.heat import EvenTemperature
from grainlaw.engine.parts.imposed import Imposed
from grainlaw.engine.parts.material_zones import MaterialZones
from grainlaw.engine.parts.part import Changing, Moment, Part
from grainlaw.engine.stability import shape_functions
from grainlaw.fields import ParameterError
from grainlaw.loads import Conduction, Convection, FixedTemperature, HeatBoundary, HeatFlux, HeatLoad, HeatSource
from grainlaw.material import Material
from grainlaw.memory import ROOM
from grainlaw.specimen import Specimen

SHARE = 0.1  #: of the duration: as much heat may pass in a step of the motion
CHANGE = 0.05  #: of the conductance of a contact point, from which on the factors are made anew


class ConductionBooks(NamedTuple):
    """Both ends of the present step of heat, and how far the motion is on the way from one to the other."""

    ends: Changing  #: (2, i) °C, of nodes
    clock: Changing  #: (2,) s of heat since the stage began
    supplied: Changing  #: (2,) J, that have come in
    steps: Changing  #: (2,) of the motion: done, and in all
    conductance: Changing  #: (p,) W/m2/K, by which the factors were made; nan before
    began: Changing  #: (1,) whether heat has flowed


class HeatFlow(Part):
    """Conduction of the present stage; without one temperatures stay as they are."""

    takes = (Conduction, HeatLoad)

    def __init__(self, specimen: Specimen, bonds: Bonds, materials: MaterialZones, even: EvenTemperature) -> None:
        self._specimen, self._bonds, self._materials, self._even = specimen, bonds, materials, even
        self.load: Conduction | None = None
        self._loads: list[HeatLoad] = []
        nodes, points = (len(specimen.mesh.nodes), 2 * len(bonds)) if specimen.conducts else (0, 0)
        self.books = ConductionBooks(
            np.full((2, nodes), ROOM), np.zeros(2), np.zeros(2), np.zeros(2, dtype=np.int64),
            np.full(points, np.nan), np.zeros(1, dtype=bool),
        )  # fmt: skip
        self._factors: tuple[float, Factors] | None = None  #: the step of heat (s) for which they were made, and they
        if specimen.conducts:
            self._lay()

    def _lay(self) -> None:
        """Capacity of nodes (J/K, a third of each zone to each corner) and conduction through zones (W/K), Eq. (28)."""
        specimen, mesh = self._specimen, self._specimen.mesh
        count = len(mesh.nodes)
        grains = np.empty((2, specimen.grains.count))
        for material, own in specimen.materials:
            assert isinstance(material, Material)
            grains[:, own] = [[material.heat_capacity], [material.conductivity]]
        warmth, ease = grains[:, mesh.zone_grain]
        warmth = warmth * specimen.zone_masses
        rows = shape_functions(mesh.nodes, mesh.zones)
        product = rows[:3, None] * rows[None, :3] + rows[3:6, None] * rows[None, 3:6]
        corner = mesh.zones.T
        at = np.broadcast_to(corner[:, None], product.shape), np.broadcast_to(corner[None], product.shape)
        self._zones = _matrix((product * (ease * mesh.zone_areas)).ravel(), at[0].ravel(), at[1].ravel(), count)
        self.capacity = np.bincount(corner.ravel(), np.tile(warmth / 3, 3), count)  #: (i,) J/K
        self._usual_step = float(np.median(warmth / ease))  # area over diffusivity

    # --- a stage -----------------------------------------------------------------------------------------------------

    def begin(self, imposed: Imposed, at: Moment) -> None:
        books, self._factors = self.books, None
        self.load = next(iter(imposed.of(Conduction)), None)
        self._loads = imposed.of(HeatLoad)
        if self.load is None:
            return
        if not books.began[0]:  # until now a schedule has warmed all of it evenly
            books.ends[:] = self._even.temperature
            books.supplied[:] = self._stored(books.ends[0])
            books.began[0] = True
        books.ends[:], books.supplied[:] = self.temperature, self._now(books.supplied)
        books.clock[:], books.steps[:], books.conductance[:] = 0.0, 0, np.nan
        mesh, count = self._specimen.mesh, len(self._specimen.mesh.nodes)
        self._fixed = np.zeros(count, dtype=bool)
        self._faces: dict[str, np.ndarray] = {}  # (i,) m of each boundary that belong to a node
        self._beyond = np.zeros(count)  # W/K to what is beyond the rim
        for load in self._loads:
            if not isinstance(load, HeatBoundary):
                continue
            edges = mesh.boundary_edges[load.boundary]
            half = np.hypot(*(mesh.nodes[edges[:, 1]] - mesh.nodes[edges[:, 0]]).T) / 2
            self._faces[load.boundary] = np.bincount(edges.ravel(), np.repeat(half, 2), count)
            if isinstance(load, FixedTemperature):
                self._fixed |= np.isin(mesh.point, mesh.point[mesh.boundaries[load.boundary]])
            elif isinstance(load, Convection):
                self._beyond += load.coefficient * self._faces[load.boundary]

    def restore(self, saved: dict[str, np.ndarray]) -> None:
        super().restore(saved)
        self._factors = None

    # --- a step of heat ----------------------------------------------------------------------------------------------

    @property
    def left(self) -> int:
        """Steps of the motion until the next step of heat."""
        done, of = self.books.steps.tolist()
        return int(of - done)

    def course(self, steps: int) -> np.ndarray:
        """(steps, 2) how far zones are on their way before and at each of the next steps, from 0 to 1."""
        done, of = self.books.steps.tolist()
        share = np.minimum(done + np.arange(steps + 1), of) / max(of, 1)
        return np.stack([share[:-1], share[1:]], axis=1)

    def count(self, steps: int) -> None:
        """Record steps of the motion that were done."""
        done, of = self.books.steps.tolist()
        self.books.steps[0] = min(done + steps, of)

    def follow(self, opening: np.ndarray, time_step: float) -> None:
        """Find the temperatures at the end of the next step of heat, if one has ended; the motion's step is in s.

        Contact points have opened by (p,) m. Raises :class:`StageError` for a temperature that a material does not
        know.
        """
        if self.load is None or self.left:
            return
        books, pace = self.books, self.load.speedup * time_step
        if pace > SHARE * self.load.duration:
            raise ParameterError(
                f"Conduction: speedup = {self.load.speedup:g}: {pace:.3g} s of heat pass in one step of the motion, "
                f"{time_step:.3g} s, more than a tenth of the duration = {self.load.duration:g} s: give a smaller one"
            )
        step = self.load.step or self._usual_step
        steps = max(1, round(step / pace))
        parts = max(1, math.ceil(steps * pace / step - 0.5))  # where even one of the motion's is longer
        length = steps * pace / parts
        self._take_conductance(opening)
        books.ends[0], books.clock[0], books.supplied[0] = books.ends[1], books.clock[1], books.supplied[1]
        for _ in range(parts):
            self._solve(length)
        books.steps[:] = 0, steps
        self._refuse_unknown()
        self._materials.warm(books.ends[1][self._specimen.mesh.zones].mean(axis=1))

    def _take_conductance(self, opening: np.ndarray) -> None:
        """Conductance of contact points by their state, Eq. (29); kept while it hardly changes."""
        assert self.load is not None
        aperture = np.maximum(opening + self._bonds.gaps, self.load.smallest_aperture)
        found = np.where(self._bonds.broken(), self.load.filling / aperture, self.load.bonded)
        before = self.books.conductance
        if not (np.abs(found - before) <= CHANGE * before).all():
            before[:], self._factors = found, None

    def _conduction(self) -> scipy.sparse.csr_matrix:
        """W/K between nodes, through zones and across contact points."""
        ends, count = self._bonds.ends, len(self.capacity)
        one, other = ends[:, :2].T.ravel(), ends[:, 2:].T.ravel()
        across = self.books.conductance * self._bonds.lengths
        return self._zones + _matrix(
            np.concatenate([across, across, -across, -across]), np.concatenate([one, other, one, other]),
            np.concatenate([one, other, other, one]), count,
        )  # fmt: skip

    def _solve(self, length: float) -> None:
        """One step of backward Euler, of ``length`` (s), Eq. (28), and the heat that has come in, Eq. (30).

        Nodes that are tied have one temperature, that of their point.
        """
        books, mesh, fixed = self.books, self._specimen.mesh, self._fixed
        point, first = mesh.point, mesh.first_of_point
        free, before = ~fixed[first], books.ends[1].copy()
        begin, end = float(books.clock[1]), float(books.clock[1]) + length
        if self._factors is None or self._factors[0] != length:
            between = self._conduction()
            matrix = scipy.sparse.csr_matrix(between + scipy.sparse.diags(self.capacity / length + self._beyond))
            if len(mesh.ties):
                gather = scipy.sparse.csr_matrix((np.ones(len(point)), (point, np.arange(len(point)))))
                matrix = scipy.sparse.csr_matrix(gather @ matrix @ gather.T)
            self._factors = length, Factors(matrix[free][:, free], mesh.nodes[first][free])
            self._between = scipy.sparse.triu(between, 1).tocoo()
        at = before[first]
        for load in self._loads:
            if isinstance(load, FixedTemperature):
                at[point[mesh.boundaries[load.boundary]]] = load.at(end)
        now = at[point]
        # From differences of temperatures: where there are none nothing is rounded, and little is lost where they are.
        coming = np.bincount(point, self._coming(begin, end, now) - self._leaving(now))
        if free.any():
            at[free] += self._factors[1].solve(coming[free])
            now = at[point]
        supplied = self._coming(begin, end, now)
        reaction = self.capacity / length * (now - before) + self._leaving(now) - supplied
        books.supplied[1] += length * float(np.sum(supplied) + np.sum(reaction[fixed]))
        books.ends[1], books.clock[1] = now, end

    def _leaving(self, temperature: np.ndarray) -> np.ndarray:
        """(i,) W that flow from each node to others."""
        pairs, count = self._between, len(temperature)
        through = pairs.data * (temperature[pairs.col] - temperature[pairs.row])
        return np.bincount(pairs.row, through, count) - np.bincount(pairs.col, through, count)

    def _coming(self, begin: float, end: float, temperature: np.ndarray) -> np.ndarray:
        """(i,) W that flow in at nodes of a temperature (i,) °C, mean from ``begin`` to ``end``, s of heat."""
        coming = np.zeros(len(self.capacity))
        mesh, times = self._specimen.mesh, (np.array([begin]), np.array([end]))
        for load in self._loads:
            if isinstance(load, HeatFlux):
                coming += load.course(*times)[0] * self._faces[load.boundary]
            elif isinstance(load, HeatSource):
                chosen = load.grains is None or np.isin(mesh.zone_grain, load.grains)
                each = np.repeat(np.where(chosen, mesh.zone_areas, 0.0) / 3, 3)
                coming += load.course(*times)[0] * np.bincount(mesh.zones.ravel(), each, len(coming))
            elif isinstance(load, Convection):
                coming += load.coefficient * (load.at(end) - temperature) * self._faces[load.boundary]
        return coming

    def _refuse_unknown(self) -> None:
        """Raise :class:`StageError` for temperatures at which a material is not known."""
        now, mesh = self.books.ends[1], self._specimen.mesh
        for material, grains in self._specimen.materials:
            assert isinstance(material, Material)
            low, high = material.temperatures
            own = np.isin(mesh.node_grain, grains)
            odd = np.flatnonzero(own & ~((now >= low) & (now <= high)))
            if len(odd):
                raise StageError(
                    f"grain {mesh.node_grain[odd[0]]} comes to {now[odd[0]]:g} °C after {self.books.clock[1]:g} s of "
                    f"heat, its material is known from {low:g} to {high:g} °C"
                )

    # --- what may be read --------------------------------------------------------------------------------------------

    def _stored(self, temperature: np.ndarray) -> float:
        return float(np.sum(self.capacity * (temperature - ROOM)))

    def _now(self, ends: np.ndarray) -> np.ndarray:
        """What both ends of the step of heat have, at the present moment."""
        done, of = self.books.steps.tolist()
        share = done / of if of else 1.0
        return ends[0] + (ends[1] - ends[0]) * share

    @property
    def temperature(self) -> np.ndarray:
        """(i,) °C of nodes, where heat has flowed."""
        return self._now(self.books.ends)

    @property
    def mean(self) -> float:
        """°C, of which each part counts by its capacity; of a specimen that has not conducted the only one."""
        if not self.books.began[0]:
            return self._even.temperature
        return float(np.sum(self.capacity * self.temperature) / np.sum(self.capacity))

    @property
    def columns(self) -> dict[str, float]:
        """What a run records of it; nothing before heat flows."""
        if not self.books.began[0]:
            return {}
        temperature = self.temperature
        return {
            HEAT_TIME: float(self._now(self.books.clock)),
            COLDEST: float(temperature.min()), HOTTEST: float(temperature.max()),
            HEAT_SUPPLIED: float(self._now(self.books.supplied)), HEAT_STORED: self._stored(temperature),
        }  # fmt: skip


def _matrix(values: np.ndarray, row: np.ndarray, column: np.ndarray, size: int) -> scipy.sparse.csr_matrix:
    return scipy.sparse.coo_matrix((values, (row, column)), shape=(size, size)).tocsr()
