"""Sparse non-negative least squares against SciPy's and against known solutions."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import nnls

from pneumorph.reduction.sparse_nnls import ActiveSet, NormalEquations, sparse_nnls


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


@pytest.mark.parametrize("seed", range(5))
def test_solutions_with_many_blocked_columns_are_scipys(seed):
    # Correlated columns of very different lengths: columns come and go many times.
    rng = np.random.default_rng(seed)
    rows = rng.normal(size=(80, 6)) @ rng.normal(size=(6, 40)) + 0.3 * rng.normal(size=(80, 40))
    rows *= 10.0 ** rng.uniform(-3.0, 3.0, size=40)
    target = rng.normal(size=80) + rows.sum(axis=1)
    expected, _ = nnls(rows, target)
    solution = sparse_nnls(problem(rows, target), 1e-14)
    assert np.array_equal(solution.weight > 0.0, expected > 0.0)
    size = np.linalg.norm(rows, axis=0)
    # Unit columns have a condition number below 100; the normal equations square it.
    assert np.abs(size * (solution.weight - expected)).max() < 1e-11 * np.linalg.norm(target)


def test_sums_of_rows_are_the_products_of_all_rows():
    rng = np.random.default_rng(4)
    rows, target = rng.normal(size=(70, 600)), rng.normal(size=70)
    sums = NormalEquations.empty(600)
    for part in (slice(0, 30), slice(30, 70)):
        sums.add(rows[part], target[part])
        assert np.allclose(sums.gram, sums.gram.T, rtol=0.0, atol=0.0)
    # Two orders of summation of 70 products of size one.
    assert np.abs(sums.gram - rows.T @ rows).max() < 1e-12
    assert np.abs(sums.correlation - rows.T @ target).max() < 1e-12
    assert sums.row_count == 70


def test_updated_factors_are_fresh_ones():
    rng = np.random.default_rng(5)
    rows = rng.normal(size=(300, 200))
    active = ActiveSet(problem(rows, rows.sum(axis=1)))
    unit = rows / np.linalg.norm(rows, axis=0)
    numbers = rng.permutation(200)
    for number in numbers[:120]:
        assert active.add(int(number))
    for _ in range(100):  # take one away anywhere, put another one in
        active.remove(int(rng.integers(len(active.columns))))
        unused = np.setdiff1d(numbers, active.columns)
        assert active.add(int(rng.choice(unused)))
    chosen = unit[:, active.columns]
    fresh = np.linalg.lstsq(chosen, rows.sum(axis=1), rcond=None)[0]
    # A condition number of about 10, squared, and 200 updates that each round once.
    assert np.abs(active.solution() - fresh).max() < 1e-10 * np.abs(fresh).max()


def test_a_column_that_depends_on_others_is_no_help():
    rng = np.random.default_rng(6)
    rows = rng.normal(size=(30, 3))
    rows = np.column_stack([rows, rows @ [1.0, 2.0, 3.0]])
    active = ActiveSet(problem(rows, rows.sum(axis=1)))
    assert [active.add(number) for number in range(4)] == [True, True, True, False]


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


def test_no_column_that_comes_or_goes_raises_the_residual(monkeypatch):
    """Lawson and Hanson's step ends at the first weight that becomes zero, not beyond it."""
    residuals: list[float] = []
    measured = ActiveSet.relative_residual

    def noted(self, weight):
        residuals.append(measured(self, weight))
        return residuals[-1]

    monkeypatch.setattr(ActiveSet, "relative_residual", noted)
    for seed in range(20):
        rng = np.random.default_rng(seed)
        rows = rng.normal(size=(80, 6)) @ rng.normal(size=(6, 40))
        rows += 0.1 * rng.normal(size=(80, 40))
        residuals.clear()
        sparse_nnls(problem(rows, rng.normal(size=80) + rows.sum(axis=1)), 1e-14)
        assert np.diff(residuals).max() < 1e-12
