"""How a robot is put on the floor before it walks."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pneumorph.base.checked import Checked
from pneumorph.geometry.pose import Pose, rotation_about

_INSIDE_MM = 0.1
"""How far into the floor a point may start that was lifted to it by a rounded number [mm]."""


@dataclass(frozen=True)
class StartPose(Checked):
    """Where a robot starts and which way it faces, from where its file places it: upright over the
    origin, facing forward.

    The floor stays: forward is its x axis whichever way the robot faces. Turns are about the axes
    of the floor through the robot's origin, roll first, then pitch, then heading.
    """

    x_mm: float = 0.0
    """How much further forward [mm]."""
    y_mm: float = 0.0
    """How far to the left [mm]."""
    lift_mm: float = 0.0
    """How much higher [mm]; what starts above the floor falls."""
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

    @property
    def pose(self) -> Pose:
        """x_floor = R x_robot + t."""
        turned = [
            rotation_about("z", self.heading_deg),
            rotation_about("y", self.pitch_deg),
            rotation_about("x", self.roll_deg),
        ]
        return Pose(np.linalg.multi_dot(turned), np.array([self.x_mm, self.y_mm, self.lift_mm]))

    def standing(self, points: np.ndarray) -> np.ndarray:
        """Where points of the robot are at the start [mm], (point, 3), of the same in its frame."""
        return points if self.is_usual else self.pose.apply(points)

    def check_above(self, standing: np.ndarray, height_mm: float) -> None:
        """Refuse a robot that starts inside a level floor.

        Args:
            standing: Where its contact points are at the start [mm], (point, 3).
            height_mm: Height of the floor [mm].

        Raises:
            ValueError: A turned robot was not lifted enough.
        """
        inside = height_mm - float(np.min(standing[:, 2], initial=np.inf))
        if (self.is_upright and self.lift_mm >= 0.0) or inside <= _INSIDE_MM:
            return
        raise ValueError(
            f"start.lift_mm is {self.lift_mm:g}, expected at least {self.lift_mm + inside:.1f} for "
            f"this robot turned by pitch_deg {self.pitch_deg:g} and roll_deg {self.roll_deg:g}: a "
            f"contact point would start {inside:.1f} mm inside the floor"
        )

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
