"""Sparse non-negative least squares on the normal equations.

Minimise ||G w - b|| over w >= 0 and stop as soon as ||G w - b|| <= tolerance ||b||: Lawson and
Hanson's active set adds one column at a time, so an early stop leaves most weights exactly zero.
Only G^T G, G^T b and ||b||^2 are needed, which rows can be streamed into; with c columns and p
chosen ones a step costs O(c p + p^3) whatever the number of rows. Working with the squared
condition number in double precision resolves relative residuals down to about 1e-7, far below any
useful tolerance.

Source: Lawson and Hanson 1974, chapter 23; early stop as in Farhat et al. 2014 (ECSW).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.linalg


@dataclass
class NormalEquations:
    """Streamed sums of a least-squares problem."""

    gram: np.ndarray
    """G^T G, (column, column)."""
    correlation: np.ndarray
    """G^T b, (column,)."""
    target_square: float = 0.0
    """||b||^2"""
    row_count: int = 0

    @classmethod
    def empty(cls, column_count: int) -> NormalEquations:
        return cls(np.zeros((column_count, column_count)), np.zeros(column_count))

    def add(self, rows: np.ndarray, target: np.ndarray) -> None:
        """Add rows (row, column) with their right side (row,)."""
        self.gram += rows.T @ rows
        self.correlation += rows.T @ target
        self.target_square += float(target @ target)
        self.row_count += len(rows)

    def relative_residual(self, weight: np.ndarray) -> float:
        """||G w - b|| / ||b|| for weights (column,)."""
        chosen = np.flatnonzero(weight)
        part = weight[chosen]
        square = (
            self.target_square
            - 2.0 * self.correlation[chosen] @ part
            + part @ self.gram[np.ix_(chosen, chosen)] @ part
        )
        return float(np.sqrt(max(square, 0.0) / self.target_square))


@dataclass(frozen=True)
class SparseSolution:
    """Weights and how the search ended."""

    weight: np.ndarray
    """Non-negative weights, (column,)."""
    relative_residual: float
    iterations: int
    converged: bool
    """Whether the tolerance was met; else no column could lower the residual, or a limit hit."""


def sparse_nnls(
    problem: NormalEquations,
    tolerance: float,
    column_limit: int | None = None,
    iteration_limit: int = 5000,
) -> SparseSolution:
    """Choose few columns with non-negative weights.

    Args:
        problem: The normal equations.
        tolerance: Relative residual at which to stop.
        column_limit: Stop at so many columns; no limit if not given.
        iteration_limit: Columns added or removed at most.

    Raises:
        ValueError: The tolerance is not positive, or the right side is zero.
    """
    if not tolerance > 0.0:
        raise ValueError(f"tolerance must be positive, got {tolerance}")
    if not problem.target_square > 0.0:
        raise ValueError("the right side must not be zero; the training rows hold no force at all")
    gram, correlation = problem.gram, problem.correlation
    column_count = len(correlation)
    limit = column_count if column_limit is None else min(column_limit, column_count)
    size = np.sqrt(np.maximum(np.diag(gram), 1e-300))
    weight = np.zeros(column_count)
    active: list[int] = []
    rejected = np.zeros(column_count, dtype=bool)
    residual, iterations = 1.0, 0

    while residual > tolerance and len(active) < limit and iterations < iteration_limit:
        iterations += 1
        gradient = correlation - gram[:, active] @ weight[active]
        # The cosine between column and residual: large elements get no head start.
        cosine = gradient / size
        cosine[active] = 0.0
        cosine[rejected] = 0.0
        best = int(np.argmax(cosine))
        if cosine[best] <= 1e-9 * np.sqrt(problem.target_square):
            break
        trial_active = [*active, best]
        trial = _fit(gram, correlation, trial_active)
        if trial[-1] <= 0.0:
            # Rounding: a column that lowers the residual must get a positive weight.
            rejected[best] = True
            continue
        current = np.append(weight[active], 0.0)
        while np.any(trial <= 0.0) and iterations < iteration_limit:
            iterations += 1
            blocked = trial <= 0.0
            step = np.min(current[blocked] / (current[blocked] - trial[blocked]))
            current = current + step * (trial - current)
            keep = current > 1e-12 * current.max()
            trial_active = [c for c, kept in zip(trial_active, keep, strict=True) if kept]
            current = current[keep]
            trial = _fit(gram, correlation, trial_active)
        active = trial_active
        weight[:] = 0.0
        weight[active] = np.maximum(trial, 0.0)
        previous, residual = residual, problem.relative_residual(weight)
        if residual < previous * (1.0 - 1e-9):
            rejected[:] = False
    return SparseSolution(weight, residual, iterations, residual <= tolerance)


def _fit(gram: np.ndarray, correlation: np.ndarray, active: list[int]) -> np.ndarray:
    """Unconstrained weights of the active columns."""
    block = gram[np.ix_(active, active)]
    scale = 1.0 / np.sqrt(np.diag(block))
    scaled = block * scale[:, None] * scale[None, :]
    right = correlation[active] * scale
    try:
        return scale * scipy.linalg.solve(scaled, right, assume_a="pos", check_finite=False)
    except np.linalg.LinAlgError:  # dependent columns
        return scale * np.linalg.lstsq(scaled, right, rcond=1e-13)[0]
