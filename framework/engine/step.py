"""The step: the passes of all parts in their order, compiled once for every law, integrator and number of threads."""

from __future__ import annotations

import functools
import threading
from typing import Any, NamedTuple

import numpy as np
from numba import njit

from grainlaw.compiler.cache import OPTIONS
from grainlaw.compiler.entry import Kernel
from grainlaw.compiler.numba_private import Table, call, place_of
from grainlaw.engine import barrier
from grainlaw.engine.contacts.contact_passes import (
    DEEP,
    LEAVING,
    MOVED,
    contact_step,
    follow_nodes,
    gather_contact_forces,
)
from grainlaw.engine.contacts.contact_table import ContactArrays
from grainlaw.engine.parts.bonds import BondArrays, bond_forces, gather_bond_forces
from grainlaw.engine.parts.drives import DriveArrays, impose
from grainlaw.engine.parts.flow import flow
from grainlaw.engine.parts.fluids import FluidArrays, press_fluids, sweep
from grainlaw.engine.parts.freedoms import FreedomArrays, NodeArrays, clear_forces, integrate
from grainlaw.engine.parts.grains import (
    GrainArrays,
    collect_forces,
    collect_tied_forces,
    place_corners,
    place_tied_nodes,
)
from grainlaw.engine.parts.gravity import GravityArrays, add_weight
from grainlaw.engine.parts.material_passes import MaterialArrays, forces_of_materials, take_temperature
from grainlaw.engine.parts.platens import PlatenArrays, move_platens
from grainlaw.engine.parts.pressures import PressureArrays, gather_pressures, press
from grainlaw.engine.parts.quiet import QuietArrays, absorb
from grainlaw.engine.parts.tractions import TractionArrays, load
from grainlaw.engine.parts.zones import ZoneArrays, add_zone_forces


class Parts(NamedTuple):
    """The arrays of all parts, for the step."""

    nodes: NodeArrays
    zones: ZoneArrays
    materials: MaterialArrays
    bonds: BondArrays
    contacts: ContactArrays
    pressures: PressureArrays
    tractions: TractionArrays
    quiet: QuietArrays
    fluids: FluidArrays
    grains: GrainArrays
    gravity: GravityArrays
    platens: PlatenArrays
    drives: DriveArrays
    freedoms: FreedomArrays


class Team(NamedTuple):
    """The threads that share a model, and where they meet."""

    threads: int
    meeting: np.ndarray
    pauses: barrier.Pauses


class Chunk(NamedTuple):
    """Steps that are done in one call."""

    steps: int
    first: int  #: number of the first, counted from the start of the run
    time_step: float  #: s
    schedule: np.ndarray  #: (steps, columns) velocities, forces, pressures; temperatures before and at the step
    velocities: np.ndarray  #: (threads, columns) those of a step, with what platens add to them
    integrator: int  #: address of its code
    parameters: int  #: address of its numbers


@njit(**OPTIONS)
def _sum(tally, column, thread):
    """Sum over threads of a column of their counts, for ``thread``."""
    total = 0
    for thread in range(tally.shape[0]):
        total += tally[thread, column]
    return total


@njit(**OPTIONS)
def _remember(contacts, nodes, thread):
    """Keep the displacement of a thread's nodes before they move, for the search."""
    first, last = nodes.share[thread], nodes.share[thread + 1]
    for i in range(first, last):  # of slices numba compiles a check of their shapes, with its words
        contacts.before[0, i], contacts.before[1, i] = nodes.displacement[0, i], nodes.displacement[1, i]


def _steps(thread, team, parts, chunk, forces_of_materials):
    """Do the steps of a chunk; all threads do so together, each with its share of every part.

    Team, parts and chunk are tables in memory, of which ``[0]`` is the tuple; ``forces_of_materials`` is an address, or
    0. Returns how many steps were done: fewer where bonds become contacts, neighbours must be searched, or grains
    overlap too much.
    """
    team, parts, chunk = team[0], parts[0], chunk[0]
    nodes, grains, freedoms = parts.nodes[0], parts.grains[0], parts.freedoms[0]
    zones, materials, bonds, contacts = parts.zones[0], parts.materials[0], parts.bonds[0], parts.contacts[0]
    pressures, tractions, fluids = parts.pressures[0], parts.tractions[0], parts.fluids[0]
    gravity, quiet, platens, drives = parts.gravity[0], parts.quiet[0], parts.platens[0], parts.drives[0]
    searching, tally = contacts.before.shape[1] > 0, contacts.tally
    velocities = chunk.velocities[thread]
    temperature_column = chunk.schedule.shape[1] - 1
    for step in range(chunk.steps):
        schedule = chunk.schedule[step]
        clear_forces(nodes, thread)
        add_zone_forces(zones, nodes, thread)
        if forces_of_materials != 0:
            changes = int(schedule[temperature_column] != schedule[temperature_column - 1])
            call(forces_of_materials, (place_of(parts.materials), place_of(parts.nodes), changes, thread))
        leaving = bond_forces(bonds, nodes, chunk.first + step, thread)
        contact_step(contacts, chunk.time_step, thread)
        press(pressures, nodes, schedule, thread)
        load(tractions, nodes, schedule, thread)
        if fluids.rate.shape[0] > 0:
            sweep(fluids, nodes, thread)
            barrier.wait(team.meeting, team.threads, team.pauses)  # what all faces have swept
            if thread == 0:
                flow(fluids, schedule, chunk.time_step)
            barrier.wait(team.meeting, team.threads, team.pauses)  # pressures
        press_fluids(fluids, nodes, schedule, thread)
        if searching:
            tally[thread, LEAVING] = leaving
        barrier.wait(team.meeting, team.threads, team.pauses)  # forces of all bonds, contacts and pressures
        # Read now: another thread may write them again before the next barrier.
        leaving, deep = _sum(tally, LEAVING, thread), _sum(tally, DEEP, thread)
        if thread == 0 and step < chunk.steps - 1:  # no thread asks a material before the next barrier
            following = chunk.schedule[step + 1]
            take_temperature(materials, following[temperature_column - 1], following[temperature_column])
        gather_bond_forces(bonds, nodes, thread)
        gather_contact_forces(contacts, nodes, thread)
        gather_pressures(pressures, nodes, thread)
        if grains.node.shape[0] > 0:
            barrier.wait(team.meeting, team.threads, team.pauses)  # forces on all nodes of a point
            collect_tied_forces(grains, nodes, freedoms, thread)
        else:
            collect_forces(grains, nodes, freedoms, thread)
        add_weight(gravity, freedoms, thread)
        absorb(quiet, freedoms, chunk.time_step, thread)
        for column in range(velocities.shape[0]):
            velocities[column] = schedule[column]
        if platens.column.shape[0] > 0:
            barrier.wait(team.meeting, team.threads, team.pauses)  # forces on all of a platen's freedoms
            move_platens(
                platens, drives, freedoms, schedule, velocities, chunk.time_step, chunk.integrator, chunk.parameters,
                thread,
            )  # fmt: skip
        impose(drives, freedoms, velocities, chunk.time_step, thread)
        if searching and (step == chunk.steps - 1 or leaving > 0):
            _remember(contacts, nodes, thread)
        integrate(freedoms, chunk.integrator, chunk.parameters, thread)
        if grains.node.shape[0] > 0:
            barrier.wait(team.meeting, team.threads, team.pauses)  # all points have moved
            place_tied_nodes(grains, nodes, freedoms, thread)
        else:
            place_corners(grains, nodes, freedoms, thread)
        if searching:
            follow_nodes(contacts, nodes, thread)
        barrier.wait(team.meeting, team.threads, team.pauses)
        # All threads read the same: nodes that have moved are counted again only after the next barrier.
        if searching and leaving + deep + _sum(tally, MOVED, thread) > 0:
            return step + 1
    return chunk.steps


_pauses = functools.cache(barrier.pauses)


class Shared(NamedTuple):
    """The arrays of all parts, divided among threads, and the same as the loop finds them."""

    parts: Parts
    tables: Any  #: :class:`Parts`, with the :class:`~grainlaw.compiler.numba_private.Table` of each
    table: Table  #: of the tables


def run(threads: int, shared: Shared, chunk: Chunk) -> int:
    """Do the steps of a chunk in ``threads`` threads; the result is the same bit for bit for any number.

    The interpreter lock is released meanwhile. Returns how many steps were done (``contacts.tally`` says why fewer).
    """
    tables = tables_of(threads, shared, chunk)
    forces = _forces_of_materials(shared)
    helpers = [threading.Thread(target=_loop, args=(k, *tables, forces)) for k in range(1, threads)]
    for helper in helpers:
        helper.start()
    done: int = _loop(0, *tables, forces)
    for helper in helpers:
        helper.join()
    return done


def tables_of(threads: int, shared: Shared, chunk: Chunk) -> list[Table]:
    """Team, parts and chunk as the loop is given them."""
    team = Team(threads, np.zeros(barrier.SIZE, dtype=np.int64), _pauses())
    return [Table(team), shared.table, Table(chunk)]


_loop = Kernel(_steps, "the time loop, once: this takes up to half a minute")


def _forces_of_materials(shared: Shared) -> int:
    """Address of what adds them; 0 where no grain has a material with a method for its stress."""
    if not len(shared.parts.materials.share):
        return 0
    return forces_of_materials.address(shared.tables.materials, shared.tables.nodes, 0, 0)
