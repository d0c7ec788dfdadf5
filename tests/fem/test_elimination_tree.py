"""Elimination along a tree solves as a sweep does, with fewer operations for a body of branches."""

import numpy as np
import pytest
from helpers.box_mesh import box_mesh
from scipy.sparse import csr_array

from pneumorph.fem import elimination_tree
from pneumorph.fem.elimination_tree import EliminationTree, minimum_degree_tree
from pneumorph.fem.frontal_cholesky import FrontalCholesky, FrontPattern
from pneumorph.fem.material import Material
from pneumorph.fem.part_model import PartModel


def comb(cell: np.ndarray) -> bool:
    """A plate with a tooth on every second cube."""
    return bool(cell[2] < 1 or cell[0] % 2 == 0)


@pytest.fixture(scope="module")
def part() -> PartModel:
    mesh = box_mesh((34.0, 10.0, 12.0), (17, 5, 6), keep=comb)
    return PartModel(mesh, Material(100.0, 0.3), 0.1)


@pytest.fixture(scope="module")
def pattern(part) -> FrontPattern:
    return FrontPattern(part.assembly, part.mesh.node_sets["left"], "tree")


@pytest.fixture(scope="module")
def data(part) -> np.ndarray:
    data = part.stiffness_data(part.rest_nodes)
    data[part.assembly.diagonal] += 1.0
    return data


def solution(pattern, data, part, right):
    """A^-1 of loads on the nodes, (3 node,), zero at the held nodes."""
    result = np.zeros(3 * part.node_count)
    chosen = pattern.unknowns
    result[chosen] = FrontalCholesky(pattern, data).solve(right[chosen][:, None])[:, 0]
    return result


def test_a_tree_solves_as_a_sweep(part, pattern, data):
    # Condition number about 1e3: backward stable eliminations agree to 1e-12 of the solution.
    sweep = FrontPattern(part.assembly, part.mesh.node_sets["left"])
    right = np.random.default_rng(0).normal(size=3 * part.node_count)
    expected = solution(sweep, data, part, right)
    found = solution(pattern, data, part, right)
    np.testing.assert_allclose(found, expected, atol=1e-10 * np.abs(expected).max())


def test_a_comb_takes_fewer_operations_along_a_tree(part, pattern):
    """Teeth are eliminated each by itself; a sweep carries its front through them."""
    sweep = FrontPattern(part.assembly, part.mesh.node_sets["left"])
    assert len(np.unique(pattern.parents)) < pattern.block_count - 1  # it does branch
    assert pattern.operation_count < 0.6 * sweep.operation_count


def test_blocks_come_after_all_those_below_them(pattern):
    numbers = np.arange(pattern.block_count)
    assert np.all(pattern.parents[:-1] > numbers[:-1])
    for number, parent in enumerate(pattern.parents[:-1]):
        assert pattern.lowest[parent] <= pattern.lowest[number] <= number


def test_columns_of_single_nodes_cost_nothing_beside_their_branch(part, pattern, data):
    generator = np.random.default_rng(1)
    nodes = generator.choice(len(pattern.unknowns) // 3, 12, replace=False)
    order = np.argsort(pattern.block[3 * nodes], kind="stable")
    right = np.zeros((len(pattern.unknowns), 12))
    right[3 * nodes[order], np.arange(12)] = 1.0
    factor = FrontalCholesky(pattern, data)
    half, gram = factor.half_solve(right.copy(), pattern.block[3 * nodes[order]])
    expected, expected_gram = factor.half_solve(right.copy())
    np.testing.assert_allclose(half, expected, atol=1e-12 * np.abs(expected).max())
    np.testing.assert_allclose(gram, expected_gram, atol=1e-12 * np.abs(expected_gram).max())
    one = factor.half_solve_one(right[:, 3])
    np.testing.assert_allclose(one, expected[:, 3], atol=1e-12 * np.abs(expected).max())


def test_single_precision_solves_to_its_rounding(part, pattern, data):
    """6e-8 times a condition number of about 1e3, and some tens of sums; columns and one column
    are the same solution."""
    right = np.random.default_rng(2).normal(size=(len(pattern.unknowns), 3))
    exact, single = FrontalCholesky(pattern, data), FrontalCholesky(pattern, data, "single")
    expected, found = exact.solve(right), single.solve(right)
    assert found.dtype == np.float32
    np.testing.assert_allclose(found, expected, atol=1e-3 * np.abs(expected).max())
    assert np.abs(found - expected).max() > 1e-9 * np.abs(expected).max()
    for factor, wanted, rounding in ((exact, expected, 1e-12), (single, found, 1e-3)):
        one = factor.half_solve_transposed_one(factor.half_solve_one(right[:, 1]))
        np.testing.assert_allclose(one, wanted[:, 1], atol=rounding * np.abs(expected).max())


def test_wrong_columns_are_refused(pattern, data):
    factor = FrontalCholesky(pattern, data, "single")
    with pytest.raises(ValueError, match="3 rows, expected"):
        factor.half_solve_one(np.zeros(3))


def zero_shares(tree: EliminationTree, touches: np.ndarray) -> np.ndarray:
    """Share of zeros in each block's panel, by eliminating node after node, (block,)."""
    filled = touches[np.ix_(tree.order, tree.order)]
    for node in range(len(filled)):
        below = node + 1 + np.flatnonzero(filled[node + 1 :, node])
        filled[np.ix_(below, below)] = True
    heights = np.tril(filled).sum(axis=0)
    shares = []
    for first, end, front in zip(tree.starts[:-1], tree.starts[1:], tree.fronts, strict=True):
        whole = sum(len(front) - place for place in range(end - first))
        shares.append((whole - heights[first:end].sum()) / ((end - first) * len(front)))
    return np.array(shares)


def test_blocks_hold_few_zeros(monkeypatch):
    """Of a panel 30 % at most where a block of few nodes was taken in, and 5 % where a large one
    was: blocks of more than eight nodes are of several."""
    mesh = box_mesh((18.0, 8.0, 6.0), (9, 4, 3))
    touches = np.zeros((len(mesh.nodes), len(mesh.nodes)), dtype=bool)
    for first in range(4):
        for second in range(4):
            touches[mesh.tetrahedra[:, first], mesh.tetrahedra[:, second]] = True
    tree = minimum_degree_tree(csr_array(touches))
    shares = zero_shares(tree, touches)
    assert 0.0 < shares.max() <= 0.3
    assert shares[np.diff(tree.starts) > 8].max() <= 0.05
    assert shares[np.diff(tree.starts) == 2].max() > 0.0  # the smallest are joined, too
    for limit in ("_FILL", "_SMALL_FILL"):
        monkeypatch.setattr(elimination_tree, limit, 0.0)
    none = minimum_degree_tree(csr_array(touches))
    assert zero_shares(none, touches).max() == 0.0
    assert len(none.parents) < len(mesh.nodes)  # columns that are the same are joined even so
