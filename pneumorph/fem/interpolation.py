"""Points of a solid as weighted sums of its nodes."""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_array, csr_array

from pneumorph.fem.quadrature import shape_values
from pneumorph.geometry.mesh import Mesh


def interpolation_matrix(mesh: Mesh, points: np.ndarray) -> csr_array:
    """Shape functions of points in their nearest tetrahedra, (point, node).

    A point outside the solid is extrapolated from the tetrahedron it is least outside of. On a mesh
    with mirror symmetry, mirrored points get mirrored weights.

    Args:
        mesh: The solid.
        points: Positions at rest [mm], (point, 3).
    """
    points = np.asarray(points, dtype=float).reshape(-1, 3)
    mirrored = np.zeros(len(points), dtype=bool)
    elements = np.arange(len(mesh.tetrahedra))
    if mesh.mirror_nodes is not None:
        mirrored = points[:, 1] < 0.0
        points = np.where(mirrored[:, None], points * [1.0, -1.0, 1.0], points)
        elements = elements[mesh.nodes[mesh.tetrahedra][:, :, 1].max(axis=1) > 0.0]
    connectivity = mesh.connectivity[elements]
    corners = mesh.nodes[connectivity[:, :4]]
    inverse = np.linalg.inv(np.swapaxes(corners[:, 1:] - corners[:, :1], 1, 2))
    node_count = connectivity.shape[1]
    nodes = np.empty((len(points), node_count), dtype=int)
    weights = np.empty((len(points), node_count))
    for number, point in enumerate(points):
        inner = (inverse @ (point - corners[:, 0])[:, :, None])[:, :, 0]
        barycentric = np.concatenate([1.0 - inner.sum(axis=1, keepdims=True), inner], axis=1)
        nearest = int(np.argmax(barycentric.min(axis=1)))
        nodes[number] = connectivity[nearest]
        weights[number] = shape_values(barycentric[nearest][None], node_count)[0]
    if mesh.mirror_nodes is not None:
        nodes[mirrored] = mesh.mirror_nodes[nodes[mirrored]]
    weights[np.abs(weights) < 1e-12] = 0.0
    rows = np.repeat(np.arange(len(points)), node_count)
    matrix = coo_array(
        (weights.ravel(), (rows, nodes.ravel())), shape=(len(points), len(mesh.nodes))
    ).tocsr()
    matrix.eliminate_zeros()
    return matrix
