"""Flow of an injected fluid along cracks: a network of what holds it, and an implicit step for its pressures.

A cell is the half of a bond that belongs to a broken contact point. Its fluid flows to the two ends of this half: to
the corner where bonds meet, and to the middle of its bond. Ends have no room. What lies behind the boundary is one room
with one pressure; without viscosity it is all there is, and the cracks are part of it.

Index letters: ``v`` vertex: the room behind the boundary, contact points, middles of bonds, corners; ``k`` vertex of
the network, in the order of elimination; ``m`` cell; ``f`` face.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import scipy
from numba import njit

from grainlaw.compiler.cache import OPTIONS
from grainlaw.engine.parts.imposed import STILL
from grainlaw.engine.parts.part import Constant, Scratch

FREE = STILL  #: instead of a column of the schedule: a vertex whose pressure is not given
TRIES = 100  #: in which the vertices without pressure are found: nearly always in one


class Network(NamedTuple):
    """What an injection has wetted (k), and the rows of the factor of its matrix, each up to the diagonal."""

    vertex: Constant  #: (k,) its number among all vertices
    given: Constant  #: (k,) column of the schedule with its pressure; ``FREE`` without one
    face: Constant  #: (n,) faces of the injection
    face_at: Constant  #: (n,) where in the network each of them is
    cell: Constant  #: (m,) where in the network each cell is
    cube: Constant  #: (m,) 1/(Pa s m4), flow to an end over the difference of pressures and the cube of the room
    end: Constant  #: (2, m) where in the network its ends are
    link: Constant  #: (2, m) where in the factor a cell and its end meet
    start: Constant  #: (k + 1,) of each row of the factor
    column: Constant  #: of each number of the factor
    factor: Scratch
    volume: Scratch  #: (k,) m2
    level: Scratch  #: (k,) Pa
    right: Scratch  #: (k,) m2
    fixed: Scratch  #: (k,) whether its pressure is given, or 0 because there is less fluid than room
    row: Scratch  #: (k,) of the factor, with all its zeros; no number is left in it
    eased: Scratch  #: (m,) m2/Pa, flow to an end in the step over the difference of pressures


def network(
    faces: np.ndarray, vertex: np.ndarray, cells: np.ndarray, ends: np.ndarray, cube: np.ndarray,
    columns: dict[int, int],
) -> Network:  # fmt: skip
    """Lay a network: ``faces`` (n,) at their ``vertex`` (n,), and ``cells`` (m,) with their ``ends`` (2, m).

    ``columns`` are those of the vertices whose pressure is given. Cells and ends are eliminated in an order of minimum
    degree, so that along a crack the matrix has no fill.
    """
    some = np.unique(np.concatenate([[0], cells, ends.ravel()]))
    count, one, other = len(some), np.searchsorted(some, np.tile(cells, 2)), np.searchsorted(some, ends.ravel())
    links = scipy.sparse.coo_matrix((np.ones(len(one)), (one, other)), shape=(count, count))
    both = links + links.T
    matrix = scipy.sparse.diags(np.asarray(both.sum(axis=1)).ravel() + 1) - both
    factors = scipy.sparse.linalg.splu(
        matrix.tocsc(), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True}
    )
    place = factors.perm_c.astype(np.int64)
    lower = factors.L.tocsr()
    lower.eliminate_zeros()
    lower.sort_indices()
    start, column = lower.indptr.astype(np.int64), lower.indices.astype(np.int64)
    entries = np.repeat(np.arange(count), np.diff(start)) * count + column
    low, high = np.minimum(place[one], place[other]), np.maximum(place[one], place[other])
    vertices = np.empty(count, dtype=np.int64)
    vertices[place] = some
    rows = {name: np.zeros(count) for name in ("volume", "level", "right", "row")}
    return Network(
        vertex=vertices, given=np.array([columns.get(v, FREE) for v in vertices.tolist()]), face=faces,
        face_at=place[np.searchsorted(some, vertex)], cell=place[np.searchsorted(some, cells)], cube=cube,
        end=place[other].reshape(2, -1), link=np.searchsorted(entries, high * count + low).reshape(2, -1), start=start,
        column=column, factor=np.zeros(len(column)), fixed=np.zeros(count, dtype=bool), eased=np.zeros(len(cells)),
        **rows,
    )  # fmt: skip


@njit(**OPTIONS)
def _take_up(fluids, schedule, time_step):
    """Room and last pressure of every vertex, and how easily fluid flows out of the cells, Eq. (25)."""
    net = fluids.network
    for k in range(net.vertex.shape[0]):
        net.volume[k], net.level[k] = fluids.room[net.vertex[k]], fluids.pressure[net.vertex[k]]
        net.row[k] = 0.0
    for n in range(net.face.shape[0]):
        net.volume[net.face_at[n]] += fluids.swept[net.face[n]]
    for m in range(net.cell.shape[0]):
        k = net.cell[m]
        net.volume[k] = max(net.volume[k], fluids.least[0] * fluids.room[net.vertex[k]])  # of the residual aperture
        net.eased[m] = time_step * net.cube[m] * net.volume[k] ** 3
    fluids.content[0] += time_step * schedule[fluids.rate[0]]
    for k in range(net.vertex.shape[0]):
        if net.given[k] != FREE:
            net.level[k] = schedule[net.given[k]]
        net.fixed[k] = net.given[k] != FREE or (net.level[k] == 0 and fluids.content[net.vertex[k]] < net.volume[k])


@njit(**OPTIONS)
def _assemble(fluids):
    """The matrix, and the right side: what each vertex holds beyond its room."""
    net, start = fluids.network, fluids.network.start
    for s in range(net.factor.shape[0]):
        net.factor[s] = 0.0
    for k in range(net.vertex.shape[0]):
        net.factor[start[k + 1] - 1] = 1.0 if net.fixed[k] else net.volume[k] / fluids.bulk[0]
        net.right[k] = net.level[k] if net.fixed[k] else fluids.content[net.vertex[k]] - net.volume[k]
    for m in range(net.cell.shape[0]):
        for e in range(2):
            i, j, eased = net.cell[m], net.end[e, m], net.eased[m]
            if not net.fixed[i]:
                net.factor[start[i + 1] - 1] += eased
                net.right[i] += eased * net.level[j] if net.fixed[j] else 0.0
            if not net.fixed[j]:
                net.factor[start[j + 1] - 1] += eased
                net.right[j] += eased * net.level[i] if net.fixed[i] else 0.0
            if not (net.fixed[i] or net.fixed[j]):
                net.factor[net.link[e, m]] -= eased


@njit(**OPTIONS)
def _solve(net):
    """Factors of the matrix (Cholesky), row by row, and pressures from them."""
    start, column, factor, row, level = net.start, net.column, net.factor, net.row, net.level
    count = net.vertex.shape[0]
    for k in range(count):
        first, last = start[k], start[k + 1] - 1  # the diagonal is the last of a row
        diagonal, right = factor[last], net.right[k]
        for s in range(first, last):
            row[column[s]] = factor[s]
        for s in range(first, last):
            j = column[s]
            value = row[j]
            for r in range(start[j], start[j + 1] - 1):
                value -= factor[r] * row[column[r]]
            value /= factor[start[j + 1] - 1]
            row[j] = factor[s] = value
            diagonal -= value * value
            right -= value * level[j]
        for s in range(first, last):
            row[column[s]] = 0.0
        factor[last] = math.sqrt(diagonal)
        level[k] = right / factor[last]
    for k in range(count - 1, -1, -1):
        level[k] /= factor[start[k + 1] - 1]
        for s in range(start[k], start[k + 1] - 1):
            level[column[s]] -= factor[s] * level[k]


@njit(**OPTIONS)
def _settle(fluids):
    """Take the pressure from vertices where it would be below 0, and free those that are full; how many there were."""
    net, changed = fluids.network, 0
    for k in range(net.vertex.shape[0]):
        net.right[k] = fluids.content[net.vertex[k]] - net.volume[k]
    for m in range(net.cell.shape[0]):
        for e in range(2):
            i, j = net.cell[m], net.end[e, m]
            net.right[i] += net.eased[m] * max(net.level[j], 0.0)
            net.right[j] += net.eased[m] * max(net.level[i], 0.0)
    for k in range(net.vertex.shape[0]):
        if net.given[k] == FREE and net.fixed[k] and net.right[k] > 0:
            net.fixed[k] = False
            changed += 1
        elif net.level[k] < 0:
            net.level[k], net.fixed[k] = 0.0, True
            changed += 1
    return changed


@njit(**OPTIONS)
def flow(fluids, schedule, time_step):
    """One step of the flow, backward Euler, Eq. (26): the pressure of every vertex, and what it holds afterwards.

    One thread does it. What cells hold is found from what flows, so that nothing is lost, whatever the pressures are.
    """
    net = fluids.network
    _take_up(fluids, schedule, time_step)
    for _ in range(TRIES):
        _assemble(fluids)
        _solve(net)
        if _settle(fluids) == 0:
            break
    for m in range(net.cell.shape[0]):
        for e in range(2):
            i, j = net.cell[m], net.end[e, m]
            through = net.eased[m] * (net.level[i] - net.level[j])
            fluids.content[net.vertex[i]] -= through
            fluids.content[net.vertex[j]] += through
    for k in range(net.vertex.shape[0]):
        fluids.pressure[net.vertex[k]] = net.level[k]
