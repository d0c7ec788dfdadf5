"""Which elements and integration points are mirror images of each other, by the nodes that are."""

from __future__ import annotations

import numpy as np

from pneumorph.fem.element_group import ElementGroup
from pneumorph.fem.quadrature import quadrature
from pneumorph.fem.volume_group import VolumeGroup


def mirror_elements(group: VolumeGroup, mirror_nodes: np.ndarray) -> np.ndarray:
    """Mirror image of each element, (element,).

    Args:
        group: The elements.
        mirror_nodes: Mirror image of each node, (node,).

    Raises:
        ValueError: The mirror image of an element is not in the mesh.
    """
    corners = group.connectivity[:, :4]
    names = np.sort(corners, axis=1), np.sort(mirror_nodes[corners], axis=1)
    own, image = ([tuple(row) for row in each.tolist()] for each in names)
    number = {name: place for place, name in enumerate(own)}
    if not number.keys() >= set(image):
        raise ValueError(
            "mirror_nodes must map elements onto elements, but the image of one is not in the "
            "mesh; the mesh is not symmetric under y -> -y"
        )
    return np.array([number[name] for name in image])


def shared_columns(group: ElementGroup, mirror_nodes: np.ndarray) -> np.ndarray:
    """Number the mirror pairs of integration points: points with equal numbers share one weight.

    A point is known by its element's corners and its barycentric coordinates at each.

    Args:
        group: The points.
        mirror_nodes: Mirror image of each node, (node,).

    Raises:
        ValueError: The mirror image of an element is not in the mesh.
    """
    corners = group.connectivity[:, : group.dimension + 1]
    rule = quadrature(group.dimension, group.connectivity.shape[1])
    # The coordinates of the rules differ by far more than a thousandth.
    coordinates = np.round(1e3 * rule.barycentric).astype(int)
    coordinates = np.tile(coordinates, (len(corners) // len(coordinates), 1))
    own, image = (
        _point_names(corners, coordinates),
        _point_names(mirror_nodes[corners], coordinates),
    )
    position = {name: number for number, name in enumerate(own)}
    partner = np.array([position.get(name, -1) for name in image])
    if np.any(partner < 0):
        lonely = int(np.flatnonzero(partner < 0)[0]) // group.points_per_element
        raise ValueError(
            f"mirror_nodes must map elements onto elements, but the image of element {lonely} "
            "is not in the mesh; the mesh is not symmetric under y -> -y"
        )
    _, column = np.unique(np.minimum(partner, np.arange(len(partner))), return_inverse=True)
    return column


def _point_names(corners: np.ndarray, coordinates: np.ndarray) -> list[tuple[int, ...]]:
    # Corners in ascending order with the point's coordinates at each.
    order = np.argsort(corners, axis=1)
    sorted_corners = np.take_along_axis(corners, order, axis=1)
    sorted_coordinates = np.take_along_axis(coordinates, order, axis=1)
    return [tuple(row) for row in np.hstack([sorted_corners, sorted_coordinates]).tolist()]
