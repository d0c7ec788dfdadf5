"""How far a solid has turned about each of its nodes from one configuration to another.

The deformation gradient from one to the other, R U by polar decomposition, has an antisymmetric
part whose axial vector is sin(angle) times the axis of R where U is the identity. Averaged over the
tetrahedra about a node it says how that node's neighbourhood has turned, to the order of what it
has been strained in between.
"""

from __future__ import annotations

import numpy as np
from scipy.sparse import csr_array

_LARGEST_SINE = 0.9


class NodeTurns:
    """Turns about the nodes of a mesh.

    Args:
        nodes: Rest positions [mm], (node, 3).
        tetrahedra: Node indices, corners first, (element, 4 or 10).
    """

    def __init__(self, nodes: np.ndarray, tetrahedra: np.ndarray) -> None:
        self._corners = np.ascontiguousarray(tetrahedra[:, :4])
        count, size = tetrahedra.shape
        volume = np.abs(np.linalg.det(self._edges(nodes)))
        elements = np.repeat(np.arange(count), size)
        weights = csr_array(
            (np.repeat(volume, size), (tetrahedra.ravel(), elements)), shape=(len(nodes), count)
        )
        total = np.asarray(weights.sum(axis=1)).ravel()
        self._average = (weights / np.maximum(total, 1e-300)[:, None]).tocsr()

    def reference(self, x: np.ndarray) -> np.ndarray:
        """What `since` needs of a configuration, (element, 3, 3).

        Args:
            x: Node positions [mm], (node, 3).

        Raises:
            numpy.linalg.LinAlgError: A tetrahedron is flat.
        """
        return np.linalg.inv(self._edges(x))

    def since(self, reference: np.ndarray, x: np.ndarray) -> np.ndarray:
        """Sine of the angle times the axis of the turn about each node, (node, 3).

        Args:
            reference: Where turns count from.
            x: Node positions [mm], (node, 3).
        """
        gradient = self._edges(x) @ reference
        axial = 0.5 * np.stack(
            [gradient[:, j, i] - gradient[:, i, j] for i, j in ((1, 2), (2, 0), (0, 1))], axis=1
        )
        sines: np.ndarray = self._average @ axial
        return sines

    def _edges(self, x: np.ndarray) -> np.ndarray:
        """Edges from the first corner as columns [mm], (element, 3, 3)."""
        corners = x[self._corners]
        return np.swapaxes(corners[:, 1:] - corners[:, :1], 1, 2)


def rotations(sines: np.ndarray) -> np.ndarray:
    """R = I + [w] + [w]^2 / (1 + cos) of w = sin(angle) times the axis, (n, 3, 3).

    Args:
        sines: w, (n, 3); where longer than 0.9 taken as that.
    """
    length = np.linalg.norm(sines, axis=1)
    w = sines * np.minimum(1.0, _LARGEST_SINE / np.maximum(length, 1e-300))[:, None]
    cross = np.zeros((len(w), 3, 3))
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        cross[:, j, i], cross[:, i, j] = w[:, k], -w[:, k]
    cosine = np.sqrt(1.0 - np.sum(w**2, axis=1))
    result: np.ndarray = np.eye(3) + cross + cross @ cross / (1.0 + cosine)[:, None, None]
    return result
