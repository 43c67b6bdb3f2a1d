"""The stable time step: highest frequency of zones and contacts together, and mass scaling to lower it."""

from __future__ import annotations

import attrs
import numpy as np
import scipy

from grainlaw.specimen import Specimen

TOUCHING = 1e-6  #: of the length of an edge


def _zone_triplets(specimen: Specimen, nodes: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Stiffness of zones with these nodes (i, 2): values (z, 6, 6) and the freedoms (z, 6) they couple."""
    mesh = specimen.mesh
    gradients = shape_functions(nodes, mesh.zones)
    b, c, area = gradients[:3].T, gradients[3:6].T, gradients[6]
    operator = np.zeros((len(area), 3, 6))
    operator[:, 0, 0::2], operator[:, 1, 1::2] = b, c
    operator[:, 2, 0::2], operator[:, 2, 1::2] = c, b
    values = np.einsum("z,zki,zkl,zlj->zij", area, operator, specimen.zone_stiffness, operator, optimize=True)
    return triplets(values, mesh.zones)


def _contact_triplets(
    specimen: Specimen, nodes: np.ndarray, kn: np.ndarray, ks: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Stiffness of the contact points (2, c) with normal and shear stiffness (Pa/m), on the edges of these nodes."""
    mesh = specimen.mesh
    edges = nodes[mesh.interfaces[:, 1]] - nodes[mesh.interfaces[:, 0]]
    lengths = np.hypot(*edges.T)
    tangent = edges / lengths[:, None]
    weight = specimen.contact_points.weights(lengths)
    values = np.zeros((len(edges), 8, 8))
    for point, (near, far) in enumerate(((1 - weight, weight), (weight, 1 - weight))):
        share = np.stack([-near, -far, near, far], axis=1)  # of the four nodes in the displacement of B relative to A
        add_springs(values, share, tangent, (kn[point] * lengths / 2, ks[point] * lengths / 2))
    return triplets(values, mesh.interfaces)


def add_springs(
    values: np.ndarray, share: np.ndarray, tangent: np.ndarray, springs: tuple[np.ndarray, np.ndarray]
) -> None:
    """Add one point of each contact to ``values`` (c, 8, 8) N/m, over the components of the contact's four nodes.

    Its displacement of B relative to A is ``share`` (c, 4) of theirs; ``springs`` are two of (c,) N/m, along the normal
    and along the ``tangent`` (c, 2).
    """
    normal = np.stack([tangent[:, 1], -tangent[:, 0]], axis=1)
    for direction, stiffness in zip((normal, tangent), springs, strict=True):
        motion = (share[:, :, None] * direction[:, None, :]).reshape(-1, 8)
        values += stiffness[:, None, None] * motion[:, :, None] * motion[:, None, :]


def _edge_triplets(
    specimen: Specimen, edges: np.ndarray, kn: float, ks: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Stiffness of edges (e, 2), each pressed along its length against its mirror image, which moves oppositely."""
    vectors = specimen.mesh.nodes[edges[:, 1]] - specimen.mesh.nodes[edges[:, 0]]
    lengths = np.hypot(*vectors.T)
    tangent = vectors / lengths[:, None]
    normal = np.stack([tangent[:, 1], -tangent[:, 0]], axis=1)
    ends = np.array([[1 / 3, 1 / 6], [1 / 6, 1 / 3]])  # of a pressure that is linear along the edge
    directions = sum(k * d[:, :, None] * d[:, None, :] for k, d in ((kn, normal), (ks, tangent)))
    values = 2 * lengths[:, None, None, None, None] * ends[:, None, :, None] * directions[:, None, :, None, :]
    return triplets(values.reshape(-1, 4, 4), edges)


def touching_stiffness(
    places: np.ndarray, nodes: np.ndarray, kn: np.ndarray, ks: np.ndarray, count: int
) -> scipy.sparse.csr_matrix:
    """Stiffness (N/m) over the components of ``count`` nodes of edges that touch, pressed together and not sliding.

    ``places`` (4, c, 2) m are the ends of the edges a and b of c contacts, both counter-clockwise round their grains,
    ``nodes`` (4, c) their nodes, ``kn`` and ``ks`` (c,) Pa/m. Edges touch where they overlap, and where
    they are apart by less than ``TOUCHING`` of their length. Two points on their common part share its stiffness.
    """
    along = places[1] - places[0]
    length = np.hypot(*along.T)
    tangent = along / length[:, None]
    normal = np.stack([tangent[:, 1], -tangent[:, 0]], axis=1)
    start, end = (np.sum((places[k] - places[0]) * tangent, axis=1) for k in (3, 2))  # b runs the other way
    low, high = np.maximum(start, 0.0), np.minimum(end, length)
    gaps = np.stack([np.sum((places[k] - places[0]) * normal, axis=1) for k in (3, 2)])
    values = np.zeros((len(length), 8, 8))
    touching = high - low > TOUCHING * length
    with np.errstate(divide="ignore", invalid="ignore"):
        for place in (0.5 - 0.5 / np.sqrt(3), 0.5 + 0.5 / np.sqrt(3)):
            at = low + place * (high - low)
            on_a, on_b = at / length, (at - start) / (end - start)
            touches = touching & (gaps[0] + on_b * (gaps[1] - gaps[0]) < TOUCHING * length)
            share = np.where(touches[:, None], np.stack([on_a - 1, -on_a, on_b, 1 - on_b], axis=1), 0.0)
            add_springs(values, share, tangent, (kn * (high - low) / 2, ks * (high - low) / 2))
    data, rows, columns = triplets(values, nodes.T)
    return scipy.sparse.coo_matrix((data, (rows, columns)), (2 * count, 2 * count)).tocsr()


def triplets(values: np.ndarray, nodes: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Values (c, 2 k, 2 k) over the components of nodes (c, k), as values, rows and columns of a sparse matrix."""
    freedoms = (2 * nodes[:, :, None] + np.arange(2)).reshape(len(nodes), 2 * nodes.shape[1]).astype(np.int32)
    size = freedoms.shape[1]
    return values.ravel(), np.repeat(freedoms, size, axis=1).ravel(), np.tile(freedoms, (1, size)).ravel()


def shape_functions(nodes: np.ndarray, zones: np.ndarray) -> np.ndarray:
    """(7, z): gradients of the three shape functions along x, along y (1/m), and the area (m2)."""
    (ax, ay), (bx, by), (cx, cy) = (nodes[zones[:, k]].T for k in range(3))
    double = (bx - ax) * (cy - ay) - (cx - ax) * (by - ay)
    return np.stack([by - cy, cy - ay, ay - by, cx - bx, ax - cx, bx - ax, double * double / 2]) / double


def stiffness_matrix(
    specimen: Specimen,
    kn: np.ndarray,
    ks: np.ndarray,
    rim: tuple[np.ndarray, float, float] | None = None,
    nodes: np.ndarray | None = None,
) -> scipy.sparse.csr_matrix:
    """Stiffness (N/m) of zones and contact points over node components (2 i); ``kn``, ``ks`` are (2, c) Pa/m.

    ``rim`` holds edges (e, 2) that may come into contact, and the stiffness (Pa/m) of such contacts. ``nodes`` (i, 2) m
    are those of turned grains, if they have turned.
    """
    nodes = specimen.mesh.nodes if nodes is None else nodes
    parts = [_contact_triplets(specimen, nodes, kn, ks)]
    if rim is not None:
        parts.append(_edge_triplets(specimen, *rim))
    if not specimen.is_rigid:
        parts.append(_zone_triplets(specimen, nodes))
    parts = [part for part in parts if len(part[0])] or parts  # one part is not copied
    values, rows, columns = parts[0] if len(parts) == 1 else map(np.concatenate, zip(*parts, strict=True))
    del parts
    size = 2 * len(specimen.mesh.nodes)
    return scipy.sparse.coo_matrix((values, (rows, columns)), (size, size)).tocsr()


def rigid_map(specimen: Specimen, nodes: np.ndarray | None = None) -> scipy.sparse.csr_matrix:
    """Displacement of node components (2 i) from grain translations and rotations (3 g: all x, all y, all angles).

    ``nodes`` (i, 2) m are those of grains that have turned about their centroids.
    """
    mesh = specimen.mesh
    count = len(mesh.first_node) - 1
    arm = (mesh.nodes if nodes is None else nodes) - specimen.grains.centroids[mesh.node_grain]
    node, one = np.arange(len(mesh.nodes)), np.ones(len(mesh.nodes))
    rows = np.concatenate([2 * node, 2 * node + 1, 2 * node, 2 * node + 1])
    columns = np.concatenate([mesh.node_grain, mesh.node_grain + count] + [mesh.node_grain + 2 * count] * 2)
    values = np.concatenate([one, one, -arm[:, 1], arm[:, 0]])
    return scipy.sparse.coo_matrix((values, (rows, columns)), (2 * len(node), 3 * count)).tocsr()


def highest_frequency(stiffness: scipy.sparse.csr_matrix, mass: np.ndarray) -> float:
    """Highest angular frequency (1/s) of freedoms with lumped ``mass`` (kg), by Lanczos' method, within 0.1 %.

    0 for a stiffness matrix of zeros.
    """
    scale = 1 / np.sqrt(mass)
    scaled = scipy.sparse.csr_matrix(stiffness.multiply(scale[:, None]).multiply(scale[None, :]))
    if scaled.shape[0] < 20:
        return float(np.sqrt(max(np.linalg.eigvalsh(scaled.toarray())[-1], 0.0)))
    start = np.random.default_rng(0).normal(size=len(mass))
    options = {"k": 1, "which": "LA", "v0": start, "tol": 1e-3, "return_eigenvectors": False}
    return float(np.sqrt(max(scipy.sparse.linalg.eigsh(scaled, **options)[0], 0.0)))


@attrs.frozen
class ScaledMass:
    """Result of mass scaling."""

    mass: np.ndarray  #: kg of each freedom
    frequency: float  #: 1/s, the highest that is left
    added: float  #: share of the specimen's mass that was added


def scale_masses(stiffness: scipy.sparse.csr_matrix, mass: np.ndarray, gain: float, groups: np.ndarray) -> ScaledMass:
    """Raise the mass of the few freedoms that alone govern the stable step until it is ``gain`` times as long.

    A freedom's mass is raised to a multiple of its row sum of stiffness (Gershgorin's bound); the smallest multiple
    that reaches the longer step is found by bisection. Freedoms of one group in ``groups`` (n,), those of a node, get
    the same mass.
    """
    frequency = highest_frequency(stiffness, mass)
    target = frequency / gain
    sums = np.asarray(abs(stiffness).sum(axis=1)).ravel()
    largest = np.zeros(groups.max() + 1)
    np.maximum.at(largest, groups, sums)
    sums = largest[groups]

    def raised(multiple: float) -> np.ndarray:
        return np.maximum(mass, multiple * sums / target**2)

    low, high = 0.0, 1.0  # with 1, the target is reached by Gershgorin's theorem
    for _ in range(8):
        middle = (low + high) / 2
        low, high = (low, middle) if highest_frequency(stiffness, raised(middle)) <= target else (middle, high)
    scaled = raised(high)
    return ScaledMass(scaled, highest_frequency(stiffness, scaled), float(scaled.sum() / mass.sum() - 1))
