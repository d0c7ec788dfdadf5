"""Cholesky factors of a body by fronts: one that sweeps along it, or a tree of them.

In a sweep, nodes are eliminated in blocks, in the order of the Fiedler vector of the mesh, which
for a leg is the order from root to tip. The front of a block is the block itself and those later
nodes that eliminated ones have touched, about a cross-section: a dense matrix, so all work is
level-3 BLAS.
Columns that begin far down the body, such as those of contacts near the tip, cost nothing before.

Beside general solvers, for the leg of the paper on one thread: CHOLMOD (supernodal, with OpenBLAS;
under the GPL) factorises in the same time, and its L^-1 B of 133 columns takes 3 to 4 times as long
as ours without their late beginnings; SciPy's SuperLU takes 7 to 10 times as long to factorise.

Irons, A frontal solution program for finite element analysis, Int. J. Numer. Meth. Eng. 2 (1970)
5; Barnard, Pothen and Simon, A spectral algorithm for envelope reduction, Numer. Lin. Alg. Appl. 2
(1995) 317.
"""

from __future__ import annotations

from itertools import pairwise
from typing import Literal

import numpy as np
from scipy.sparse import coo_array, csr_array, diags_array
from scipy.sparse.linalg import eigsh

import pneumorph._engine as engine
from pneumorph.fem.assembly import Assembly
from pneumorph.fem.elimination_tree import minimum_degree_tree

Along = Literal["sweep", "tree"]
Precision = Literal["double", "single"]

_BLOCK_NODES = 20  # more: fewer calls of BLAS; less: narrower fronts


class FrontPattern:
    """The order of elimination, and which entry of a sparse matrix goes where in the fronts.

    Args:
        assembly: Sparsity of the part's matrices.
        slaves: Nodes that are not unknowns, (n,); a sweep starts at their end of the part.
        along: A ``sweep`` along the part, or a ``tree`` (`pneumorph.fem.elimination_tree`): fewer
            operations, but columns of contacts reach more blocks.
    """

    def __init__(self, assembly: Assembly, slaves: np.ndarray, along: Along = "sweep") -> None:
        graph = _node_graph(assembly)
        if along == "sweep":
            order, starts, fronts = _sweep(graph, slaves)
            parents = np.minimum(np.arange(1, len(starts)), len(starts) - 2)
        else:
            free = np.setdiff1d(np.arange(graph.shape[0]), slaves)
            tree = minimum_degree_tree(graph[free][:, free].tocsr())
            order, starts, fronts = free[tree.order], tree.starts, tree.fronts
            parents = tree.parents

        self.unknowns: np.ndarray = _unknowns(order)
        """Unknowns of the part in the order of elimination, (free,)."""
        self.place: np.ndarray = np.full(assembly.size, -1)
        """Place of each unknown of the part in that order, -1 for slaves, (3 node,)."""
        self.place[self.unknowns] = np.arange(len(self.unknowns))
        self.starts: np.ndarray = 3 * starts
        """First unknown of each block, and the number of all, (block + 1,)."""
        self.block: np.ndarray = np.repeat(np.arange(len(starts) - 1), np.diff(self.starts))
        """Block of each unknown in the order of elimination, (free,)."""
        self.parents: np.ndarray = parents
        """Block that each block's update goes to, (block,); the last block's is itself."""
        self.lowest: np.ndarray = np.arange(len(parents))
        """First of the blocks below each block, itself included, (block,)."""
        for number, parent in enumerate(parents):
            self.lowest[parent] = min(self.lowest[parent], self.lowest[number])
        self.engine_pattern = self._engine_pattern(assembly, [_unknowns(f) for f in fronts])

    @property
    def block_count(self) -> int:
        """Number of blocks."""
        return len(self.starts) - 1

    @property
    def largest_front(self) -> int:
        """Unknowns of the largest front, its block included."""
        return int(self._heights.max())

    @property
    def operation_count(self) -> float:
        """Multiplications and additions of one factorisation."""
        width, height = np.diff(self.starts).astype(float), self._heights.astype(float)
        beyond = height - width
        return float(np.sum(width**3 / 3 + width**2 * beyond + width * beyond**2))

    def _engine_pattern(self, assembly: Assembly, fronts: list[np.ndarray]) -> engine.FrontPattern:
        self._heights: np.ndarray = np.array([len(front) for front in fronts])
        width = np.diff(self.starts)
        rows = [front[w:] for front, w in zip(fronts, width, strict=True)]
        landing = [
            np.searchsorted(fronts[parent], mine)
            for parent, mine in zip(self.parents, rows, strict=True)
        ]
        row = self.place[assembly.indices]
        column = self.place[np.repeat(np.arange(assembly.size), np.diff(assembly.indptr))]
        lower = np.flatnonzero((column >= 0) & (row >= column))
        lower = lower[np.argsort(self.block[column[lower]], kind="stable")]
        entry_starts = np.searchsorted(self.block[column[lower]], np.arange(len(fronts) + 1))
        targets = [
            (column[mine] - start) * len(front) + np.searchsorted(front, row[mine])
            for front, start, mine in zip(
                fronts, self.starts, np.split(lower, entry_starts[1:-1]), strict=False
            )
        ]
        integers = (
            self.starts,
            np.concatenate([[0], np.cumsum([len(r) for r in rows])]),
            np.concatenate(rows),
            np.concatenate(landing),
            self.parents,
            entry_starts,
            lower,
            np.concatenate(targets),
        )
        return engine.FrontPattern(
            *(np.ascontiguousarray(values, dtype=np.int32) for values in integers),
            len(assembly.indices),
        )


class FrontalCholesky:
    """A = L L^T of a symmetric positive definite matrix.

    Args:
        pattern: The order of elimination.
        data: Data of the sparse matrix in the order of the assembly's pattern.
        precision: Of L and of all that is solved with it: ``single`` takes half the time and memory
            where L only leads to a solution whose residual is known otherwise.

    Raises:
        numpy.linalg.LinAlgError: The matrix is not positive definite.
    """

    def __init__(
        self, pattern: FrontPattern, data: np.ndarray, precision: Precision = "double"
    ) -> None:
        self.pattern = pattern
        single = precision == "single"
        self.real: type[np.floating] = np.float32 if single else np.float64
        """Type of the numbers of L and of what is solved with it."""
        made = engine.SingleFrontalCholesky if single else engine.FrontalCholesky
        self._factor = made(pattern.engine_pattern, data)
        if self._factor.failed_block >= 0:
            raise np.linalg.LinAlgError(
                f"matrix is not positive definite at block {self._factor.failed_block}"
            )

    def half_solve(
        self, right: np.ndarray, first_block: np.ndarray | None = None
    ) -> tuple[np.ndarray, np.ndarray]:
        """Y = L^-1 B, and Y^T Y = B^T A^-1 B: what couples bodies and contacts.

        Args:
            right: B in the order of elimination, (free, column); becomes Y where its rows are
                contiguous.
            first_block: Block of the first non-zero of each column, ascending, (column,); columns
                cost nothing before it, nor in blocks of a tree that it is not below.

        Returns:
            Y, (free, column), and Y^T Y, (column, column).

        Raises:
            ValueError: Columns that are not in the order of their first blocks, or a wrong shape.
        """
        y = np.ascontiguousarray(right, dtype=self.real)
        count = y.shape[1]
        first = np.zeros(count, dtype=int) if first_block is None else np.asarray(first_block)
        if first.shape != (count,) or np.any(np.diff(first) < 0):
            raise ValueError(
                f"first_block must ascend, one block for each of {count} columns, got {first}; "
                "sort the columns by their first block"
            )
        begin = np.searchsorted(first, self.pattern.lowest)
        end = np.searchsorted(first, np.arange(self.pattern.block_count), side="right")
        if first_block is None:
            begin[:], end[:] = 0, count  # not even in the order of a tree's branches
        upper = np.zeros((count, count), dtype=self.real)
        self._factor.half_solve(y, begin.astype(np.int32), end.astype(np.int32), upper)
        return y, upper + np.triu(upper, 1).T

    def half_solve_one(self, right: np.ndarray) -> np.ndarray:
        """y = L^-1 b, (free,), of b in the order of elimination, (free,)."""
        y = np.array(right, dtype=self.real)
        self._factor.half_solve_one(y)
        return y

    def half_solve_transposed_one(self, right: np.ndarray) -> np.ndarray:
        """x = L^-T b, (free,)."""
        x = np.array(right, dtype=self.real)
        self._factor.half_solve_transposed_one(x)
        return x

    def half_solve_transposed(self, right: np.ndarray) -> np.ndarray:
        """X = L^-T B, (free, column)."""
        x = np.array(right, dtype=self.real, order="C")
        self._factor.half_solve_transposed(x)
        return x

    def solve(self, right: np.ndarray) -> np.ndarray:
        """A^-1 B in the order of elimination, (free, column)."""
        return self.half_solve_transposed(self.half_solve(right.copy())[0])


def _sweep(graph: csr_array, slaves: np.ndarray) -> tuple[np.ndarray, np.ndarray, list[np.ndarray]]:
    """Nodes in the order of a sweep, starts of its blocks, places of the nodes of each front."""
    along = _fiedler_vector(graph)
    if along[slaves].mean() > along.mean():
        along = -along
    order = np.argsort(along, kind="stable")
    order = order[~np.isin(order, slaves)]
    block_of = np.arange(len(order)) // _BLOCK_NODES
    starts = np.append(np.arange(0, len(order), _BLOCK_NODES), len(order))
    # The first block that touches a node puts it into the front.
    inner = graph[order][:, order].tocoo()
    touched_by = block_of.copy()
    np.minimum.at(touched_by, inner.row, block_of[inner.col])
    fronts = [
        np.concatenate([np.arange(first, end), end + np.flatnonzero(touched_by[end:] <= number)])
        for number, (first, end) in enumerate(pairwise(starts))
    ]
    return order, starts, fronts


def _unknowns(nodes: np.ndarray) -> np.ndarray:
    unknowns: np.ndarray = (3 * nodes[:, None] + np.arange(3)).ravel()
    return unknowns


def _node_graph(assembly: Assembly) -> csr_array:
    """Ones where two nodes share an element, and on the diagonal, (node, node)."""
    # The pattern of x components is that of the nodes.
    column = np.repeat(np.arange(assembly.size), np.diff(assembly.indptr))
    chosen = (column % 3 == 0) & (assembly.indices % 3 == 0)
    pairs = assembly.indices[chosen] // 3, column[chosen] // 3
    node_count = assembly.size // 3
    return coo_array((np.ones(len(pairs[0])), pairs), shape=(node_count, node_count)).tocsr()


def _fiedler_vector(graph: csr_array) -> np.ndarray:
    """Eigenvector of the second smallest eigenvalue of the graph's Laplacian, (node,)."""
    laplacian = (diags_array(np.asarray(graph.sum(axis=1)).ravel()) - graph).tocsc()
    # A start of our own, as ARPACK's is random; shifted off the zero eigenvalue of rigid motion.
    start = np.linspace(0.0, 1.0, graph.shape[0])
    _, vectors = eigsh(laplacian, 2, sigma=-1e-3, v0=start)
    vector: np.ndarray = vectors[:, 1]
    return vector
