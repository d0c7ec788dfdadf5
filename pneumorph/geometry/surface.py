"""Triangulated surfaces: the boundary of a solid, and the volume a closed surface holds."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from pneumorph.base.artefact import write_atomically

TETRAHEDRON_FACES = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]])
"""Corners of a positive tetrahedron's faces, normals outward."""


def boundary_triangles(tetrahedra: np.ndarray) -> np.ndarray:
    """Faces that belong to one tetrahedron only, (triangle, 3), normals out of the solid.

    Args:
        tetrahedra: Node indices of positive tetrahedra, (element, 4).
    """
    faces = tetrahedra[:, TETRAHEDRON_FACES].reshape(-1, 3)
    _, first, count = np.unique(
        np.sort(faces, axis=1), axis=0, return_index=True, return_counts=True
    )
    boundary: np.ndarray = faces[np.sort(first[count == 1])]
    return boundary


def connected_pieces(cells: np.ndarray, node_count: int) -> np.ndarray:
    """Which connected piece each node is in, from 0; a node that no cell has is one by itself.

    Args:
        cells: Node indices of elements or triangles, (cell, corner).
        node_count: How many nodes there are.
    """
    first = np.repeat(cells[:, 0], cells.shape[1] - 1)
    links = (np.ones(len(first)), (first, cells[:, 1:].ravel()))
    graph = coo_array(links, shape=(node_count, node_count)).tocsr()
    label: np.ndarray = connected_components(graph, directed=False)[1]
    return label


def enclosed_volume(nodes: np.ndarray, triangles: np.ndarray) -> float:
    """Volume within a closed surface [mm^3], positive when its normals point out of it.

    The divergence theorem gives V = 1/6 sum_t x_0 . (x_1 x x_2).

    Args:
        nodes: Positions [mm], (node, 3).
        triangles: Node indices, (triangle, 3).
    """
    corners = nodes[triangles]
    normal = np.cross(corners[:, 1], corners[:, 2])
    return float(np.einsum("ti,ti->", corners[:, 0], normal) / 6.0)


def enclosed_centre(nodes: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Middle of the volume within a closed surface [mm], (3,), by the divergence theorem.

    Args:
        nodes: Positions [mm], (node, 3).
        triangles: Node indices, normals all outward or all inward, (triangle, 3); of more nodes the
            first three are the corners.
    """
    corners = nodes[triangles[:, :3]]
    volumes = np.linalg.det(corners) / 6.0  # of a tetrahedron with the origin
    centre: np.ndarray = volumes @ corners.sum(axis=1) / 4.0 / volumes.sum()
    return centre


def surface_area(nodes: np.ndarray, triangles: np.ndarray) -> float:
    """Area of triangles [mm^2].

    Args:
        nodes: Positions [mm], (node, 3).
        triangles: Node indices, (triangle, 3).
    """
    corners = nodes[triangles]
    crosses = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    return float(0.5 * np.linalg.norm(crosses, axis=1).sum())


def write_stl(path: Path, nodes: np.ndarray, triangles: np.ndarray) -> Path:
    """Write a surface as binary STL, which knows no units: millimetres.

    Args:
        path: The file.
        nodes: Positions [mm], (node, 3).
        triangles: Node indices, (triangle, 3).
    """
    corners = nodes[triangles]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    record = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
    facets = np.zeros(len(corners), dtype=record)
    facets["normal"], facets["corners"] = normals, corners
    head = b"pneumorph, millimetres".ljust(80) + np.uint32(len(facets)).tobytes()
    return write_atomically(path, lambda stream: stream.write(head + facets.tobytes()))


def winding_number(points: np.ndarray, nodes: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """How often a closed surface goes round points: 1 inside, 0 outside where its normals point out
    of it, (point,); sum of solid angles over 4 pi (van Oosterom and Strackee 1983).

    Args:
        points: The points [mm], (point, 3).
        nodes: Positions [mm], (node, 3).
        triangles: Node indices, (triangle, 3).
    """
    found = np.zeros(len(points))
    corners = nodes[triangles].transpose(1, 2, 0).copy()  # (corner, axis, triangle)
    low, high = corners.min(axis=(0, 2)), corners.max(axis=(0, 2))
    for number in np.flatnonzero(((points >= low) & (points <= high)).all(axis=1)):
        a, b, c = corners - points[number][:, None]
        la, lb, lc = (np.sqrt(np.einsum("it,it->t", each, each)) for each in (a, b, c))
        volume = np.einsum("it,it->t", a, np.cross(b, c, axis=0))
        cosines = la * lb * lc
        for first, second, length in ((a, b, lc), (b, c, la), (c, a, lb)):
            cosines += np.einsum("it,it->t", first, second) * length
        found[number] = 2.0 * np.arctan2(volume, cosines).sum() / (4.0 * np.pi)
    return found
