"""Refuse a robot that would begin inside the floor, which would throw it up in its first step, or
so high above it that it would fall first."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from pneumorph.physics.floor import HeightField
from pneumorph.physics.ground import RoughGround
from pneumorph.physics.physics import Physics
from pneumorph.robot.design import Design

_DEEPEST_MM = 1.0
"""Points that begin this far below a level floor are a matter of rounded numbers."""
_FURTHEST_FALL = 2.0
"""Times the longest side of all that may be mounted, beyond which the floor is not meant to lie so
far below: that is another unit."""


def check_payload_above_floor(
    place_mm: np.ndarray, physics: Physics, points: np.ndarray | None = None
) -> None:
    """Refuse a payload that lies below the floor, whatever is rough on it: that may be drawn, and a
    payload touches nothing.

    Args:
        place_mm: Where it lies in the robot's frame [mm], (3,).
        physics: What the robot is simulated in.
        points: The contact points of the design that carries it, at rest in the robot's frame [mm],
            (point, 3): an uneven floor is put below them. None for any design, of which only a
            level floor is known.

    Raises:
        FileNotFoundError: There is no such map of the ground.
        ValueError: It lies more than 1 mm below, or as of `Physics.floor`.
    """
    start, ground = physics.start, replace(physics.ground, rough=RoughGround())
    physics = replace(physics, ground=ground)
    if not start.is_upright or (points is None and not ground.is_plane):
        return
    height, floor_mm = float(place_mm[2]) + start.lift_mm, physics.floor_height_mm
    if points is not None and not ground.is_plane:
        floor = physics.floor(points)
        assert isinstance(floor, HeightField)
        x, y, _ = physics.start_pose(points).apply(place_mm[None]).T
        floor_mm = floor.base_mm + float(ground.grid().height(x, y)[0])
    if floor_mm - height > _DEEPEST_MM:
        raise ValueError(
            f"payload_mm of [hub] is at a height of {height:.4g} mm at rest and the floor at "
            f"{floor_mm:.6g}, expected it above the floor: it is in mm, z upwards, in the robot's "
            "frame"
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


def check_near_floor(
    hub: np.ndarray, legs: Callable[[], list[np.ndarray]], physics: Physics
) -> None:
    """Refuse a floor so far below a robot that it would fall before it walks. A lift, gravity of
    zero and a map of heights, which may have any zero, are taken as they are.

    Args:
        hub: The hub's nodes in the robot's frame [mm], (node, 3).
        legs: Gives the contact points of all that may be mounted, at rest there [mm], (point, 3)
            each; not asked for where the hub alone is near the floor.
        physics: What the robot is simulated in.

    Raises:
        ValueError: It lies more than twice the longest side of the robot below.
    """
    if physics.gravity_mm_per_s2 == 0.0 or physics.ground.map.path is not None:
        return
    if _fall_mm(hub, physics) <= _FURTHEST_FALL * _longest_mm(hub):
        return
    points = np.concatenate([hub, *legs()])
    fall, longest = _fall_mm(points, physics), _longest_mm(points)
    if fall > _FURTHEST_FALL * longest:
        raise ValueError(
            f"physics.floor_height_mm is {physics.floor_height_mm:g}, {fall:.4g} mm below the "
            f"robot, which would first fall as far; expected at most {_FURTHEST_FALL:g} times its "
            f"longest side, {longest:.4g} mm: it is the height where contact points rest, in mm, z "
            "upwards, in the robot's frame; what is to fall has physics.start.lift_mm"
        )


def _fall_mm(points: np.ndarray, physics: Physics) -> float:
    """How high points are above the floor, or its highest step, without a lift [mm]."""
    steps, start = physics.ground.steps, physics.start
    lowest = float(np.min(physics.start_pose(points).apply(points)[:, 2])) - start.lift_mm
    return lowest - physics.floor_height_mm - max(steps.count * steps.rise_mm, 0.0)


def _longest_mm(points: np.ndarray) -> float:
    return float(np.max(np.ptp(points, axis=0)))
