"""The volume of a cavity and its derivatives; pressure does work on it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pneumorph.geometry.surface import enclosed_volume


@dataclass(frozen=True, eq=False)
class Cavity:
    """A closed surface; V = 1/6 sum_t x_0 . (x_1 x x_2).

    A pressure p loads the nodes with p dV/dx, the follower load on the deformed surface.
    """

    triangles: np.ndarray
    """Node indices, normals out of the cavity, (triangle, 3)."""

    def volume(self, x: np.ndarray) -> float:
        """V [mm^3] at node positions x [mm], (node, 3)."""
        return enclosed_volume(x, self.triangles)

    def gradient(self, x: np.ndarray) -> np.ndarray:
        """dV/dx [mm^2], (node, 3): a sixth of x_1 x x_2 for corner 0, and so on round."""
        corners = [np.ascontiguousarray(x[self.triangles[:, corner]]) for corner in range(3)]
        gradient = np.empty((3, len(x)))
        contributions = [
            np.cross(corners[(corner + 1) % 3], corners[(corner + 2) % 3]) / 6.0
            for corner in range(3)
        ]
        values = np.concatenate(contributions)
        indices = self.triangles.T.ravel()
        for axis in range(3):
            gradient[axis] = np.bincount(indices, values[:, axis], minlength=len(x))
        return gradient.T

    def hessian_blocks(self, x: np.ndarray) -> np.ndarray:
        """d2V/dx2 of every triangle [mm], (triangle, 9, 9); the diagonal blocks vanish."""
        blocks = np.zeros((len(self.triangles), 3, 3, 3, 3))
        for first in range(3):
            second, third = (first + 1) % 3, (first + 2) % 3
            # dV/dx_a = x_b x x_c / 6, so d2V/dx_a dx_b = -[x_c] / 6.
            block = -_skew(x[self.triangles[:, third]]) / 6.0
            blocks[:, first, :, second, :] = block
            blocks[:, second, :, first, :] = np.swapaxes(block, 1, 2)
        return blocks.reshape(-1, 9, 9)


def _skew(vectors: np.ndarray) -> np.ndarray:
    """[v] with [v] w = v x w, (n, 3, 3)."""
    skew = np.zeros((len(vectors), 3, 3))
    skew[:, 0, 1], skew[:, 0, 2], skew[:, 1, 2] = -vectors[:, 2], vectors[:, 1], -vectors[:, 0]
    skew[:, 1, 0], skew[:, 2, 0], skew[:, 2, 1] = vectors[:, 2], -vectors[:, 1], vectors[:, 0]
    return skew
