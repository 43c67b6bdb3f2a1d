"""The state of a running specimen: its parts, and what may be read from them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from operator import is_not
from typing import Any

import numpy as np

from grainlaw.arguments import Checked
from grainlaw.compiler.batch import Compiled
from grainlaw.compiler.numba_private import Table
from grainlaw.engine.contacts.contacts import Contacts
from grainlaw.engine.model import Model
from grainlaw.engine.parts.bonds import Bonds
from grainlaw.engine.parts.boundaries import Boundaries
from grainlaw.engine.parts.breaks import Breaks
from grainlaw.engine.parts.clock import Clock
from grainlaw.engine.parts.conduction import HeatFlow
from grainlaw.engine.parts.deformable_grains import DeformableGrains, TiedGrains
from grainlaw.engine.parts.drives import Drives
from grainlaw.engine.parts.ended import Ended
from grainlaw.engine.parts.every_zone import EveryZone
from grainlaw.engine.parts.fluids import Fluids
from grainlaw.engine.parts.freedoms import Nodes
from grainlaw.engine.parts.grains import Grains
from grainlaw.engine.parts.gravity import Weight
from grainlaw.engine.parts.heat import EvenTemperature
from grainlaw.engine.parts.imposed import Imposed
from grainlaw.engine.parts.material_zones import MaterialZones
from grainlaw.engine.parts.part import Moment, Part, Split, check_names
from grainlaw.engine.parts.platens import Platens
from grainlaw.engine.parts.pressures import Pressures
from grainlaw.engine.parts.quiet import QuietBoundaries
from grainlaw.engine.parts.rigid_grains import RigidGrains
from grainlaw.engine.parts.steady import Steady
from grainlaw.engine.parts.tractions import Tractions
from grainlaw.engine.parts.zones import Zones
from grainlaw.engine.step import Parts, Shared
from grainlaw.fields import ParameterError
from grainlaw.loads import InitialVelocity
from grainlaw.messages import LIKE, nearest
from grainlaw.specimen import Specimen
from grainlaw.stage import Load, Stage

Saved = dict[str, dict[str, np.ndarray]]  #: by part and name


def grains_of(specimen: Specimen) -> Grains:
    """How the nodes of a specimen follow its freedoms."""
    if specimen.is_rigid:
        return RigidGrains(specimen)
    return TiedGrains(specimen) if len(specimen.mesh.ties) else DeformableGrains(specimen)


class State(metaclass=Checked):
    """Everything that changes while a specimen is loaded. Observers and protocols read it; only the engine writes.

    Letters as in :class:`~grainlaw.mesh.Mesh`; ``p`` contact points: the first points of all bonds, then the second.
    """

    def __init__(self, model: Model) -> None:
        specimen, detection, self.model = model.specimen, model.detection, model
        self.specimen, self.mesh = specimen, specimen.mesh
        self.stage, self.began, self.time_step, self.mass_added = "", 0.0, 0.0, 0.0
        self.usual_end, self.stages = 0.0, 1  #: s, when the present stage usually ends, 0 if unknown; of the test
        self.nodes = Nodes(len(self.mesh.nodes))
        self.grains = grains_of(specimen)
        self.freedoms = self.grains.freedoms(self.nodes)
        self.zones, self.materials = Zones(specimen), MaterialZones(specimen)
        self.every_zone = EveryZone(specimen, self.zones, self.materials)
        self.bonds = Bonds(specimen, *model.bonds, detection)
        self.imposed = Imposed(self.mesh)
        self.drives = Drives(self.grains, self.freedoms)
        self.platens = Platens(self.mesh, self.drives, self.freedoms)
        self.pressures, self.tractions = Pressures(specimen), Tractions(self.mesh)
        self.quiet, self.fluids = QuietBoundaries(specimen, self.freedoms), Fluids(specimen, self.bonds)
        self.gravity = Weight(self.freedoms, self.grains.true_mass())
        self.boundaries, self.ended = Boundaries(self.mesh, self.nodes, self.drives), Ended()
        self.contacts = Contacts(self.grains, model.contacts, detection, self.bonds.ends)
        self.clock, self.breaks = Clock(), Breaks(2 * len(self.bonds), specimen.vicinity[1])
        self.heat = EvenTemperature(self.materials)
        self.conduction = HeatFlow(specimen, self.bonds, self.materials, self.heat)
        self.steady = Steady(self.freedoms, self.heat)
        self._splits: dict[int, Split] = {}  #: by number of threads
        self._shared: dict[str, tuple[Split, Any, Table]] = {}  #: for whom, arrays and what was made of them, by part
        self._last: Shared | None = None  #: what the last steps were given of all parts
        self.on_device: Any = None  #: a device that does the steps, and the arrays in its memory
        self.search(self.displacement_at_forces())

    @property
    def parts(self) -> dict[str, Part]:
        """All parts by name, in the order in which the ledger adds them up."""
        return {
            "drives": self.drives, "pressures": self.pressures, "tractions": self.tractions, "quiet": self.quiet,
            "platens": self.platens, "boundaries": self.boundaries, "ended": self.ended, "fluids": self.fluids,
            "gravity": self.gravity, "nodes": self.nodes, "freedoms": self.freedoms, "grains": self.grains,
            "zones": self.zones, "materials": self.materials, "bonds": self.bonds, "contacts": self.contacts,
            "clock": self.clock, "breaks": self.breaks, "steady": self.steady, "heat": self.heat,
            "conduction": self.conduction,
        }  # fmt: skip

    @property
    def compiled(self) -> Iterator[Compiled]:
        """Laws and materials of the model."""
        for group in (*self.bonds.groups, *self.contacts.groups):
            yield group.compiled
        for zones in self.materials.groups:
            yield from (zones.stress, zones.energy)

    def shared(self, threads: int) -> Shared:
        """The arrays of all parts, divided among threads; made again only where a part has other arrays than before."""
        return self.shared_by(dict.fromkeys(Parts._fields, self._split(threads)))

    def shared_by(self, splits: Mapping[str, Split]) -> Shared:
        """The same, where each part is divided in its own way."""
        parts, known = self.parts, self._last
        tables = [self._share(name, parts[name], splits[name]) for name in Parts._fields]
        if known is None or any(map(is_not, known.tables, tables)):
            laid = Parts._make(tables)
            known = self._last = Shared(Parts._make(table.value for table in tables), laid, Table(laid))
        known.parts.contacts.tally[:] = 0
        return known

    def table(self, name: str, threads: int) -> Table:
        """The arrays of one part for so many threads, as compiled code finds them."""
        return self._share(name, self.parts[name], self._split(threads))

    def _share(self, name: str, part: Part, split: Split) -> Table:
        known = self._shared.get(name)
        if known is None or known[0] is not split or known[1] is not part.arrays:
            known = self._shared[name] = split, part.arrays, Table(part.shared(split))
        return known[2]

    def _split(self, threads: int) -> Split:
        """Each thread has whole grains with about equal numbers of nodes."""
        if threads not in self._splits:
            self._splits[threads] = self.split(threads)
        return self._splits[threads]

    def split(self, threads: int, alone: bool = False) -> Split:
        """Whole grains with about equal numbers of nodes for each of so many threads."""
        ends = self.mesh.first_node[1:]
        cuts = np.searchsorted(ends, np.arange(1, threads) * ends[-1] / threads)
        grain = np.array([0, *cuts, self.specimen.grains.count])
        return Split(threads, grain, self.mesh.first_node[grain], alone)

    def save(self) -> Saved:
        """Copy what steps change."""
        return {name: part.save() for name, part in self.parts.items()}

    def check_saved(self, saved: Saved) -> None:
        """Raise ValueError for what ``save`` cannot have returned at a state of this stage."""
        check_names(self.parts, (*saved, *(name for name, part in self.parts.items() if not part.save())))
        for name, part in self.parts.items():
            try:
                part.check_saved(saved.get(name, {}))
            except ValueError as error:
                raise ValueError(f"{name}: {error}") from None

    def restore(self, saved: Saved) -> None:
        """Return to the state at the call of ``save``, in the same stage."""
        self.every_zone.known = None
        self._shared.clear()
        for name, part in self.parts.items():
            part.restore(saved.get(name, {}))

    # --- boundary conditions ---------------------------------------------------------------------------------------

    def check(self, stage: Stage) -> None:
        """Raise :class:`ParameterError` for a load that the specimen cannot bear, or that no part brings on it."""
        stage.check_specimen(self.specimen)
        of_parts = (kind for part in self.parts.values() for kind in part.takes)
        taken: tuple[type[Load], ...] = (InitialVelocity, *of_parts)
        for load in stage.loads:
            if not isinstance(load, taken):
                names = ", ".join(sorted(kind.__name__ for kind in taken))
                raise ParameterError(f"{type(load).__name__}: no part of State.parts takes this load, only {names}")

    def begin(self, stage: Stage) -> None:
        """Impose the loads of a stage from now on; what has been supplied and lost so far stays in the ledger.

        Raises as :meth:`check`.
        """
        self.check(stage)
        self.stage, self.began = stage.name, self.clock.begin_stage()
        self.imposed = Imposed(self.mesh, stage.imposed)
        at = Moment(self.time_step, self.displacement_at_forces())
        for part in self.parts.values():
            had = part.energy(self.time_step) if part.takes else {}
            ended = part.end(self.nodes.arrays.displacement)
            part.begin(self.imposed, at)
            has = part.energy(self.time_step) if part.takes else {}
            kinds = {**had, **has, **ended}
            self.ended.take({kind: had.get(kind, 0.0) - has.get(kind, 0.0) + ended.get(kind, 0.0) for kind in kinds})
        for push in self.imposed.of(InitialVelocity):
            self.give_velocity(push.velocity)

    def take_back_half_a_step_of_gravity(self) -> None:
        """Velocities are those half a step before the stage begins: take half a step of its new weight from them."""
        f = self.freedoms.arrays
        gain = self.time_step * f.free * self.gravity.new / f.mass
        f.velocity[:] -= gain / 2
        # The kinetic energy is half the mass times the product of the velocities half a step before and after.
        self.freedoms.books.given[0] -= float(np.sum(f.mass * gain**2)) / 8

    def give_velocity(self, velocity: np.ndarray) -> None:
        """Add a velocity field (i, 2) m/s; rigid grains take its mean and spin, fixed grains nothing."""
        self.change_velocity(self.grains.field(np.asarray(velocity, dtype=float).T, self.freedoms, self.positions))

    def change_velocity(self, rows: np.ndarray) -> None:
        """Add velocities (r, n) to the freedoms, and to platens with them; the energy is recorded."""
        self.freedoms.change_velocity(rows, self.time_step)
        self.platens.follow(rows)

    def let_membranes_follow(self) -> None:
        """Lay membranes anew where the rim has parted."""
        self.pressures.follow_rim(self.nodes.arrays.displacement, self.displacement_at_forces())

    def let_fluids_follow(self) -> None:
        """Let fluids enter what has broken."""
        self.fluids.follow(self.time - self.began, self.displacement_at_forces())

    def let_heat_flow(self) -> int:
        """Find the temperatures of the next step of heat, if it is due; steps until another is, 0 where none flows."""
        if self.conduction.load is None:
            return 0
        self.conduction.follow(self.opening, self.time_step)
        return self.conduction.left

    # --- time --------------------------------------------------------------------------------------------------------

    @property
    def time(self) -> float:
        """s."""
        return self.clock.time

    @property
    def since_sample(self) -> float:
        """s since the last sample, over which reactions and motions of boundaries are means."""
        return float(self.boundaries.books.samples[0] * self.time_step)

    @property
    def steps(self) -> int:
        """Steps done."""
        return self.clock.steps

    def next_times(self, count: int) -> np.ndarray:
        """(count,) s of the next steps."""
        return self.clock.next_times(count, self.time_step)

    def change_time_step(self, time_step: float) -> None:
        """Take another time step (s) while in motion; the energy is recorded."""
        self.freedoms.change_time_step(self.time_step, time_step)
        self.time_step = time_step

    def count_steps(self, steps: int, time: float) -> None:
        """Record steps that were done until ``time`` (s)."""
        self.clock.count(steps, time)
        self.boundaries.books.samples[0] += steps

    # --- what may be read ------------------------------------------------------------------------------------------

    @property
    def displacement(self) -> np.ndarray:
        """(i, 2) m."""
        return self.nodes.arrays.displacement.T

    @property
    def mean_displacement(self) -> np.ndarray:
        """(i, 2) m where forces act, averaged over the steps since the last sample, as reactions are."""
        return self.boundaries.mean_displacement(self.displacement_at_forces()).T

    @property
    def positions(self) -> np.ndarray:
        """(i, 2) m."""
        return self.mesh.nodes + self.displacement

    @property
    def velocity(self) -> np.ndarray:
        """(i, 2) m/s."""
        return self.grains.node_velocity(self.freedoms, self.positions)

    @property
    def fluid_pressure(self) -> np.ndarray:
        """(p,) Pa of the fluid on the faces of contact points; 0 where dry. Tractions are those beside it."""
        return self.fluids.at_points(self.time - self.began)

    @property
    def pumped(self) -> dict[str, float]:
        """Of an injection: its pressure behind the boundary (Pa), and where what was pumped in is (m2).

        ``injected`` is what it would fill without pressure, and so are ``crack_fluid``, what of it is in cracks, and
        ``outflow``, what has left. By ``room`` that behind the boundary has grown. Zeros without one.
        """
        fluids = self.fluids
        room, cracks = fluids.room
        grown = room - float(fluids.arrays.room[0]) if fluids.injection else 0.0
        return {
            "injection_pressure": fluids.pressure, "injected": fluids.pumped_in, "room": grown, "crack_room": cracks,
            "crack_fluid": fluids.in_cracks, "outflow": fluids.out,
        }  # fmt: skip

    @property
    def zone_temperature(self) -> np.ndarray:
        """(z,) °C at the last forces: means of nodes where heat is conducted."""
        found, own = np.full(len(self.mesh.zones), self.heat.temperature), self.materials.temperatures
        found[self.materials.chosen[: len(own)]] = own
        return found

    def zone_state(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """At the last forces: stress (z, 3) Pa, xx, yy, xy in fixed axes, energy stored and dissipated (z,) J/m3."""
        return self.every_zone.states(self.steps, self.displacement_at_forces)

    def displacement_at_forces(self) -> np.ndarray:
        """(2, i) m, at the moment of the last forces."""
        return self.grains.nodes_at(self.freedoms.displacement_at_forces(self.time_step))

    def grain_stress(self) -> np.ndarray:
        """(g, 3) Pa, xx, yy, xy: mean over zones, or of the forces on a rigid grain's rim (Love's formula)."""
        if isinstance(self.grains, RigidGrains):
            forces = self.nodes.arrays.force + self.boundaries.forces_on_rigid_nodes()
            return self.grains.stress(forces, self.freedoms, self.positions)
        return self.every_zone.mean_stress(self.zone_state()[0])

    def grain_motion(self) -> tuple[np.ndarray, np.ndarray]:
        """Centres of mass of grains (g, 2) m and their velocities (g, 2) m/s."""
        return self.grains.centres(self.freedoms, self.positions)

    def rotation(self, grain: int) -> float:
        """rad, counter-clockwise, of a grain since the specimen was made; if it deforms, from -pi to pi."""
        return float(self.grains.rotations(self.freedoms, self.positions)[grain])

    def reaction(self, boundary: str) -> np.ndarray:
        """(2,) N per metre, reaction of the drives of a boundary, mean over the steps since the last sample.

        Raises :class:`ParameterError` for a boundary that is not there.
        """
        self.mesh.require_boundaries("state.reaction", boundary)
        return self.boundaries.reaction(boundary)

    def moved(self, boundary: str) -> np.ndarray:
        """(2,) m: mean displacement of a boundary where forces act, averaged over the steps since the last sample.

        Raises :class:`ParameterError` for a boundary that is not there.
        """
        self.mesh.require_boundaries("state.moved", boundary)
        return self.mean_displacement[self.mesh.boundaries[boundary]].mean(axis=0)

    @property
    def beyond_elastic(self) -> np.ndarray:
        """(2, p) m, opening and slip less those of the tractions over the first stiffness of each point."""
        return np.stack([self.opening, self.slip]) - np.stack([self.normal, self.shear]) / self.stiffness

    @property
    def damage(self) -> float:
        """Sum of the damage of all contact points: it grows whenever one of them is damaged."""
        return float(self.memory("damage").sum())

    @property
    def kinetic_energy(self) -> float:
        """J, of the velocities half a step after the last forces."""
        return self.freedoms.kinetic_energy

    # --- contact points p: the first points of all bonds, then the second ---------------------------------------------

    @property
    def opening(self) -> np.ndarray:
        """(p,) m."""
        return self._at_points(self.bonds.arrays.opening, 0)

    @property
    def slip(self) -> np.ndarray:
        """(p,) m."""
        return self._at_points(self.bonds.arrays.slip, 1)

    @property
    def normal(self) -> np.ndarray:
        """(p,) Pa, tension positive; 0 at bonds that a contact has replaced."""
        return self._at_points(self.bonds.arrays.normal)

    @property
    def shear(self) -> np.ndarray:
        """(p,) Pa; 0 at bonds that a contact has replaced."""
        return self._at_points(self.bonds.arrays.shear)

    def last(self, rows: np.ndarray) -> np.ndarray:
        """(p,) of the last step, of rows (2, p) of bonds for this and the previous step in turn."""
        return rows[(self.steps + 1) % 2]

    def _at_points(self, rows: np.ndarray, motion: int | None = None) -> np.ndarray:
        """(p,) from the last step; at replaced bonds ``motion`` of their points, or 0."""
        row, replaced = self.last(rows), self.bonds.books.replaced
        if not replaced.any():
            return row
        moved = 0.0 if motion is None else self.bonds.motion(self.displacement_at_forces())[motion]
        return np.where(np.tile(replaced, 2), moved, row)

    @property
    def replaced(self) -> np.ndarray:
        """(c,) whether a contact has taken the place of a bond, in the order of ``bonds.order``."""
        return self.bonds.books.replaced

    def memory(self, name: str) -> np.ndarray:
        """(p,) one variable of the laws' memory; zero where a law has no such memory.

        Raises :class:`ParameterError` for a name that none has and that is like one which some have.
        """
        known = {each for group in self.bonds.groups for each in group.compiled.memory}
        if name not in known and (like := nearest(name, known, LIKE)):
            raise ParameterError(f"state.memory: no law has '{name}' in its memory{like}")
        return self.bonds.memory(name, np.zeros(2 * len(self.bonds)))

    @property
    def mode(self) -> np.ndarray:
        """(p,) share of shear in the damage: by the law itself, or from the work done in opening and in slip."""
        work = np.maximum(self.bonds.work, 0)
        return self.bonds.memory("mode", work[1] / np.maximum(work.sum(axis=0), 1e-300))

    @property
    def stiffness(self) -> np.ndarray:
        """(2, p) Pa/m: kn and ks of the first response, as the laws declare them."""
        return self.bonds.stiffness

    @property
    def contact_lengths(self) -> np.ndarray:
        """(p,) m: half the length of the bond."""
        return self.bonds.lengths

    @property
    def contact_positions(self) -> np.ndarray:
        """(p, 2) m: middle of the half of the bond that belongs to each point, on the deformed specimen."""
        ends = self.positions[self.bonds.ends]
        first, second = (ends[:, 0] + ends[:, 2]) / 2, (ends[:, 1] + ends[:, 3]) / 2
        return np.concatenate([0.75 * first + 0.25 * second, 0.25 * first + 0.75 * second])

    @property
    def broken_time(self) -> np.ndarray:
        """(p,) s to within one sample, nan where unbroken."""
        return self.breaks.books.time

    @property
    def broken_mode(self) -> np.ndarray:
        """(p,) share of shear at breaking."""
        return self.breaks.books.mode

    @property
    def source(self) -> np.ndarray:
        """(2, p) m, opening and slip beyond elastic ones that points gained by breaking, till waves left or so far."""
        books = self.breaks.books
        return np.where(np.isnan(books.source), self.beyond_elastic - books.before, books.source)

    @property
    def broken_work(self) -> np.ndarray:
        """(p,) J/m2 spent until the point broke."""
        return self.breaks.books.work

    # --- for the engine ----------------------------------------------------------------------------------------------

    def search(self, before: np.ndarray, *, beside: bool = False) -> None:
        """Search neighbours; ``before`` (2, i) m is the displacement one step ago; see :meth:`Contacts.search`."""
        self._shared.pop("contacts", None)  # it keeps the old table, which is freed column by column as it is copied
        self.contacts.search(self.nodes.arrays.displacement, before, beside=beside)

    def start_from_rest(self, lost: np.ndarray) -> None:
        """Let the first step after ``stop`` begin from rest; see :meth:`Freedoms.start_from_rest`."""
        self.freedoms.start_from_rest(lost, self.time_step)
        self.nodes.arrays.displacement[:] = self.grains.nodes_at(self.freedoms.arrays.displacement)

    def new_sample(self) -> None:
        """Begin a new interval over which means are taken."""
        self.boundaries.new_sample()

    def note_breaks(self) -> None:
        """Remember when and how contact points broke, to within one sample, and the work it took."""
        broken = self.breaks.new(self.memory("damage"))
        if broken.any():
            self.breaks.note(broken, self.bonds, self.time, self.mode, np.stack([self.normal, self.shear]))
        beyond = self.beyond_elastic
        self.breaks.whole(beyond)
        waiting = self.breaks.waiting(self.time)
        if waiting.any():
            self.breaks.settle(waiting, beyond)
