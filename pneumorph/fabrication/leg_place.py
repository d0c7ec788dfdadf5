"""Where a leg of any sizes sits on the paper's hub: as in the simulation, the face of its end tooth
lies where that of the paper's leg does (`pneumorph.catalogue.paper_robot.ring_of_sites`).
"""

from __future__ import annotations

import numpy as np

from pneumorph.catalogue.paper_robot import PAPER_FACE
from pneumorph.geometry.attachment import mount_pose, same_frame
from pneumorph.geometry.mounting import RadialMounting
from pneumorph.geometry.pneunet import PneuNetShape
from pneumorph.geometry.pose import Pose


def end_face_mm(leg: PneuNetShape) -> np.ndarray:
    """Middle of the face of a leg's inner end tooth, in the leg's frame [mm], (3,)."""
    half = 0.5 * leg.tooth_base_mm[0]
    return np.array([-half, 0.0, 0.5 * (leg.base_plate_mm[2] + leg.height_mm)])


def leg_pose(leg: PneuNetShape, mounting: RadialMounting, location: int) -> Pose:
    """Pose of a leg's frame in the robot's.

    Args:
        leg: Sizes of the leg.
        mounting: Where legs sit.
        location: Which place, 0 .. location_count - 1.

    Raises:
        ValueError: No such place.
    """
    usual = np.array([-mounting.half_tooth_length_mm, *PAPER_FACE.translation[1:]])
    place, face = Pose(np.eye(3), usual), Pose(np.eye(3), end_face_mm(leg))
    pose = mounting.pose(location)
    return pose if same_frame(place, face) else mount_pose(pose.compose(place), face)
