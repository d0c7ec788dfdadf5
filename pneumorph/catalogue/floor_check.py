"""Refuse a robot that would begin inside the floor, which would throw it up in its first step."""

from __future__ import annotations

import numpy as np

from pneumorph.physics.physics import Physics
from pneumorph.robot.design import Design

_DEEPEST_MM = 1.0
"""Points that begin this far below a level floor are a matter of rounded numbers."""


def check_payload_above_floor(place_mm: np.ndarray, physics: Physics) -> None:
    """Refuse a payload that lies below a level floor, whichever design carries it.

    Args:
        place_mm: Where it lies in the robot's frame [mm], (3,).
        physics: What the robot is simulated in.

    Raises:
        ValueError: It lies more than 1 mm below.
    """
    start = physics.start
    if not physics.ground.is_plane or not start.is_upright:
        return
    height = float(place_mm[2]) + start.lift_mm
    if physics.floor_height_mm - height > _DEEPEST_MM:
        raise ValueError(
            f"payload_mm of [hub] is at a height of {height:.4g} mm at rest and the floor at "
            f"{physics.floor_height_mm:g}, expected it above the floor: it is in mm, z upwards, in "
            "the robot's frame"
        )


def check_above_floor(points: np.ndarray, design: Design, physics: Physics) -> None:
    """Refuse a robot whose contact points at rest lie below a level floor.

    Uneven floors are put below the robot, and so is one that is pitched or rolled put above its
    floor (`pneumorph.physics.start_pose`).

    Args:
        points: The contact points at rest in the robot's frame, its legs mounted as its sites
            have them [mm], (point, 3).
        design: The robot's.
        physics: What it is simulated in.

    Raises:
        ValueError: One lies more than 1 mm below.
    """
    start = physics.start
    if not physics.ground.is_plane or not start.is_upright or not len(points):
        return
    lowest = float(np.min(points[:, 2])) + start.lift_mm
    inside = physics.floor_height_mm - lowest
    if inside > _DEEPEST_MM:
        raise ValueError(
            f"physics.floor_height_mm is {physics.floor_height_mm:g} and the robot of design "
            f"{design} reaches down to {lowest:.4g} mm at rest: it would begin {inside:.3g} mm "
            f"inside the floor and be thrown up; expected {lowest:.4g} or lower, or "
            "physics.start.lift_mm"
        )
