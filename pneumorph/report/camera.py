"""An orthographic camera: parallel lines stay parallel, so one scale bar is true everywhere."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Camera:
    """A view of the floor from above and from the side.

    Attributes:
        axes: Unit vectors of the world, (3, 3): to the right and down in the image, and away from
            the viewer; a column each.
        origin_mm: Image coordinates (right, down) of the upper left pixel, (2,) mm.
        pixels_per_mm: Scale.
        width: Pixels across, even (video needs it).
        height: Pixels down, even.
    """

    axes: np.ndarray
    origin_mm: np.ndarray
    pixels_per_mm: float
    width: int
    height: int

    def project(self, points_mm: np.ndarray) -> np.ndarray:
        """Return pixel x, pixel y and depth in mm of world points (..., 3)."""
        image = points_mm @ self.axes
        image[..., :2] = (image[..., :2] - self.origin_mm) * self.pixels_per_mm
        return np.asarray(image)

    def floor_point(self, pixel: np.ndarray, floor_mm: float) -> np.ndarray:
        """Return world x and y, (..., 2), where the lines of sight of pixels (..., 2) meet z."""
        image = pixel / self.pixels_per_mm + self.origin_mm
        return np.asarray((image - floor_mm * self.axes[2, :2]) @ np.linalg.inv(self.axes[:2, :2]))


def fitted_camera(
    points_mm: np.ndarray,
    width: int = 960,
    azimuth_deg: float = 12.0,
    elevation_deg: float = 42.0,
    margin: float = 0.04,
    slope_deg: float = 0.0,
) -> Camera:
    """Return the camera that sees all ``points_mm`` (point, 3) in an image ``width`` pixels across.

    Args:
        points_mm: What must be in the image.
        width: Pixels across; made even.
        azimuth_deg: Turn of the view about the vertical; 0 looks along +y with x to the right.
        elevation_deg: Height of the viewer above the horizon, above 0 to 90 (a plan view).
        margin: Free part of the width at each side.
        slope_deg: How far the floor rises forward (x) in the image [degrees].

    Raises:
        ValueError: No finite point to look at.
    """
    if points_mm.size == 0 or not np.isfinite(points_mm).all():
        raise ValueError("the camera has no finite points to look at; did the simulation diverge?")
    azimuth, elevation = np.radians([azimuth_deg, elevation_deg])
    right = np.array([np.cos(azimuth), np.sin(azimuth), 0.0])
    level = np.cos(elevation)
    away = np.array([-level * right[1], level * right[0], -np.sin(elevation)])
    slope = np.radians(slope_deg)
    # From the floor's axes to those of which the vertical is one.
    tilted = np.array(
        [
            [np.cos(slope), 0.0, -np.sin(slope)],
            [0.0, 1.0, 0.0],
            [np.sin(slope), 0.0, np.cos(slope)],
        ]
    )
    axes = tilted.T @ np.stack([right, np.cross(away, right), away], axis=1)
    image = points_mm @ axes[:, :2]
    low, high = image.min(axis=0), image.max(axis=0)
    free = margin * (high[0] - low[0])
    low, high = low - free, high + free
    width = width // 2 * 2
    pixels_per_mm = width / (high[0] - low[0])
    height = int(np.ceil((high[1] - low[1]) * pixels_per_mm / 2)) * 2
    return Camera(axes, low, float(pixels_per_mm), width, height)
