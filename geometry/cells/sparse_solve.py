"""Systems of equations with as many unknowns as there are grains, each with few neighbours, near in number."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.sparse import csc_array, csr_array
from scipy.sparse.linalg import SuperLU, splu

FEW = 10_000  #: grains, up to which nothing is gained by an iteration, nor by compiling
GROUP = 16  #: unknowns in a row that move as one on the coarse level
CLOSE = 0.01  #: of the right side: remaining residual of many unknowns
MOST = 60  #: iterations; 10 to 30 are usual, more take as long as factors


def solved(matrix: csc_array, right: np.ndarray) -> np.ndarray:
    """(n,) solution of a symmetric positive definite system (n, n).

    Exact for few unknowns. For many, who want it for a step of Newton's method, it is found by conjugate gradients to
    1 %, preconditioned by the diagonal and, for what varies slowly in space, by the same system for groups of
    unknowns (Nicolaides 1987, doi:10.1137/0724027, has the groups). Exact, too, where that takes too long.
    """
    n = len(right)
    if n <= FEW:
        return _factors(matrix).solve(right)
    rows, diagonal, first = matrix.tocsr(), matrix.diagonal(), np.arange(0, n, GROUP)
    groups = csr_array((np.ones(n), (np.arange(n), np.arange(n) // GROUP)))
    coarse = _factors((groups.T @ rows @ groups).tocsc())

    def both_levels(residual: np.ndarray) -> np.ndarray:
        return residual / diagonal + np.repeat(coarse.solve(np.add.reduceat(residual, first)), GROUP)[:n]

    found = _conjugate_gradients(rows, right, both_levels)
    return _factors(matrix).solve(right) if found is None else found


def _conjugate_gradients(
    matrix: csr_array, right: np.ndarray, preconditioned: Callable[[np.ndarray], np.ndarray]
) -> np.ndarray | None:
    """None if it takes too long."""
    found, residual, along, last = np.zeros_like(right), right.copy(), np.zeros_like(right), 1.0
    for _ in range(MOST):
        if _product(residual, residual) <= CLOSE**2 * _product(right, right):
            return found
        direction = preconditioned(residual)
        slope = _product(residual, direction)
        along = direction + slope / last * along
        image = matrix @ along
        step, last = slope / _product(along, image), slope
        found += step * along
        residual -= step * image
    return None


def _product(a: np.ndarray, b: np.ndarray) -> float:
    """Without BLAS, which adds in an order that depends on its threads."""
    return float(np.einsum("i,i", a, b))


def _factors(matrix: csc_array) -> SuperLU:
    return splu(matrix, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
