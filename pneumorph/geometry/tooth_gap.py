"""How far apart the walls of neighbouring teeth are: do the teeth of a bent PneuNet touch?"""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from pneumorph.geometry.mesh import Mesh
from pneumorph.geometry.pneunet import PneuNetShape

_ON_WALL_MM = 1e-6
_ABOVE_BASE_MM = 0.1


def least_tooth_gap_mm(shape: PneuNetShape, mesh: Mesh, positions: np.ndarray) -> float:
    """Least distance between facing walls of neighbouring teeth [mm], negative where they cross.

    Points of equal height and breadth at rest are compared along the mean of the walls' normals.

    Args:
        shape: What the mesh is of.
        mesh: A mesh of the leg, at rest.
        positions: Where its nodes are [mm], (node, 3).

    Raises:
        ValueError: The mesh has no nodes on a wall: it is of another shape.
    """
    bottom = shape.base_plate_mm[2] + shape.tooth_base_mm[2]
    teeth = mesh.nodes[:, 2] > bottom + _ABOVE_BASE_MM
    start = -shape.tooth_base_mm[0] / 2.0 + shape.end_tooth_length_mm
    least = np.inf
    for number in range(shape.inner_tooth_count + 1):
        at = start + number * shape.tooth_pitch_mm
        walls = [
            np.flatnonzero(teeth & (np.abs(mesh.nodes[:, 0] - x) < _ON_WALL_MM))
            for x in (at, at + shape.tooth_gap_mm)
        ]
        if min(map(len, walls)) == 0:
            raise ValueError(
                f"the mesh has no nodes on the walls of the gap at x = {at:g} mm, expected a mesh "
                "of the shape that was given"
            )
        across = [mesh.nodes[wall][:, 1:] for wall in walls]
        _, nearest = cKDTree(across[1]).query(across[0])
        apart = positions[walls[1]][nearest] - positions[walls[0]]
        normals = [_normal(positions[wall]) for wall in walls]
        normal = sum(each * np.sign(each @ apart.mean(axis=0)) for each in normals)
        normal /= np.linalg.norm(normal)
        least = min(least, float((apart @ normal).min()))
    return least


def _normal(points: np.ndarray) -> np.ndarray:
    """Normal of the plane nearest to points, of either sign, (3,)."""
    normal: np.ndarray = np.linalg.svd(points - points.mean(axis=0))[2][2]
    return normal
