"""Make a mesh exactly symmetric: mesh one half, mirror it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True, eq=False)
class MirroredSolid:
    """A solid symmetric under y -> -y; element e + E/2 is the image of element e."""

    nodes: np.ndarray
    """Positions [mm], (node, 3)."""
    tetrahedra: np.ndarray
    """Node indices, (element, 4)."""
    mirror_nodes: np.ndarray
    """Image of each node, (node,)."""

    def mirrored(self, triangles: np.ndarray) -> np.ndarray:
        """Triangles of the first half followed by their images, (2 triangle, 3)."""
        return _with_images(triangles, self.mirror_nodes)


def mirror_half(
    nodes: np.ndarray, tetrahedra: np.ndarray, tolerance: float = 1e-6
) -> MirroredSolid:
    """Complete the half y >= 0 of a solid by its image.

    Nodes on the plane y = 0 are set to exactly 0 and shared. An image has the first two nodes
    of its original swapped: that restores its orientation, and a frame built on the first edge and
    the first face is then the exact image of the original's.

    Args:
        nodes: Positions of the half [mm], (node, 3).
        tetrahedra: Positive tetrahedra of the half, (element, 4).
        tolerance: Distance from the plane that counts as on it [mm].

    Raises:
        ValueError: A node lies on the other side of the plane.
    """
    if nodes[:, 1].min() < -tolerance:
        raise ValueError(
            f"nodes must lie at y >= 0, got y = {nodes[:, 1].min():.6g} mm; cut the solid at its "
            "plane of symmetry before meshing"
        )
    half = np.array(nodes, dtype=float)
    on_plane = half[:, 1] < tolerance
    half[on_plane, 1] = 0.0
    image = np.arange(len(half))
    image[~on_plane] = len(half) + np.arange(np.sum(~on_plane))
    both = np.concatenate([half, half[~on_plane] * [1.0, -1.0, 1.0]])
    mirror_nodes = np.concatenate([image, np.flatnonzero(~on_plane)]).astype(np.int32)
    return MirroredSolid(both, _with_images(tetrahedra, mirror_nodes), mirror_nodes)


def _with_images(cells: np.ndarray, mirror_nodes: np.ndarray) -> np.ndarray:
    swapped = cells[:, [1, 0, *range(2, cells.shape[1])]]
    both: np.ndarray = np.concatenate([cells, mirror_nodes[swapped]]).astype(np.int32)
    return both
