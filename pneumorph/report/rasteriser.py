"""Draw triangles into an image with a depth buffer: no display, no graphics driver, numpy alone.

Triangles of a leg's skin cover a few pixels each, so they are drawn in groups of equal window size:
every pixel of every window of a group is tested at once.
"""

from __future__ import annotations

import numpy as np

NOTHING = np.iinfo(np.int64).max
_DEPTH_STEPS = 2**30
_WINDOW_PIXELS = 2_000_000


class DepthBuffer:
    """The nearest triangle of every pixel.

    Args:
        width: Pixels across.
        height: Pixels down.
        near: Depth nearer than anything drawn.
        far: Depth farther than anything drawn.
    """

    def __init__(self, width: int, height: int, near: float, far: float) -> None:
        self.width, self.height = width, height
        self._near = near
        self._scale = _DEPTH_STEPS / (far - near)
        # Depth in the high half of one integer and the triangle in the low half: the minimum of
        # such keys is the nearest triangle, found without a sort.
        self._keys = np.full(width * height, NOTHING, dtype=np.int64)

    def clear(self) -> None:
        """Forget everything drawn."""
        self._keys.fill(NOTHING)

    def draw(self, corners: np.ndarray, first_index: int = 0) -> None:
        """Draw triangles.

        Args:
            corners: (triangle, 3, 3): pixel x, pixel y (down) and depth (away) of each corner.
            first_index: Number of the first triangle, as `triangle_index` shall return it.
        """
        corners = np.asarray(corners, dtype=np.float32)
        low = np.floor(corners[:, :, :2].min(axis=1)).astype(np.int64)
        high = np.floor(corners[:, :, :2].max(axis=1)).astype(np.int64)
        on_screen = (high >= 0).all(axis=1) & (low[:, 0] < self.width) & (low[:, 1] < self.height)
        extent = (high - low).max(axis=1) + 1
        # Few sizes mean few passes: even ones where most triangles are, then powers of two.
        power = 1 << np.ceil(np.log2(extent)).astype(np.int64)
        window = np.where(extent <= 16, extent + extent % 2, power)
        for size in np.unique(window[on_screen]):
            members = np.flatnonzero(on_screen & (window == size))
            chunk = max(1, _WINDOW_PIXELS // int(size) ** 2)
            for start in range(0, len(members), chunk):
                part = members[start : start + chunk]
                self._draw_windows(corners[part], low[part], int(size), first_index + part)

    def _draw_windows(
        self, corners: np.ndarray, low: np.ndarray, size: int, index: np.ndarray
    ) -> None:
        """Draw triangles that fit in square windows whose upper left pixel is ``low``."""
        offset = np.arange(size)
        column = low[:, 0, None, None] + offset[None, None, :]
        row = low[:, 1, None, None] + offset[None, :, None]
        x = (column + 0.5).astype(np.float32)
        y = (row + 0.5).astype(np.float32)
        a = corners[:, 0, :2, None, None]
        # Edges from corner a, and from a to every pixel's centre.
        b_x, b_y = np.moveaxis(corners[:, 1, :2, None, None] - a, 1, 0)
        c_x, c_y = np.moveaxis(corners[:, 2, :2, None, None] - a, 1, 0)
        p_x, p_y = x - a[:, 0], y - a[:, 1]
        area = b_x * c_y - b_y * c_x
        inverse = 1.0 / np.where(np.abs(area) < 1e-6, np.inf, area)
        # Barycentric weights of b and c: signed areas over the whole area.
        weight_b = (p_x * c_y - p_y * c_x) * inverse
        weight_c = (b_x * p_y - b_y * p_x) * inverse
        inside = (weight_b >= 0) & (weight_c >= 0) & (weight_b + weight_c <= 1) & (inverse != 0)
        inside &= (column >= 0) & (column < self.width) & (row >= 0) & (row < self.height)
        which, down, across = np.nonzero(inside)
        depth = (
            corners[which, 0, 2]
            + weight_b[inside] * (corners[which, 1, 2] - corners[which, 0, 2])
            + weight_c[inside] * (corners[which, 2, 2] - corners[which, 0, 2])
        )
        steps = np.clip((depth - self._near) * self._scale, 0, _DEPTH_STEPS).astype(np.int64)
        pixel = (low[which, 1] + down) * self.width + low[which, 0] + across
        np.minimum.at(self._keys, pixel, (steps << 32) | index[which])

    def nearest(self) -> tuple[np.ndarray, np.ndarray]:
        """Return what was drawn where.

        Returns:
            pixel: Numbers of the covered pixels, row * width + column, ascending, (covered,).
            triangle: The nearest triangle of each, (covered,).
        """
        pixel = np.flatnonzero(self._keys != NOTHING)
        return pixel, self._keys[pixel] & 0xFFFFFFFF
