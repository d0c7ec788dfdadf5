"""Linear tetrahedra of a solid."""

from __future__ import annotations

import numpy as np

from pneumorph.fem.element_group import ElementGroup
from pneumorph.fem.material import Material


def tetrahedron_group(
    nodes: np.ndarray, tetrahedra: np.ndarray, material: Material
) -> ElementGroup:
    """Corotational linear tetrahedra.

    Args:
        nodes: Rest positions [mm], (node, 3).
        tetrahedra: Node indices of positive tetrahedra, (element, 4).
        material: What the solid is made of.
    """
    edges = nodes[tetrahedra[:, 1:]] - nodes[tetrahedra[:, :1]]  # (element, 3, xyz)
    frame = material_frame(edges)
    local = edges @ frame
    return ElementGroup(
        kind="tetrahedron",
        connectivity=tetrahedra,
        material_gradients=shape_gradients(local),
        rest_frame=frame,
        measure=np.linalg.det(local) / 6.0,
        lame_lambda=np.full(len(tetrahedra), material.lame_lambda),
        lame_mu=np.full(len(tetrahedra), material.lame_mu),
    )


def material_frame(edges: np.ndarray) -> np.ndarray:
    """Axes of the material frame as columns, (element, 3, 3).

    Args:
        edges: Edges from node 0 to nodes 1, 2 (and 3) [mm], (element, 2 or 3, 3).
    """
    first = edges[:, 0] / np.linalg.norm(edges[:, 0], axis=1, keepdims=True)
    normal = np.cross(edges[:, 0], edges[:, 1])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    return np.stack([first, np.cross(normal, first), normal], axis=2)


def shape_gradients(local_edges: np.ndarray) -> np.ndarray:
    """Gradients of linear shape functions [1/mm], (element, d + 1, d).

    Args:
        local_edges: Edges from node 0 in the material frame [mm], (element, d, d).
    """
    others = np.swapaxes(np.linalg.inv(local_edges), 1, 2)
    return np.concatenate([-others.sum(axis=1, keepdims=True), others], axis=1)
