"""Parts that are tied over a flat face, not at a few of its nodes.

What is tied at nodes gives way the more the finer its mesh: a force on a point of an elastic body
moves it without limit (Boussinesq). Over a face it has a limit. The nodes of the set `attachment`
stay what a hub carries; all others of the face (the set `attachment_face`) follow them,

    x_i = sum_k w_ik x_k,   sum_k w_ik = 1,   sum_k w_ik X_k = X_i,

with the thin-plate spline through the attachment nodes (Duchon 1977), which is smooth, meets them,
and is exact for every affine motion. So a rigid hub carries the face rigidly, and a soft one bends
it as it moves the attachment nodes.

The spline is over the face's plane. Where attachment nodes lie off it, so may those that follow:
their weights then reproduce their heights as well. A node that is further off the plane than these
is refused, since it would be pressed into it for good.
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
_OFF_MM = 1e-3
"""Most by which what follows may be misplaced: far below an edge, above what mesh files round."""
_LONGEST_LEVER = 1.0
"""Largest weight that may be added for a node's height: attachment nodes that are all but flat
would carry it by long levers."""
_ON_LINE = 1e-6
"""Width of attachment nodes over their length below which they count as on one line."""


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
            MeshError: It has no node set ``attachment``, or others of its face cannot follow it:
                its nodes are fewer than three, on one line or one above another, or a node of the
                face is further off their plane than they are.
        """
        attachment = mesh.node_set(ATTACHMENT).astype(int)
        if ATTACHMENT_FACE not in mesh.node_sets:
            return cls(attachment, np.zeros((0, len(attachment))))
        others = np.setdiff1d(mesh.node_set(ATTACHMENT_FACE), attachment).astype(int)
        if len(others) == 0:
            return cls(attachment, np.zeros((0, len(attachment))))
        corners = mesh.nodes[attachment]
        _, spread, axes = np.linalg.svd(corners - corners.mean(axis=0))
        along = axes[:2].T  # the face's own axes
        _check_span(attachment, corners @ along, spread)
        # Imported here: the online part of the package does without.
        from scipy.interpolate import RBFInterpolator

        spline = RBFInterpolator(corners @ along, np.eye(len(corners)), kernel="thin_plate_spline")
        weights = _lifted(spline(mesh.nodes[others] @ along), corners, mesh.nodes[others], axes[2])
        _check_carried(np.linalg.norm(weights @ corners - mesh.nodes[others], axis=1), others)
        return cls(np.concatenate([attachment, others]), weights)

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


def _check_span(nodes: np.ndarray, flat: np.ndarray, spread: np.ndarray) -> None:
    """Refuse attachment nodes through which there is no thin-plate spline.

    Args:
        nodes: Their numbers in the mesh, (attachment,).
        flat: Where they are in their plane [mm], (attachment, 2).
        spread: Their singular values along their axes, the largest first.

    Raises:
        MeshError: They are fewer than three, on one line, or two are at one place of the plane.
    """
    needed = (
        f"expected at least three that span a face, which the other nodes of {ATTACHMENT_FACE!r} "
        f"follow; or leave out {ATTACHMENT_FACE!r} and attach all of its nodes"
    )
    if len(flat) < 3:
        raise MeshError(f"the node set {ATTACHMENT!r} has {len(flat)} nodes, {needed}")
    if spread[1] < _ON_LINE * spread[0] or spread[0] == 0.0:
        raise MeshError(f"the {len(flat)} nodes of {ATTACHMENT!r} lie on one line, {needed}")
    from scipy.spatial import cKDTree

    pairs = cKDTree(flat).query_pairs(_NEAR_MM)
    if pairs:
        first, second = min(pairs)
        raise MeshError(
            f"nodes {nodes[first]} and {nodes[second]} of {ATTACHMENT!r} are at one place of its "
            "face, seen across it: expected nodes apart; are there double nodes, or nodes of a "
            "side wall?"
        )


def _lifted(
    weights: np.ndarray, corners: np.ndarray, followers: np.ndarray, normal: np.ndarray
) -> np.ndarray:
    """Weights that reproduce heights off the plane too, where the attachment nodes have such.

    The spline's are affine in the plane. Where a node's height is missed by more than `_OFF_MM`,
    to those of each are added the least shares that change nothing in the plane and make up what
    is missing, unless one of these is above `_LONGEST_LEVER`.

    Args:
        weights: The spline's, (follower, attachment).
        corners: Attachment nodes [mm], (attachment, 3).
        followers: Nodes that follow [mm], (follower, 3).
        normal: Across the plane: the last principal axis of the attachment nodes, (3,).
    """
    missing = (followers - weights @ corners) @ normal
    # Of principal axes the last is orthogonal to the others over the nodes, and to a constant.
    own = (corners - corners.mean(axis=0)) @ normal
    carried = np.abs(missing) * np.abs(own).max() < _LONGEST_LEVER * (own @ own)
    if np.abs(missing).max() <= _OFF_MM or not carried.any():
        return weights
    lifted: np.ndarray = weights + np.outer(np.where(carried, missing, 0.0), own / (own @ own))
    return lifted


def _check_carried(misplaced_mm: np.ndarray, others: np.ndarray) -> None:
    """Refuse nodes of a face that a rigid hub would not carry rigidly.

    Args:
        misplaced_mm: How far each is from where its weights put it at rest [mm], (follower,).
        others: Their numbers in the mesh, (follower,).

    Raises:
        MeshError: One is more than `_OFF_MM` away.
    """
    worst = int(np.argmax(misplaced_mm))
    if misplaced_mm[worst] > _OFF_MM:
        count = np.sum(misplaced_mm > _OFF_MM)
        raise MeshError(
            f"node {others[worst]} of {ATTACHMENT_FACE!r} lies {misplaced_mm[worst]:.3g} mm off "
            f"the face that the nodes of {ATTACHMENT!r} span, and {count} of {len(others)} lie "
            f"more than {_OFF_MM:g} mm off: they would be pressed into it for good. Expected "
            f"nodes of one plane; leave out those of a recess, a rim or a side wall, or put them "
            f"into {ATTACHMENT!r}"
        )
