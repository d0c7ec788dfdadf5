"""What legs can be mounted on: the protocol of `RigidHub`, `SoftHub` and a hub of one's own."""

from __future__ import annotations

from typing import Protocol, TypeVar

import numpy as np

from pneumorph.fem.part_model import PartModel
from pneumorph.geometry.contact_surfaces import ContactSurfaces
from pneumorph.geometry.mesh import Mesh
from pneumorph.geometry.pose import Pose
from pneumorph.physics.physics import Physics

Body = tuple[PartModel, np.ndarray, np.ndarray]
"""A part, world positions of its nodes [mm] and their velocities [mm/s], each (node, 3)."""


class HubMotion(Protocol):
    """Where a hub is and how it moves: a frozen dataclass of arrays."""

    @property
    def velocity(self) -> np.ndarray:
        """The hub's unknowns, (unknown,)."""


HubState = TypeVar("HubState", bound=HubMotion)


class HubBody(Protocol[HubState]):
    """A body that legs are tied to; points of it are given in its frame, the robot's at rest."""

    @property
    def contact_points(self) -> np.ndarray:
        """Points that may touch the floor [mm], (point, 3)."""

    @property
    def contact_surfaces(self) -> ContactSurfaces:
        """What they lie on."""

    @property
    def unknown_count(self) -> int:
        """Length of `HubMotion.velocity`."""

    @property
    def rigid(self) -> bool:
        """Whether its points keep their places in its frame."""

    @property
    def mesh(self) -> Mesh | None:
        """Its shape in its frame, for drawing."""

    @property
    def payload_mm(self) -> np.ndarray | None:
        """Where what it carries lies in its frame [mm], (3,), for drawing; None for nothing."""

    def identity(self) -> list[np.ndarray]:
        """Numbers that tell this hub from others."""

    def initial_state(self, start: Pose | None = None) -> HubState:
        """At rest in its own frame, or in that of a pose."""

    def frame(self, state: HubState) -> tuple[np.ndarray, np.ndarray]:
        """Rotation (3, 3) and position (3,) of the hub's frame, x_world = R x_robot + t."""

    def bodies(self, state: HubState) -> list[Body]:
        """What it has of finite elements."""

    def point_positions(self, state: HubState, points: np.ndarray) -> np.ndarray:
        """World positions of points of the hub [mm], (point, 3)."""

    def point_map(self, state: HubState, points: np.ndarray) -> np.ndarray:
        """Velocities of points as a linear map of the unknowns, (3 point, unknown)."""

    def system(self, state: HubState, physics: Physics) -> tuple[np.ndarray, np.ndarray]:
        """Its own share of the linearly implicit step: A (unknown, unknown) and b (unknown,)."""

    def implicit_system(
        self, start: HubState, trial: HubState, physics: Physics, definite: bool
    ) -> tuple[np.ndarray, np.ndarray]:
        """A and b of the implicit Euler step linearised at a trial end of it.

        Args:
            start: Where the step begins.
            trial: Where it may end.
            physics: What acts on it, and for how long.
            definite: Make A positive definite at the price of a slower convergence.
        """

    def turning_matrix(
        self, state: HubState, points: np.ndarray, impulses: np.ndarray
    ) -> np.ndarray | None:
        """How moments of impulses on its points change as it turns: -d(map^T impulses) / d(turn),
        (unknown, unknown), symmetric; None where its points go straight.

        Args:
            state: Where it is.
            points: Points of it [mm], (point, 3).
            impulses: What acts on them, world axes [mN s], (point, 3).
        """

    def residual_size(self, residual: np.ndarray) -> float:
        """Norm of unbalanced impulses on the unknowns, (unknown,) [mN s]."""

    def advance(self, state: HubState, velocity: np.ndarray, step: float) -> HubState:
        """Move with new unknowns (unknown,) for a time step [s]."""
