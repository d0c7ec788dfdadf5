"""Heights on a grid, bicubic between its nodes."""

from __future__ import annotations

from functools import cached_property

import numpy as np
from jaxtyping import Float

TILE_MM = 20.0
"""About the side of the tiles whose highest points are known [mm]."""


class HeightGrid:
    """Heights over a base, joined by bicubic splines (twice differentiable).

    Beyond its edges the surface goes on level, at the height of the nearest edge.

    Args:
        heights_mm: Heights seen from above [mm], (row, column), at least 4 x 4: columns go along x,
            rows from +y to -y.
        spacing_mm: Distance between neighbours [mm].
        centre_mm: Where the middle of the array lies, x and y [mm].

    Raises:
        ValueError: The array is not of two axes, too small, or not finite.
    """

    def __init__(
        self,
        heights_mm: np.ndarray,
        spacing_mm: float,
        centre_mm: tuple[float, float] = (0.0, 0.0),
    ) -> None:
        from scipy.interpolate import RectBivariateSpline

        heights = checked_heights(heights_mm)
        row_count, column_count = heights.shape
        self.spacing_mm = spacing_mm
        self.x_mm = nodes_along(column_count, spacing_mm) + centre_mm[0]
        """Where the nodes are along x [mm], (x node,)."""
        self.y_mm = nodes_along(row_count, spacing_mm) + centre_mm[1]
        """Where the nodes are along y [mm], (y node,)."""
        self._spline = RectBivariateSpline(self.x_mm, self.y_mm, heights[::-1].T)

    def height(self, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        """Heights at places [mm], in the shape of x and y."""
        values: np.ndarray = self._spline.ev(*self._inside(x, y))
        return values

    def gradient(self, x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Slopes dz/dx and dz/dy at places, each in the shape of x and y."""
        inner_x, inner_y = self._inside(x, y)
        return (
            np.where(inner_x == x, self._spline.ev(inner_x, inner_y, dx=1), 0.0),
            np.where(inner_y == y, self._spline.ev(inner_x, inner_y, dy=1), 0.0),
        )

    def covers(self, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        """Which places lie within its edges, in the shape of x and y."""
        inner_x, inner_y = self._inside(x, y)
        within: np.ndarray = (inner_x == x) & (inner_y == y)
        return within

    @cached_property
    def nodes(self) -> Float[np.ndarray, "x_node y_node 4"]:
        """H, d H_x, d H_y and d^2 H_xy at each node, d being the spacing [mm]: a bicubic polynomial
        is what these are at the corners of its cell (Hermite)."""
        d, x, y = self.spacing_mm, self.x_mm, self.y_mm
        orders = ((0, 0), (1, 0), (0, 1), (1, 1))
        terms = [d ** (i + j) * self._spline(x, y, dx=i, dy=j) for i, j in orders]
        return np.ascontiguousarray(np.stack(terms, axis=2))

    @cached_property
    def steepest(self) -> float:
        """No slope of the surface is above this."""
        net = self._control_net
        along_x, along_y = (3.0 * np.abs(np.diff(net, axis=axis)).max() for axis in (2, 3))
        return float(np.hypot(along_x, along_y) / self.spacing_mm)

    @property
    def tile_cells(self) -> int:
        """Cells along the side of a tile."""
        return max(1, round(TILE_MM / self.spacing_mm))

    @cached_property
    def ceilings(self) -> Float[np.ndarray, "x_tile y_tile"]:
        """Heights that the surface of each tile does not pass [mm]."""
        tops = self._control_net.max(axis=(2, 3))
        for axis in (0, 1):
            starts = np.arange(0, tops.shape[axis], self.tile_cells)
            tops = np.maximum.reduceat(tops, starts, axis=axis)
        return np.ascontiguousarray(tops)

    @property
    def _control_net(self) -> Float[np.ndarray, "x_cell y_cell 4 4"]:
        """Bezier's control points of each cell: the surface lies between the least and the largest,
        and so does its slope for those of their differences."""
        found = np.zeros((len(self.x_mm) - 1, len(self.y_mm) - 1, 4, 4))
        for i, j in np.ndindex(2, 2):
            stop = (len(self.x_mm) - 1 + i, len(self.y_mm) - 1 + j)
            height, by_x, by_y, by_both = np.moveaxis(self.nodes[i : stop[0], j : stop[1]], 2, 0)
            inward_x, inward_y = (1 - 2 * i) / 3.0, (1 - 2 * j) / 3.0
            near_x, near_y = (0, 3)[i], (0, 3)[j]
            next_x, next_y = (1, 2)[i], (1, 2)[j]
            found[:, :, near_x, near_y] = height
            found[:, :, next_x, near_y] = height + inward_x * by_x
            found[:, :, near_x, next_y] = height + inward_y * by_y
            both = inward_x * by_x + inward_y * by_y + inward_x * inward_y * by_both
            found[:, :, next_x, next_y] = height + both
        return found

    def _inside(self, x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        ends_x, ends_y = self.x_mm[[0, -1]], self.y_mm[[0, -1]]
        return np.clip(x, *ends_x), np.clip(y, *ends_y)


def nodes_along(count: int, spacing_mm: float) -> Float[np.ndarray, " node"]:
    """Where a row of nodes is whose middle is 0 [mm]."""
    along: np.ndarray = spacing_mm * (np.arange(count) - (count - 1) / 2.0)
    return along


def checked_heights(heights_mm: np.ndarray) -> Float[np.ndarray, "row column"]:
    """Heights [mm] as numbers.

    Raises:
        ValueError: The array is not of two axes, too small, or not finite.
    """
    heights = np.array(heights_mm, dtype=float)
    if heights.ndim != 2 or min(heights.shape) < 4:
        raise ValueError(
            f"heights_mm must have two axes, (row, column), of at least 4 each, which a bicubic "
            f"spline needs, got the shape {heights.shape}"
        )
    holes = np.argwhere(~np.isfinite(heights))
    if len(holes):
        row, column = holes[0]
        raise ValueError(
            f"heights_mm must be finite, got {heights[row, column]} in row {row}, column {column} "
            f"({len(holes)} of {heights.size} are not): holes must be filled"
        )
    return heights
