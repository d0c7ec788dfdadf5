"""How far a soft hub lets a part's attachment give way: a linear stiffness of its own.

A reduced robot's hub is rigid, but a soft disk lets the root of a leg turn by a degree. Seen from
the hub's mean frame, forces on the attachment points of one place move them by the hub's compliance

    C = B P K^+ P^T B^T,

with K the hub's stiffness at rest, P what removes rigid motions in the mass norm (the loads are
carried by the hub's inertia, so no point of it is held: inertia relief) and B the displacement of
the points. Its inverse is the stiffness that the part's modes feel at their attachment. Places of
one kind of part share the mean of their compliances; what a load at one place does at another
(about a fifth of what it does at its own) is left out.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pneumorph.fem.interpolation import interpolation_matrix
from pneumorph.fem.part_model import PartModel
from pneumorph.geometry.pose import Pose

# Smallest compliance as a share of the largest.
_STIFFEST = 1e-4


def mount_stiffness(
    hub: PartModel,
    points: np.ndarray,
    poses: Sequence[Pose],
    mirror_points: np.ndarray | None = None,
) -> np.ndarray:
    """Stiffness of a hub against displacements of a part's attachment points.

    Args:
        hub: Finite elements of the hub, in the robot's frame.
        points: Attachment points in the part's frame [mm], (point, 3).
        poses: Places of the part in the robot's frame.
        mirror_points: Mirror image under y -> -y of each point, (point,), to give a part and its
            mirror image the same mount; None to leave it out.

    Returns:
        Stiffness [mN/mm] along the part's axes, symmetric and positive definite, (3 point,
        3 point), points major.

    Raises:
        ValueError: No poses.
    """
    if not poses:
        raise ValueError("poses is empty, expected the places of the part in the robot's frame")
    relief = _inertia_relief(hub)
    compliance = np.zeros((points.size, points.size))
    for pose in poses:
        weights = interpolation_matrix(hub.mesh, pose.apply(points)).toarray()
        along = np.einsum("pn,ji->pinj", weights, pose.rotation)  # part axes, then the hub's
        displacement = along.reshape(points.size, -1)
        compliance += displacement @ relief @ displacement.T / len(poses)
    if mirror_points is not None:
        image = np.arange(points.size).reshape(-1, 3)[mirror_points].ravel()
        sign = np.tile([1.0, -1.0, 1.0], len(points))
        compliance = 0.5 * (compliance + sign[:, None] * compliance[np.ix_(image, image)] * sign)
    values, vectors = np.linalg.eigh(compliance)
    # A coarse hub cannot move all points apart: there they are as good as held.
    values = np.maximum(values, _STIFFEST * values[-1])
    stiffness: np.ndarray = (vectors / values) @ vectors.T
    return stiffness


def leg_mount_stiffness(leg: PartModel, hub: PartModel, poses: Sequence[Pose]) -> np.ndarray:
    """`mount_stiffness` of the attachment nodes of a leg, with the mirror plane of its mesh.

    Raises:
        MeshError: The leg's mesh has no attachment.
    """
    nodes = leg.mesh.node_set("attachment")
    mirror = leg.mesh.mirror_nodes
    points = None
    if mirror is not None:
        place = {int(node): number for number, node in enumerate(nodes)}
        points = np.array([place[int(node)] for node in mirror[nodes]])
    return mount_stiffness(hub, leg.rest_nodes[nodes], poses, points)


def _inertia_relief(hub: PartModel) -> np.ndarray:
    """P K^+ P^T of a free body, (3 node, 3 node) [mm/mN]."""
    stiffness = hub.stiffness(hub.rest_nodes).toarray()
    arms = hub.rest_nodes - hub.node_mass @ hub.rest_nodes / hub.node_mass.sum()
    rigid = np.zeros((*arms.shape, 6))
    rigid[:, :, :3] = np.eye(3)
    for axis in range(3):
        rigid[:, :, 3 + axis] = np.cross(np.eye(3)[axis], arms)
    flat = rigid.reshape(-1, 6)
    weighted = np.repeat(hub.node_mass, 3)[:, None] * flat
    project = np.eye(len(flat)) - flat @ np.linalg.solve(flat.T @ weighted, weighted.T)
    # Rigid motions get a stiffness of their own, and are removed again.
    scale = np.trace(stiffness) / len(flat)
    filled = stiffness + scale * weighted @ np.linalg.solve(weighted.T @ weighted, weighted.T)
    relief: np.ndarray = project @ np.linalg.solve(filled, project.T)
    return relief
