"""Whether a mesh is its own mirror image, node by node and element by element."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.spatial import KDTree

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

    Args:
        mesh: A linear mesh.
    """
    image = _image_nodes(mesh, 0.0)
    if image is None:
        return mesh
    nodes = 0.5 * (mesh.nodes + mesh.nodes[image] * _FLIP)
    return replace(mesh, nodes=nodes, mirror_nodes=image)


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
