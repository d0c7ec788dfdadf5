"""How far the nodes of a reduced robot are from those of the full one (paper, appendix B)."""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np

from pneumorph.comparison.animations import Animation
from pneumorph.gait.open_loop_gait import sample_commands
from pneumorph.simulation.rollout import RobotModel, State, rollout
from pneumorph.trajectory import Trajectory


@dataclass(frozen=True, eq=False)
class AnimationError:
    """Distances between corresponding leg nodes of two trajectories.

    Attributes:
        name: The animation.
        mean_node_error_mm: Mean over frames, legs and nodes [mm]: the paper's measure.
        mean_node_error_in_hub_mm: The same in the frame of each robot's hub: shape alone, without
            the difference of the paths [mm].
        largest_node_error_mm: The largest of all [mm].
        mean_displacement_mm: How far the full robot's nodes moved, to compare with [mm].
        full_s_per_step: Wall time of a step of the full robot [s].
        reduced_s_per_step: The same of the reduced one [s].
        contact_count: Mean number of contact points of the full robot.
    """

    name: str
    mean_node_error_mm: float
    mean_node_error_in_hub_mm: float
    largest_node_error_mm: float
    mean_displacement_mm: float
    full_s_per_step: float
    reduced_s_per_step: float
    contact_count: float

    @property
    def time_ratio(self) -> float:
        """How many times faster the reduced robot is."""
        return self.full_s_per_step / self.reduced_s_per_step


def compare_animation(
    animation: Animation,
    full: RobotModel[State],
    reduced: RobotModel[State],
    time_step_s: float = 0.01,
    record_every: int = 5,
) -> tuple[AnimationError, Trajectory, Trajectory]:
    """Run an animation with both models.

    Args:
        animation: Design and pressures; both models must be of that design.
        full: The finite elements.
        reduced: The reduced robot.
        time_step_s: Time step of both [s].
        record_every: Steps between compared frames.

    Returns:
        The error, and the trajectories of the full and the reduced robot.

    Raises:
        ValueError: A model diverged, or the two have different nodes.
    """
    commands = sample_commands(
        animation.gait, time_step_s, round(animation.gait.duration_s / time_step_s)
    )
    full_trajectory, full_s = _timed(full, commands, record_every, record_nodes=True)
    reduced_trajectory, _ = _timed(reduced, commands, record_every, record_nodes=True)
    # Timed once more without the nodes: drawing them is no part of a step.
    _, reduced_s = _timed(reduced, commands, len(commands), record_nodes=False)
    for trajectory, model in ((full_trajectory, "full"), (reduced_trajectory, "reduced")):
        if trajectory.status != "completed":
            raise ValueError(
                f"the {model} robot of animation {animation.name!r} ended as {trajectory.status} "
                f"after {trajectory.time_s[-1]:.2f} s"
            )
    error = node_error(full_trajectory, reduced_trajectory)
    shape_error = np.linalg.norm(_in_hub(full_trajectory) - _in_hub(reduced_trajectory), axis=-1)
    nodes = _nodes(full_trajectory)
    return (
        AnimationError(
            name=animation.name,
            mean_node_error_mm=float(error.mean()),
            mean_node_error_in_hub_mm=float(shape_error.mean()),
            largest_node_error_mm=float(error.max()),
            mean_displacement_mm=float(np.linalg.norm(nodes - nodes[0], axis=-1).mean()),
            full_s_per_step=full_s,
            reduced_s_per_step=reduced_s,
            contact_count=float(full_trajectory.contact_count.mean()),
        ),
        full_trajectory,
        reduced_trajectory,
    )


def node_error(full: Trajectory, reduced: Trajectory) -> np.ndarray:
    """Distance of each leg node to its counterpart [mm], (frame, leg, node).

    Raises:
        ValueError: A trajectory without nodes, or two of different frames, legs or nodes.
    """
    full_nodes, reduced_nodes = _nodes(full), _nodes(reduced)
    if full_nodes.shape != reduced_nodes.shape:
        raise ValueError(
            f"the trajectories have (frame, leg, node) {full_nodes.shape[:3]} and "
            f"{reduced_nodes.shape[:3]}, expected the same; the models come from different meshes "
            "or were recorded differently"
        )
    distance: np.ndarray = np.linalg.norm(full_nodes - reduced_nodes, axis=-1)
    return distance


def _timed(
    model: RobotModel[State], commands: np.ndarray, record_every: int, record_nodes: bool
) -> tuple[Trajectory, float]:
    start = time.perf_counter()
    _, trajectory = rollout(model, commands, record_every=record_every, record_nodes=record_nodes)
    return trajectory, (time.perf_counter() - start) / len(commands)


def _nodes(trajectory: Trajectory) -> np.ndarray:
    if trajectory.node_positions_mm is None:
        raise ValueError("a trajectory without node positions cannot be compared node by node")
    return trajectory.node_positions_mm.astype(np.float64)


def _in_hub(trajectory: Trajectory) -> np.ndarray:
    """Node positions in the hub's frame, (frame, leg, node, 3)."""
    arm = _nodes(trajectory) - trajectory.hub_position_mm[:, None, None]
    turned: np.ndarray = np.einsum("fji,flnj->flni", trajectory.hub_rotation, arm)
    return turned
