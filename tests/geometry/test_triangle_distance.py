"""How far a point is from triangles, where some of them have shrunk to a line or a point too."""

from __future__ import annotations

import numpy as np
import pytest

from pneumorph.geometry.triangle_distance import distance_to, nearest_point

WHOLE = np.array([[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [0.0, 2.0, 0.0]])
LINE = np.array([[0.0, 0.0, 9.0], [4.0, 0.0, 9.0], [2.0, 0.0, 9.0]])
TWICE = np.array([[0.0, 0.0, 9.0], [0.0, 0.0, 9.0], [4.0, 0.0, 9.0]])
DOT = np.array([[0.0, 0.0, 9.0]] * 3)


@pytest.mark.parametrize(
    ("point", "nearest"),
    [
        ((0.5, 0.5, 3.0), (0.5, 0.5, 0.0)),  # the plane
        ((1.0, -3.0, 0.0), (1.0, 0.0, 0.0)),  # the first edge
        ((2.0, 2.0, 0.0), (1.0, 1.0, 0.0)),  # the second
        ((-1.0, 1.0, 1.0), (0.0, 1.0, 0.0)),  # the third
        ((-3.0, -4.0, 0.0), (0.0, 0.0, 0.0)),  # a corner
    ],
)
@pytest.mark.parametrize("beside", [[], [LINE], [TWICE], [DOT], [LINE, TWICE, DOT]])
def test_triangles_without_area_hide_no_other(
    point: tuple[float, ...], nearest: tuple[float, ...], beside: list[np.ndarray]
) -> None:
    for triangles in ([WHOLE, *beside], [*beside, WHOLE]):
        found = nearest_point(np.array(point), np.array(triangles))
        np.testing.assert_allclose(found, nearest, atol=1e-12)
        far = float(np.linalg.norm(np.subtract(nearest, point)))
        assert distance_to(np.array(point), np.array(triangles)) == pytest.approx(far, abs=1e-12)


@pytest.mark.parametrize(
    ("triangle", "nearest"),
    [(LINE, (3.0, 0.0, 9.0)), (TWICE, (3.0, 0.0, 9.0)), (DOT, (0.0, 0.0, 9.0))],
)
def test_one_without_area_is_its_edges(triangle: np.ndarray, nearest: tuple[float, ...]) -> None:
    point = np.array([3.0, 1.0, 8.0])
    np.testing.assert_allclose(nearest_point(point, triangle[None]), nearest, atol=1e-12)
    far = float(np.linalg.norm(nearest - point))
    assert distance_to(point, triangle[None]) == pytest.approx(far)


def test_no_triangle_is_at_no_distance() -> None:
    assert distance_to(np.zeros(3), np.zeros((0, 3, 3))) == np.inf
