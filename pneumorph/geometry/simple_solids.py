"""Meshes of boxes and truncated cones, made layer by layer from a plane mesh without a mesher."""

from __future__ import annotations

import numpy as np

from pneumorph.geometry.mesh import Mesh
from pneumorph.geometry.mesh_checks import check_mesh
from pneumorph.geometry.surface import boundary_triangles

ROUND_SEGMENTS = 48
"""Corners of the polygon that stands for a circle; it has the circle's area."""
_EDGE_SIZE_MM = 15.0
"""About the length of an edge: as fine as a drawing and a soft hub need."""


def box_solid(length_mm: float, width_mm: float, height_mm: float, bottom_mm: float) -> Mesh:
    """A box about the z axis.

    Args:
        length_mm: Its size along x [mm].
        width_mm: Along y [mm].
        height_mm: Along z [mm].
        bottom_mm: Height of its lower face [mm].

    Returns:
        Surface ``skin``; node sets ``top`` and ``bottom``.

    Raises:
        ValueError: A size is not positive.
    """
    _check(length_mm=length_mm, width_mm=width_mm, height_mm=height_mm)
    x, y = (
        np.linspace(-0.5 * size, 0.5 * size, _pieces(size) + 1) for size in (length_mm, width_mm)
    )
    points = np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1).reshape(-1, 2)
    row = len(y)
    first = (np.arange(len(x) - 1)[:, None] * row + np.arange(row - 1)).ravel()
    triangles = np.concatenate(
        [
            np.stack([first, first + row, first + row + 1], axis=1),
            np.stack([first, first + row + 1, first + 1], axis=1),
        ]
    )
    return _layered(points, triangles, height_mm, bottom_mm, 1.0)


def cone_solid(
    bottom_radius_mm: float, top_radius_mm: float, height_mm: float, bottom_mm: float
) -> Mesh:
    """A truncated cone about the z axis; with equal radii a disk.

    Args:
        bottom_radius_mm: Radius of the lower face [mm].
        top_radius_mm: Radius of the upper face [mm].
        height_mm: Height [mm].
        bottom_mm: Height of its lower face [mm].

    Returns:
        Surface ``skin``; node sets ``top`` and ``bottom``. Each cross-section is a polygon of the
        circle's area.

    Raises:
        ValueError: A size is not positive.
    """
    _check(bottom_radius_mm=bottom_radius_mm, top_radius_mm=top_radius_mm, height_mm=height_mm)
    ring = np.arange(ROUND_SEGMENTS)
    angle = 2.0 * np.pi * ring / ROUND_SEGMENTS
    corner = 2.0 * np.pi / ROUND_SEGMENTS
    radius = bottom_radius_mm * np.sqrt(corner / np.sin(corner))
    rings = np.linspace(0.0, 1.0, _pieces(bottom_radius_mm) + 1)[1:]
    circle = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    points = np.concatenate([np.zeros((1, 2)), *(radius * share * circle for share in rings)])
    after = (ring + 1) % ROUND_SEGMENTS
    triangles = [np.stack([np.zeros_like(ring), 1 + ring, 1 + after], axis=1)]
    for number in range(len(rings) - 1):
        low, high = 1 + number * ROUND_SEGMENTS, 1 + (number + 1) * ROUND_SEGMENTS
        triangles += [
            np.stack([low + ring, high + ring, high + after], axis=1),
            np.stack([low + ring, high + after, low + after], axis=1),
        ]
    return _layered(
        points, np.concatenate(triangles), height_mm, bottom_mm, top_radius_mm / bottom_radius_mm
    )


def _layered(
    points: np.ndarray, triangles: np.ndarray, height_mm: float, bottom_mm: float, widening: float
) -> Mesh:
    """Stack a plane mesh of counter-clockwise triangles, each prism cut into three tetrahedra.

    A prism's corners are taken in the order of their plane nodes, so neighbours cut their common
    side alike.
    """
    count, layers = len(points), _pieces(height_mm)
    share = np.linspace(0.0, 1.0, layers + 1)
    nodes = np.concatenate(
        [
            np.column_stack(
                [(1.0 + (widening - 1.0) * t) * points, np.full(count, bottom_mm + t * height_mm)]
            )
            for t in share
        ]
    )
    a, b, c = np.sort(triangles, axis=1).T
    tetrahedra = np.concatenate(
        [
            np.stack(corners, axis=1) + layer * count
            for layer in range(layers)
            for corners in (
                (a, b, c, c + count),
                (a, b, c + count, b + count),
                (a, b + count, c + count, a + count),
            )
        ]
    )
    edges = nodes[tetrahedra[:, 1:]] - nodes[tetrahedra[:, :1]]
    negative = np.linalg.det(edges) < 0.0
    tetrahedra[negative] = tetrahedra[negative][:, [0, 1, 3, 2]]
    mesh = Mesh(
        nodes=nodes,
        tetrahedra=tetrahedra,
        surfaces={"skin": boundary_triangles(tetrahedra)},
        node_sets={"bottom": np.arange(count), "top": layers * count + np.arange(count)},
    )
    check_mesh(mesh, ("skin",), ("top", "bottom"))
    return mesh


def _pieces(size_mm: float) -> int:
    return max(1, round(size_mm / _EDGE_SIZE_MM))


def _check(**sizes_mm: float) -> None:
    for name, value in sizes_mm.items():
        if not 0.0 < value < np.inf:
            raise ValueError(f"{name} must be positive and finite, got {value}")
