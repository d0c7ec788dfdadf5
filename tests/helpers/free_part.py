"""Snapshots of a part that nothing holds, such as the disk that carries the legs.

Its frame is that of its own rigid motion: the rotation R and translation t that fit its nodes best
by mass, min sum m |x - (R Y + t)|^2. Displacements u = R^T (x - t) - Y then have

    sum m u = 0    and    sum m Y x u = 0,

and so has every mode made of them: the deforming part carries no momentum and no moment of momentum
where it is at rest (Buckens' frame), and its rigid motion is left to the hub's six unknowns.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pneumorph.fem.full_robot_state import FullRobotState
from pneumorph.fem.part_model import PartModel
from pneumorph.fem.soft_hub import SoftHub, SoftHubState
from pneumorph.geometry.pose import Pose
from pneumorph.reduction.snapshots import Snapshots
from pneumorph.reduction.walk_snapshots import WalkSnapshotSettings, walk_plan, walking_robot


def hub_deformation(hub: SoftHub, state: SoftHubState) -> np.ndarray:
    """Displacements of a soft hub's nodes in the frame of its own rigid motion [mm], (node, 3)."""
    rotation, translation = hub.frame(state)
    moved: np.ndarray = (state.positions - translation) @ rotation - hub.part.rest_nodes
    return moved


def hub_snapshots(
    leg: PartModel,
    hub: SoftHub,
    poses: Sequence[Pose],
    settings: WalkSnapshotSettings,
    number: int,
) -> Snapshots:
    """Let a robot walk and record the hub that carries its legs.

    Args:
        leg: The leg.
        hub: The hub, of finite elements.
        poses: Places for legs in the robot's frame.
        settings: Robots and pressures, as for the snapshots of legs.
        number: Which of the settings' robots.

    Raises:
        ValueError: More legs than places.
    """
    plan = walk_plan(settings, number, len(poses))
    robot = walking_robot(leg, hub, poses, settings, plan)
    recorded: list[np.ndarray] = []
    steps = 0

    def observe(state: FullRobotState) -> None:
        nonlocal steps
        steps += 1
        if steps % settings.record_every == 0 and isinstance(state.hub, SoftHubState):
            recorded.append(hub_deformation(hub, state.hub).astype(np.float32))

    commands = plan.commands_kPa(settings)
    _, trajectory = robot.rollout(
        robot.settled_state(settings.settling_steps),
        commands,
        record_every=len(commands),
        record_nodes=False,
        observe=observe,
    )
    return Snapshots(
        np.array(recorded, dtype=np.float32).reshape(-1, hub.part.node_count, 3),
        np.zeros(len(recorded)),
        np.zeros(len(recorded), dtype=np.int32),
        {
            "mesh_digest": hub.part.mesh.digest(),
            "sources": [f"walk {'.'.join(map(str, plan.places))}"],
            "details": {"status": trajectory.status, "steps": steps},
        },
    )
