"""Vertices of a tiling moved a little, so that its grains have prescribed areas again after short edges were merged.

The areas depend on the vertices with known slopes. Of all displacements that correct them, that of the least squares is
taken, each over the area of the smallest grain at its vertex (Newton's method for an underdetermined system). Vertices
stay on their side; those whose grain would not stay convex stay where they are, and the others do their part.
"""

from __future__ import annotations

import attrs
import numpy as np
from scipy.sparse import coo_array, diags_array, eye_array

from grainlaw.geometry.cells.merging import FLATTEST
from grainlaw.geometry.cells.sides import region_sides
from grainlaw.geometry.cells.sparse_solve import solved
from grainlaw.geometry.cells.tiling import Tiling
from grainlaw.polygon import areas_and_centroids, cross

STEPS = 8
STUCK = 1e-3  #: change of the error, below which no further step is made
SOFT = 1e-12  #: of the largest entry


def owned_areas(tiling: Tiling, count: int) -> np.ndarray:
    """(n,) m2 of the grains of each of ``count`` seeds together."""
    areas = areas_and_centroids(tiling.vertices[tiling.corners], tiling.first)[0]
    return np.bincount(tiling.owner, areas, count)


def with_areas(tiling: Tiling, areas: np.ndarray, tolerance: float) -> Tiling:
    """With the grains of seed n covering ``areas[n]`` (m2) in all, to within a ``tolerance`` times it or nearly so."""
    held = np.zeros(len(tiling.vertices), dtype=bool)
    best, least, last = tiling, np.inf, np.inf
    for _ in range(STEPS):
        missing = areas - owned_areas(tiling, len(areas))
        error = float(np.sqrt(((missing / areas) ** 2).mean()))
        if error < least:
            best, least = tiling, error
        # the area of all grains is that of the region
        if abs(missing / areas).max() <= tolerance or len(areas) == 1 or abs(error / last - 1) < STUCK:
            break
        tiling, back = _still_convex(_moved(tiling, missing, areas, held), tiling)
        held, last = held | back, error
    return best


def _still_convex(moved: Tiling, before: Tiling) -> tuple[Tiling, np.ndarray]:
    """Vertices put back until all grains are as convex as they were, and (v,) which."""
    back = np.zeros(len(before.vertices), dtype=bool)
    while True:
        bent = _bent(moved, (moved.vertices != before.vertices).any(axis=1))
        if not bent.any():
            return moved, back
        back |= bent
        moved = attrs.evolve(moved, vertices=np.where(back[:, None], before.vertices, moved.vertices))


def _moved(tiling: Tiling, missing: np.ndarray, areas: np.ndarray, held: np.ndarray) -> Tiling:
    """By the displacement that would add ``missing`` (n,) m2 if areas depended linearly on it."""
    vertex, count = tiling.corners, len(tiling.vertices)
    chord = tiling.vertices[vertex[tiling.next]] - tiling.vertices[vertex[tiling.previous]]
    gain = np.column_stack([chord[:, 1], -chord[:, 0]]) / 2  # m2 per m that the corner moves
    owner = tiling.owner[tiling.grain]
    row, column = np.concatenate([owner, owner]), np.concatenate([2 * vertex, 2 * vertex + 1])
    slopes = coo_array((gain.T.ravel(), (row, column)), shape=(len(areas), 2 * count)).tocsr()

    free = _directions(tiling, held)
    ease = np.full(count, np.inf)
    np.minimum.at(ease, vertex, areas[owner])
    ease[np.isinf(ease)] = 0
    # Relative to the areas asked for: small grains count as much as large ones.
    along = diags_array(1 / areas) @ slopes @ free
    system = (along @ diags_array(np.repeat(ease, 2)) @ along.T).tocsc()
    soft = SOFT * system.diagonal().max() or 1.0  # where the vertices of a grain are all held
    # The areas of all grains add up to that of the region whatever moves: one condition follows from the others.
    system = (system + soft * eye_array(len(areas))).tocsc()
    force = np.append(solved(system[:-1, :-1], (missing / areas)[:-1]), 0.0)
    step = free @ (np.repeat(ease, 2) * (along.T @ force))
    moved = tiling.vertices + step.reshape(-1, 2)
    return attrs.evolve(tiling, vertices=region_sides(tiling.region).hold(moved, tiling.on))


def _directions(tiling: Tiling, held: np.ndarray) -> coo_array:
    """(2 v, 2 v) of how vertices may move: anywhere, along their side or not at all."""
    count = len(tiling.vertices)
    inward = region_sides(tiling.region).inward
    blocks = np.tile(np.eye(2), (count, 1, 1))
    on_side = tiling.on[:, 0] >= 0
    normal = inward[tiling.on[on_side, 0]]
    blocks[on_side] -= normal[:, :, None] * normal[:, None, :]
    blocks[(tiling.on[:, 1] >= 0) | held] = 0
    first = 2 * np.arange(count)[:, None, None]
    row = first + np.array([[0, 0], [1, 1]])
    column = first + np.array([[0, 1], [0, 1]])
    return coo_array((blocks.ravel(), (row.ravel(), column.ravel())), shape=(2 * count, 2 * count)).tocsr()


def _bent(tiling: Tiling, moved: np.ndarray) -> np.ndarray:
    """(v,) whether a vertex has part in a corner that turns too little to the left since one of the three has moved."""
    here, after, before = tiling.corners, tiling.corners[tiling.next], tiling.corners[tiling.previous]
    into, onward = tiling.vertices[here] - tiling.vertices[before], tiling.vertices[after] - tiling.vertices[here]
    flat = cross(into, onward) <= FLATTEST / 2 * np.hypot(*into.T) * np.hypot(*onward.T)
    flat &= moved[before] | moved[here] | moved[after]
    bent = np.zeros(len(tiling.vertices), dtype=bool)
    for corner in (before, here, after):
        bent[corner[flat]] = True
    return bent
