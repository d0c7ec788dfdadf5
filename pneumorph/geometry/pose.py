"""Where a part sits in the robot: a rotation and a translation."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np


@dataclass(frozen=True, eq=False)
class Pose:
    """Rigid placement of a part, x_robot = R x_part + t.

    Args:
        rotation: Proper rotation matrix R, (3, 3).
        translation: t [mm], (3,).

    Raises:
        ValueError: The rotation is not orthonormal with determinant +1, or something is not finite.
    """

    rotation: np.ndarray = field(default_factory=lambda: np.eye(3))
    translation: np.ndarray = field(default_factory=lambda: np.zeros(3))

    def __post_init__(self) -> None:
        rotation = np.array(self.rotation, dtype=float)
        translation = np.array(self.translation, dtype=float)
        if rotation.shape != (3, 3):
            raise ValueError(f"rotation must have shape (3, 3), got {rotation.shape}")
        if translation.shape != (3,):
            raise ValueError(f"translation must have shape (3,), got {translation.shape}")
        if not (np.all(np.isfinite(rotation)) and np.all(np.isfinite(translation))):
            raise ValueError("rotation and translation must be finite, got NaN or infinity")
        if np.abs(rotation @ rotation.T - np.eye(3)).max() > 1e-9 or np.linalg.det(rotation) < 0.0:
            raise ValueError(
                "rotation must be orthonormal with determinant +1; a reflection, a scaling or a "
                "matrix of rounded numbers was given"
            )
        object.__setattr__(self, "rotation", rotation)
        object.__setattr__(self, "translation", translation)

    def apply(self, points: np.ndarray) -> np.ndarray:
        """Points of the part [mm], (..., 3), in the frame of the robot."""
        return np.asarray(points) @ self.rotation.T + self.translation

    @property
    def yaw_deg(self) -> float:
        """Where the part's x axis points, seen from above, from forward (0) to the left (90)
        [degrees], 0 to 360."""
        x, y, _ = self.rotation[:, 0]
        # What is left of a right angle's cosine is no direction.
        return round(float(np.degrees(np.arctan2(y, x))), 9) % 360.0

    @property
    def roll_deg(self) -> float:
        """How far the part is turned about its own x axis, its left side up [degrees], -180 to 180:
        the last of the turns about z, y and x that make its rotation."""
        _, y, z = self.rotation[2]
        return round(float(np.degrees(np.arctan2(y, z))), 9)

    def inverse(self) -> Pose:
        """The pose that takes points of the robot back into the part."""
        return Pose(self.rotation.T, -self.rotation.T @ self.translation)

    def compose(self, inner: Pose) -> Pose:
        """First `inner`, then this pose."""
        return Pose(self.rotation @ inner.rotation, self.apply(inner.translation))


def rotation_about(axis: str, angle_deg: float) -> np.ndarray:
    """Right-handed rotation about a coordinate axis, (3, 3).

    Args:
        axis: ``"x"``, ``"y"`` or ``"z"``.
        angle_deg: Angle [degrees].

    Raises:
        ValueError: The axis is none of these.
    """
    if axis not in ("x", "y", "z"):
        raise ValueError(f'axis must be "x", "y" or "z", got {axis!r}')
    angle = np.radians(angle_deg)
    first, second = {"x": (1, 2), "y": (2, 0), "z": (0, 1)}[axis]
    rotation = np.eye(3)
    rotation[first, first] = rotation[second, second] = np.cos(angle)
    rotation[first, second] = -np.sin(angle)
    rotation[second, first] = np.sin(angle)
    return rotation
