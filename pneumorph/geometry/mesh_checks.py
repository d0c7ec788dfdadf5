"""Refuse a mesh that cannot be computed with, and say why."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from pneumorph.geometry.mesh import Mesh, MeshError
from pneumorph.geometry.region_names import cavity_regions
from pneumorph.geometry.surface import (
    TETRAHEDRON_FACES,
    connected_pieces,
    enclosed_volume,
    winding_number,
)

DEGENERATE_SHAPE = 1e-4
"""Least volume of a tetrahedron relative to that of a regular one with its longest edge."""


def check_mesh(
    mesh: Mesh,
    surfaces: Iterable[str] = (),
    node_sets: Iterable[str] = (),
    cavities: Iterable[str] = (),
) -> None:
    """Check everything a finite-element model relies on.

    Args:
        mesh: The mesh.
        surfaces: Surface regions that must be there; cavities of other names, such as
            ``cavity_left``, stand for ``cavity``.
        node_sets: Node sets that must be there.
        cavities: Regions that must be closed with their normals into the solid and hold no contact
            point, besides all whose names begin with ``cavity``.

    Raises:
        MeshError: The mesh is empty; an element is inverted or degenerate; a face belongs to three
            elements; nodes are unused; the solid falls apart; a region is unknown or empty; a
            surface has a triangle twice, or one that was asked for, or the sheet, has one that is
            no element's face; a cavity is open, inside out or filled with elements, shares a
            triangle with another or holds a contact point; a node's mirror image is elsewhere.
    """
    surfaces = list(surfaces)
    if not len(mesh.tetrahedra):
        raise MeshError("the mesh has no tetrahedra; was only its surface meshed or exported?")
    for name in surfaces:
        if name == "cavity" and cavity_regions(mesh):
            continue  # each is checked below
        if not len(mesh.surface(name)):
            raise MeshError(f"surface region {name!r} is empty")
    for name in node_sets:
        if not len(mesh.node_set(name)):
            raise MeshError(f"node set {name!r} is empty")
    check_elements(mesh)
    _check_connection(mesh)
    _check_once(mesh)
    regions = list(dict.fromkeys([*cavities, *cavity_regions(mesh)]))
    for region in regions:
        check_cavity(mesh, region)
    _check_apart(mesh, regions)
    for name in dict.fromkeys([*surfaces, "sheet"]):
        if name in mesh.surfaces and name not in regions:
            _check_faces(mesh, name)
    if mesh.mirror_nodes is not None:
        _check_mirror(mesh)


def check_cavity(mesh: Mesh, region: str = "cavity") -> None:
    """Check that a surface is closed, lies on the solid's boundary and points into the solid.

    Raises:
        MeshError: It is not so, or there are elements on both sides of it.
    """
    triangles = mesh.surface(region)
    if not len(triangles):
        raise MeshError(f"surface region {region!r} is empty")
    boundary, inner = _face_keys(mesh)
    size = len(mesh.nodes)
    filled = int(np.isin(_keys(triangles, size), inner).sum())
    if filled:
        raise MeshError(
            f"{filled} of {len(triangles)} triangles of surface {region!r} lie between two "
            "elements, expected elements on one side alone: the cavity is filled with elements; "
            "delete its volume before meshing"
        )
    edges = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    forward = edges[:, 0].astype(np.int64) * size + edges[:, 1]
    backward = edges[:, 1].astype(np.int64) * size + edges[:, 0]
    open_edges = np.setdiff1d(forward, backward)
    if len(open_edges):
        node = mesh.nodes[open_edges[0] // size]
        raise MeshError(
            f"surface {region!r} is not closed: {len(open_edges)} edges belong to one triangle or "
            f"to two of opposite orientation, one of them at {np.round(node, 3).tolist()} mm"
        )
    inward = int(np.isin(_keys(triangles[:, ::-1], size), boundary).sum())
    if inward < len(triangles):
        outward = int(np.isin(_keys(triangles, size), boundary).sum())
        if outward + inward < len(triangles):
            raise MeshError(
                f"{len(triangles) - outward - inward} triangles of surface {region!r} are no faces "
                "of the solid; was the surface meshed apart from it?"
            )
        raise MeshError(
            f"surface {region!r} is wrongly oriented: {outward} of {len(triangles)} normals point "
            "out of the solid, all must point into it"
        )
    volume = enclosed_volume(mesh.nodes, triangles)
    if volume <= 0.0:
        raise MeshError(
            f"surface {region!r} holds {volume:.6g} mm^3: it is the outside of the solid, not a "
            "cavity, or it crosses itself"
        )


def _check_once(mesh: Mesh) -> None:
    """Check that no surface has a triangle twice, whichever way it looks."""
    for name, triangles in mesh.surfaces.items():
        _, first, count = np.unique(
            _keys(np.sort(triangles, axis=1), len(mesh.nodes)),
            return_index=True,
            return_counts=True,
        )
        if np.any(count > 1):
            corners = mesh.nodes[triangles[first[count > 1].min()]]
            raise MeshError(
                f"{np.sum(count > 1)} of {len(count)} triangles of surface {name!r} occur more "
                f"than once, one of them at {np.round(corners.mean(axis=0), 3).tolist()} mm, "
                "expected each once: what acts on them would act twice; were overlapping groups "
                "joined? `pneumorph mesh --file` drops those of a file"
            )


def _check_faces(mesh: Mesh, region: str) -> None:
    """Check that a surface's triangles are faces of elements, on the boundary or inside."""
    triangles = mesh.surface(region)
    faces = np.concatenate(_face_keys(mesh))
    there = [
        np.isin(_keys(each, len(mesh.nodes)), faces) for each in (triangles, triangles[:, ::-1])
    ]
    strange = int((~there[0] & ~there[1]).sum())
    if strange:
        raise MeshError(
            f"{strange} of {len(triangles)} triangles of surface {region!r} are no faces of the "
            "solid's elements; was the surface meshed apart from it?"
        )


def _check_apart(mesh: Mesh, regions: list[str]) -> None:
    """Check that no two cavities share a triangle, and that no contact point lies in one."""
    owner: dict[int, str] = {}
    for region in regions:
        for key in _keys(mesh.surface(region), len(mesh.nodes)).tolist():
            if owner.setdefault(key, region) != region:
                raise MeshError(f"surfaces {owner[key]!r} and {region!r} share a triangle")
    for region in regions:
        triangles = mesh.surface(region)
        corners = mesh.nodes[np.unique(triangles)]
        low, high = corners.min(axis=0), corners.max(axis=0)
        near = np.all((mesh.contact_points >= low) & (mesh.contact_points <= high), axis=1)
        points = mesh.contact_points[near]
        # One half on the surface itself, but for rounding.
        inside = winding_number(points, mesh.nodes, triangles) > 0.25
        inside |= (points[:, None] == corners).all(axis=2).any(axis=1)
        if inside.any():
            raise MeshError(
                f"{inside.sum()} contact points lie in or on {region!r}, the first at "
                f"{np.round(points[inside][0], 3).tolist()} mm: what touches the floor is outside; "
                "does the region 'skin' hold the cavity as well?"
            )


def _keys(triangles: np.ndarray, node_count: int) -> np.ndarray:
    """One number for each oriented triangle, whichever corner comes first."""
    turn = (np.argmin(triangles, axis=1)[:, None] + np.arange(3)) % 3
    turned = np.take_along_axis(triangles, turn, axis=1).astype(np.int64)
    keys: np.ndarray = (turned[:, 0] * node_count + turned[:, 1]) * node_count + turned[:, 2]
    return keys


def _face_keys(mesh: Mesh) -> tuple[np.ndarray, np.ndarray]:
    """Numbers of the elements' faces, looking out of them: of those on the solid's boundary, and
    of those between two elements, each of which is there both ways."""
    faces, size = mesh.tetrahedra[:, TETRAHEDRON_FACES].reshape(-1, 3), len(mesh.nodes)
    keys = _keys(faces, size)
    between = np.isin(_keys(faces[:, ::-1], size), keys)
    return keys[~between], keys[between]


def check_elements(mesh: Mesh) -> None:
    """Check what the volume of a solid relies on.

    Raises:
        MeshError: A tetrahedron is degenerate, inverted or doubled.
    """
    corners = mesh.nodes[mesh.tetrahedra]
    pairs = [(0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)]
    longest = np.max(
        [np.linalg.norm(corners[:, a] - corners[:, b], axis=1) for a, b in pairs], axis=0
    )
    shape = mesh.volumes / np.maximum(longest**3 / (6.0 * np.sqrt(2.0)), 1e-300)
    degenerate = np.flatnonzero(np.abs(shape) < DEGENERATE_SHAPE)
    if len(degenerate):
        raise MeshError(
            f"{len(degenerate)} tetrahedra are degenerate (flat), the first is {degenerate[0]}"
        )
    inverted = np.flatnonzero(shape < 0.0)
    if len(inverted):
        advice = (
            "; all are: swap two nodes of every element"
            if len(inverted) == len(mesh.tetrahedra)
            else ""
        )
        raise MeshError(
            f"{len(inverted)} of {len(mesh.tetrahedra)} tetrahedra are inverted (negative volume), "
            f"the first is {inverted[0]}{advice}"
        )
    faces = np.sort(mesh.tetrahedra[:, TETRAHEDRON_FACES].reshape(-1, 3), axis=1)
    _, count = np.unique(_keys(faces, len(mesh.nodes)), return_counts=True)
    if count.max() > 2:
        raise MeshError(
            f"{np.sum(count > 2)} faces belong to more than two tetrahedra; elements are doubled"
        )


def _check_connection(mesh: Mesh) -> None:
    count = len(mesh.nodes)
    used = np.zeros(count, dtype=bool)
    used[mesh.connectivity] = True
    if not used.all():
        raise MeshError(
            f"{np.sum(~used)} nodes belong to no tetrahedron, the first is {np.argmin(used)}; they "
            "would have mass but no stiffness"
        )
    nodes_of_piece = np.bincount(connected_pieces(mesh.connectivity, count))
    if len(nodes_of_piece) > 1:
        smallest = nodes_of_piece.min()
        raise MeshError(
            f"the mesh falls into {len(nodes_of_piece)} disconnected pieces, the smallest of "
            f"{smallest} nodes; do touching solids share their nodes?"
        )


def _check_mirror(mesh: Mesh) -> None:
    assert mesh.mirror_nodes is not None
    image = mesh.nodes[mesh.mirror_nodes] * [1.0, -1.0, 1.0]
    distance = np.abs(image - mesh.nodes).max()
    if distance > 0.0:
        raise MeshError(
            f"mirror_nodes do not mirror the mesh exactly in y: a node is {distance:.3g} mm from "
            "the image of its partner"
        )
