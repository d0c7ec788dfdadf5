"""How far a reduced robot is from the full one: nodes, path, contact forces, who slips.

The mean node error is the paper's measure (appendix B). Gaits live at the edge of slipping, so
small errors of shape can become other paths; forces and slipping points tell where that begins.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pneumorph.gait.friction_margin import point_contacts
from pneumorph.trajectory import Trajectory

SLIPPING_MM_PER_S = 2.0
"""A loaded point that is faster along the floor counts as slipping [mm/s]: 0.02 mm a step."""
LOADED_SHARE = 0.05
"""A leg counts as loaded when it carries more than this share of the robot's weight."""


@dataclass(frozen=True)
class RobotError:
    """Distances between two trajectories of one design under the same commands.

    Attributes:
        mean_node_error_mm: Mean over frames, legs and nodes [mm]: the paper's measure.
        mean_node_error_in_hub_mm: The same in the frame of each robot's hub: shape alone, without
            the difference of the paths [mm].
        worst_frame_node_error_mm: Mean over legs and nodes in the worst frame [mm].
        largest_node_error_mm: The largest of all [mm].
        mean_displacement_mm: How far the full robot's nodes moved, to compare with [mm].
        path_error_mm: Root mean square distance of the tracked points [mm].
        forward_full_cm: Forward distance of the full robot [cm].
        forward_reduced_cm: The same of the reduced one [cm].
        leg_force_error_percent: Root mean square over frames and legs of the difference of the
            forces on a leg, in percent of the root mean square force; NaN without contact.
        slip_agreement_percent: Share of the loaded legs and frames in which both models say alike
            whether the leg slips; NaN without contact.
        slipping_points_overlap_percent: Points that slip in both models, in percent of those that
            slip in either; NaN where none does.
        contact_count: Mean number of the full robot's contact points.
        range_ratio: How far any leg of the reduced robot went relative to the furthest snapshot it
            was reduced from; None where that is not known.
    """

    mean_node_error_mm: float
    mean_node_error_in_hub_mm: float
    worst_frame_node_error_mm: float
    largest_node_error_mm: float
    mean_displacement_mm: float
    path_error_mm: float
    forward_full_cm: float
    forward_reduced_cm: float
    leg_force_error_percent: float
    slip_agreement_percent: float
    slipping_points_overlap_percent: float
    contact_count: float
    range_ratio: float | None = None

    @property
    def distance_error_cm(self) -> float:
        """Difference of the forward distances [cm], not negative."""
        return abs(self.forward_reduced_cm - self.forward_full_cm)


def robot_error(full: Trajectory, reduced: Trajectory) -> RobotError:
    """Compare a reduced robot with the full one.

    Args:
        full: Trajectory of the finite elements, with nodes and contacts.
        reduced: The same frames of the reduced robot.

    Raises:
        ValueError: A model diverged, or frames, legs, nodes or contact points differ.
    """
    for trajectory, model in ((full, "full"), (reduced, "reduced")):
        if trajectory.status != "completed":
            raise ValueError(
                f"the {model} robot ended as {trajectory.status} after "
                f"{trajectory.time_s[-1]:.2f} s, expected completed"
            )
    error = node_error(full, reduced)
    shape_error = np.linalg.norm(_in_hub(full) - _in_hub(reduced), axis=-1)
    nodes = _nodes(full)
    path = np.linalg.norm(full.tracked_point_mm - reduced.tracked_point_mm, axis=-1)
    return RobotError(
        mean_node_error_mm=float(error.mean()),
        mean_node_error_in_hub_mm=float(shape_error.mean()),
        worst_frame_node_error_mm=float(error.mean(axis=(1, 2)).max()),
        largest_node_error_mm=float(error.max()),
        mean_displacement_mm=float(np.linalg.norm(nodes - nodes[0], axis=-1).mean()),
        path_error_mm=float(np.sqrt(np.mean(path**2))),
        forward_full_cm=full.forward_distance_cm,
        forward_reduced_cm=reduced.forward_distance_cm,
        **_contact_errors(full, reduced),
        contact_count=float(full.contact_count.mean()),
        range_ratio=reduced.metadata.get("range_ratio"),
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


def _contact_errors(full: Trajectory, reduced: Trajectory) -> dict[str, float]:
    found = [_contacts(each) for each in (full, reduced)]
    forces, presses, slipping = zip(*found, strict=True)
    if forces[0].shape != forces[1].shape:
        raise ValueError(
            f"the trajectories have (frame, leg, point) {forces[0].shape[:3]} and "
            f"{forces[1].shape[:3]}, expected the same contact points"
        )
    legs = [force.sum(axis=2) for force in forces]  # (frame, leg, 3)
    size = float(np.sqrt(np.mean(np.sum(legs[0] ** 2, axis=-1))))
    if size == 0.0:
        nothing = float("nan")
        return dict.fromkeys(
            ("leg_force_error_percent", "slip_agreement_percent",
             "slipping_points_overlap_percent"), nothing
        )  # fmt: skip
    difference = float(np.sqrt(np.mean(np.sum((legs[1] - legs[0]) ** 2, axis=-1))))
    weight = legs[0][..., 2].sum(axis=1, keepdims=True)
    loaded = legs[0][..., 2] > LOADED_SHARE * weight
    # A leg slips when the points that carry most of its load do.
    slips = []
    for normal, moving in zip(presses, slipping, strict=True):
        slips.append((normal * moving).sum(axis=2) > 0.5 * normal.sum(axis=2))
    both, either = slipping[0] & slipping[1], slipping[0] | slipping[1]
    return {
        "leg_force_error_percent": 100.0 * difference / size,
        "slip_agreement_percent": 100.0 * float((slips[0] == slips[1])[loaded].mean()),
        "slipping_points_overlap_percent": (
            100.0 * float(both.sum() / either.sum()) if either.any() else float("nan")
        ),
    }


def _contacts(trajectory: Trajectory) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    # Forces (frame, leg, point, 3), their part along the normal, and which points carry one and
    # slide.
    force = trajectory.contact_force_mN
    if force is None:
        raise ValueError("a trajectory without contact forces cannot be compared; record the nodes")
    pressing, _, sliding = point_contacts(trajectory)
    return force.astype(float), pressing, (pressing > 0.0) & (sliding > SLIPPING_MM_PER_S)


def _nodes(trajectory: Trajectory) -> np.ndarray:
    if trajectory.node_positions_mm is None:
        raise ValueError("a trajectory without node positions cannot be compared node by node")
    return trajectory.node_positions_mm.astype(np.float64)


def _in_hub(trajectory: Trajectory) -> np.ndarray:
    """Node positions in the hub's frame, (frame, leg, node, 3)."""
    arm = _nodes(trajectory) - trajectory.hub_position_mm[:, None, None]
    turned: np.ndarray = np.einsum("fji,flnj->flni", trajectory.hub_rotation, arm)
    return turned
