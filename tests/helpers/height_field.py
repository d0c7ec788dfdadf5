"""A floor through an array of heights, as a ground makes one of a file's."""

from __future__ import annotations

import numpy as np

from pneumorph.physics.floor import HeightField
from pneumorph.physics.height_grid import HeightGrid, checked_heights
from pneumorph.physics.height_map import smoothed


def height_field(
    heights_mm: np.ndarray,
    mm_per_pixel: float,
    centre_mm: tuple[float, float] = (0.0, 0.0),
    smoothing_mm: float = 0.0,
    base_mm: float = 0.0,
) -> HeightField:
    """Return the floor through an array of heights, by bicubic splines (twice differentiable).

    Args:
        heights_mm: Heights seen from above [mm], (row, column), at least 4 x 4: columns go along x,
            rows from +y to -y.
        mm_per_pixel: Distance between neighbours [mm].
        centre_mm: Where the middle of the array lies, x and y [mm].
        smoothing_mm: Standard deviation of a Gaussian smoothing [mm].
        base_mm: Added to every height [mm].

    Raises:
        ValueError: The array is not of two axes, too small, or not finite.
    """
    heights = checked_heights(heights_mm)
    grid = HeightGrid(smoothed(heights, smoothing_mm / mm_per_pixel), mm_per_pixel, centre_mm)
    return HeightField(grid.height, grid.gradient, base_mm)
