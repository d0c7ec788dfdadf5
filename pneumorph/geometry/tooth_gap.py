"""The gaps between neighbouring teeth of a PneuNet: do the teeth touch when it bends?"""

from __future__ import annotations

import numpy as np

from pneumorph.geometry.mesh import Mesh
from pneumorph.geometry.pneunet import PneuNetShape
from pneumorph.geometry.wall_gap import WallGap

_ON_WALL_MM = 1e-6
_ABOVE_BASE_MM = 0.1


def tooth_gaps(shape: PneuNetShape, mesh: Mesh) -> list[WallGap]:
    """The gaps between neighbouring teeth, from the inner end on.

    Args:
        shape: What the mesh is of.
        mesh: A mesh of the leg, at rest.

    Raises:
        ValueError: The mesh has no nodes on a wall: it is of another shape.
    """
    bottom = shape.base_plate_mm[2] + shape.tooth_base_mm[2]
    teeth, x = mesh.nodes[:, 2] > bottom + _ABOVE_BASE_MM, mesh.nodes[:, 0]
    start = -shape.tooth_base_mm[0] / 2.0 + shape.end_tooth_length_mm
    thickness = shape.tooth_pitch_mm - shape.tooth_gap_mm
    gaps = []
    for number in range(shape.inner_tooth_count + 1):
        inner = start + number * shape.tooth_pitch_mm
        outer = inner + shape.tooth_gap_mm
        walls = tuple(
            np.flatnonzero(teeth & (np.abs(x - at) < _ON_WALL_MM)) for at in (inner, outer)
        )
        if min(map(len, walls)) == 0:
            raise ValueError(
                f"the mesh has no nodes on the walls of the gap at x = {inner:g} mm, expected a "
                "mesh of the shape that was given"
            )
        behind = (
            teeth & (x > inner - thickness - _ON_WALL_MM) & (x < inner + _ON_WALL_MM),
            teeth & (x > outer - _ON_WALL_MM) & (x < outer + thickness + _ON_WALL_MM),
        )
        sides = (np.flatnonzero(behind[0]), np.flatnonzero(behind[1]))
        gaps.append(WallGap.between(mesh, (walls[0], walls[1]), sides))
    return gaps


def least_tooth_gap_mm(shape: PneuNetShape, mesh: Mesh, positions: np.ndarray) -> float:
    """Least distance between facing walls of neighbouring teeth [mm], negative where they cross.

    Points of equal height and breadth at rest are compared along the mean of the walls' normals.

    Args:
        shape: What the mesh is of.
        mesh: A mesh of the leg, at rest.
        positions: Where its nodes are [mm], (node, 3).

    Raises:
        ValueError: As of `tooth_gaps`.
    """
    return min(gap.least_mm(positions) for gap in tooth_gaps(shape, mesh))
