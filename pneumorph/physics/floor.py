"""What a robot stands on: the distance of points from it, and which way it faces there.

World axes are the floor's own. A slope is gravity that leans (`Physics.gravity_vector`),
as in the reduced robots, so a plane is always level and "forward" is always x.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np

DIFFERENCE_MM = 1e-3
"""Half the width of the central differences of a height without a gradient [mm]."""


class Floor(Protocol):
    """A surface that points must stay above."""

    @property
    def description(self) -> str:
        """What it is, in words, for a trajectory's metadata."""

    def gap(self, points: np.ndarray) -> np.ndarray:
        """Distance from the floor along its normal, negative below [mm], (point,).

        Args:
            points: World positions [mm], (point, 3).
        """

    def frames(self, points: np.ndarray) -> np.ndarray:
        """Unit normal and two tangents at the floor below each point, as rows, (point, 3, 3).

        Args:
            points: World positions [mm], (point, 3).
        """


@dataclass(frozen=True)
class PlaneFloor:
    """The plane z = height."""

    height_mm: float
    """Height where contact points rest [mm]."""

    @property
    def description(self) -> str:
        """What it is."""
        return f"plane at {self.height_mm:g} mm"

    def gap(self, points: np.ndarray) -> np.ndarray:
        """Height above the plane [mm], (point,)."""
        gap: np.ndarray = points[:, 2] - self.height_mm
        return gap

    def frames(self, points: np.ndarray) -> np.ndarray:
        """Normal z, tangents x and y, (point, 3, 3)."""
        return np.broadcast_to(np.eye(3)[[2, 0, 1]], (len(points), 3, 3))


Height = Callable[[np.ndarray, np.ndarray], np.ndarray]
Gradient = Callable[[np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]]


class HeightField:
    """The floor z = base + height(x, y).

    The distance of a point is taken from the plane that touches the floor straight below it: exact
    on a slope, and wrong by curvature times distance squared elsewhere. Where the floor bends
    within what a point travels in a step, the step is solved again
    (`FullOrderSettings.contact_passes`).

    Args:
        height: Takes arrays x and y [mm] of equal shape and returns the heights [mm] in that shape;
            it should be differentiable.
        gradient: Takes the same and returns the slopes dz/dx and dz/dy; None for central
            differences.
        base_mm: Added to every height [mm].
        description: What it is, in words.

    Raises:
        ValueError: The height or the gradient of a few points near the origin has the wrong shape
            or is not finite.
    """

    def __init__(
        self,
        height: Height,
        gradient: Gradient | None = None,
        base_mm: float = 0.0,
        description: str = "height field given as a function",
    ) -> None:
        self._height, self._gradient = height, gradient or self._differences
        self.base_mm, self.description = base_mm, description
        x, y = np.array([0.0, 1.0, -2.0, 3.0]), np.array([0.0, -1.0, 2.0, 5.0])
        _check("height", height(x, y), x.shape)
        slopes = self._gradient(x, y)
        if len(slopes) != 2:
            raise ValueError(
                f"gradient must return two arrays, dz/dx and dz/dy, got {len(slopes)} of them"
            )
        for name, slope in zip(("gradient dz/dx", "gradient dz/dy"), slopes, strict=True):
            _check(name, slope, x.shape)

    def gap(self, points: np.ndarray) -> np.ndarray:
        """Distance from the plane that touches the floor below each point [mm], (point,)."""
        x, y, z = points.T
        slope_x, slope_y = self._gradient(x, y)
        above: np.ndarray = z - self.base_mm - self._height(x, y)
        return above / np.sqrt(1.0 + slope_x**2 + slope_y**2)

    def frames(self, points: np.ndarray) -> np.ndarray:
        """Normal, the tangent in the plane of x and z, and the one across it, (point, 3, 3)."""
        x, y, _ = points.T
        slope_x, slope_y = self._gradient(x, y)
        one, zero = np.ones_like(x), np.zeros_like(x)
        normal = np.stack([-slope_x, -slope_y, one], axis=1)
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        tangent = np.stack([one, zero, slope_x], axis=1)
        tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
        return np.stack([normal, tangent, np.cross(normal, tangent)], axis=1)

    def _differences(self, x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        step, height = DIFFERENCE_MM, self._height
        return (
            (height(x + step, y) - height(x - step, y)) / (2.0 * step),
            (height(x, y + step) - height(x, y - step)) / (2.0 * step),
        )


def ground_note(floor: Floor) -> dict[str, float]:
    """What a trajectory's metadata says of a floor of heights beside its settings: what they are
    counted from [mm]."""
    return {"ground_base_mm": floor.base_mm} if isinstance(floor, HeightField) else {}


def _check(name: str, values: np.ndarray, shape: tuple[int, ...]) -> None:
    if np.shape(values) != shape:
        raise ValueError(
            f"{name} must return an array of shape {shape} for x and y of that shape, got "
            f"{np.shape(values)}; write it with numpy functions, element by element"
        )
    if not np.all(np.isfinite(values)):
        raise ValueError(f"{name} must be finite near the origin, got {values}")
