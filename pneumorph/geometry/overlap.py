"""How deep parts reach into each other."""

from __future__ import annotations

import numpy as np

from pneumorph.geometry.surface import winding_number
from pneumorph.geometry.triangle_distance import distance_to


def deepest_inside(
    points: np.ndarray, nodes: np.ndarray, skin: np.ndarray
) -> tuple[float, np.ndarray]:
    """How deep the deepest of points is inside a closed surface [mm], 0 if none is, and where; 0
    too of a part of another program without a skin.

    Args:
        points: The points [mm], (point, 3).
        nodes: Positions [mm], (node, 3).
        skin: Node indices, normals out of what it encloses, (triangle, 3).
    """
    within = points[winding_number(points, nodes, skin) > 0.5] if len(skin) else points[:0]
    depths = [distance_to(point, nodes[skin]) for point in within]
    if not depths:
        return 0.0, points[0]
    deepest = int(np.argmax(depths))
    return depths[deepest], within[deepest]
