import numpy as np
import pytest

from pneumorph.geometry.mounting import RadialMounting
from pneumorph.geometry.pose import Pose, rotation_about


def test_inverse_and_composition_undo_each_other():
    pose = Pose(rotation_about("x", 20.0) @ rotation_about("z", -50.0), np.array([1.0, 2.0, 3.0]))
    points = np.random.default_rng(0).normal(size=(7, 3))
    # Orthonormal products of unit size: a few roundings.
    np.testing.assert_allclose(pose.inverse().apply(pose.apply(points)), points, atol=1e-14)
    np.testing.assert_allclose(
        pose.compose(pose).apply(points), pose.apply(pose.apply(points)), atol=1e-14
    )


def test_reflection_is_refused():
    with pytest.raises(ValueError, match="orthonormal with determinant"):
        Pose(np.diag([1.0, -1.0, 1.0]), np.zeros(3))


def test_paper_mounting_has_its_lowest_point_and_inner_face_where_the_paper_has_them():
    mounting = RadialMounting()
    pose = mounting.pose(0)
    outer_bottom = pose.apply(np.array([57.5, 0.0, 0.0]))
    assert outer_bottom[2] == pytest.approx(-4.0 - 5.5 * np.sin(np.radians(15.0)), abs=1e-12)
    inner = pose.apply(np.array([-52.0, 0.0, 4.0]))
    radial = np.hypot(inner[0], inner[1])
    assert np.degrees(np.arctan2(inner[1], inner[0])) == pytest.approx(22.5)
    assert radial == pytest.approx(50.0 + 4.0 * np.sin(np.radians(15.0)))
    assert mounting.hub_bottom_mm == pytest.approx(26.92, abs=0.005)


def test_locations_are_quarter_turns_two_apart_and_mirror_in_pairs():
    mounting = RadialMounting()
    point = np.array([10.0, 3.0, 2.0])
    turned = rotation_about("z", 90.0) @ mounting.pose(0).apply(point)
    np.testing.assert_allclose(mounting.pose(2).apply(point), turned, atol=1e-12)
    mirror = np.array([1.0, -1.0, 1.0])
    np.testing.assert_allclose(
        mounting.pose(7).apply(point * mirror), mounting.pose(0).apply(point) * mirror, atol=1e-12
    )


def test_unknown_location_is_refused():
    with pytest.raises(ValueError, match=r"location must be 0 \.\. 7, got 8"):
        RadialMounting().pose(8)
