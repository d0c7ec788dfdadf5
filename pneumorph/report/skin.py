"""Trajectories that hold only what can be seen: a third of the nodes, so a third of the file."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from pneumorph.trajectory import Trajectory


def with_skin_only(trajectory: Trajectory) -> Trajectory:
    """Return a trajectory with the nodes of the skin alone, numbered anew.

    Args:
        trajectory: One with node positions and skin; others are returned as they are.
    """
    nodes, skin = trajectory.node_positions_mm, trajectory.skin_triangles
    if nodes is None or skin is None:
        return trajectory
    kept, renumbered = np.unique(skin, return_inverse=True)
    return replace(
        trajectory,
        node_positions_mm=np.ascontiguousarray(nodes[:, :, kept]),
        skin_triangles=renumbered.reshape(skin.shape).astype(np.int32),
    )
