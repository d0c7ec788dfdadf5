"""Triangles cover the pixels whose centres lie inside them, and the nearest one is seen."""

from __future__ import annotations

import numpy as np

from pneumorph.report.rasteriser import DepthBuffer


def _image(buffer: DepthBuffer) -> np.ndarray:
    image = np.full(buffer.width * buffer.height, -1)
    pixel, triangle = buffer.nearest()
    image[pixel] = triangle
    return image.reshape(buffer.height, buffer.width)


def _square(low: float, high: float, depth: float) -> np.ndarray:
    a, b, c, d = ([x, y, depth] for x, y in ((low, low), (high, low), (high, high), (low, high)))
    return np.array([[a, b, c], [a, c, d]])


def test_a_square_covers_exactly_the_pixels_whose_centres_it_holds() -> None:
    buffer = DepthBuffer(12, 10, 0.0, 10.0)
    buffer.draw(_square(2.4, 7.6, 5.0))
    expected = np.zeros((10, 12), dtype=bool)
    expected[2:8, 2:8] = True  # centres 2.5 to 7.5
    assert np.array_equal(_image(buffer) >= 0, expected)


def test_winding_does_not_matter() -> None:
    one, other = DepthBuffer(9, 9, 0.0, 10.0), DepthBuffer(9, 9, 0.0, 10.0)
    triangle = np.array([[[1.0, 1, 5], [8, 2, 5], [3, 7.5, 5]]])
    one.draw(triangle)
    other.draw(triangle[:, ::-1])
    assert np.array_equal(_image(one), _image(other))
    # A triangle of area 21.25 square pixels covers that many centres but for its border.
    assert abs((_image(one) >= 0).sum() - 21.25) < 4


def test_the_nearest_triangle_is_seen_whatever_the_order() -> None:
    for order in ((3.0, 6.0), (6.0, 3.0)):
        buffer = DepthBuffer(10, 10, 0.0, 10.0)
        for depth in order:
            buffer.draw(_square(1, 9, depth), first_index=int(depth) * 10)
        assert set(_image(buffer)[2:8, 2:8].ravel()) <= {30, 31}


def test_a_slope_is_hidden_where_it_lies_behind() -> None:
    buffer = DepthBuffer(20, 10, 0.0, 20.0)
    corners = np.array([[0.0, 0], [20, 0], [20, 10], [0, 10]])[[[0, 1, 2], [0, 2, 3]]]
    buffer.draw(np.concatenate([corners, corners[..., :1]], axis=2))
    buffer.draw(np.concatenate([corners, np.full((2, 3, 1), 10.0)], axis=2), first_index=2)
    image = _image(buffer)
    assert (image[:, :10] < 2).all()  # the slope's depth is x, the wall's 10
    assert (image[:, 10:] >= 2).all()


def test_triangles_larger_than_the_screen_and_outside_it() -> None:
    buffer = DepthBuffer(8, 6, 0.0, 10.0)
    buffer.draw(_square(-500.0, 500.0, 5.0))
    assert (_image(buffer) >= 0).all()
    buffer.clear()
    buffer.draw(_square(20.0, 30.0, 5.0))
    buffer.draw(np.array([[[1.0, 1, 5], [4, 4, 5], [7, 7, 5]]]))  # no area
    assert (_image(buffer) < 0).all()
