"""Which way a robot faces: not where its axis points up, and turning over is no turn."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from pneumorph.base.heading import LEAST_UPRIGHT, heading_deg, last_known


def rotations(*angles: np.ndarray | float) -> np.ndarray:
    """Of yaw, pitch and roll [degrees], one after another in the robot's own axes."""
    return Rotation.from_euler("ZYX", np.array(np.broadcast_arrays(*angles)).T, True).as_matrix()


def test_a_robot_that_leans_faces_where_its_forward_axis_points() -> None:
    yaw = np.array([-170.0, -30.0, 0.0, 90.0, 179.0])
    found = heading_deg(rotations(yaw, 40.0, 0.0))
    np.testing.assert_allclose(found, yaw, atol=1e-9)


def test_one_that_is_tipped_over_faces_nowhere() -> None:
    limit = np.degrees(np.arccos(LEAST_UPRIGHT))
    tipped = np.array([limit - 0.01, limit + 0.01, 90.0, 180.0])
    for axes in ((0.0, tipped, 0.0), (0.0, 0.0, tipped), (50.0, -tipped, 0.0)):
        assert np.isnan(heading_deg(rotations(*axes))).tolist() == [False, True, True, True]


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_somersault_is_no_turn_however_it_is_disturbed(sign: float) -> None:
    """Its axis swings to the other side by half a circle, to the left or to the right by the sign
    of a hundredth of a degree."""
    pitch = np.linspace(0.0, 360.0, 721)
    whole = last_known(heading_deg(rotations(0.01 * sign, pitch, 0.01 * sign)))
    assert np.abs(whole).max() < 0.05
    on_its_back = last_known(heading_deg(rotations(0.01 * sign, pitch[:361], 0.01 * sign)))
    assert abs(on_its_back[-1]) < 0.05


def test_before_the_first_that_is_known_a_course_is_where_it_begins() -> None:
    course = np.array([np.nan, 3.0, np.nan, np.nan, 5.0])
    np.testing.assert_array_equal(last_known(course), [0.0, 3.0, 3.0, 3.0, 5.0])
    np.testing.assert_array_equal(last_known(np.full(2, np.nan), start=7.0), [7.0, 7.0])
