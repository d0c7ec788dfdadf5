"""The directions that hold any number of rows best, in memory that does not grow with them.

Singular values times right singular vectors stand for all rows before them: with more rows below
them they have the singular values and right singular vectors of all rows together, to rounding. So
rows are gathered until they are twice as many as they are long, and decomposed then.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np


def leading_vectors(
    rows: Iterable[Sequence[np.ndarray]], tolerance: float, limit: int, what: str
) -> np.ndarray:
    """The orthonormal vectors that hold all rows best, each within one of several subspaces.

    Args:
        rows: Of each snapshot its part in each of the subspaces, which are orthogonal to each
            other, (number,) each.
        tolerance: Relative root mean square of what the vectors may leave.
        limit: At most so many.
        what: What the rows are, for the message.

    Returns:
        (number, vector): those of one subspace after those of another, of each the most important
        first.

    Raises:
        ValueError: All rows are zero, or there are none.
    """
    gathered: list[list[np.ndarray]] = []
    for parts in rows:
        gathered = gathered or [[] for _ in parts]
        for subspace, row in zip(gathered, parts, strict=True):
            subspace.append(row)
            if len(subspace) == 2 * len(row):
                values, vectors = _decomposed(subspace)
                subspace[:] = list(values[:, None] * vectors)
    found = [_decomposed(subspace) for subspace in gathered]
    values = np.concatenate([np.zeros(0), *(value for value, _ in found)])
    total = float(np.sum(values**2))
    if total == 0.0:
        raise ValueError(f"{what} is zero in every snapshot; nothing was put under pressure")
    vectors = np.concatenate([vector for _, vector in found])
    order = np.argsort(-values, kind="stable")
    left = np.sqrt(np.maximum(1.0 - np.cumsum(values[order] ** 2) / total, 0.0))
    wanted = int(np.argmax(left <= tolerance)) + 1 if left.min() <= tolerance else len(order)
    leading: np.ndarray = vectors[np.sort(order[: min(wanted, limit)])].T
    return leading


def mirrored_halves(row: np.ndarray, image: np.ndarray | None) -> tuple[np.ndarray, ...]:
    """The symmetric and the antisymmetric half of a row, by its mirror image; the row itself where
    there is no mirror."""
    return (row,) if image is None else (0.5 * (row + image), 0.5 * (row - image))


def _decomposed(rows: Sequence[np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """Singular values (value,), descending, and right singular vectors (value, number)."""
    _, values, vectors = np.linalg.svd(np.array(rows), full_matrices=False)
    return values, vectors
