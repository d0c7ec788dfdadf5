"""Where a part is attached: the frame of its attachment face, computed from the nodes there.

The rule. The face is the convex hull of the attachment nodes in the plane that fits them best, so
that four corners and all nodes of one face have the same frame. Its origin is the hull's centroid.
Its x axis is the plane's normal into the part, away from what carries it; its z axis is the part's
own z axis projected into the plane, or the part's x axis where the face looks along z; y = z x x.
A part is mounted by laying this frame on that of a place of the robot.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial import ConvexHull, QhullError

from pneumorph.geometry.face_tie import ATTACHMENT, ATTACHMENT_FACE
from pneumorph.geometry.mesh import Mesh, MeshError
from pneumorph.geometry.pose import Pose

FLAT_SHARE = 0.1
"""Most that attachment nodes may lie off their plane, relative to the width of their face."""
OBLIQUE = float(np.cos(np.pi / 4.0))
"""Cosine of 45 degrees: what looks further off where it should counts as turned."""
_UPRIGHT = 0.9
"""Cosine between normal and z axis beyond which the face counts as looking along z."""
_SAME_MM = 1e-6
_SAME = 1e-9


def attachment_frame(points: np.ndarray, inside: np.ndarray) -> Pose:
    """The frame of an attachment face in the frame of its part.

    Args:
        points: Attachment nodes [mm], (node, 3).
        inside: A point on the part's side of the face, such as its centre [mm], (3,).

    Raises:
        MeshError: The nodes span no face: fewer than three, all on a line, or far from any plane.
    """
    points = np.asarray(points, dtype=float)
    if len(points) < 3:
        raise MeshError(
            f"the attachment has {len(points)} nodes, expected at least three that span a face"
        )
    middle = points.mean(axis=0)
    _, spread, axes = np.linalg.svd(points - middle, full_matrices=False)
    if spread[1] < 1e-6 * spread[0]:
        raise MeshError("the attachment nodes lie on one line, expected a face")
    normal = axes[2] if axes[2] @ (inside - middle) > 0.0 else -axes[2]
    x = _tidy(normal)
    up = np.array([1.0, 0.0, 0.0]) if abs(x[2]) > _UPRIGHT else np.array([0.0, 0.0, 1.0])
    z = _tidy(up - (up @ x) * x)
    rotation = np.column_stack([x, np.cross(z, x), z])
    flat = (points - middle) @ rotation
    try:
        hull = ConvexHull(flat[:, 1:])
    except QhullError as error:  # nodes on a line are refused above
        raise MeshError(f"the attachment nodes span no face ({error})") from error
    width = float(np.sqrt(hull.volume))  # of a plane figure, its area
    off = float(np.ptp(flat[:, 0]))
    if off > FLAT_SHARE * width:
        raise MeshError(
            f"the attachment nodes lie up to {off:.3g} mm apart across their face, which is "
            f"{width:.3g} mm wide: expected nodes of one plane face; is a side wall among them?"
        )
    centre = np.array([flat[:, 0].mean(), *_centroid(flat[hull.vertices, 1:])])
    return Pose(rotation, middle + rotation @ centre)


def face_of_mesh(mesh: Mesh) -> Pose:
    """The frame of the face that a mesh's node sets ``attachment`` and ``attachment_face`` span.

    Raises:
        MeshError: It has no attachment, or its nodes span no face.
    """
    nodes = mesh.node_set(ATTACHMENT)
    if ATTACHMENT_FACE in mesh.node_sets:
        nodes = np.union1d(nodes, mesh.node_set(ATTACHMENT_FACE))
    return attachment_frame(mesh.nodes[nodes], mesh.nodes.mean(axis=0))


def mount_pose(place: Pose, face: Pose) -> Pose:
    """Pose of a part whose attachment face lies on a place of the robot.

    Args:
        place: Where the face's frame shall be, in the robot's frame.
        face: The face's frame in the part's.
    """
    return place.compose(face.inverse())


def same_frame(first: Pose, second: Pose) -> bool:
    """Whether two frames differ by no more than rounding."""
    return bool(
        np.abs(first.translation - second.translation).max() < _SAME_MM
        and np.abs(first.rotation - second.rotation).max() < _SAME
    )


def _tidy(vector: np.ndarray) -> np.ndarray:
    """Unit vector, along a coordinate axis exactly where it is so but for rounding."""
    unit: np.ndarray = vector / np.linalg.norm(vector)
    largest = int(np.abs(unit).argmax())
    if 1.0 - abs(unit[largest]) < 1e-14:
        unit = np.sign(unit[largest]) * np.eye(3)[largest]
    return unit


def _centroid(corners: np.ndarray) -> np.ndarray:
    """Centroid of a polygon (corner, 2), counter-clockwise."""
    after = np.roll(corners, -1, axis=0)
    twice = corners[:, 0] * after[:, 1] - after[:, 0] * corners[:, 1]
    centroid: np.ndarray = twice @ (corners + after) / (3.0 * twice.sum())
    return centroid
