"""Parts that are tied over a flat face, not at a few of its nodes.

What is tied at nodes gives way the more the finer its mesh: a force on a point of an elastic body
moves it without limit (Boussinesq). Over a face it has a limit. The nodes of the set `attachment`
stay what a hub carries; all others of the face (the set `attachment_face`) follow them,

    x_i = sum_k w_ik x_k,   sum_k w_ik = 1,   sum_k w_ik X_k = X_i,

with the thin-plate spline through the attachment nodes (Duchon 1977), which is smooth, meets them,
and is exact for every affine motion. So a rigid hub carries the face rigidly, and a soft one bends
it as it moves the attachment nodes.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from pneumorph.geometry.mesh import Mesh, MeshError

ATTACHMENT = "attachment"
"""Node set that a hub carries."""
ATTACHMENT_FACE = "attachment_face"
"""Node set of the face that follows it."""

_NEAR_MM = 1e-6
"""Far above rounding, far below any edge."""


def tied_over_face(mesh: Mesh) -> Mesh:
    """The same part, tied over the flat piece of its surface that its attachment nodes span.

    The piece is the box that the attachment nodes span, flat in one of the axes.

    Args:
        mesh: The part, with a node set ``attachment``.

    Raises:
        MeshError: The attachment nodes do not span a rectangle across one of the axes.
    """
    corners = mesh.nodes[mesh.node_set(ATTACHMENT)]
    low, high = corners.min(axis=0), corners.max(axis=0)
    if np.count_nonzero(high - low > _NEAR_MM) != 2:
        raise MeshError(
            f"the attachment nodes span {(high - low).tolist()} mm, expected a rectangle across "
            "one of the axes: a face is flat"
        )
    inside = np.all((mesh.nodes > low - _NEAR_MM) & (mesh.nodes < high + _NEAR_MM), axis=1)
    face = np.flatnonzero(inside).astype(mesh.node_set(ATTACHMENT).dtype)
    return replace(mesh, node_sets={**mesh.node_sets, ATTACHMENT_FACE: face})


@dataclass(frozen=True, eq=False)
class FaceTie:
    """Nodes that a hub carries, and those that follow them.

    Attributes:
        nodes: All of them, the attachment nodes first, (tied,).
        weights: w of those that follow, (tied - attachment, attachment).
    """

    nodes: np.ndarray
    weights: np.ndarray

    @classmethod
    def of(cls, mesh: Mesh) -> FaceTie:
        """How a part is tied.

        Args:
            mesh: The part; without a node set ``attachment_face`` its attachment nodes stand alone.

        Raises:
            MeshError: It has no node set ``attachment``.
        """
        attachment = mesh.node_set(ATTACHMENT).astype(int)
        if ATTACHMENT_FACE not in mesh.node_sets:
            return cls(attachment, np.zeros((0, len(attachment))))
        others = np.setdiff1d(mesh.node_set(ATTACHMENT_FACE), attachment).astype(int)
        corners = mesh.nodes[attachment]
        along = np.linalg.svd(corners - corners.mean(axis=0))[2][:2].T  # the face's own axes
        # Imported here: the online part of the package does without.
        from scipy.interpolate import RBFInterpolator

        spline = RBFInterpolator(corners @ along, np.eye(len(corners)), kernel="thin_plate_spline")
        return cls(np.concatenate([attachment, others]), spline(mesh.nodes[others] @ along))

    @property
    def unknowns(self) -> np.ndarray:
        """Unknowns of the nodes, (3 tied,)."""
        unknowns: np.ndarray = (3 * self.nodes[:, None] + np.arange(3)).ravel()
        return unknowns

    def spread(self, attached: np.ndarray) -> np.ndarray:
        """Vectors of all tied nodes from those of the attachment.

        Args:
            attached: (attachment, 3), or with more axes behind.

        Returns:
            (tied, 3), with the same axes behind.
        """
        if len(self.weights) == 0:
            return attached
        return np.concatenate([attached, np.tensordot(self.weights, attached, axes=1)])

    def gathered(self, tied: np.ndarray) -> np.ndarray:
        """What loads on the tied nodes are at the attachment: the transpose of `spread`.

        Args:
            tied: (tied, 3), or with more axes behind.

        Returns:
            (attachment, 3), with the same axes behind.
        """
        if len(self.weights) == 0:
            return tied
        count = self.weights.shape[1]
        gathered: np.ndarray = tied[:count] + np.tensordot(self.weights.T, tied[count:], axes=1)
        return gathered
