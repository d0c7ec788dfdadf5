"""Sparse non-negative least squares against SciPy's and against known solutions."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import nnls

from pneumorph.reduction.sparse_nnls import NormalEquations, sparse_nnls


def problem(rows: np.ndarray, target: np.ndarray) -> NormalEquations:
    result = NormalEquations.empty(rows.shape[1])
    for part, right in zip(np.array_split(rows, 3), np.array_split(target, 3), strict=True):
        result.add(part, right)
    return result


def test_full_solution_is_that_of_lawson_and_hanson():
    rng = np.random.default_rng(0)
    rows, target = rng.normal(size=(60, 25)), rng.normal(size=60)
    expected, residual = nnls(rows, target)
    solution = sparse_nnls(problem(rows, target), 1e-12)
    # Normal equations square the condition number (about 5 here): rounding stays below 1e-12.
    assert np.abs(solution.weight - expected).max() < 1e-10
    assert solution.relative_residual == pytest.approx(residual / np.linalg.norm(target))
    assert not solution.converged  # the residual cannot reach the tolerance


def test_a_sparse_non_negative_combination_is_found_and_only_it():
    rng = np.random.default_rng(1)
    rows = rng.normal(size=(80, 200))
    weight = np.zeros(200)
    weight[[3, 50, 120]] = [2.0, 0.5, 7.0]
    solution = sparse_nnls(problem(rows, rows @ weight), 1e-6)
    assert solution.converged
    assert np.flatnonzero(solution.weight).tolist() == [3, 50, 120]
    # A relative residual of 1e-6 bounds the error of well-conditioned columns alike.
    assert np.abs(solution.weight - weight).max() < 1e-5


def test_early_stop_keeps_weights_few_and_the_reported_residual_true():
    rng = np.random.default_rng(2)
    rows = np.abs(rng.normal(size=(40, 300)))
    target = rows.sum(axis=1)
    loose, tight = (sparse_nnls(problem(rows, target), t) for t in (0.1, 0.01))
    assert 0 < np.count_nonzero(loose.weight) < np.count_nonzero(tight.weight) < 300
    for solution in (loose, tight):
        assert np.all(solution.weight >= 0.0)
        true = np.linalg.norm(rows @ solution.weight - target) / np.linalg.norm(target)
        assert solution.relative_residual == pytest.approx(true, rel=1e-6)


def test_column_limit_is_kept():
    rng = np.random.default_rng(3)
    rows = np.abs(rng.normal(size=(40, 100)))
    solution = sparse_nnls(problem(rows, rows.sum(axis=1)), 1e-9, column_limit=5)
    assert np.count_nonzero(solution.weight) <= 5
    assert not solution.converged


def test_impossible_questions_are_refused():
    rows = np.eye(3)
    with pytest.raises(ValueError, match="tolerance must be positive"):
        sparse_nnls(problem(rows, rows.sum(axis=1)), 0.0)
    with pytest.raises(ValueError, match="must not be zero"):
        sparse_nnls(problem(rows, np.zeros(3)), 0.1)
