"""The hub as a rigid body of six unknowns: velocity of its centre of mass, angular velocity.

The gyroscopic moment w x I w is that of a step's start, in both integrators. So a hub that spins
freely gains energy, in proportion to the length of the step: unlike implicit Euler, which loses
some, an explicit term gives some.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pneumorph.fem.hub_body import Body
from pneumorph.geometry.contact_surfaces import ContactSurfaces
from pneumorph.geometry.mass_properties import MassProperties
from pneumorph.geometry.mesh import Mesh
from pneumorph.geometry.pose import Pose
from pneumorph.physics.physics import Physics


@dataclass(frozen=True, eq=False)
class RigidHubState:
    """Where a rigid hub is and how it moves."""

    centre: np.ndarray
    """World position of the centre of mass [mm], (3,)."""
    rotation: np.ndarray
    """Hub frame to world, (3, 3)."""
    velocity: np.ndarray
    """Unknowns: velocity of the centre [mm/s] and angular velocity, world axes [rad/s], (6,)."""


class RigidHub:
    """A rigid body: that of a mesh with its mass spread evenly over the nodes, or a given one.

    Args:
        mesh: Shape of the hub in the robot's frame.
        mass: Total mass [kg], or mass, centre and inertia in the robot's frame.
        contact_points: Points that may touch the floor [mm], (point, 3); those of the mesh by
            default.
        surface: What they lie on, by name.
        payload_mm: Where what it carries lies in the robot's frame, for drawing: the mass has it in
            it [mm], (3,); None for nothing.

    Raises:
        ValueError: The mass is not positive.
    """

    def __init__(
        self,
        mesh: Mesh,
        mass: float | MassProperties,
        contact_points: np.ndarray | None = None,
        surface: str = "",
        payload_mm: np.ndarray | None = None,
    ) -> None:
        body = mass if isinstance(mass, MassProperties) else _of_nodes(mesh, mass)
        self.mesh = mesh
        self.payload_mm = payload_mm
        self.mass_kg = body.mass_kg
        self.rest_centre: np.ndarray = body.centre_mm
        """Centre of mass at rest [mm], (3,)."""
        self.inertia: np.ndarray = body.inertia
        """About the centre, in the hub's frame [kg mm^2], (3, 3)."""
        self.contact_points: np.ndarray = np.array(
            mesh.contact_points if contact_points is None else contact_points, dtype=float
        ).reshape(-1, 3)
        self.contact_surfaces = ContactSurfaces.of_one(
            surface, mesh.skin_area_mm2, len(self.contact_points)
        )
        self.unknown_count = 6
        self.rigid = True

    def identity(self) -> list[np.ndarray]:
        """Numbers that tell this hub from others: mass, centre, inertia, contacts."""
        return [np.array([self.mass_kg]), self.rest_centre, self.inertia, self.contact_points]

    def initial_state(self, start: Pose | None = None) -> RigidHubState:
        """At rest in its own frame, or in that of a pose."""
        start = start or Pose()
        return RigidHubState(start.apply(self.rest_centre), start.rotation.copy(), np.zeros(6))

    def frame(self, state: RigidHubState) -> tuple[np.ndarray, np.ndarray]:
        """Rotation (3, 3) and position (3,) of the hub's frame, x_world = R x_robot + t."""
        return state.rotation, state.centre - state.rotation @ self.rest_centre

    def bodies(self, state: RigidHubState) -> list[Body]:
        """None: it does not deform."""
        return []

    def point_positions(self, state: RigidHubState, points: np.ndarray) -> np.ndarray:
        """World positions of points of the hub [mm], (point, 3)."""
        return state.centre + (points - self.rest_centre) @ state.rotation.T

    def point_map(self, state: RigidHubState, points: np.ndarray) -> np.ndarray:
        """Velocities of points as a linear map of the unknowns, (3 point, 6)."""
        arms = (points - self.rest_centre) @ state.rotation.T
        jacobian = np.zeros((len(points), 3, 6))
        jacobian[:, :, :3] = np.eye(3)
        # v = v_c + w x r = v_c - [r] w
        jacobian[:, 0, 4], jacobian[:, 0, 5] = arms[:, 2], -arms[:, 1]
        jacobian[:, 1, 3], jacobian[:, 1, 5] = -arms[:, 2], arms[:, 0]
        jacobian[:, 2, 3], jacobian[:, 2, 4] = arms[:, 1], -arms[:, 0]
        return jacobian.reshape(-1, 6)

    def system(self, state: RigidHubState, physics: Physics) -> tuple[np.ndarray, np.ndarray]:
        """The hub's own share of the step: matrix (6, 6) and right side (6,); the gyroscopic moment
        is that of the start."""
        inertia = state.rotation @ self.inertia @ state.rotation.T
        matrix = np.zeros((6, 6))
        matrix[:3, :3] = self.mass_kg * np.eye(3)
        matrix[3:, 3:] = inertia
        right = matrix @ state.velocity
        spin = state.velocity[3:]
        step = physics.time_step_s
        right[:3] += step * self.mass_kg * physics.gravity_vector
        right[3:] -= step * np.cross(spin, inertia @ spin)
        return physics.mass_factor * matrix, right

    def implicit_system(
        self,
        start: RigidHubState,
        trial: RigidHubState,
        physics: Physics,
        definite: bool,
    ) -> tuple[np.ndarray, np.ndarray]:
        """The same as `system`: no stiffness, and the gyroscopic moment is taken at the start,
        which gives a free hub energy in proportion to the step."""
        return self.system(start, physics)

    def turning_matrix(
        self, state: RigidHubState, points: np.ndarray, impulses: np.ndarray
    ) -> np.ndarray:
        """The symmetric part of -d(sum r x p) / d(turn) = sum (r . p) 1 - r p^T, in (6, 6): what
        pulls outwards resists a turn. The rest is the moment of all, which inertia takes up."""
        arms = (points - self.rest_centre) @ state.rotation.T
        virial = arms.T @ impulses
        matrix = np.zeros((6, 6))
        matrix[3:, 3:] = np.trace(virial) * np.eye(3) - 0.5 * (virial + virial.T)
        return matrix

    def residual_size(self, residual: np.ndarray) -> float:
        """Norm of an unbalanced impulse and moment, (6,), with the radius of gyration [mN s]."""
        radius = np.sqrt(np.trace(self.inertia) / (2.0 * self.mass_kg))
        return float(np.linalg.norm([*residual[:3], *(residual[3:] / radius)]))

    def advance(self, state: RigidHubState, velocity: np.ndarray, step: float) -> RigidHubState:
        """Move with a velocity (6,) for a time step [s]."""
        return RigidHubState(
            state.centre + step * velocity[:3],
            rotation_of(step * velocity[3:]) @ state.rotation,
            velocity,
        )


def _of_nodes(mesh: Mesh, mass_kg: float) -> MassProperties:
    if not 0.0 < mass_kg < float("inf"):
        raise ValueError(f"mass_kg must be positive and finite, got {mass_kg}")
    centre = mesh.nodes.mean(axis=0)
    arms = mesh.nodes - centre
    second_moment = mass_kg / len(arms) * arms.T @ arms
    return MassProperties(mass_kg, centre, np.trace(second_moment) * np.eye(3) - second_moment)


def rotation_of(vector: np.ndarray) -> np.ndarray:
    """Rotation by |v| about v, exp([v]), by Rodrigues' formula, (3, 3)."""
    angle = float(np.linalg.norm(vector))
    x, y, z = vector
    skew = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    if angle < 1e-8:
        return np.eye(3) + skew + 0.5 * skew @ skew
    result: np.ndarray = (
        np.eye(3) + np.sin(angle) / angle * skew + (1 - np.cos(angle)) / angle**2 * skew @ skew
    )
    return result
