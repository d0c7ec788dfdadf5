"""What a symmetry of designs is called in messages: as a robot's file has it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pneumorph.geometry.pose import Pose

_SAME_DEG = 0.05
"""Turns that are this near are one: files have their sites rounded [degrees]."""


def said_symmetry(text: str, poses: Sequence[Pose]) -> str:
    """The mirror, or the turn about z that takes sites where a symmetry of a space does.

    Args:
        text: The symmetry, as `DesignChoices.symmetries` has it.
        poses: Each site's frame in the robot's; none where they are not known.

    Returns:
        What `same` in a robot's file calls it, such as ``'72'``, and where sites go; the symmetry
        as it is where it is no such turn.
    """
    to = [int(each) for each in text.split() if each.isdecimal()]
    if not poses or sorted(to) != list(range(len(poses))):
        return repr(text)
    turns = [poses[image].rotation @ pose.rotation.T for pose, image in zip(poses, to, strict=True)]
    angles = np.degrees([np.arctan2(turn[1, 0], turn[0, 0]) for turn in turns])
    apart = (angles - angles[0] + 180.0) % 360.0 - 180.0
    is_turn = all(turn[2, 2] > np.cos(np.radians(_SAME_DEG)) for turn in turns)
    if not is_turn or np.abs(apart).max() > _SAME_DEG:
        return repr(text)
    angle = round(float(angles[0] + apart.mean()) % 360.0, 2)
    return f"'{angle:g}' (which takes sites to {text})"
