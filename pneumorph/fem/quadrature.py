"""Shape functions of tetrahedra and triangles at their integration points, by number of nodes.

Corners come first; midside nodes follow on the edges 01 12 20 (03 13 23). Rules and shape functions
as in Zienkiewicz, Taylor and Zhu, The Finite Element Method, chapter 6.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pneumorph.geometry.mesh import TETRAHEDRON_EDGES, TRIANGLE_EDGES


@dataclass(frozen=True, eq=False)
class Quadrature:
    """Integration over a reference element."""

    weights: np.ndarray
    """Share of the reference volume (1/6) or area (1/2), (point,)."""
    barycentric: np.ndarray
    """Barycentric coordinates of the points, (point, d + 1)."""
    gradients: np.ndarray
    """Derivatives of the shape functions by the last d barycentric coordinates, (point, k, d)."""


def shape_values(barycentric: np.ndarray, node_count: int) -> np.ndarray:
    """Shape functions at barycentric coordinates, (point, k).

    Args:
        barycentric: Coordinates, (point, d + 1).
        node_count: k: d + 1, or with midside nodes 6 (d = 2) and 10 (d = 3).
    """
    if node_count == barycentric.shape[1]:
        return barycentric
    edges = _edges(barycentric.shape[1])
    at_edges = [4.0 * barycentric[:, a] * barycentric[:, b] for a, b in edges]
    corners = barycentric * (2.0 * barycentric - 1.0)
    return np.column_stack([corners, *at_edges])


def quadrature(dimension: int, node_count: int) -> Quadrature:
    """One point for linear elements; four (d = 3) or three (d = 2) for quadratic ones.

    Exact for the strain energy of straight-sided linear elastic elements of either order.

    Args:
        dimension: d.
        node_count: k.

    Raises:
        ValueError: No element has so many nodes.
    """
    corners = dimension + 1
    if node_count == corners:
        points = np.full((1, corners), 1.0 / corners)
    elif node_count == corners + len(_edges(corners)):
        inner = 0.5854101966249685 if dimension == 3 else 2.0 / 3.0
        outer = (1.0 - inner) / dimension
        points = np.full((corners, corners), outer) + (inner - outer) * np.eye(corners)
    else:
        raise ValueError(
            f"an element of {dimension} dimensions must have {corners} or "
            f"{corners + len(_edges(corners))} nodes, got {node_count}"
        )
    return Quadrature(
        np.full(len(points), 1.0 / len(points)), points, shape_gradients(points, node_count)
    )


def shape_gradients(points: np.ndarray, node_count: int) -> np.ndarray:
    """Derivatives of the shape functions by the last d coordinates, (point, k, d).

    Args:
        points: Barycentric coordinates, (point, d + 1).
        node_count: k.
    """
    corners = points.shape[1]
    # Derivatives by the d + 1 barycentric coordinates, of which the first depends on the others.
    full = np.zeros((len(points), node_count, corners))
    if node_count == corners:
        full[:] = np.eye(corners)
    else:
        for corner in range(corners):
            full[:, corner, corner] = 4.0 * points[:, corner] - 1.0
        for number, (a, b) in enumerate(_edges(corners)):
            full[:, corners + number, a] = 4.0 * points[:, b]
            full[:, corners + number, b] = 4.0 * points[:, a]
    gradients: np.ndarray = full[:, :, 1:] - full[:, :, :1]
    return gradients


def _edges(corner_count: int) -> tuple[tuple[int, int], ...]:
    return TRIANGLE_EDGES if corner_count == 3 else TETRAHEDRON_EDGES
