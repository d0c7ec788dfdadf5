"""Parts that are not mounted quite as their poses say."""

from __future__ import annotations

import numpy as np

from pneumorph.geometry.pose import Pose, rotation_about

_UPRIGHT = 1e-6
"""Cosine of a part's pitch below which it points straight down or up."""


def tilted(pose: Pose, rest_nodes: np.ndarray, angle_deg: float) -> Pose:
    """The pose of a part whose outer end points further down.

    It turns through the middle of its inner end, where x is least, about the horizontal axis across
    its x axis: z cross x in the robot's frame, however it is rolled about its length. That is the
    part's own y axis where it is not rolled. A part that points straight down or up has no such
    axis and turns about its own y axis.

    Args:
        pose: Where the part should be, in the robot's frame, z up.
        rest_nodes: Its nodes at rest in its own frame [mm], (node, 3).
        angle_deg: How much further [degrees].
    """
    if angle_deg == 0.0:
        return pose
    turn, roll_deg = rotation_about("y", angle_deg), pose.roll_deg
    # Its y and z axes have no height where its x axis has all of it, and a roll is only rounding.
    if roll_deg != 0.0 and np.hypot(*pose.rotation[2, 1:]) > _UPRIGHT:
        turn = rotation_about("x", -roll_deg) @ turn @ rotation_about("x", roll_deg)
    centre = np.array([rest_nodes[:, 0].min(), 0.0, 0.0])
    return pose.compose(Pose(turn, centre - turn @ centre))
