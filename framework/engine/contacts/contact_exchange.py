"""What a chunk of contacts takes from the table into its rows, and puts back.

Index letters: ``c`` contact, ``k`` place in a row. ``t`` is the table of contacts (contact_table.py), ``r`` the rows of
a thread (contact_rows.py), ``contact`` (k,) the numbers c of the chunk.
"""

from numba import njit  # noqa: I001 - the rows in few lines

from grainlaw.compiler.cache import PASS
from grainlaw.engine.contacts.contact_geometry import gather_angles, gather_edges, gather_increments
from grainlaw.engine.contacts.contact_rows import (
    BEFORE, DAMPING_FORCE, DAMPING_WORK, DASHPOT, FX, FY, GX, GY, HX, HY, LARGEST, LENGTH, LIFT, LIFT_BEFORE, MEMORY,
    NORMAL, OFFSET, OPENING, OPENING_WORK, OVERLAP, ROW, SHARE_A, SHEAR, SLIP, SLIP_WORK, STATE, TX, TY,
)  # fmt: skip


@njit(**PASS)
def fill(active, first, count, contact):
    """The contacts of a chunk, the last one again and again to the end."""
    for k in range(contact.shape[0]):
        contact[k] = active[first + min(k, count - 1)]


@njit(**PASS)
def _take(row, contact, r, place):
    for k in range(contact.shape[0]):
        r[place + k] = row[contact[k]]


@njit(**PASS)
def copy(r, source, place, count):
    for k in range(count):
        r[place + k] = r[source + k]


@njit(**PASS)
def clear(r, place, count):
    for k in range(count):
        r[place + k] = 0.0


@njit(**PASS)
def take_from_table(t, r, contact, row):
    """Fill the rows of a chunk with what its contacts keep; ``row`` of the memory is the lift, or -1 without one."""
    gather_edges(t, t.place, r, contact)
    gather_angles(t, r, contact)
    gather_increments(t, r, contact)
    _take(t.state, contact, r, STATE)
    _take(t.offset, contact, r, OFFSET)
    _take(t.largest_overlap, contact, r, LARGEST)
    _take(t.dashpot, contact, r, DASHPOT)
    _take(t.length, contact, r, BEFORE)
    _take(t.slip, contact, r, SLIP)
    _take(t.shear, contact, r, SHEAR)
    _take(t.force_x[0], contact, r, FX)
    _take(t.force_y[0], contact, r, FY)
    _take(t.force_x[1], contact, r, GX)
    _take(t.force_y[1], contact, r, GY)
    _take(t.force_x[2], contact, r, HX)
    _take(t.force_y[2], contact, r, HY)
    _take(t.damping_force, contact, r, DAMPING_FORCE)
    for m in range(t.memory.shape[0]):
        _take(t.memory[m], contact, r, MEMORY + m * ROW)
    if row >= 0:
        copy(r, MEMORY + row * ROW, LIFT, contact.shape[0])
    else:  # of another law there may be one from before
        clear(r, LIFT, contact.shape[0])
        clear(r, LIFT_BEFORE, contact.shape[0])
    if row >= 0 and t.damping > 0:  # the lift less the overlap was the opening of a closed contact
        _take(t.opening, contact, r, LIFT_BEFORE)
        for k in range(contact.shape[0]):
            r[LIFT_BEFORE + k] += t.overlap[contact[k]]


@njit(**PASS)
def _put(row, contact, count, r, place):
    for k in range(count):
        row[contact[k]] = r[place + k]


@njit(**PASS)
def _add(row, contact, count, r, place):
    for k in range(count):
        row[contact[k]] += r[place + k]


@njit(**PASS)
def put_into_table(t, r, contact, count):
    """Put what contacts keep into the table."""
    _add(t.opening_work, contact, count, r, OPENING_WORK)
    _add(t.slip_work, contact, count, r, SLIP_WORK)
    _add(t.damping_work, contact, count, r, DAMPING_WORK)
    _put(t.state, contact, count, r, STATE)
    _put(t.offset, contact, count, r, OFFSET)
    _put(t.overlap, contact, count, r, OVERLAP)
    _put(t.opening, contact, count, r, OPENING)
    _put(t.slip, contact, count, r, SLIP)
    _put(t.normal, contact, count, r, NORMAL)
    _put(t.shear, contact, count, r, SHEAR)
    _put(t.length, contact, count, r, LENGTH)
    _put(t.tangent_x, contact, count, r, TX)
    _put(t.tangent_y, contact, count, r, TY)
    _put(t.share_a, contact, count, r, SHARE_A)
    _put(t.force_x[0], contact, count, r, FX)
    _put(t.force_y[0], contact, count, r, FY)
    _put(t.force_x[1], contact, count, r, GX)
    _put(t.force_y[1], contact, count, r, GY)
    _put(t.force_x[2], contact, count, r, HX)
    _put(t.force_y[2], contact, count, r, HY)
    _put(t.damping_force, contact, count, r, DAMPING_FORCE)
    for m in range(t.memory.shape[0]):
        _put(t.memory[m], contact, count, r, MEMORY + m * ROW)
