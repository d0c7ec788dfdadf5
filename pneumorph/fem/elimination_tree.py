"""Elimination of a body's nodes along a tree: far fewer operations where a body has branches.

Nodes are eliminated in an order of minimum degree (George and Liu, The evolution of the minimum
degree ordering algorithm, SIAM Review 31 (1989) 1). The first later node that an eliminated one has
touched is its parent (Liu, The role of elimination trees in sparse factorization, SIAM J. Matrix
Anal. Appl. 11 (1990) 134). Chains of nodes whose fronts are nearly the same become one block, so
that the work is that of dense matrices.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_array, diags_array
from scipy.sparse.linalg import splu

_FILL = 0.05
"""A block takes in one below it where at most this share of the block's panel is zeros then."""
_SMALL_NODES = 4
"""Blocks of at most so many nodes ..."""
_SMALL_FILL = 0.3
"""... are taken in up to this share: products of small matrices are slow."""


@dataclass(frozen=True, eq=False)
class EliminationTree:
    """Blocks of nodes in the order of elimination, each after all blocks below it."""

    order: np.ndarray
    """Nodes in the order of elimination, (node,)."""
    starts: np.ndarray
    """Place of the first node of each block, and the number of all, (block + 1,)."""
    fronts: list[np.ndarray]
    """Places of the nodes of each block's front, its own first, ascending."""
    parents: np.ndarray
    """Block whose front each block's update is added to, (block,); the last block's is itself."""


def minimum_degree_tree(graph: csr_array) -> EliminationTree:
    """The tree of an order of minimum degree.

    Args:
        graph: Non-zero where two nodes share an element, and on the diagonal, (node, node).
    """
    order = _minimum_degree(graph)
    parent, rows = _structure(graph, order)
    children: list[list[int]] = [[] for _ in order]
    for node, above in enumerate(parent):
        if above >= 0:
            children[above].append(node)
    after = _postorder(parent, children, [len(each) for each in rows])
    place = np.empty(len(order), dtype=int)
    place[after] = np.arange(len(order))
    return _blocks(
        order[after],
        np.array([place[parent[node]] if parent[node] >= 0 else -1 for node in after]),
        [np.sort(place[rows[node]]) for node in after],
    )


def _minimum_degree(graph: csr_array) -> np.ndarray:
    """SuperLU's order for a symmetric matrix of this sparsity, (node,)."""
    ones = csr_array((np.ones(len(graph.indices)), graph.indices, graph.indptr), shape=graph.shape)
    dominant = ones + diags_array(np.diff(graph.indptr).astype(float))
    factor = splu(
        dominant.tocsc(),
        permc_spec="MMD_AT_PLUS_A",
        diag_pivot_thresh=0.0,
        options={"SymmetricMode": True},
    )
    return np.argsort(factor.perm_c)


def _structure(graph: csr_array, order: np.ndarray) -> tuple[list[int], list[np.ndarray]]:
    """Parent of each node, -1 without, and later nodes that its column of the factor touches."""
    place = np.empty(len(order), dtype=int)
    place[order] = np.arange(len(order))
    parent: list[int] = []
    rows: list[np.ndarray] = []
    children: list[list[int]] = [[] for _ in order]
    for number, node in enumerate(order):
        touched = place[graph.indices[graph.indptr[node] : graph.indptr[node + 1]]]
        parts = [touched[touched > number], *(rows[child][1:] for child in children[number])]
        column = np.unique(np.concatenate(parts))
        rows.append(column)
        parent.append(int(column[0]) if len(column) else -1)
        if len(column):
            children[column[0]].append(number)
    return parent, rows


def _postorder(parent: list[int], children: list[list[int]], size: list[int]) -> np.ndarray:
    """Nodes after all below them, the child of the largest column right before its parent."""
    roots = [node for node, above in enumerate(parent) if above < 0]
    order, stack = [], sorted(roots, key=size.__getitem__)
    while stack:  # parents first, then turned round
        node = stack.pop()
        order.append(node)
        stack.extend(sorted(children[node], key=size.__getitem__))
    return np.array(order[::-1])


def _blocks(order: np.ndarray, parent: np.ndarray, rows: list[np.ndarray]) -> EliminationTree:
    """Nodes whose columns are nearly the same joined to blocks."""
    blocks: list[tuple[int, int]] = []  # first node and zeros; each ends where the next begins
    for last in range(len(order)):
        first, zeros, beyond = last, 0, len(rows[last])
        while blocks and first <= parent[first - 1] <= last:
            below, zeros_below = blocks[-1]
            height, width = last + 1 - first + beyond, first - below
            made = zeros + zeros_below + width * (height - len(rows[first - 1]))
            whole = last + 1 - below
            limit = _SMALL_FILL if width <= _SMALL_NODES else _FILL
            if made > limit * whole * (whole + beyond):
                break
            blocks.pop()
            first, zeros = below, made
        blocks.append((first, zeros))
    starts = np.array([first for first, _ in blocks] + [len(order)])
    lasts = starts[1:] - 1
    block_of = np.repeat(np.arange(len(blocks)), np.diff(starts))
    fronts = [
        np.concatenate([np.arange(first, last + 1), rows[last]])
        for first, last in zip(starts, lasts, strict=False)
    ]
    parents = np.where(parent[lasts] >= 0, block_of[parent[lasts]], np.arange(len(blocks)))
    return EliminationTree(order, starts, fronts, parents)
