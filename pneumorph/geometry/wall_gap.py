"""A gap of a part between two walls that face each other, by the nodes of its mesh."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from pneumorph.geometry.mesh import Mesh, MeshError


@dataclass(frozen=True, eq=False)
class WallGap:
    """Two walls that may meet.

    Attributes:
        first: Numbers of the nodes on one wall, (node,).
        facing: The node of the other wall that each of them faces, (node,).
        first_side: Nodes of what stands behind the first wall, (node,).
        second_side: Likewise behind the other.
    """

    first: np.ndarray
    facing: np.ndarray
    first_side: np.ndarray
    second_side: np.ndarray

    @classmethod
    def between(
        cls,
        mesh: Mesh,
        walls: tuple[np.ndarray, np.ndarray],
        sides: tuple[np.ndarray, np.ndarray],
        axis: int = 0,
    ) -> WallGap:
        """The gap between two flat walls of a mesh at rest, across one of its axes.

        Args:
            mesh: The mesh, at rest.
            walls: Nodes of each wall, (node,).
            sides: Nodes of what stands behind each, whose middles tell the direction.
            axis: The axis that the gap is measured along.

        Raises:
            MeshError: A wall or a side has no nodes.
        """
        if min(map(len, (*walls, *sides))) == 0:
            raise MeshError("a wall of a gap, or what stands behind it, has no nodes")
        along = [other for other in range(3) if other != axis]
        first, second = (mesh.nodes[wall][:, along] for wall in walls)
        _, nearest = cKDTree(second).query(first)
        return cls(walls[0], walls[1][nearest], *sides)

    def least_mm(self, positions: np.ndarray) -> float:
        """Least distance between the walls where the nodes are now [mm], negative where they cross.

        Points that face each other are compared along the mean of the walls' normals.

        Args:
            positions: Of the nodes [mm], (node, 3).
        """
        apart = positions[self.facing] - positions[self.first]
        # From side to side: walls that cross, or slide along each other, may be apart either way.
        axis = positions[self.second_side].mean(axis=0) - positions[self.first_side].mean(axis=0)
        normals = [_normal(positions[wall]) for wall in (self.first, self.facing)]
        normal = sum(each * np.sign(each @ axis) for each in normals)
        normal /= np.linalg.norm(normal)
        return float((apart @ normal).min())

    def areas(self, mesh: Mesh) -> np.ndarray:
        """Area of the first wall that each of its nodes stands for [mm^2], (node,)."""
        return mesh.node_areas(self.first)[self.first]


def _normal(points: np.ndarray) -> np.ndarray:
    """Normal of the plane nearest to points, of either sign, (3,)."""
    normal: np.ndarray = np.linalg.svd(points - points.mean(axis=0))[2][2]
    return normal
