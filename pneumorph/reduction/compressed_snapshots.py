"""Snapshots as combinations of few fields, gathered in bounded memory with a known error.

States u_s arrive in blocks U. With fields F, orthonormal in an inner product H, the coefficients
are C = U H F^T; the POD of what is left, U - C F, gives as many further fields as are needed to
leave at most the fraction t of the block: ||U - C F||_H <= t ||U||_H. Fields are only ever added,
so the error of earlier blocks stays, and over all snapshots

    sum_s ||u_s - c_s F||_H^2  <=  t^2 sum_s ||u_s||_H^2 .

A walk of four legs (2.6 GB for eight) shrinks to some hundred fields and a row of numbers a state.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import scipy.sparse as sparse

from pneumorph.reduction.incremental_pod import gram_vectors
from pneumorph.reduction.snapshots import BLOCK_SIZE, SavedSnapshots

FORMAT_VERSION = 2


@dataclass(frozen=True, eq=False)
class CompressedSnapshots(SavedSnapshots):
    """Displacements of a part in its own frame: coefficients times fields."""

    format_version = FORMAT_VERSION
    state_arrays = ("fields", "coefficients")

    fields: np.ndarray
    """Displacement fields, (field, node, 3), single precision."""
    coefficients: np.ndarray
    """(snapshot, field), single precision."""
    pressure_kPa: np.ndarray
    """Pressure in the cavity [kPa], (snapshot,)."""
    source: np.ndarray
    """Index into ``metadata["sources"]``, (snapshot,)."""
    metadata: dict[str, Any] = field(default_factory=dict)
    """As of `Snapshots`; with ``relative_error`` in the norm of the compression."""

    def blocks(self, numbers: np.ndarray) -> Iterator[np.ndarray]:
        """Displacements of the numbered snapshots; see `SnapshotSet`."""
        for start in range(0, len(numbers), BLOCK_SIZE):
            chosen = self.coefficients[numbers[start : start + BLOCK_SIZE]]
            yield (chosen @ self._flat).reshape(-1, *self.fields.shape[1:])

    def factors(self, numbers: np.ndarray) -> Iterator[np.ndarray]:
        """Fields with the same sum of products: R F with C = Q R, at most one for each field."""
        chosen = self.coefficients[numbers].astype(np.float64)
        triangle = np.linalg.qr(chosen, mode="r")
        for start in range(0, len(triangle), BLOCK_SIZE):
            rows = triangle[start : start + BLOCK_SIZE]
            yield (rows @ self._flat).reshape(-1, *self.fields.shape[1:])

    @property
    def _flat(self) -> np.ndarray:
        return self.fields.reshape(len(self.fields), -1)


class SnapshotCompressor:
    """Gathers states; memory is that of one block, the fields and the coefficients.

    Args:
        metric: Inner product H, symmetric (3 node, 3 node) and definite on the states.
        tolerance: Fraction t of each block that may be left, between 0 and 1.

    Raises:
        ValueError: A tolerance out of range.
    """

    def __init__(self, metric: sparse.spmatrix, tolerance: float) -> None:
        if not 0.0 < tolerance < 1.0:
            raise ValueError(f"tolerance must lie between 0 and 1, got {tolerance}")
        self._metric, self._tolerance = metric, tolerance
        size = metric.shape[0]
        self._fields = np.zeros((0, size))
        self._coefficients: list[np.ndarray] = []
        self._waiting: list[np.ndarray] = []
        self._square = self._left_square = 0.0

    def add(self, displacement: np.ndarray) -> None:
        """Add states [mm], (snapshot, node, 3).

        Raises:
            ValueError: A state is not finite.
        """
        if not np.all(np.isfinite(displacement)):
            raise ValueError("displacement must be finite; the full-order run may have diverged")
        self._waiting.append(displacement.reshape(len(displacement), -1).astype(np.float32))
        if sum(map(len, self._waiting)) >= BLOCK_SIZE:
            self._compress()

    def _compress(self) -> None:
        block = np.concatenate(self._waiting).astype(np.float64)
        self._waiting = []
        square = _square(self._metric, block)
        coefficients = (self._metric @ block.T).T @ self._fields.T
        left = block - coefficients @ self._fields
        # Once more: the fields are orthonormal to rounding of their own size, not of what is left.
        again = (self._metric @ left.T).T @ self._fields.T
        left -= again @ self._fields
        values, vectors = gram_vectors(left, self._metric)
        remaining = np.append(np.cumsum(values[::-1])[::-1], 0.0)
        count = int(np.argmax(remaining <= self._tolerance**2 * square))
        if count:
            new = vectors[:, :count].T @ left / np.sqrt(values[:count, None])
            self._fields = np.concatenate([self._fields, new])
            coefficients = np.hstack(
                [coefficients + again, vectors[:, :count] * np.sqrt(values[:count])]
            )
        else:
            coefficients += again
        self._coefficients.append(coefficients.astype(np.float32))
        self._square += square
        self._left_square += float(remaining[count])

    def finish(
        self, pressure_kPa: np.ndarray, source: np.ndarray, metadata: dict[str, Any]
    ) -> CompressedSnapshots:
        """All states, with what else is known of them; arguments as of `CompressedSnapshots`."""
        if self._waiting:
            self._compress()
        width = len(self._fields)
        rows = [np.pad(each, ((0, 0), (0, width - each.shape[1]))) for each in self._coefficients]
        node_count = self._metric.shape[0] // 3
        error = (self._left_square / self._square) ** 0.5 if self._square > 0.0 else 0.0
        return CompressedSnapshots(
            self._fields.astype(np.float32).reshape(width, node_count, 3),
            np.concatenate(rows) if rows else np.zeros((0, width), dtype=np.float32),
            pressure_kPa,
            source,
            {**metadata, "relative_error": error},
        )


def _square(metric: sparse.spmatrix, block: np.ndarray) -> float:
    return float(np.einsum("sj,js->", block, metric @ block.T))
