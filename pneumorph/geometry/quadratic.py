"""Quadratic tetrahedra from linear ones: a node in the middle of every edge."""

from __future__ import annotations

import numpy as np

from pneumorph.geometry.mesh import TETRAHEDRON_EDGES, Mesh, MeshError, edge_keys


def quadratic_mesh(mesh: Mesh) -> Mesh:
    """The same mesh with 10-node tetrahedra of straight edges.

    Midside nodes are numbered after the corners. One joins a node set when both ends of its edge
    and the whole edge belong to it, that is when both ends do.

    Args:
        mesh: A linear mesh.

    Raises:
        MeshError: The mesh is quadratic already.
    """
    if mesh.edge_nodes is not None:
        raise MeshError("the mesh has midside nodes already")
    count = len(mesh.nodes)
    keys, number = np.unique(
        edge_keys(mesh.tetrahedra, TETRAHEDRON_EDGES, count), return_inverse=True
    )
    ends = np.stack(np.divmod(keys, count), axis=1)
    member = {name: np.isin(np.arange(count), nodes) for name, nodes in mesh.node_sets.items()}
    mirror = mesh.mirror_nodes
    if mirror is not None:
        image = np.sort(mirror[ends].astype(np.int64), axis=1)
        across = np.searchsorted(keys, image[:, 0] * count + image[:, 1])
        mirror = np.concatenate([mirror, count + across])
    return Mesh(
        nodes=np.concatenate([mesh.nodes, mesh.nodes[ends].mean(axis=1)]),
        tetrahedra=mesh.tetrahedra,
        surfaces=mesh.surfaces,
        node_sets={
            name: np.concatenate([nodes, count + np.flatnonzero(member[name][ends].all(axis=1))])
            for name, nodes in mesh.node_sets.items()
        },
        contact_points=mesh.contact_points,
        mirror_nodes=mirror,
        edge_nodes=count + number.reshape(len(mesh.tetrahedra), 6),
    )
