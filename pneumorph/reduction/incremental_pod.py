"""Proper orthogonal decomposition of any number of snapshots in bounded memory.

Hierarchical approximate POD (HAPOD; Himpel, Leibner and Rave 2018) on a chain: the scaled modes
kept so far, Y = U S, stand for all earlier snapshots; with each block X of new ones the POD of
[Y, X] in the inner product H gives the next Y, and drops the directions of the smallest singular
values.

**Error.** Let D be the sum of the squares of all singular values ever dropped. The snapshots S and
their approximation S' in the span of the last Y obey

    ||S - S'||_H^2 = D

and the squared singular values of S' are below those of S by D in all, each by no less than 0,
because a dropped part and what is kept have orthogonal rows, in this POD and so in all later ones.
A step drops as much as keeps D <= t^2 ||S||_H^2 for the snapshots seen so far (the paper divides
its budget among the steps beforehand). So the span of Y holds the snapshots to the relative error
t, and m modes of the last POD to

    sqrt( (D + sum_{j > m} s_j^2) / ||S||_H^2 ) .
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sparse

MIRROR = np.array([1.0, -1.0, 1.0])
"""Reflection y -> -y of a vector."""


class IncrementalPod:
    """Scaled modes of a growing set of snapshots, for each half of a mirror-symmetric part.

    Args:
        metric: Inner product H, symmetric (3 node, 3 node) and definite on the snapshots.
        tolerance: Relative error t of the kept modes, between 0 and 1.
        mirror_nodes: Node that each node's image under y -> -y is, (node,), or None. The images of
            the snapshots count as snapshots then.

    Raises:
        ValueError: A tolerance out of range.
    """

    def __init__(
        self,
        metric: sparse.spmatrix,
        tolerance: float,
        mirror_nodes: np.ndarray | None = None,
    ) -> None:
        if not 0.0 < tolerance < 1.0:
            raise ValueError(f"tolerance must lie between 0 and 1, got {tolerance}")
        self._metric, self._tolerance, self._mirror_nodes = metric, tolerance, mirror_nodes
        parities = (0,) if mirror_nodes is None else (1, -1)
        self.scaled_modes: dict[int, np.ndarray] = {
            parity: np.zeros((0, metric.shape[0])) for parity in parities
        }
        """Y by parity: +1 symmetric, -1 antisymmetric, 0 without a mirror plane; (mode, 3 node)."""
        self.square = 0.0
        """||S||_H^2 of all snapshots (and images)."""
        self.dropped_square = 0.0
        """D"""
        self._kept_square = dict.fromkeys(parities, 0.0)

    def add(self, displacement: np.ndarray) -> None:
        """Add snapshots [mm], (snapshot, node, 3)."""
        displacement = np.asarray(displacement, dtype=np.float64)
        halves = {0: displacement}
        if self._mirror_nodes is not None:
            image = displacement[:, self._mirror_nodes] * MIRROR
            # Without the factor 1/2 these are sqrt(2) times the halves of snapshots and images.
            halves = {1: (displacement + image) / 2**0.5, -1: (displacement - image) / 2**0.5}
        for parity, half in halves.items():
            kept = self.scaled_modes[parity]
            rows = np.concatenate([kept, half.reshape(len(half), -1)])
            values, vectors = gram_vectors(rows, self._metric)
            self.square += float(values.sum()) - self._kept_square[parity]
            remaining = np.append(np.cumsum(values[::-1])[::-1], 0.0)
            allowed = self._tolerance**2 * self.square - self.dropped_square
            count = int(np.argmax(remaining <= allowed))
            self.scaled_modes[parity] = vectors[:, :count].T @ rows
            self.dropped_square += float(remaining[count])
            self._kept_square[parity] = float(values[:count].sum())


def gram_vectors(rows: np.ndarray, metric: sparse.spmatrix) -> tuple[np.ndarray, np.ndarray]:
    """Eigenvalues (row,), descending, and eigenvectors (row, row) of the rows' Gram matrix in H.

    Values below the rounding of the largest are set to zero.
    """
    values, vectors = np.linalg.eigh(rows @ (metric @ rows.T))
    values, vectors = values[::-1], vectors[:, ::-1]
    noise = len(rows) * np.finfo(float).eps * max(float(values[0]), 0.0) if len(values) else 0.0
    return np.where(values > noise, values, 0.0), vectors
