"""Sparse non-negative least squares on the normal equations.

Minimise ||G w - b|| over w >= 0 and stop as soon as ||G w - b|| <= tolerance ||b||: Lawson and
Hanson's active set adds one column at a time, so an early stop leaves most weights exactly zero.
Only G^T G, G^T b and ||b||^2 are needed, which rows are streamed into. The Cholesky factor of the
active columns' block is updated when a column comes (a triangular solve) or goes (plane rotations),
so that with c columns and p active ones a step costs O(c p + p^2), whatever the number of rows.
Working with the squared condition number in double precision resolves relative residuals down to
about 1e-7, far below any useful tolerance.

Source: Lawson and Hanson 1974, chapters 23 and 24; early stop as in Farhat et al. 2014 (ECSW).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.linalg
from scipy.linalg.blas import dsyrk

# A column whose part normal to the active ones is smaller than this, relative to its length, cannot
# be told from their combination: rounding of G^T G.
_DEPENDENT = 1e-7


class NormalEquations:
    """Streamed sums of a least-squares problem in double precision."""

    def __init__(self, column_count: int) -> None:
        # Column-major, so that BLAS adds in place; only one triangle is kept up to date.
        self._lower = np.zeros((column_count, column_count), order="F")
        self._complete = True
        self.correlation = np.zeros(column_count)
        """G^T b, (column,)."""
        self.target_square = 0.0
        """||b||^2"""
        self.row_count = 0

    @classmethod
    def empty(cls, column_count: int) -> NormalEquations:
        """No rows yet."""
        return cls(column_count)

    @property
    def gram(self) -> np.ndarray:
        """G^T G, (column, column); symmetric."""
        if not self._complete:
            for start in range(0, len(self._lower), 512):  # no second matrix of that size
                end = start + 512
                block = self._lower[start:end, start:end]
                block += np.tril(block, -1).T - np.triu(block, 1)
                self._lower[start:end, end:] = self._lower[end:, start:end].T
            self._complete = True
        return self._lower

    def add(self, rows: np.ndarray, target: np.ndarray) -> None:
        """Add rows (row, column) with their right side (row,)."""
        rows = np.ascontiguousarray(rows, dtype=np.float64)
        # rows.T is column-major as it is: half the products of rows.T @ rows, and no temporary.
        self._lower = dsyrk(1.0, rows.T, beta=1.0, c=self._lower, lower=1, overwrite_c=1)
        self._complete = False
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
    active = ActiveSet(problem)
    column_count = len(problem.correlation)
    limit = column_count if column_limit is None else min(column_limit, column_count)
    smallest_cosine = 1e-9 * np.sqrt(problem.target_square)
    rejected = np.zeros(column_count, dtype=bool)
    weight, residual, iterations = np.zeros(0), 1.0, 0

    while residual > tolerance and len(active.columns) < limit and iterations < iteration_limit:
        iterations += 1
        cosine = active.cosines(weight)
        cosine[active.columns] = 0.0
        cosine[rejected] = 0.0
        best = int(np.argmax(cosine))
        if cosine[best] <= smallest_cosine:
            break
        if not active.add(best):
            rejected[best] = True
            continue
        trial = active.solution()
        if trial[-1] <= 0.0:
            # Rounding: a column that lowers the residual must get a positive weight.
            active.remove(len(trial) - 1)
            rejected[best] = True
            continue
        weight = np.append(weight, 0.0)
        while np.any(trial <= 0.0) and iterations < iteration_limit:
            iterations += 1
            blocked = trial <= 0.0
            step = np.min(weight[blocked] / (weight[blocked] - trial[blocked]))
            weight = weight + step * (trial - weight)
            keep = weight > 1e-12 * weight.max()
            for place in np.flatnonzero(~keep)[::-1]:
                active.remove(int(place))
            weight = weight[keep]
            trial = active.solution()
        weight = np.maximum(trial, 0.0)
        previous, residual = residual, active.relative_residual(weight)
        if residual < previous * (1.0 - 1e-9):
            rejected[:] = False
    every = np.zeros(column_count)
    every[active.columns] = weight / active.size[active.columns]
    return SparseSolution(every, residual, iterations, residual <= tolerance)


class ActiveSet:
    """Active columns and the Cholesky factor of their block of G^T G; columns have unit length.

    Weights here are those of unit columns: divide by `size` for the problem's own.
    """

    def __init__(self, problem: NormalEquations) -> None:
        gram = problem.gram
        self._problem, self._gram = problem, gram
        self.size: np.ndarray = np.sqrt(np.maximum(np.diag(gram), 1e-300))
        """Length of each column, (column,)."""
        self.columns: list[int] = []
        """Numbers of the active columns, in the order of the factor."""
        self._correlation = problem.correlation / self.size
        self._lower = np.zeros((0, 0))  # L of L L^T, leading block of a larger array
        self._products = np.zeros((0, len(gram)))  # rows of G^T G of the active columns

    def cosines(self, weight: np.ndarray) -> np.ndarray:
        """Product of each unit column with the residual, (column,).

        Unit columns: large elements get no head start.
        """
        count = len(self.columns)
        return self._correlation - (weight @ self._products[:count]) / self.size

    def add(self, column: int) -> bool:
        """Append a column to the factor; refused (False) where it depends on the active ones."""
        count = len(self.columns)
        if count == len(self._lower):
            self._grow()
        products = self._gram[:, column] / self.size[column]
        row = scipy.linalg.solve_triangular(
            self._lower[:count, :count],
            products[self.columns] / self.size[self.columns],
            lower=True,
            check_finite=False,
        )
        square = 1.0 - float(row @ row)
        if square < _DEPENDENT**2:
            return False
        self._lower[count, :count] = row
        self._lower[count, count] = np.sqrt(square)
        self._products[count] = products
        self.columns.append(column)
        return True

    def remove(self, place: int) -> None:
        """Take the column at a place out of the factor, by plane rotations (O(p^2))."""
        count = len(self.columns)
        lower = self._lower
        lower[place : count - 1] = lower[place + 1 : count]
        self._products[place : count - 1] = self._products[place + 1 : count]
        for k in range(place, count - 1):  # each row now reaches one entry beyond the diagonal
            along, beyond = lower[k, k], lower[k, k + 1]
            radius = float(np.hypot(along, beyond))
            cosine, sine = along / radius, beyond / radius
            first, second = lower[k : count - 1, k].copy(), lower[k : count - 1, k + 1].copy()
            lower[k : count - 1, k] = cosine * first + sine * second
            lower[k : count - 1, k + 1] = cosine * second - sine * first
        lower[count - 1] = 0.0
        lower[: count - 1, count - 1] = 0.0
        del self.columns[place]

    def solution(self) -> np.ndarray:
        """Unconstrained weights of the active columns, (active,)."""
        count = len(self.columns)
        solution: np.ndarray = scipy.linalg.cho_solve(
            (self._lower[:count, :count], True),
            self._correlation[self.columns],
            check_finite=False,
        )
        return solution

    def relative_residual(self, weight: np.ndarray) -> float:
        """||G w - b|| / ||b|| for weights of the active columns, (active,)."""
        image = self._lower[: len(weight), : len(weight)].T @ weight
        correlation = self._correlation[self.columns] @ weight
        square = self._problem.target_square - 2.0 * correlation + image @ image
        return float(np.sqrt(max(square, 0.0) / self._problem.target_square))

    def _grow(self) -> None:
        count = len(self._lower)
        size = min(2 * count + 64, len(self._gram))
        lower, products = np.zeros((size, size)), np.zeros((size, len(self._gram)))
        lower[:count, :count], products[:count] = self._lower, self._products
        self._lower, self._products = lower, products
