"""Whether a mesh is its own mirror image, node by node and element by element."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.spatial import KDTree

from pneumorph.geometry.corner_order import largest_face_first
from pneumorph.geometry.mesh import Mesh
from pneumorph.geometry.region_names import NODE_SETS, cavity_regions

_FLIP = np.array([1.0, -1.0, 1.0])
_APART = 1e-6
"""Of the longest side: what files round lies below it, what is meshed apart far above."""
_OTHER_SHAPE = 1e-3
"""Least moment, over that of all the mass at the box about it, of a shape that is not its own
mirror image; round faces in coarse facets have less."""


def with_mirror_nodes(mesh: Mesh) -> Mesh:
    """The mesh with the image of each of its nodes under y -> -y, where it has them all; else as it
    is.

    Elements, skin, sheet and the nodes where a part is held and turns must be their own images;
    cavities may be each other's. Nodes are moved to be exact images where a file has them rounded.
    Where the corners of elements are not in the order of images (`with_mirrored_corners`), they are
    put into it; `largest_face_first` says which order one side has then.

    Args:
        mesh: A linear mesh.
    """
    image = _image_nodes(mesh, 0.0)
    if image is None:
        return mesh
    nodes = 0.5 * (mesh.nodes + mesh.nodes[image] * _FLIP)
    mesh = replace(mesh, nodes=nodes, mirror_nodes=image)
    mirrored = with_mirrored_corners(mesh)
    if np.array_equal(mirrored.tetrahedra, mesh.tetrahedra):
        return mirrored
    ordered = largest_face_first(nodes, mesh.tetrahedra)
    return with_mirrored_corners(replace(mirrored, tetrahedra=ordered))


def with_mirrored_corners(mesh: Mesh) -> Mesh:
    """The mesh with the corners of each element, of two that are images the later, in the order of
    its image's with the first two swapped, as `mirror_half` has them: an edge-based rotation
    follows that order. So with the triangles of surfaces that are their own image, but for skin and
    cavities, which have no rotation.

    Args:
        mesh: A linear mesh that has ``mirror_nodes``.
    """
    image = mesh.mirror_nodes
    assert image is not None
    unmoved = {"skin", *cavity_regions(mesh)}
    surfaces = {
        name: cells
        if name in unmoved or _names(cells) != _names(image[cells])
        else _mirrored_corners(cells, image)
        for name, cells in mesh.surfaces.items()
    }
    tetrahedra = _mirrored_corners(mesh.tetrahedra, image)
    return replace(mesh, tetrahedra=tetrahedra, surfaces=surfaces)


def _mirrored_corners(cells: np.ndarray, image: np.ndarray) -> np.ndarray:
    """The same cells, (cell, corner), each with its orientation where its image has it too."""
    number = {name: place for place, name in enumerate(map(tuple, np.sort(cells).tolist()))}
    partner = np.array([number[name] for name in map(tuple, np.sort(image[cells]).tolist())], int)
    own = np.arange(len(cells))
    ordered = cells.copy()
    # One across the plane has two corners in it: its others first, it is its own image.
    for cell in np.flatnonzero(partner == own):
        aside = np.flatnonzero(image[cells[cell]] != cells[cell])
        if len(aside):  # a triangle may lie in the plane
            ordered[cell] = _put_first(cells[cell], *aside)
    later = np.flatnonzero(partner < own)
    ordered[later] = image[cells[partner[later]][:, [1, 0, *range(2, cells.shape[1])]]]
    return ordered


def _put_first(cell: np.ndarray, first: int, second: int) -> np.ndarray:
    """A tetrahedron or triangle with two of its corners before the others, its orientation kept."""
    rest = [corner for corner in range(len(cell)) if corner not in (first, second)]
    order = [first, second, *rest]
    if np.linalg.det(np.eye(len(cell))[order]) < 0.0:
        order[:2] = second, first
    return cell[order]


def mirror_notes(mesh: Mesh) -> tuple[str, ...]:
    """What to say of a mesh that has no images of its nodes; nothing of others, and of a shape
    that is not its own mirror image however it is meshed.

    Args:
        mesh: Of a leg or a hub.
    """
    if mesh.mirror_nodes is not None:
        return ()
    middle_mm = 0.5 * float(mesh.nodes[:, 1].min() + mesh.nodes[:, 1].max())
    if _image_nodes(mesh, middle_mm) is not None:
        if abs(middle_mm) <= _APART * mesh.longest_side_mm:
            return (
                "its left and right are mirror images, which its file does not say, so they are "
                "not treated alike; save it again: pneumorph mesh --file of what it was read from",
            )
        return (
            f"its mirror plane is y = {middle_mm:.4g} mm, expected y = 0, where alone it is looked "
            "for: mirror images of a design walk alike only roughly; move the nodes before the "
            "file is written",
        )
    if not _may_be_own_image(mesh, middle_mm):
        return ()  # a mirror image added to its half would be another shape
    aside = abs(middle_mm) > _APART * mesh.longest_side_mm
    move = f"move its middle, y = {middle_mm:.4g} mm, to y = 0, " if aside else ""
    return (
        "its left and right are meshed apart: mirror images of a design walk alike only as far as "
        f"the mesh has it; {move}mesh its half y >= 0 and add the mirror image to have them "
        "exactly alike",
    )


def _may_be_own_image(mesh: Mesh, middle_mm: float) -> bool:
    """Whether what lies to the left of the plane y = `middle_mm` has the volume and the moments up
    to the third order of what lies to its right: all that are odd in y vanish."""
    low, high = mesh.nodes.min(axis=0), mesh.nodes.max(axis=0)
    middle = 0.5 * (low + high)
    middle[1] = middle_mm
    corners = ((mesh.nodes - middle) / (0.5 * (high - low)))[mesh.tetrahedra]
    # Points and weights of degree 3: the middle, and one towards each corner.
    points = np.concatenate([np.full((1, 4), 0.25), np.full((4, 4), 1.0 / 6.0) + np.eye(4) / 3.0])
    weights = np.outer(mesh.volumes, [-0.8, *[0.45] * 4]) / mesh.volumes.sum()
    x, y, z = np.einsum("pc,eci->iep", points, corners)
    odd = [y, x * y, y * z, y**3, x**2 * y, y * z**2, x * y * z]
    return max(abs(float((weights * each).sum())) for each in odd) < _OTHER_SHAPE


def _image_nodes(mesh: Mesh, middle_mm: float) -> np.ndarray | None:
    """Image of each node about the plane y = `middle_mm`, (node,); None where one has none, or
    where elements or regions have none."""
    mirrored = mesh.nodes * _FLIP + [0.0, 2.0 * middle_mm, 0.0]
    away_mm, image = KDTree(mesh.nodes).query(mirrored)
    if away_mm.max() > _APART * mesh.longest_side_mm:
        return None
    if not np.array_equal(image[image], np.arange(len(image))):
        return None
    own = [mesh.tetrahedra]
    own += [mesh.surfaces[name] for name in ("skin", "sheet") if name in mesh.surfaces]
    own += [mesh.node_sets[name][:, None] for name in NODE_SETS if name in mesh.node_sets]
    if any(_names(each) != _names(image[each]) for each in own):
        return None
    cavities = [mesh.surfaces[name] for name in cavity_regions(mesh)]
    known = [_names(each) for each in cavities]
    if any(_names(image[each]) not in known for each in cavities):
        return None
    return image


def _names(cells: np.ndarray) -> set[tuple[int, ...]]:
    """Cells by their nodes, whatever their order."""
    return set(map(tuple, np.sort(cells, axis=1).tolist()))
