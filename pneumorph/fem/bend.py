"""How far a leg bends."""

from __future__ import annotations

import numpy as np

from pneumorph.geometry.mesh import Mesh

LEAST_WIDTH = 1e-4
"""Of a face across relative to its length, below which it is a line."""


def end_face_bend_deg(mesh: Mesh, positions: np.ndarray, region: str = "outer_end_face") -> float:
    """Turn of the outer end face about y, positive towards the paper side [degrees].

    The face's rotation is the best rigid fit of its nodes; the angle is counted on past 180 by
    looking at the way the leg's own x axis points: bends between -90 and 270 are told apart.

    Args:
        mesh: The leg.
        positions: Its node positions in its own frame [mm], (node, 3).
        region: Node set of the face.

    Raises:
        MeshError: No such region.
        ValueError: Its nodes lie on a line.
    """
    rotation = _face_rotation(mesh, positions, region)
    # Rotation about +y carries x towards -z, the paper side.
    angle = float(np.degrees(np.arctan2(-rotation[2, 0], rotation[0, 0])))
    return angle + 360.0 if angle < -90.0 else angle


def end_face_turn_deg(mesh: Mesh, positions: np.ndarray, region: str = "outer_end_face") -> float:
    """Angle by which the outer end face turned about whatever axis, 0 to 180 [degrees].

    Args:
        mesh: The leg.
        positions: Its node positions in its own frame [mm], (node, 3).
        region: Node set of the face.

    Raises:
        MeshError: No such region.
        ValueError: Its nodes lie on a line.
    """
    rotation = _face_rotation(mesh, positions, region)
    axis = np.array([rotation[2, 1] - rotation[1, 2], rotation[0, 2] - rotation[2, 0],
                     rotation[1, 0] - rotation[0, 1]])  # fmt: skip
    return float(np.degrees(np.arctan2(np.linalg.norm(axis), np.trace(rotation) - 1.0)))


def _face_rotation(mesh: Mesh, positions: np.ndarray, region: str) -> np.ndarray:
    """Best rigid fit of a face's nodes, (3, 3).

    Raises:
        MeshError: No such region.
        ValueError: Its nodes lie on a line, whose turn about itself nothing tells.
    """
    nodes = mesh.node_set(region)
    rest = mesh.nodes[nodes] - mesh.nodes[nodes].sum(axis=0) / max(len(nodes), 1)
    _, across, along = np.linalg.eigvalsh(rest.T @ rest)  # squares of lengths
    if across <= LEAST_WIDTH**2 * along:
        raise ValueError(
            f"the {len(nodes)} nodes of {region!r} lie on a line or in a point, expected those of "
            "a face: how far it turned cannot be told; was an edge of the end put into that region?"
        )
    return best_rotation(rest, positions[nodes] - positions[nodes].mean(axis=0))


def best_rotation(
    rest: np.ndarray, now: np.ndarray, weights: np.ndarray | None = None
) -> np.ndarray:
    """R that minimises sum_i w_i |now_i - R rest_i|^2, (3, 3). Kabsch, Acta Cryst. A32 (1976) 922.

    Args:
        rest: Points about their centre, (point, 3).
        now: The same points later, about their centre, (point, 3).
        weights: w, (point,); equal by default.
    """
    weighted = now if weights is None else now * weights[:, None]
    left, _, right = np.linalg.svd(weighted.T @ rest)
    left[:, 2] *= np.sign(np.linalg.det(left @ right))
    rotation: np.ndarray = left @ right
    return rotation
