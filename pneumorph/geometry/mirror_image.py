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
    """What to say of a mesh that has no images of its nodes; nothing of others.

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
    return (
        "its left and right are meshed apart: mirror images of a design walk alike only as far as "
        "the mesh has it; mesh its half y >= 0 and add the mirror image to have them exactly alike",
    )


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
