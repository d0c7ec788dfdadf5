"""Where a reduced part is attached: by its reduction, its mesh, or nodes that stay in place."""

from __future__ import annotations

import numpy as np

from pneumorph.geometry.attachment import attachment_frame, face_of_mesh
from pneumorph.geometry.mesh import Mesh
from pneumorph.geometry.pose import Pose
from pneumorph.reduction.reduced_part import ReducedPart


def attachment_of(part: ReducedPart, shipped: Mesh) -> Pose | None:
    """The attachment face of a reduced part: as its reduction noted it, or that of the mesh that
    ships where it was made from that, or where its modes leave nodes in place; None where nothing
    tells.

    Args:
        part: The reduced part.
        shipped: A mesh that it may have been made from.

    Raises:
        MeshError: The nodes span no face.
    """
    recorded = part.metadata.get("attachment_nodes")
    if recorded is None and part.metadata.get("mesh_digest") == shipped.digest():
        return face_of_mesh(shipped)
    held = (
        np.flatnonzero(np.abs(part.modes).max(axis=(1, 2)) == 0.0)
        if recorded is None
        else np.array(recorded, dtype=int)
    )
    if len(held) < 3:
        return None
    return attachment_frame(part.rest_nodes[held], part.rest_nodes.mean(axis=0))
