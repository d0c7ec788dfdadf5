"""How a robot is put on the floor before it walks."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pneumorph.base.checked import Checked, NotNegative
from pneumorph.geometry.pose import Pose, rotation_about

PRESSED_MM = 2.0
"""An upright robot whose legs reach this far below the floor is left there, for they give way; one
whose legs droop further would be thrown up."""


@dataclass(frozen=True)
class StartPose(Checked):
    """Where a robot starts and which way it faces, from where its file places it: upright over the
    origin, facing forward.

    The floor stays: forward is its x axis whichever way the robot faces. Turns are about the axes
    of the floor through the robot's origin, roll first, then pitch, then heading. A robot that is
    pitched or rolled, or whose legs droop more than `PRESSED_MM` below the floor, starts where it
    touches it. A turned one topples unless it stands so: episodes that are to begin after that
    settle for longer.
    """

    x_mm: float = 0.0
    """How much further forward [mm]."""
    y_mm: float = 0.0
    """How far to the left [mm]."""
    lift_mm: NotNegative = 0.0
    """How much higher [mm], one that is turned than where it touches the floor. What starts above
    the floor falls."""
    heading_deg: float = 0.0
    """Turn to the left [degrees]."""
    pitch_deg: float = 0.0
    """Turn nose down [degrees]."""
    roll_deg: float = 0.0
    """Turn left side up [degrees]; 180 puts it on its back."""

    @property
    def is_usual(self) -> bool:
        """Whether it is the pose of the robot's file."""
        return self == StartPose()

    @property
    def is_upright(self) -> bool:
        """Whether neither pitch nor roll turns it."""
        return self.pitch_deg % 360.0 == 0.0 and self.roll_deg % 360.0 == 0.0

    @property
    def has_mirror(self) -> bool:
        """Whether the mirror image of a robot about the vertical plane through the x axis starts in
        this pose as well, but for its place to the left."""
        return self.heading_deg % 180.0 == 0.0 and self.roll_deg % 180.0 == 0.0

    def pose(self, points: np.ndarray, height_mm: float | None = None) -> Pose:
        """x_floor = R x_robot + t of a robot.

        Args:
            points: Its contact points in its own frame, undeformed [mm], (point, 3).
            height_mm: Height of a level floor, out of which a robot is raised that would start
                inside it, an upright one by more than `PRESSED_MM`; None for a floor that is put
                below it.
        """
        turns = [
            rotation_about("z", self.heading_deg),
            rotation_about("y", self.pitch_deg),
            rotation_about("x", self.roll_deg),
        ]
        rotation = np.linalg.multi_dot(turns)
        lowest = float(np.min(points @ rotation[2], initial=np.inf))
        raised = 0.0
        if height_mm is not None and np.isfinite(lowest):
            raised = self.raised_mm(lowest, height_mm)
        return Pose(rotation, np.array([self.x_mm, self.y_mm, self.lift_mm + raised]))

    def raised_mm(self, lowest_mm: float, floor_mm: float) -> float:
        """How much a robot is raised out of a level floor [mm].

        Args:
            lowest_mm: Height of its lowest contact point as it is turned, without a lift [mm].
            floor_mm: Height of the floor [mm].
        """
        if not self.is_upright:
            return max(floor_mm - lowest_mm, 0.0)
        inside = floor_mm - lowest_mm - self.lift_mm
        return inside if inside > PRESSED_MM else 0.0

    @property
    def description(self) -> str:
        """It in words, such as ``starts turned by 30 degrees``; empty for the usual one."""
        words = []
        if self.x_mm or self.y_mm or self.lift_mm:
            words.append(f"at {self.x_mm:g}, {self.y_mm:g}, {self.lift_mm:g} mm")
        if self.heading_deg:
            words.append(f"turned by {self.heading_deg:g} degrees")
        if not self.is_upright:
            words.append(f"pitched by {self.pitch_deg:g} and rolled by {self.roll_deg:g} degrees")
        return f"starts {', '.join(words)}" if words else ""
