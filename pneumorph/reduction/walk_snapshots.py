"""Snapshots of legs that carry a robot: a walk over the corners of the pressure hypercube.

The paper's protocol: legs at a subset of the places, each driven alone, pressures at the corners of
the hypercube {0, amplitude}^legs one after another, every second step recorded.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pneumorph.fem.full_order_settings import FullOrderSettings
from pneumorph.fem.full_robot import FullRobot
from pneumorph.fem.full_robot_state import FullRobotState
from pneumorph.fem.part_model import PartModel
from pneumorph.fem.rigid_hub import RigidHub
from pneumorph.fem.soft_hub import SoftHub
from pneumorph.geometry.pose import Pose
from pneumorph.pressure import PressureMap
from pneumorph.reduction.snapshots import Snapshots


@dataclass(frozen=True)
class WalkSnapshotSettings:
    """Which robots walk, and how far."""

    leg_counts: tuple[int, ...] = (3, 4, 4, 6)
    """Number of legs of each robot; their places are drawn."""
    corner_limit: int = 8
    """Corners visited by each robot, along a Gray code with its legs in drawn order."""
    hold_s: float = 0.8
    """Time at each corner [s]."""
    amplitude_kPa: float = 350.0
    """Simulated pressure of an inflated leg [kPa]."""
    pressure_rate_kPa_per_s: float = 612.0
    """Rate of the simulated pressure, 4.08 times 150 kPa/s [kPa/s]."""
    settling_steps: int = 15
    """Steps without pressure before the walk."""
    record_every: int = 2
    """Steps between snapshots."""
    seed: int = 0
    """Seed of places and orders."""


def walk_snapshots(
    part: PartModel,
    hub: RigidHub | SoftHub,
    poses: Sequence[Pose],
    settings: WalkSnapshotSettings,
    number: int,
) -> Snapshots:
    """Let one full-order robot walk and record its legs in their own frames.

    On a rigid hub a leg's attachment rests in its frame whatever the robot does; on a soft one it
    moves with the hub's deformation.

    Args:
        part: The leg.
        hub: What carries the legs.
        poses: Places for legs in the robot's frame.
        settings: Robots and pressures.
        number: Which of the settings' robots.

    Raises:
        ValueError: More legs than places.
    """
    leg_count = settings.leg_counts[number]
    if leg_count > len(poses):
        raise ValueError(
            f"leg_counts must not exceed the {len(poses)} places of the robot, got {leg_count}"
        )
    rng = np.random.default_rng([settings.seed, number])
    places = np.sort(rng.choice(len(poses), leg_count, replace=False))
    order = rng.permutation(leg_count)
    physics = FullOrderSettings(
        regulator_count=leg_count,
        pressure_map=PressureMap(1.0, 0.0),
        pressure_rate_kPa_per_s=settings.pressure_rate_kPa_per_s,
    )
    robot = FullRobot(hub, [(part, poses[place], leg) for leg, place in enumerate(places)], physics)
    corners = gray_corners(leg_count)[1 : settings.corner_limit + 1, order]
    hold = round(settings.hold_s / physics.time_step_s)
    commands = settings.amplitude_kPa * np.repeat(corners, hold, axis=0)

    recorded: list[np.ndarray] = []
    pressures: list[np.ndarray] = []
    steps = 0

    def observe(state: FullRobotState) -> None:
        nonlocal steps
        steps += 1
        if steps % settings.record_every == 0:
            legs = np.array(robot.leg_nodes_in_hub_frame(state)) - part.rest_nodes
            if isinstance(hub, RigidHub):
                legs[:, part.mesh.node_set("attachment")] = 0.0  # rounding
            recorded.append(legs.astype(np.float32))
            pressures.append(state.regulated_kPa)

    start = robot.settled_state(settings.settling_steps)
    _, trajectory = robot.rollout(
        start, commands, record_every=len(commands), record_nodes=False, observe=observe
    )
    displacement = np.array(recorded, dtype=np.float32).reshape(-1, part.node_count, 3)
    return Snapshots(
        displacement,
        np.array(pressures).reshape(-1),
        np.zeros(len(displacement), dtype=np.int32),
        {
            "mesh_digest": part.mesh.digest(),
            "sources": [f"walk {'.'.join(map(str, places))}"],
            "details": {
                "status": trajectory.status,
                "steps": steps,
                "forward_distance_cm": trajectory.forward_distance_cm,
            },
        },
    )


def gray_corners(dimension: int) -> np.ndarray:
    """Corners of the unit hypercube in Gray order, (2^dimension, dimension)."""
    number = np.arange(2**dimension)
    gray = number ^ (number >> 1)
    corners: np.ndarray = (gray[:, None] >> np.arange(dimension)) & 1
    return corners
