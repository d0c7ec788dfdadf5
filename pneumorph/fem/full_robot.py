"""A whole robot at full order: legs of finite elements on a hub, on a floor with friction.

One linearly implicit Euler step with Rayleigh damping (Baraff and Witkin 1998; the paper's
equation for dv), solved for the new velocity:

    ((1 + alpha h) M + h (h + beta) K) v_new = M v_old + h f + H^T lambda,

f elastic, pressure and weight at the old positions; lambda impulses that obey, at every contact,

    0 <= v_n + gap / h  perp  lambda_n >= 0,   |lambda_t| <= mu lambda_n, opposite to any sliding.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from pneumorph.fem.contact_solve import solve_contacts
from pneumorph.fem.full_order_settings import FullOrderSettings
from pneumorph.fem.mounted_leg import CONTACT_AXES, CondensedLeg, MountedLeg
from pneumorph.fem.part_model import PartModel
from pneumorph.fem.rigid_hub import RigidHub, RigidHubState
from pneumorph.fem.soft_hub import SoftHub, SoftHubState
from pneumorph.fem.stage_clock import StageClock
from pneumorph.geometry.pose import Pose
from pneumorph.pressure import rate_limit
from pneumorph.trajectory import Trajectory


@dataclass(frozen=True, eq=False)
class FullRobotState:
    """State of a full-order robot."""

    hub: RigidHubState | SoftHubState
    """Of the hub."""
    positions: tuple[np.ndarray, ...]
    """World positions of each leg's nodes [mm], each (node, 3)."""
    velocities: tuple[np.ndarray, ...]
    """Their velocities [mm/s], each (node, 3)."""
    regulated_kPa: np.ndarray
    """Pressure of each regulator [real kPa], (regulator,)."""
    impulses: np.ndarray
    """Contact impulses of the last step, rows normal x y [mN s], (contact point, 3); legs' points
    first, then the hub's."""
    active_contacts: int = 0
    """Contact points that took part in the last step."""
    contact_residual: float = 0.0
    """Contact law violated by at most this in the last step [mm/s]."""


class FullRobot:
    """Legs of finite elements on a soft or rigid hub.

    Args:
        hub: What carries the legs.
        mounts: Part, pose in the robot's frame and regulator (counted from 0) of each leg.
        settings: Physics and numerics.
        tracked_point: Point of the hub's frame whose travel is rewarded [mm], (3,); the frame's
            origin by default.

    Raises:
        ValueError: No legs, or a regulator that does not exist.
    """

    def __init__(
        self,
        hub: RigidHub | SoftHub,
        mounts: Sequence[tuple[PartModel, Pose, int]],
        settings: FullOrderSettings | None = None,
        tracked_point: np.ndarray | None = None,
    ) -> None:
        self.hub: Any = hub
        self.settings = settings or FullOrderSettings()
        if not mounts:
            raise ValueError("mounts is empty: a robot needs at least one leg")
        self.legs = tuple(MountedLeg(*mount) for mount in mounts)
        for leg in self.legs:
            if not 0 <= leg.regulator < self.settings.regulator_count:
                raise ValueError(
                    f"regulator must be 0 .. {self.settings.regulator_count - 1}, got "
                    f"{leg.regulator}; regulators are counted from 0"
                )
        self.tracked_point: np.ndarray = np.array(
            (0.0, 0.0, 0.0) if tracked_point is None else tracked_point, dtype=float
        )
        self.clock = StageClock()
        """Time spent in ``assembly``, ``factorisation``, ``elimination`` and ``friction``."""
        counts = [leg.contact_count for leg in self.legs]
        self._contact_starts: np.ndarray = np.concatenate([[0], np.cumsum(counts)])

    @property
    def contact_point_count(self) -> int:
        """All contact points: the legs', then the hub's."""
        return int(self._contact_starts[-1]) + len(self.hub.contact_points)

    def initial_state(self) -> FullRobotState:
        """At rest in the initial pose, no pressure."""
        return FullRobotState(
            hub=self.hub.initial_state(),
            positions=tuple(leg.initial_positions() for leg in self.legs),
            velocities=tuple(np.zeros_like(leg.part.rest_nodes) for leg in self.legs),
            regulated_kPa=np.zeros(self.settings.regulator_count),
            impulses=np.zeros((self.contact_point_count, 3)),
        )

    def tracked_point_mm(self, state: FullRobotState) -> np.ndarray:
        """World position of the point whose travel is rewarded [mm], (3,)."""
        position: np.ndarray = self.hub.point_positions(state.hub, self.tracked_point[None])[0]
        return position

    def leg_nodes_in_hub_frame(self, state: FullRobotState) -> tuple[np.ndarray, ...]:
        """Nodes of each leg in its own frame, carried by the hub [mm], each (node, 3).

        At rest they are the part's rest nodes; the attachment nodes stay there on a rigid hub.
        """
        rotation, position = self.hub.frame(state.hub)
        carried = Pose(rotation, position).inverse()
        return tuple(
            leg.pose.inverse().apply(carried.apply(x))
            for leg, x in zip(self.legs, state.positions, strict=True)
        )

    def step(self, state: FullRobotState, command_kPa: np.ndarray) -> FullRobotState:
        """Advance by one time step.

        Args:
            state: Where the robot is.
            command_kPa: Real pressure asked of each regulator [kPa], (regulator,).

        Raises:
            numpy.linalg.LinAlgError: A matrix of the step is not positive definite.
        """
        settings, hub = self.settings, self.hub
        regulated = rate_limit(
            state.regulated_kPa, command_kPa, settings.pressure_rate_kPa_per_s, settings.time_step_s
        )
        pressure = settings.pressure_map.simulated(regulated)
        active, gaps = self._active_contacts(state)

        matrix, right = self.clock.timed("assembly", hub.system)(state.hub, settings)
        condensed: list[CondensedLeg] = []
        ties: list[np.ndarray] = []
        for leg, x, v, points in zip(
            self.legs, state.positions, state.velocities, active, strict=False
        ):
            share = leg.condense(x, v, float(pressure[leg.regulator]), points, settings, self.clock)
            tie = hub.point_map(state.hub, leg.attachment_in_hub)
            matrix += tie.T @ share.attachment_matrix @ tie
            right += tie.T @ share.attachment_right
            condensed.append(share)
            ties.append(tie)

        hub_points = hub.point_map(state.hub, hub.contact_points[active[-1]]).reshape(
            -1, 3, hub.unknown_count
        )[:, CONTACT_AXES]
        coupling = np.concatenate(
            [
                *(
                    share.contact_attachment @ tie
                    for share, tie in zip(condensed, ties, strict=True)
                ),
                hub_points.reshape(-1, hub.unknown_count),
            ]
        )
        numbers = np.concatenate(
            [start + points for start, points in zip(self._contact_starts, active, strict=True)]
        )
        solution = self.clock.timed("friction", solve_contacts)(
            matrix,
            right,
            coupling,
            [share.delassus for share in condensed],
            np.concatenate(
                [*(share.contact_right for share in condensed), np.zeros(3 * len(hub_points))]
            ),
            gaps,
            state.impulses[numbers],
            settings,
        )
        new_hub = hub.advance(state.hub, solution.hub_velocity, settings.time_step_s)
        positions, velocities = [], []
        start = 0
        for leg, x, share, tie, points in zip(
            self.legs, state.positions, condensed, ties, active, strict=False
        ):
            impulse = solution.impulses[start : start + len(points)].ravel()
            start += len(points)
            attached = tie @ solution.hub_velocity
            velocity = leg.full_velocity(share.free_velocity(attached, impulse), attached)
            position = x + settings.time_step_s * velocity
            position[leg.attachment] = hub.point_positions(new_hub, leg.attachment_in_hub)
            # The next step starts from the hub's motion at its new place.
            next_tie = hub.point_map(new_hub, leg.attachment_in_hub)
            velocity[leg.attachment] = (next_tie @ solution.hub_velocity).reshape(-1, 3)
            positions.append(position)
            velocities.append(velocity)
        impulses = np.zeros_like(state.impulses)
        impulses[numbers] = solution.impulses
        return FullRobotState(
            hub=new_hub,
            positions=tuple(positions),
            velocities=tuple(velocities),
            regulated_kPa=regulated,
            impulses=impulses,
            active_contacts=len(numbers),
            contact_residual=solution.residual,
        )

    def rollout(
        self,
        state: FullRobotState,
        commands_kPa: np.ndarray,
        record_every: int = 5,
        record_nodes: bool = True,
        description: dict[str, Any] | None = None,
        *,
        observe: Callable[[FullRobotState], None] | None = None,
        progress: bool = False,
    ) -> tuple[FullRobotState, Trajectory]:
        """Follow commands from a state.

        Args:
            state: Where to start.
            commands_kPa: Real pressure asked for in every step [kPa], (step, regulator).
            record_every: Steps between frames; the start is a frame too.
            record_nodes: Record every node's position.
            description: What else to note in the trajectory's metadata.
            observe: Called with the state after every step.
            progress: Show a progress bar with the time left.

        Returns:
            The last sound state, and the trajectory; its status is ``diverged`` when the robot
            became faster than the settings' limit or a matrix lost its definiteness.

        Raises:
            ValueError: The commands have a wrong shape or are not finite.
        """
        from tqdm import trange

        from pneumorph.fem.full_trajectory import Recorder

        commands = np.atleast_2d(np.asarray(commands_kPa, dtype=float))
        if commands.shape[1] != self.settings.regulator_count:
            raise ValueError(
                f"commands_kPa must have shape (step, {self.settings.regulator_count}), got "
                f"{commands.shape}: one column for each regulator"
            )
        if not np.all(np.isfinite(commands)):
            raise ValueError("commands_kPa must be finite, got NaN or infinity")
        recorder = Recorder(self, record_nodes)
        recorder.record(0, state.regulated_kPa, state)
        status = "completed"
        for number in trange(len(commands), disable=not progress, unit="step"):
            with np.errstate(all="ignore"):
                try:
                    new = self.step(state, commands[number])
                except np.linalg.LinAlgError:
                    status = "diverged"
                    break
            speed = max(float(np.abs(v).max()) for v in new.velocities)
            if not speed < self.settings.speed_limit_mm_per_s:  # NaN compares false
                status = "diverged"
                break
            state = new
            if observe is not None:
                observe(state)
            if (number + 1) % record_every == 0 or number + 1 == len(commands):
                recorder.record(number + 1, commands[number], state)
        return state, recorder.trajectory(status, description)

    def settled_state(self, step_count: int = 15) -> FullRobotState:
        """Let the robot fall and settle without pressure, 15 steps in the paper's episodes."""
        rest = np.zeros((step_count, self.settings.regulator_count))
        state, _ = self.rollout(self.initial_state(), rest, step_count, record_nodes=False)
        return replace(state)

    def _active_contacts(self, state: FullRobotState) -> tuple[list[np.ndarray], np.ndarray]:
        """Points that take part, by leg and last the hub's; and the gaps of all of them [mm]."""
        settings, hub = self.settings, self.hub
        heights, speeds = [], []
        for leg, x, v in zip(self.legs, state.positions, state.velocities, strict=True):
            heights.append(leg.contact_weights @ x[:, 2])
            speeds.append(leg.contact_weights @ v[:, 2])
        heights.append(hub.point_positions(state.hub, hub.contact_points)[:, 2])
        map_z = hub.point_map(state.hub, hub.contact_points)[2::3]
        speeds.append(map_z @ state.hub.velocity)
        active, gaps = [], []
        for height, speed in zip(heights, speeds, strict=True):
            gap = height - settings.floor_height_mm
            coming = gap + settings.time_step_s * np.minimum(speed, 0.0)
            chosen = np.flatnonzero(coming < settings.contact_margin_mm)
            active.append(chosen)
            gaps.append(gap[chosen])
        return active, np.concatenate(gaps)
