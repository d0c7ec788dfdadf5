"""Sum element matrices into one sparse matrix of fixed pattern."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.sparse import csc_array


class Assembly:
    """Where every entry of every element matrix goes.

    The pattern is found once, so a new matrix costs one weighted count over the upper triangles.

    Args:
        node_count: Number of nodes; a matrix has three unknowns for each.
        connectivities: Node indices of the groups of elements, each (element, k).
    """

    def __init__(self, node_count: int, connectivities: Sequence[np.ndarray]) -> None:
        size = 3 * node_count
        keys = []
        for connectivity in connectivities:
            unknowns = 3 * connectivity[:, :, None].astype(np.int64) + np.arange(3)
            unknowns = unknowns.reshape(len(connectivity), -1)
            rows, columns = np.triu_indices(unknowns.shape[1])
            first, second = unknowns[:, rows].T, unknowns[:, columns].T  # (pair, element)
            keys.append((np.maximum(first, second) * size + np.minimum(first, second)).ravel())
        upper, scatter = np.unique(np.concatenate(keys), return_inverse=True)
        self._splits = np.cumsum([len(key) for key in keys])[:-1]
        self._scatter = np.split(scatter.ravel(), self._splits)
        self._upper_count = len(upper)

        columns, rows = np.divmod(upper, size)
        strict = rows != columns
        whole = np.concatenate([upper, rows[strict] * size + columns[strict]])
        source = np.concatenate([np.arange(len(upper)), np.flatnonzero(strict)])
        order = np.argsort(whole)
        self._source = source[order]
        self.indices = (whole[order] % size).astype(np.int32)
        self.indptr = np.searchsorted(whole[order], np.arange(size + 1) * size).astype(np.int32)
        self.size = size
        diagonal = np.flatnonzero(self.indices == np.repeat(np.arange(size), np.diff(self.indptr)))
        self.diagonal = diagonal
        """Positions of the diagonal in the data, (3 node,)."""

    def symmetric_data(self, entries: Sequence[np.ndarray]) -> np.ndarray:
        """Data of the sum, in the order of `indices`.

        Args:
            entries: Upper triangles of each group's matrices, each (pair, element); groups at the
                end may be left out.
        """
        upper = np.zeros(self._upper_count)
        for scatter, values in zip(self._scatter, entries, strict=False):
            upper += np.bincount(scatter, values.ravel(), minlength=self._upper_count)
        return upper[self._source]

    def matrix(self, data: np.ndarray) -> csc_array:
        """The sparse matrix with these data, (3 node, 3 node)."""
        return csc_array((data, self.indices, self.indptr), shape=(self.size, self.size))
