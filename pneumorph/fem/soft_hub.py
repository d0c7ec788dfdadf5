"""The hub as a soft body of finite elements."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pneumorph.fem.bend import best_rotation
from pneumorph.fem.body_equations import (
    damping_data,
    damps_by_its_start,
    implicit_equations,
    linearly_implicit_equations,
)
from pneumorph.fem.hub_body import Body
from pneumorph.fem.interpolation import interpolation_matrix
from pneumorph.fem.part_model import PartModel
from pneumorph.geometry.contact_surfaces import ContactSurfaces
from pneumorph.geometry.pose import Pose
from pneumorph.physics.physics import Physics


@dataclass(frozen=True, eq=False)
class SoftHubState:
    """Where the nodes of a soft hub are and how they move."""

    positions: np.ndarray
    """World positions [mm], (node, 3)."""
    velocity: np.ndarray
    """Unknowns: velocities of the nodes [mm/s], (3 node,)."""


class SoftHub:
    """A hub of finite elements; what is tied to it follows its nodes by barycentric weights.

    Args:
        part: The hub in the robot's frame.
        contact_points: Points that may touch the floor [mm], (point, 3); those of the mesh by
            default.
        surface: What they lie on, by name.

    Raises:
        ValueError: The part relaxes or has cavities, which a hub does nothing with.
    """

    def __init__(
        self, part: PartModel, contact_points: np.ndarray | None = None, surface: str = ""
    ) -> None:
        if part.branches is not None:
            raise ValueError(
                f"the hub's part relaxes by {part.branches.series}, expected one that does not: a "
                "hub's stress is elastic; make the part without relaxation"
            )
        if part.cavities:
            raise ValueError(
                f"the hub's part has the cavities {', '.join(part.cavity_names)}, expected none: "
                "nothing inflates a hub; make the part without a cavity"
            )
        self.part = part
        self.mesh = part.mesh
        self.contact_points: np.ndarray = np.array(
            part.mesh.contact_points if contact_points is None else contact_points, dtype=float
        ).reshape(-1, 3)
        self.contact_surfaces = ContactSurfaces.of_one(
            surface, part.mesh.skin_area_mm2, len(self.contact_points)
        )
        self.unknown_count = 3 * part.node_count
        self.rigid = False
        self.payload_mm: np.ndarray | None = None  # a point would hang on one node
        self._weights: dict[bytes, np.ndarray] = {}

    def identity(self) -> list[np.ndarray]:
        """Numbers that tell this hub from others: shape, masses, stiffness at rest, contacts."""
        part = self.part
        stiffness = part.stiffness_data(part.rest_nodes)
        return [part.rest_nodes, part.node_mass, stiffness, self.contact_points]

    def initial_state(self, start: Pose | None = None) -> SoftHubState:
        """At rest in its own frame, or in that of a pose."""
        placed = (start or Pose()).apply(self.part.rest_nodes)
        return SoftHubState(placed, np.zeros(self.unknown_count))

    def frame(self, state: SoftHubState) -> tuple[np.ndarray, np.ndarray]:
        """Best rigid fit to the nodes by mass: R (3, 3) and t (3,) of x_world = R x_robot + t."""
        mass = self.part.node_mass / self.part.mass_kg
        rest_centre, centre = mass @ self.part.rest_nodes, mass @ state.positions
        rotation = best_rotation(self.part.rest_nodes - rest_centre, state.positions - centre, mass)
        return rotation, centre - rotation @ rest_centre

    def bodies(self, state: SoftHubState) -> list[Body]:
        """Itself."""
        return [(self.part, state.positions, state.velocity.reshape(-1, 3))]

    def point_positions(self, state: SoftHubState, points: np.ndarray) -> np.ndarray:
        """World positions of points of the hub [mm], (point, 3)."""
        return self._interpolation(points) @ state.positions

    def point_map(self, state: SoftHubState, points: np.ndarray) -> np.ndarray:
        """Velocities of points as a linear map of the unknowns, (3 point, 3 node)."""
        return np.kron(self._interpolation(points), np.eye(3))

    def system(self, state: SoftHubState, physics: Physics) -> tuple[np.ndarray, np.ndarray]:
        """A, (3 node, 3 node), and b, (3 node,), of the linearly implicit step."""
        v = state.velocity.reshape(-1, 3)
        return self._dense(
            *linearly_implicit_equations(self.part, state.positions, v, 0.0, physics)
        )

    def implicit_system(
        self, start: SoftHubState, trial: SoftHubState, physics: Physics, definite: bool
    ) -> tuple[np.ndarray, np.ndarray]:
        """A and b of the implicit Euler step linearised at a trial end of it."""
        at = start if damps_by_its_start(physics) else trial
        return self._dense(
            *implicit_equations(
                self.part,
                start.velocity.reshape(-1, 3),
                trial.positions,
                trial.velocity.reshape(-1, 3),
                0.0,
                physics,
                definite,
                damping_data(self.part, at.positions, physics),
            )
        )

    def turning_matrix(self, state: SoftHubState, points: np.ndarray, impulses: np.ndarray) -> None:
        """None: its points go with its nodes, which go straight."""

    def residual_size(self, residual: np.ndarray) -> float:
        """Norm of unbalanced impulses [mN s] of the unknowns, (3 node,)."""
        return float(np.linalg.norm(residual))

    def advance(self, state: SoftHubState, velocity: np.ndarray, step: float) -> SoftHubState:
        """Move with velocities (3 node,) for a time step [s]."""
        return SoftHubState(state.positions + step * velocity.reshape(-1, 3), velocity)

    def _dense(self, data: np.ndarray, right: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return self.part.assembly.matrix(data).toarray(), right

    def _interpolation(self, points: np.ndarray) -> np.ndarray:
        key = np.ascontiguousarray(points).tobytes()
        if key not in self._weights:
            self._weights[key] = interpolation_matrix(self.part.mesh, points).toarray()
        return self._weights[key]
