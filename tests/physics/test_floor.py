"""Gaps and frames of floors."""

import numpy as np
import pytest

from pneumorph.fem.contact_points import linearise_contacts
from pneumorph.physics.floor import HeightField, PlaneFloor
from pneumorph.physics.physics import Physics

POINTS = np.random.default_rng(1).uniform(-30.0, 30.0, (20, 3))


def waves(x, y):
    return 3.0 * np.cos(0.1 * x) + 2.0 * np.sin(0.07 * y) + 0.1 * x


def waves_gradient(x, y):
    return -0.3 * np.sin(0.1 * x) + 0.1, 0.14 * np.cos(0.07 * y)


def test_a_plane_has_the_axes_of_the_world():
    floor = PlaneFloor(-3.0)
    np.testing.assert_array_equal(floor.gap(POINTS), POINTS[:, 2] + 3.0)
    np.testing.assert_array_equal(floor.frames(POINTS)[7], [[0, 0, 1], [1, 0, 0], [0, 1, 0]])


def test_a_level_field_is_the_plane():
    field = HeightField(lambda x, y: np.full_like(x, 2.0), base_mm=-5.0)
    plane = PlaneFloor(-3.0)
    np.testing.assert_allclose(field.gap(POINTS), plane.gap(POINTS), atol=1e-13)
    np.testing.assert_allclose(field.frames(POINTS), plane.frames(POINTS), atol=1e-13)


def test_the_gap_of_a_slope_is_the_distance_from_its_plane():
    field = HeightField(lambda x, y: 0.5 * x - 0.2 * y + 1.0)
    normal = np.array([-0.5, 0.2, 1.0]) / np.linalg.norm([-0.5, 0.2, 1.0])
    expected = (POINTS - [0.0, 0.0, 1.0]) @ normal
    # Central differences of a linear height, 1e-3 mm apart: rounding of 1e-14 over 1e-3.
    np.testing.assert_allclose(field.gap(POINTS), expected, atol=1e-9)
    np.testing.assert_allclose(field.frames(POINTS)[:, 0], np.tile(normal, (20, 1)), atol=1e-10)


def test_frames_are_right_handed_and_touch_the_surface():
    field = HeightField(waves, waves_gradient)
    frames = field.frames(POINTS)
    np.testing.assert_allclose(
        frames @ np.swapaxes(frames, 1, 2), np.tile(np.eye(3), (20, 1, 1)), atol=1e-14
    )
    np.testing.assert_allclose(np.linalg.det(frames), 1.0, atol=1e-14)
    step = 1e-4
    for tangent in (frames[:, 1], frames[:, 2]):
        foot = POINTS.copy()
        foot[:, 2] = waves(foot[:, 0], foot[:, 1])
        # Curvature of 0.03 / mm over a step of 1e-4 mm.
        assert np.abs(field.gap(foot + step * tangent)).max() < 0.03 * step**2
    differences = HeightField(waves)
    # Third derivatives of 3e-3 / mm^2 times (1e-3 mm)^2, and rounding of 1e-15 * 5 mm / 1e-3 mm.
    np.testing.assert_allclose(differences.frames(POINTS), frames, atol=1e-8)


def test_the_linearised_gap_is_of_second_order():
    """Of a point that moves by d: the gap linearised where it was, plus n . d, is the gap where it
    comes to lie but for half the curvature times d^2; linearised where it lies, exactly."""
    field = HeightField(waves, waves_gradient)
    way = np.array([1.0, -0.5, 0.2])
    chosen = np.arange(20)
    true = field.gap(POINTS + way)
    still = np.zeros_like(POINTS)
    before = linearise_contacts(field, [chosen], [POINTS], [still])
    after = linearise_contacts(field, [chosen], [POINTS + way], [still + way])
    error = before.gaps + before.frames[0][:, 0] @ way - true
    gap = np.abs(field.gap(POINTS))
    # Curvatures up to 0.03 / mm; the normal turns by as much over d, which the gap is measured by.
    assert np.all(np.abs(error) < 0.03 * (way @ way) * (0.5 + 0.3 * gap))
    np.testing.assert_allclose(after.gaps + after.frames[0][:, 0] @ way, true, atol=1e-13)


def test_gravity_leans_back_where_the_floor_rises():
    for slope in (0.0, 20.0, -7.0):
        leaning = Physics(floor_slope_deg=slope).gravity_vector
        along, normal = np.sin(np.radians(slope)), np.cos(np.radians(slope))
        np.testing.assert_allclose(leaning, [-9800.0 * along, 0.0, -9800.0 * normal], rtol=1e-15)


def test_bad_heights_are_refused():
    with pytest.raises(ValueError, match=r"height must return an array of shape \(4,\)"):
        HeightField(lambda x, y: 0.0)
    with pytest.raises(ValueError, match="height must be finite near the origin"):
        HeightField(lambda x, y: np.full_like(x, np.nan))
    with pytest.raises(ValueError, match="gradient must return two arrays"):
        HeightField(waves, lambda x, y: (x,))
    with pytest.raises(ValueError, match=r"gradient dz/dy must return an array of shape \(4,\)"):
        HeightField(waves, lambda x, y: (x, 0.0))
