"""Messages name a turn as a robot's file does."""

from __future__ import annotations

import numpy as np
import pytest

from pneumorph.geometry.pose import Pose, rotation_about
from pneumorph.robot.said_symmetry import said_symmetry


def ring(count: int, turned_deg: float = 0.0) -> list[Pose]:
    """Sites around z that look outwards and down, rounded as in files; the second one is turned."""
    poses = []
    for number in range(count):
        yaw_deg = 360.0 * number / count + (turned_deg if number == 1 else 0.0)
        rotation = rotation_about("z", yaw_deg) @ rotation_about("y", 15.0)
        angle = np.radians(360.0 * number / count)
        place = np.round([45.0 * np.cos(angle), 45.0 * np.sin(angle), 35.0], 4)
        poses.append(Pose(rotation, place))
    return poses


@pytest.mark.parametrize(
    ("text", "turn"),
    [("1 2 3 4 0", "72"), ("2 3 4 0 1", "144"), ("4 0 1 2 3", "288"), ("0 1 2 3 4", "0")],
)
def test_a_turn_is_named_by_its_degrees(text: str, turn: str) -> None:
    assert said_symmetry(text, ring(5)) == f"'{turn}' (which takes sites to {text})"


def test_what_is_no_turn_of_the_sites_is_named_as_it_is() -> None:
    assert said_symmetry("mirror", ring(5)) == "'mirror'"
    for poses in ((), ring(4), ring(5, turned_deg=10.0)):
        assert said_symmetry("1 2 3 4 0", poses) == "'1 2 3 4 0'"
    assert said_symmetry("0 4 3 2 1", ring(5)) == "'0 4 3 2 1'"
