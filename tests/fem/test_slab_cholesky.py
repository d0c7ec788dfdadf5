import numpy as np
import pytest
from box_mesh import box_mesh

from pneumorph.fem.material import Material
from pneumorph.fem.part_model import PartModel
from pneumorph.fem.slab_cholesky import SlabCholesky, SlabPattern


@pytest.fixture
def bar() -> PartModel:
    return PartModel(box_mesh((20.0, 4.0, 4.0), (10, 2, 2)), Material(100.0, 0.3), 0.1)


def matrix_data(bar: PartModel) -> np.ndarray:
    data = bar.stiffness_data(bar.rest_nodes)
    data[bar.assembly.diagonal] += 1.0
    return data


def test_solves_like_a_dense_factorisation(bar):
    slaves = bar.mesh.node_sets["left"]
    data = matrix_data(bar)
    pattern = SlabPattern(bar.assembly, slaves)
    assert len(pattern.slabs) >= 9
    dense = bar.assembly.matrix(data).toarray()[np.ix_(pattern.unknowns, pattern.unknowns)]
    factor = SlabCholesky(pattern, data)
    right = np.random.default_rng(0).normal(size=(len(pattern.unknowns), 5))
    np.testing.assert_allclose(factor.solve(right), np.linalg.solve(dense, right), rtol=1e-9)
    half = factor.half_solve(right)
    np.testing.assert_allclose(half.T @ half, right.T @ np.linalg.solve(dense, right), rtol=1e-9)


def test_columns_that_begin_late_may_say_so(bar):
    data = matrix_data(bar)
    pattern = SlabPattern(bar.assembly, bar.mesh.node_sets["left"])
    right = np.random.default_rng(1).normal(size=(len(pattern.unknowns), 3))
    first = np.array([0, 2, 5])
    for column, slab in enumerate(first):
        right[: pattern.starts[slab], column] = 0.0
    factor = SlabCholesky(pattern, data)
    np.testing.assert_allclose(
        factor.half_solve(right, first), factor.half_solve(right), atol=1e-14
    )


def test_indefinite_matrix_is_refused(bar):
    data = matrix_data(bar)
    data[bar.assembly.diagonal] -= 1e6
    pattern = SlabPattern(bar.assembly, bar.mesh.node_sets["left"])
    with pytest.raises(np.linalg.LinAlgError, match="not positive definite"):
        SlabCholesky(pattern, data)
