"""How deep parts reach into each other."""

from __future__ import annotations

import numpy as np

from pneumorph.geometry.contact_surfaces import distance_to
from pneumorph.geometry.surface import winding_number


def deepest_inside(points: np.ndarray, nodes: np.ndarray, skin: np.ndarray) -> float:
    """How deep the deepest of some points is inside a closed surface [mm]; 0 where none is.

    Args:
        points: The points [mm], (point, 3).
        nodes: Positions [mm], (node, 3).
        skin: Node indices, normals out of what it encloses, (triangle, 3).
    """
    within = points[winding_number(points, nodes, skin) > 0.5]
    return max((distance_to(point, nodes[skin]) for point in within), default=0.0)
