"""How far a recorded robot turned, of whatever pose it started in."""

from __future__ import annotations

import numpy as np
import pytest

from pneumorph.geometry.pose import rotation_about
from pneumorph.trajectory import Trajectory


def turning(heading_deg: list[float], roll_deg: list[float]) -> Trajectory:
    """A robot that faces and lies so from frame to frame."""
    count = len(heading_deg)
    return Trajectory(
        time_s=np.arange(count) / 10.0,
        hub_position_mm=np.zeros((count, 3)),
        hub_rotation=np.array(
            [
                rotation_about("z", heading) @ rotation_about("x", roll)
                for heading, roll in zip(heading_deg, roll_deg, strict=True)
            ]
        ),
        tracked_point_mm=np.zeros((count, 3)),
        commanded_kPa=np.zeros((count, 1)),
        regulated_kPa=np.zeros((count, 1)),
        contact_count=np.zeros(count),
    )


@pytest.mark.parametrize("start_deg", [0.0, 90.0, -120.0])
def test_a_robot_that_stands_up_turns_from_where_it_first_faces(start_deg: float) -> None:
    """On its back, tipped, up, on its side, and up again: the turn while it is down counts once it
    stands, that before it first stood does not."""
    heading = [start_deg, start_deg + 5.0, start_deg + 20.0, start_deg + 50.0, start_deg + 60.0]
    turned = turning(heading, [180.0, 90.0, 10.0, 90.0, 0.0]).turned_deg
    np.testing.assert_allclose(turned, [0.0, 0.0, 0.0, 0.0, 40.0], atol=1e-9)


def test_one_that_never_stands_does_not_turn() -> None:
    np.testing.assert_array_equal(turning([40.0, 80.0], [180.0, 180.0]).turned_deg, [0.0, 0.0])
