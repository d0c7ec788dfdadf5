"""Directions of many rows, found piece by piece, beside those of all rows at once."""

from __future__ import annotations

import numpy as np
import pytest

from pneumorph.reduction.leading_vectors import leading_vectors, mirrored_halves

# Directions of well-separated weight: vectors are then found to rounding over the gaps.
ROWS = np.random.default_rng(0).normal(size=(47, 5)) * [16.0, 8.0, 4.0, 2.0, 1.0]


@pytest.mark.parametrize("count", [3, 10, 11, 47])
def test_pieces_give_the_vectors_of_all_rows_at_once(count: int) -> None:
    """Ten rows of five numbers are a piece; of less the decomposition is one."""
    found = leading_vectors(((row,) for row in ROWS[:count]), 1e-12, 5, "rows")
    expected = np.linalg.svd(ROWS[:count], full_matrices=False)[2].T
    assert found.shape == expected.shape
    np.testing.assert_allclose(np.abs(found.T @ expected), np.eye(expected.shape[1]), atol=1e-12)


def test_what_may_be_left_counts_all_rows() -> None:
    """Four directions leave the square of the least singular value, of the squares of all."""
    values = np.linalg.svd(ROWS, compute_uv=False)
    left = values[-1] / np.linalg.norm(values)
    for tolerance, wanted in ((1.01 * left, 4), (0.99 * left, 5)):
        assert leading_vectors(ROWS[:, None], tolerance, 5, "rows").shape == (5, wanted)
    with pytest.raises(ValueError, match="swelling is zero in every snapshot"):
        leading_vectors([], 0.1, 5, "swelling")


def test_halves_are_those_of_a_row_and_its_image() -> None:
    row, image = ROWS[:2]
    whole, against = mirrored_halves(row, image)
    np.testing.assert_allclose(whole + against, row, rtol=1e-15)
    np.testing.assert_allclose(whole - against, image, rtol=1e-15)
    assert mirrored_halves(row, None) == (row,)
