"""Cholesky factors of a slender body, slab by slab along its length.

The nodes of a leg fall into slabs such that neighbours in the mesh lie in the same slab or in
neighbouring ones. Its matrices then are block tridiagonal with dense blocks of a few hundred rows,
and a direct solution is dense linear algebra at the full speed of BLAS: three times as fast as a
general sparse factorisation for the leg of the paper.
"""

from __future__ import annotations

import numpy as np
from scipy.linalg.blas import dsyrk, dtrsm
from scipy.linalg.lapack import dpotrf

from pneumorph.fem.assembly import Assembly


class SlabPattern:
    """Which entry of a sparse matrix goes where in the blocks.

    Args:
        assembly: Sparsity of the part's matrices.
        slaves: Nodes that are not unknowns, (n,); the slabs start beside them.
    """

    def __init__(self, assembly: Assembly, slaves: np.ndarray) -> None:
        node_count = assembly.size // 3
        is_slave = np.zeros(node_count, dtype=bool)
        is_slave[slaves] = True
        level = _levels(assembly, slaves)
        self.slabs: list[np.ndarray] = [
            np.flatnonzero((level == number) & ~is_slave) for number in range(level.max() + 1)
        ]
        """Nodes of each slab."""
        self.slabs = [slab for slab in self.slabs if len(slab)]
        sizes = np.array([3 * len(slab) for slab in self.slabs])
        self.starts: np.ndarray = np.concatenate([[0], np.cumsum(sizes)])
        """First unknown of each slab, and the number of all, (slab + 1,)."""
        ordered = np.concatenate(self.slabs)
        self.unknowns: np.ndarray = (3 * ordered[:, None] + np.arange(3)).ravel()
        """Unknowns of the part in the order of the factors, (free,)."""
        self.place: np.ndarray = np.full(assembly.size, -1)
        """Place of each unknown of the part in the factors, -1 for slaves, (3 node,)."""
        self.place[self.unknowns] = np.arange(len(self.unknowns))

        rows = self.place[assembly.indices]
        columns = self.place[np.repeat(np.arange(assembly.size), np.diff(assembly.indptr))]
        slab_of = np.searchsorted(self.starts, np.arange(self.starts[-1]), side="right") - 1
        both_free = (rows >= 0) & (columns >= 0)
        self._diagonal: list[tuple[np.ndarray, np.ndarray]] = []
        self._below: list[tuple[np.ndarray, np.ndarray]] = []
        row_slab, column_slab = slab_of[rows], slab_of[columns]
        if np.any(np.abs(row_slab - column_slab)[both_free] > 1):
            raise AssertionError("slabs that are not neighbours must not be connected")
        for number in range(len(self.slabs)):
            for target, offset in ((self._diagonal, 0), (self._below, 1)):
                chosen = np.flatnonzero(
                    both_free & (column_slab == number) & (row_slab == number + offset)
                )
                height = sizes[number + offset] if number + offset < len(sizes) else 0
                local_row = rows[chosen] - (self.starts[number + offset] if height else 0)
                local_column = columns[chosen] - self.starts[number]
                target.append((chosen, local_column * height + local_row))

    def blocks(self, data: np.ndarray) -> tuple[list[np.ndarray], list[np.ndarray]]:
        """Diagonal blocks and those below them, in column-major order.

        Args:
            data: Data of the sparse matrix in the order of the assembly's pattern.
        """
        sizes = np.diff(self.starts)
        diagonal: list[np.ndarray] = []
        below: list[np.ndarray] = []
        for number, size in enumerate(sizes):
            heights = (size, sizes[number + 1] if number + 1 < len(sizes) else 0)
            for target, height, (chosen, flat) in zip(
                (diagonal, below),
                heights,
                (self._diagonal[number], self._below[number]),
                strict=True,
            ):
                block = np.zeros(height * size)
                block[flat] = data[chosen]
                target.append(block.reshape((height, size), order="F"))
        return diagonal, below


class SlabCholesky:
    """A = L L^T of a symmetric positive definite matrix in slabs.

    Args:
        pattern: The slabs.
        data: Data of the sparse matrix in the order of the assembly's pattern.

    Raises:
        numpy.linalg.LinAlgError: The matrix is not positive definite.
    """

    def __init__(self, pattern: SlabPattern, data: np.ndarray) -> None:
        self._starts = pattern.starts
        diagonal, below = pattern.blocks(data)
        self._factors: list[np.ndarray] = []
        self._below: list[np.ndarray] = []
        for number, block in enumerate(diagonal):
            factor, info = dpotrf(block, lower=1, clean=1, overwrite_a=1)
            if info:
                raise np.linalg.LinAlgError(f"matrix is not positive definite at slab {number}")
            self._factors.append(factor)
            if number + 1 < len(diagonal):
                link = dtrsm(1.0, factor, below[number], side=1, lower=1, trans_a=1, overwrite_b=1)
                self._below.append(link)
                diagonal[number + 1] = dsyrk(
                    -1.0, link, beta=1.0, c=diagonal[number + 1], lower=1, overwrite_c=1
                )

    def half_solve(self, right: np.ndarray, first_slab: np.ndarray | None = None) -> np.ndarray:
        """Y = L^-1 B.

        Products Y^T Y are B^T A^-1 B: what couples bodies and contacts needs no more than this.

        Args:
            right: B in the order of the factors, (free, column).
            first_slab: Slab of the first non-zero of each column, ascending, (column,); columns
                cost nothing before it.
        """
        y = np.asfortranarray(right, dtype=float)
        count = np.full(len(self._factors), y.shape[1])
        if first_slab is not None:
            count = np.searchsorted(first_slab, np.arange(len(self._factors)), side="right")
        for number, factor in enumerate(self._factors):
            columns = count[number]
            if columns == 0:
                continue
            here = slice(self._starts[number], self._starts[number + 1])
            solved = dtrsm(
                1.0, factor, np.asfortranarray(y[here, :columns]), lower=1, overwrite_b=1
            )
            y[here, :columns] = solved
            if number + 1 < len(self._factors):
                there = slice(self._starts[number + 1], self._starts[number + 2])
                y[there, :columns] -= self._below[number] @ solved
        return y

    def half_solve_transposed(self, right: np.ndarray) -> np.ndarray:
        """X = L^-T B, (free, column)."""
        x = np.array(right, dtype=float, order="F")
        for number in reversed(range(len(self._factors))):
            here = slice(self._starts[number], self._starts[number + 1])
            if number + 1 < len(self._factors):
                there = slice(self._starts[number + 1], self._starts[number + 2])
                x[here] -= self._below[number].T @ x[there]
            x[here] = dtrsm(
                1.0, self._factors[number], np.asfortranarray(x[here]), lower=1, trans_a=1
            )
        return x

    def solve(self, right: np.ndarray) -> np.ndarray:
        """A^-1 B in the order of the factors, (free, column)."""
        return self.half_solve_transposed(self.half_solve(right))


def _levels(assembly: Assembly, start: np.ndarray) -> np.ndarray:
    """Steps from the start nodes to each node along the mesh, (node,)."""
    node_count = assembly.size // 3
    # The pattern of x components is that of the nodes.
    pointers, rows = assembly.indptr, assembly.indices
    neighbours = [
        rows[pointers[3 * node] : pointers[3 * node + 1]][::3] // 3 for node in range(node_count)
    ]
    level = np.full(node_count, -1)
    front = np.unique(start)
    level[front] = 0
    number = 0
    while len(front):
        number += 1
        reached = np.unique(np.concatenate([neighbours[node] for node in front]))
        front = reached[level[reached] < 0]
        level[front] = number
    return level
