"""Forces of a contact between two edges are the gradient of one energy, for every way in which edges can overlap."""

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from grainlaw.engine.contacts import contact_geometry, contact_passes
from grainlaw.engine.contacts.contact_rows import FX, FY, GX, GY, HX, HY, LARGEST, NORMAL, OVERLAP, rows_of
from grainlaw.engine.contacts.contact_table import no_contacts

KN = 2.5e9
STEP = 1e-6


def unit(vector):
    return vector / np.hypot(*vector)


def energy(edges, cotangent=(0, 0, 0, 0)):
    """kn/2 J^3 D^2 / (J^2 + D^2) of Eq. (14); the grain's angle at a node is acute where its cotangent is above 0.

    Where an overlap runs from a corner of A to one of B, a length begins at the other side of its own grain's corner.
    """
    a1, a2, b1, b2 = edges
    along_a, along_b = unit(a2 - a1), unit(b1 - b2)
    tangent = unit(along_a + along_b)
    ends = {"a": sorted([a1 @ tangent, a2 @ tangent]), "b": sorted([b1 @ tangent, b2 @ tangent])}
    begin, end = max(e[0] for e in ends.values()), min(e[1] for e in ends.values())
    if begin >= end:
        return 0.0

    def point_and_depth(s):
        """The corner that lies at a place along the tangent, how deep it is behind the other edge, its cotangent."""
        for corner, cot in zip((a1, a2), cotangent[:2], strict=True):
            if abs(corner @ tangent - s) < 1e-12:
                return corner, along_b[1] * (corner - b2)[0] - along_b[0] * (corner - b2)[1], cot, True
        corner, cot = min(zip((b1, b2), cotangent[2:], strict=True), key=lambda point: abs(point[0] @ tangent - s))
        return corner, along_a[0] * (corner - a1)[1] - along_a[1] * (corner - a1)[0], cot, False

    (p, d1, cot_1, of_a_1), (q, d2, cot_2, of_a_2) = point_and_depth(begin), point_and_depth(end)
    if max(d1, d2) <= 0:
        return 0.0
    cut_a = cut_b = 0.0
    if of_a_1 != of_a_2 and min(d1, d2) >= 0:
        both = 2 / (1 / d1 + 1 / d2) if min(d1, d2) > 0 else 0.0
        cut_a, cut_b = (cot_1 * both, cot_2 * both) if of_a_1 else (cot_2 * both, cot_1 * both)
    if min(d1, d2) < 0:  # lines that cross
        share = np.linalg.solve(np.column_stack([a2 - a1, b2 - b1]), b2 - a1)[0]
        crossing = a1 + share * (a2 - a1)
        p, d1, q, d2 = (p, d1, crossing, 0.0) if d2 < 0 else (crossing, 0.0, q, d2)
    runs = (q - p) @ along_a - cut_a, (q - p) @ along_b - cut_b
    if min(runs) <= 0:
        return 0.0
    run, square = np.sqrt(runs[0] * runs[1]), (d1**2 + d1 * d2 + d2**2) / 3
    return KN / 2 * run**3 * square / (run**2 + square)


def touching(edges, cotangent=(0, 0, 0, 0)):
    """What the engine finds for two edges with a linear closure without friction, by rows of contact_rows.py."""
    table = no_contacts(1)._replace(
        node=np.arange(4, dtype=np.int32).reshape(4, 1), cotangent=np.array(cotangent, dtype=float),
        place=np.ascontiguousarray(np.transpose(edges)), increment=np.zeros((2, 4)),
    )  # fmt: skip
    row = rows_of(1, 0)[0]
    row[LARGEST] = np.inf
    contact_geometry.gather_edges(table, table.place, row, np.array([0]))
    contact_geometry.gather_angles(table, row, np.array([0]))
    contact_geometry.overlaps(row, 1)
    row[NORMAL] = -KN * row[OVERLAP]
    contact_passes.springs(row, 1)
    contact_passes.forces(row, 1)
    return row


def contact_forces(edges, cotangent=(0, 0, 0, 0)):
    """Nodal forces (4, 2) N by the engine."""
    row = touching(edges, cotangent)
    on_a, end_a, start_b = row[[FX, FY]], row[[GX, GY]], row[[HX, HY]]
    return np.stack([on_a - end_a, end_a, start_b, -on_a - start_b])


@settings(max_examples=400)
@given(
    turn=st.floats(-1.3, 1.3),
    length=st.floats(0.2, 2.0),
    x=st.floats(-1.0, 1.0).filter(lambda x: abs(x) > 1e-3),
    y=st.floats(-0.3, 0.3).filter(lambda y: abs(y) > 1e-3),
    way=st.tuples(st.floats(-1, 1), st.floats(-1, 1), st.floats(-1, 1)),
    cotangent=st.just((0, 0, 0, 0)) | st.tuples(*4 * [st.floats(0, 1.5)]),
)
@pytest.mark.thorough
def test_forces_and_moments_are_the_gradient_of_the_energy(turn, length, x, y, way, cotangent):
    start = np.array([x, y])
    edges = np.array([[0, 0], [1, 0], start + length * np.array([np.cos(turn), np.sin(turn)]), start])
    stored = energy(edges, cotangent)
    assume(stored >= 1e-4 * KN * length**3)  # less is next to nothing
    forces = contact_forces(edges, cotangent)
    resultant = forces.sum(axis=0)
    moment = (edges[:, 0] * forces[:, 1] - edges[:, 1] * forces[:, 0]).sum()
    scale = np.abs(forces).sum()
    assert np.abs(resultant).max() <= 1e-12 * scale
    assert abs(moment) <= 1e-12 * scale

    def moved(step):
        cosine, sine = np.cos(step * way[2]), np.sin(step * way[2])
        other = edges[2:] @ np.array([[cosine, sine], [-sine, cosine]]) + step * np.array(way[:2])
        return np.concatenate([edges[:2], other])

    motion = (moved(STEP) - moved(-STEP)) / (2 * STEP)
    before, after = (stored - energy(moved(-STEP), cotangent)) / STEP, (energy(moved(STEP), cotangent) - stored) / STEP
    assume(abs(after - before) <= 2e-5 * scale)  # else a corner passes the end of the other edge: the slope has a kink
    assert -np.sum(forces * motion) == pytest.approx((before + after) / 2, abs=2e-5 * scale)


@pytest.mark.thorough
@pytest.mark.parametrize("cotangent", [(1.0, 0, 0, 0), (0, 0, 0.8, 0), (1.0, 0, 0.8, 0)])
def test_nothing_jumps_where_a_corner_leaves_the_other_edge(cotangent):
    """An acute corner of B sinks behind edge a while one of A is already deep behind edge b."""
    sunk, out = (
        np.array([[0, 0], [1, 0], [0.6, depth], [-0.4, depth + 0.2]]) for depth in (1e-9, -1e-9)
    )  # fmt: skip
    assert energy(sunk, cotangent) > 0.001 * KN
    assert energy(sunk, cotangent) == pytest.approx(energy(out, cotangent), rel=1e-6)
    assert touching(sunk, cotangent)[OVERLAP] == pytest.approx(touching(out, cotangent)[OVERLAP], rel=1e-6)


@pytest.mark.thorough
def test_a_face_on_a_face_is_an_elastic_foundation():
    """Two faces that overlap by a wedge: kn times the mean depth, at the centre of the wedge."""
    d1, d2 = 1e-4, 3e-4
    edges = np.array([[0, 0], [1, 0], [2, 2 * d2 - d1], [-1, 2 * d1 - d2]])
    forces = contact_forces(edges)
    on_a = forces[:2].sum(axis=0)
    assert np.hypot(*on_a) == pytest.approx(KN * (d1 + d2) / 2, rel=1e-6)
    centre = forces[1, 1] / on_a[1]
    assert centre == pytest.approx((d1 + 2 * d2) / (3 * (d1 + d2)), rel=1e-3)


@pytest.mark.thorough
def test_side_faces_of_corners_that_overlap_carry_next_to_nothing():
    """Half a block rests on another one, a micrometre deep: the faces beside it see half a block as their overlap."""
    deep, wide = 1e-6, 0.5
    resting = np.array([[0, 0], [1, 0], [1.5, deep], [0.5, deep]])  # lower side of A on the upper side of B
    sides = np.array([[1, 0], [1, 1], [0.5, deep], [0.5, -1]])  # right side of A against the left side of B
    carried = np.hypot(*contact_forces(resting)[:2].sum(axis=0))
    assert carried == pytest.approx(KN * deep * wide, rel=1e-5)
    assert np.hypot(*contact_forces(sides)[:2].sum(axis=0)) < 10 * deep / wide * carried
