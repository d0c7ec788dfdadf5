"""Parts that are not mounted quite as their poses say."""

from __future__ import annotations

import numpy as np

from pneumorph.geometry.pose import Pose, rotation_about


def tilted(pose: Pose, rest_nodes: np.ndarray, angle_deg: float) -> Pose:
    """The pose of a part whose outer end points further down.

    It turns about the y axis of its own frame, through the middle of its inner end, where x is
    least.

    Args:
        pose: Where the part should be.
        rest_nodes: Its nodes at rest in its own frame [mm], (node, 3).
        angle_deg: How much further [degrees].
    """
    if angle_deg == 0.0:
        return pose
    turn = rotation_about("y", angle_deg)
    centre = np.array([rest_nodes[:, 0].min(), 0.0, 0.0])
    return pose.compose(Pose(turn, centre - turn @ centre))
