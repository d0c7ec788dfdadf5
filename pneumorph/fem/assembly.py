"""Sum element matrices into one sparse matrix of fixed pattern."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

import numpy as np
from scipy.sparse import coo_array, csc_array


class Assembly:
    """Where every entry of every element matrix goes.

    The pattern is found once, so a new matrix costs one weighted count over the upper triangles.
    Where the entries of a group go is found when they are first asked for.

    Args:
        node_count: Number of nodes; a matrix has three unknowns for each.
        connectivities: Node indices of the groups of elements, each (element, k).
    """

    def __init__(self, node_count: int, connectivities: Sequence[np.ndarray]) -> None:
        self.size = 3 * node_count
        self._connectivities = list(connectivities)
        self._scatters: dict[int, np.ndarray] = {}
        # Element by element the same nodes at every integration point: each pair of nodes once.
        pairs = [
            (each[:, :, None] * node_count + each[:, None]).reshape(-1)
            for each in (np.unique(c.astype(np.int64), axis=0) for c in connectivities)
        ]
        columns, rows = np.divmod(np.unique(np.concatenate(pairs)), node_count)
        counts = np.bincount(columns, minlength=node_count)
        self.indptr = np.concatenate([[0], np.cumsum(np.repeat(3 * counts, 3))]).astype(np.int32)
        blocks = np.repeat(np.cumsum(counts) - counts, counts)  # first of each column's blocks
        slot = np.arange(len(rows)) - blocks
        self.indices = np.empty(9 * len(rows), dtype=np.int32)
        for axis in range(3):
            start = self.indptr[3 * columns + axis] + 3 * slot
            for row in range(3):
                self.indices[start + row] = 3 * rows + row
        self.diagonal = np.flatnonzero(self.indices == self._columns)
        """Positions of the diagonal in the data, (3 node,)."""

    @property
    def _columns(self) -> np.ndarray:
        """Column of each datum, (entry,)."""
        return np.repeat(np.arange(self.size), np.diff(self.indptr))

    @cached_property
    def _upper(self) -> np.ndarray:
        """Column times size plus row of the upper triangle's data, ascending, (upper entry,)."""
        columns = self._columns
        upper = self.indices <= columns
        keys: np.ndarray = columns[upper] * self.size + self.indices[upper]
        return keys

    @cached_property
    def _source(self) -> np.ndarray:
        """Place in the upper triangle of each datum, (entry,)."""
        upper = self.indices <= self._columns
        place = np.cumsum(upper) - 1
        # The pattern is symmetric, so rows of the places are columns of their mirror images.
        mirrored = self.matrix(np.arange(len(self.indices))).tocsr().data
        return np.where(upper, place, place[mirrored])

    def _scatter(self, group: int) -> np.ndarray:
        """Place in the upper triangle of every entry of a group's matrices, (pair element,)."""
        if group not in self._scatters:
            connectivity = self._connectivities[group]
            unknowns = 3 * connectivity[:, :, None].astype(np.int64) + np.arange(3)
            unknowns = unknowns.reshape(len(connectivity), -1)
            rows, columns = np.triu_indices(unknowns.shape[1])
            first, second = unknowns[:, rows].T, unknowns[:, columns].T  # (pair, element)
            keys = (np.maximum(first, second) * self.size + np.minimum(first, second)).ravel()
            self._scatters[group] = np.searchsorted(self._upper, keys)
        return self._scatters[group]

    def symmetric_data(self, entries: Sequence[np.ndarray]) -> np.ndarray:
        """Data of the sum, in the order of `indices`.

        Args:
            entries: Upper triangles of each group's matrices, each (pair, element); groups at the
                end may be left out.
        """
        count = len(self._upper)
        upper = np.zeros(count)
        for group, values in enumerate(entries):
            upper += np.bincount(self._scatter(group), values.ravel(), minlength=count)
        return upper[self._source]

    def matrix(self, data: np.ndarray) -> csc_array:
        """The sparse matrix with these data, (3 node, 3 node)."""
        return csc_array((data, self.indices, self.indptr), shape=(self.size, self.size))


def matrix_of_blocks(node_count: int, blocks: Sequence[tuple[np.ndarray, np.ndarray]]) -> coo_array:
    """Sum of whole element matrices, symmetric or not; no pattern is kept for later.

    Args:
        node_count: Number of nodes; the matrix has three unknowns for each.
        blocks: Node indices of each group's elements (element, k) with their matrices, (element,
            3 k, 3 k).
    """
    rows, columns, values = [], [], []
    for connectivity, matrices in blocks:
        unknowns = (3 * connectivity[:, :, None] + np.arange(3)).reshape(len(connectivity), -1)
        rows.append(np.repeat(unknowns, unknowns.shape[1], axis=1).ravel())
        columns.append(np.tile(unknowns, (1, unknowns.shape[1])).ravel())
        values.append(matrices.ravel())
    entries = (np.concatenate(values), (np.concatenate(rows), np.concatenate(columns)))
    return coo_array(entries, shape=(3 * node_count, 3 * node_count))
