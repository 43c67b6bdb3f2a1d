"""Factors of large matrices: they solve, and are filled as little as nested dissection promises."""

import numpy as np
import pytest
import scipy

from grainlaw.engine import factors
from grainlaw.engine.factors import Factors, nested_dissection


def grid(n):
    """Nine-point operator on a grid of n x n places, shuffled, and the places."""
    one = scipy.sparse.diags([np.ones(n - 1), np.ones(n), np.ones(n - 1)], [-1, 0, 1])
    matrix = 9.5 * scipy.sparse.identity(n * n) - scipy.sparse.kron(one, one)
    places = np.stack(np.meshgrid(np.arange(n), np.arange(n), indexing="ij"), axis=-1).reshape(-1, 2) / n
    shuffled = np.random.default_rng(0).permutation(n * n)
    return matrix.tocsr()[shuffled][:, shuffled].tocsc(), places[shuffled]


def test_large_matrices_are_solved_as_small_ones(monkeypatch):
    """With freedoms of equal place, and one that is everywhere and touches many."""
    matrix, places = grid(12)
    both = scipy.sparse.kron(matrix, np.array([[2.0, 1.0], [1.0, 2.0]])).tolil()
    both[5, ::7] = both[::7, 5] = 0.01
    places = np.repeat(places, 2, axis=0)
    places[5] = np.nan
    right = np.random.default_rng(1).normal(size=(len(places), 2))
    monkeypatch.setattr(factors, "SMALL", 10)
    large = Factors(both, places)
    assert large.solve(right) == pytest.approx(np.linalg.solve(both.toarray(), right))
    assert large.solve(right[:, 0]) == pytest.approx(np.linalg.solve(both.toarray(), right[:, 0]))


@pytest.mark.parametrize("n", [40, 100])
def test_a_grid_is_filled_as_theory_says(n, monkeypatch):
    """Fewer than 31/4 n^2 log2 n numbers on a grid of n x n (George 1973); row by row it would be n^3."""
    matrix, places = grid(n)
    order = nested_dissection(matrix, places)
    assert sorted(order) == list(range(n * n))
    monkeypatch.setattr(factors, "SMALL", 10)
    assert Factors(matrix, places)._factors.L.nnz < 31 / 4 * n**2 * np.log2(n)
