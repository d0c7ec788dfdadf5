"""Where the legs of a radial robot are mounted."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pneumorph.base.checked import Checked, Count
from pneumorph.geometry.pose import Pose, rotation_about


@dataclass(frozen=True)
class RadialMounting(Checked):
    """Evenly spaced locations for legs around a disk."""

    location_count: Count = 8
    """Number of locations around the disk."""
    pitch_deg: float = 15.0
    """Angle by which each leg points down [degrees]."""
    hub_radius_mm: float = 50.0
    """Distance of the leg's inner end face from the disk's axis [mm]."""
    half_tooth_length_mm: float = 52.0
    """Half the length of the leg's toothed body [mm], from its middle to its inner end face."""
    base_thickness_mm: float = 4.0
    """Thickness of the leg's base plate [mm]; the leg hangs this far below the disk's lower
    face."""

    @property
    def hub_bottom_mm(self) -> float:
        """Height of the disk's bottom in the robot's frame, 2 * 52 sin 15 in the paper [mm]."""
        return 2.0 * self.half_tooth_length_mm * float(np.sin(np.radians(self.pitch_deg)))

    def pose(self, location: int) -> Pose:
        """Pose of the leg at a place.

        The leg is pitched about y, moved outwards and up, then turned about z by
        360/location_count (location + 1/2) degrees; x points forward, z up.

        Args:
            location: Which place, 0 .. location_count - 1, counter-clockwise from the front.

        Raises:
            ValueError: No such place.
        """
        if not 0 <= location < self.location_count:
            raise ValueError(
                f"location must be 0 .. {self.location_count - 1}, got {location}; places are "
                "numbered from 0"
            )
        pitch = np.radians(self.pitch_deg)
        half = self.half_tooth_length_mm
        outwards = np.array(
            [
                half * np.cos(pitch) + self.hub_radius_mm,
                0.0,
                half * np.sin(pitch) - self.base_thickness_mm,
            ]
        )
        pitched = Pose(rotation_about("y", self.pitch_deg), outwards)
        yaw_deg = 360.0 / self.location_count * (location + 0.5)
        return Pose(rotation_about("z", yaw_deg)).compose(pitched)
