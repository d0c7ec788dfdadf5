import numpy as np
import pneumorph._engine as engine
import pytest
from helpers.box_mesh import box_mesh

from pneumorph.fem.assembly import Assembly
from pneumorph.fem.frontal_cholesky import FrontalCholesky, FrontPattern
from pneumorph.fem.material import Material
from pneumorph.fem.part_model import PartModel


@pytest.fixture(scope="module")
def bar() -> PartModel:
    return PartModel(box_mesh((40.0, 4.0, 4.0), (20, 2, 2)), Material(100.0, 0.3), 0.1)


@pytest.fixture(scope="module")
def pattern(bar) -> FrontPattern:
    return FrontPattern(bar.assembly, bar.mesh.node_sets["left"])


def matrix_data(bar: PartModel) -> np.ndarray:
    data = bar.stiffness_data(bar.rest_nodes)
    data[bar.assembly.diagonal] += 1.0
    return data


def dense_matrix(bar: PartModel, pattern: FrontPattern) -> np.ndarray:
    matrix = bar.assembly.matrix(matrix_data(bar)).toarray()
    return matrix[np.ix_(pattern.unknowns, pattern.unknowns)]


# The matrix has a condition number of about 1e3 and elimination is backward stable, so solutions
# agree to 1e-12 of their size; 1e-10 leaves room for the sums of 540 terms.
_ROUNDING = 1e-10


def test_solves_like_a_dense_factorisation(bar, pattern):
    dense = dense_matrix(bar, pattern)
    assert pattern.block_count > 5
    factor = FrontalCholesky(pattern, matrix_data(bar))
    right = np.random.default_rng(0).normal(size=(len(dense), 5))
    expected = np.linalg.solve(dense, right)
    scale = np.abs(expected).max()
    np.testing.assert_allclose(factor.solve(right), expected, atol=_ROUNDING * scale)
    half, gram = factor.half_solve(right.copy())
    products = right.T @ expected
    np.testing.assert_allclose(gram, products, atol=_ROUNDING * np.abs(products).max())
    np.testing.assert_allclose(half.T @ half, gram, atol=_ROUNDING * np.abs(products).max())


def test_columns_that_begin_late_may_say_so(bar, pattern):
    first = np.array([0, 2, 5, pattern.block_count])  # the last one is zero altogether
    right = np.random.default_rng(1).normal(size=(len(pattern.unknowns), 4))
    for column, block in enumerate(first):
        right[: pattern.starts[block], column] = 0.0
    factor = FrontalCholesky(pattern, matrix_data(bar))
    half, gram = factor.half_solve(right.copy(), first)
    expected, expected_gram = factor.half_solve(right.copy())
    np.testing.assert_allclose(half, expected, atol=_ROUNDING * np.abs(expected).max())
    np.testing.assert_allclose(gram, expected_gram, atol=_ROUNDING * np.abs(expected_gram).max())


def test_sweep_starts_at_the_slaves_and_passes_along_the_body(bar):
    for side, sign in (("left", 1.0), ("right", -1.0)):
        pattern = FrontPattern(bar.assembly, bar.mesh.node_sets[side])
        x = bar.rest_nodes[pattern.unknowns[::3] // 3, 0]
        place = np.arange(len(x))
        assert sign * np.corrcoef(x, place)[0, 1] > 0.99


def test_front_is_about_a_cross_section(bar, pattern):
    """A sweep along the bar holds a block and the cross-section it has touched, however long it is.

    The bar has 9 nodes a cross-section; a block of 20 nodes reaches into at most 4 of them and
    touches the neighbours' nodes of the last: 36 + 9 nodes, and 9 more for fronts that lean.
    """
    assert pattern.largest_front <= 3 * (36 + 9 + 9)
    longer = PartModel(box_mesh((160.0, 4.0, 4.0), (80, 2, 2)), Material(100.0, 0.3), 0.1)
    long_pattern = FrontPattern(longer.assembly, longer.mesh.node_sets["left"])
    assert long_pattern.largest_front <= 3 * (36 + 9 + 9)
    # Four times the length, four times the work; the ends and the last block make the difference.
    ratio = long_pattern.operation_count / pattern.operation_count
    assert ratio == pytest.approx(4.0, rel=0.15)


def test_elements_of_ten_nodes():
    """The pattern knows connectivity alone: any number of nodes an element will do."""
    generator = np.random.default_rng(2)
    # A chain of 30 elements of ten nodes, each sharing four with the next.
    connectivity = 6 * np.arange(30)[:, None] + np.arange(10)
    node_count = int(connectivity.max()) + 1
    shuffled = generator.permutation(node_count)[connectivity]
    assembly = Assembly(node_count, [shuffled])
    square = generator.normal(size=(30, 30, 30))
    matrices = square @ square.transpose(0, 2, 1) + 5.0 * np.eye(30)
    rows, columns = np.triu_indices(30)
    data = assembly.symmetric_data([matrices[:, rows, columns].T])
    pattern = FrontPattern(assembly, shuffled[0, :2])
    dense = assembly.matrix(data).toarray()[np.ix_(pattern.unknowns, pattern.unknowns)]
    right = generator.normal(size=(len(dense), 2))
    expected = np.linalg.solve(dense, right)
    found = FrontalCholesky(pattern, data).solve(right)
    np.testing.assert_allclose(found, expected, atol=_ROUNDING * np.abs(expected).max())


def test_factors_share_no_memory(bar, pattern):
    """A new factor takes the memory of one that is gone, never of one that is in use."""
    data = matrix_data(bar)
    right = np.random.default_rng(3).normal(size=(len(pattern.unknowns), 1))
    first = FrontalCholesky(pattern, data)
    expected = first.solve(right)
    for scale in (2.0, 3.0):
        other = FrontalCholesky(pattern, scale * data)
        np.testing.assert_allclose(scale * other.solve(right), expected, rtol=1e-9)
        del other
    assert np.array_equal(first.solve(right), expected)


def test_indefinite_matrix_is_refused(bar, pattern):
    data = matrix_data(bar)
    data[bar.assembly.diagonal[pattern.unknowns[-1]]] -= 1e6
    with pytest.raises(
        np.linalg.LinAlgError, match=f"not positive definite at block {pattern.block_count - 1}"
    ):
        FrontalCholesky(pattern, data)


def test_wrong_shapes_are_refused(bar, pattern):
    factor = FrontalCholesky(pattern, matrix_data(bar))
    with pytest.raises(ValueError, match=f"3 rows, expected {len(pattern.unknowns)}"):
        factor.solve(np.zeros((3, 1)))
    with pytest.raises(ValueError, match="data has 5 numbers"):
        FrontalCholesky(pattern, np.zeros(5))
    with pytest.raises(ValueError, match="first_block must ascend"):
        factor.half_solve(np.zeros((len(pattern.unknowns), 2)), np.array([3, 0]))


def test_engine_refuses_a_pattern_that_would_leave_its_arrays():
    whole = [[0, 1], [0, 1], [1], [0], [0], [0, 1], [0], [0]]  # one block, and a row beyond it
    arrays = [np.array(values, dtype=np.int32) for values in whole]
    with pytest.raises(ValueError, match="the last front must end with its block"):
        engine.FrontPattern(*arrays, 1)
