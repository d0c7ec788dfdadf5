"""Spread points cover all others within the spacing, and are that far apart themselves."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from scipy.spatial import ConvexHull

from pneumorph.geometry.spread_points import spread_points


def test_every_point_is_near_a_chosen_one_and_chosen_ones_are_apart() -> None:
    """Apart by the spacing, but corners of the hull by a quarter of it."""
    points = np.random.default_rng(0).uniform(-50.0, 50.0, (400, 3))
    chosen = spread_points(points, 20.0)
    between = np.linalg.norm(points[:, None] - points[chosen][None], axis=2)
    assert between.min(axis=1).max() <= 20.0
    apart = between[chosen] + 1e9 * np.eye(len(chosen))
    assert apart.min() > 5.0
    inner = ~np.isin(chosen, ConvexHull(points).vertices)
    assert inner.any()
    assert apart[inner].min() > 20.0
    assert np.array_equal(chosen, np.sort(chosen))


def test_corners_of_a_thin_plate_are_all_there() -> None:
    grid = np.meshgrid(np.arange(0.0, 31.0), np.arange(0.0, 11.0), [0.0, 4.0])
    plate = np.column_stack([axis.ravel() for axis in grid])
    chosen = plate[spread_points(plate, 10.0)]
    for corner in itertools.product((0.0, 30.0), (0.0, 10.0), (0.0, 4.0)):
        assert (chosen == corner).all(axis=1).any(), corner


def test_points_of_a_tilted_plane_are_spread_where_that_is_said() -> None:
    """Its corners are there; a line is refused, and a volume is as it is without that."""
    grid = np.meshgrid(np.arange(0.0, 31.0), np.arange(0.0, 11.0))
    x, y = (axis.ravel() for axis in grid)
    plane = np.column_stack([x, y, 0.5 * x - 0.25 * y])
    chosen = plane[spread_points(plane, 10.0, flat=True)]
    for corner in itertools.product((0.0, 30.0), (0.0, 10.0)):
        assert (chosen[:, :2] == corner).all(axis=1).any(), corner
    between = np.linalg.norm(plane[:, None] - chosen[None], axis=2)
    assert between.min(axis=1).max() <= 10.0
    with pytest.raises(ValueError, match="span no"):
        spread_points(plane[y == 0.0], 10.0, flat=True)
    with pytest.raises(ValueError, match="span no"):
        spread_points(plane[:2], 10.0, flat=True)
    points = np.random.default_rng(0).uniform(-50.0, 50.0, (200, 3))
    same = spread_points(points, 20.0, flat=True)
    np.testing.assert_array_equal(same, spread_points(points, 20.0))


def test_bad_input_is_refused() -> None:
    with pytest.raises(ValueError, match=r"points, of shape \(0, 3\), span no volume"):
        spread_points(np.zeros((0, 3)), 1.0)
    with pytest.raises(ValueError, match="not lie in a plane"):
        spread_points(np.random.default_rng(0).uniform(size=(9, 3)) * [1.0, 1.0, 0.0], 1.0)
    with pytest.raises(ValueError, match="spacing_mm must be positive, got 0"):
        spread_points(np.eye(4, 3), 0.0)
