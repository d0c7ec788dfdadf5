"""A whole robot at full order: legs of finite elements on a hub, on a floor with friction.

`pneumorph.fem.time_integration` makes its steps, with impulses lambda that obey, at every contact,

    0 <= v_n + gap / h  perp  lambda_n >= 0,   |lambda_t| <= mu lambda_n, opposite to any sliding,

normal and tangents those of the floor below each point.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from pneumorph.fem.floor import Floor
from pneumorph.fem.full_order_settings import FullOrderSettings
from pneumorph.fem.full_robot_state import FullRobotState
from pneumorph.fem.mounted_leg import MountedLeg
from pneumorph.fem.part_model import PartModel
from pneumorph.fem.rigid_hub import RigidHub
from pneumorph.fem.soft_hub import SoftHub, SoftHubState
from pneumorph.fem.stage_clock import StageClock
from pneumorph.fem.step_problem import TrialStep
from pneumorph.fem.time_integration import StepError, implicit_euler_step, linearly_implicit_step
from pneumorph.geometry.pose import Pose
from pneumorph.pressure import rate_limit
from pneumorph.trajectory import Trajectory


class FullRobot:
    """Legs of finite elements on a soft or rigid hub.

    Args:
        hub: What carries the legs.
        mounts: Part, pose in the robot's frame and regulator (counted from 0) of each leg.
        settings: Physics and numerics.
        tracked_point: Point of the hub's frame whose travel is rewarded [mm], (3,); the frame's
            origin by default.
        floor: What it stands on; the settings' floor by default.

    Raises:
        FileNotFoundError: The settings' height map is missing.
        ValueError: No legs, a regulator that does not exist, or no heights in the height map.
    """

    def __init__(
        self,
        hub: RigidHub | SoftHub,
        mounts: Sequence[tuple[PartModel, Pose, int]],
        settings: FullOrderSettings | None = None,
        tracked_point: np.ndarray | None = None,
        floor: Floor | None = None,
    ) -> None:
        self.hub: Any = hub
        self.settings = settings or FullOrderSettings()
        self.floor = floor or self.settings.floor()
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
            contact_velocities=np.zeros((self.contact_point_count, 3)),
            pressure_work_mJ=np.zeros(len(self.legs)),
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

    def contact_positions(self, state: FullRobotState | TrialStep) -> tuple[np.ndarray, ...]:
        """Where the contact points of each leg, and last the hub's, are [mm], each (point, 3)."""
        legs = (leg.contact_weights @ x for leg, x in zip(self.legs, state.positions, strict=True))
        return (*legs, self.hub.point_positions(state.hub, self.hub.contact_points))

    def leg_contacts(self, state: FullRobotState) -> tuple[np.ndarray, np.ndarray]:
        """Forces on the legs' contact points and the velocities of those that carry one.

        Returns:
            Force in the last step [mN] and velocity after it [mm/s], world axes, both (leg, point,
            3) for legs that are all the same part.
        """
        positions = np.concatenate(self.contact_positions(state)[:-1])
        count, shape = len(positions), (len(self.legs), -1, 3)
        frames = self.floor.frames(positions)
        impulses, velocities = state.impulses[:count], state.contact_velocities[:count]
        force = np.einsum("pra,pr->pa", frames, impulses) / self.settings.time_step_s
        velocity = np.einsum("pra,pr->pa", frames, velocities)
        pressed = impulses[:, :1] > 0.0
        return force.reshape(shape), np.where(pressed, velocity, 0.0).reshape(shape)

    def bodies(self, state: FullRobotState) -> list[tuple[PartModel, np.ndarray, np.ndarray]]:
        """Every body of finite elements, legs first and then a soft hub.

        Returns:
            Part, world positions of its nodes [mm] and their velocities [mm/s], each (node, 3).
        """
        bodies = [
            (leg.part, x, v)
            for leg, x, v in zip(self.legs, state.positions, state.velocities, strict=True)
        ]
        if isinstance(state.hub, SoftHubState):
            bodies.append((self.hub.part, state.hub.positions, state.hub.velocity.reshape(-1, 3)))
        return bodies

    def step(self, state: FullRobotState, command_kPa: np.ndarray) -> FullRobotState:
        """Advance by one time step.

        A step that fails is made as two of half the length, and those again where they fail; the
        new state's `substeps` says how many there were.

        Args:
            state: Where the robot is.
            command_kPa: Real pressure asked of each regulator [kPa], (regulator,).

        Raises:
            StepError: The step fails even in the smallest parts.
        """
        return self._divided(state, np.asarray(command_kPa, dtype=float), self.settings, 0)

    def _divided(
        self,
        state: FullRobotState,
        command_kPa: np.ndarray,
        settings: FullOrderSettings,
        halvings: int,
    ) -> FullRobotState:
        """One step of the settings' length, or its halves where it fails."""
        try:
            return self._undivided(state, command_kPa, settings)
        except (StepError, np.linalg.LinAlgError) as error:
            if halvings == settings.step_halvings:
                raise StepError(
                    f"a step of {settings.time_step_s:g} s failed, {halvings} times halved: {error}"
                ) from error
        half = replace(settings, time_step_s=0.5 * settings.time_step_s)
        middle = self._divided(state, command_kPa, half, halvings + 1)
        end = self._divided(middle, command_kPa, half, halvings + 1)
        return replace(
            end,
            impulses=middle.impulses + end.impulses,
            active_contacts=max(middle.active_contacts, end.active_contacts),
            contact_residual=max(middle.contact_residual, end.contact_residual),
            penetration_mm=max(middle.penetration_mm, end.penetration_mm),
            substeps=middle.substeps + end.substeps,
            iterations=middle.iterations + end.iterations,
        )

    def _undivided(
        self, state: FullRobotState, command_kPa: np.ndarray, settings: FullOrderSettings
    ) -> FullRobotState:
        regulated = rate_limit(
            state.regulated_kPa, command_kPa, settings.pressure_rate_kPa_per_s, settings.time_step_s
        )
        implicit = settings.integrator == "implicit_euler"
        with np.errstate(all="ignore"):
            advance = implicit_euler_step if implicit else linearly_implicit_step
            new = advance(self, state, regulated, settings)
        # numpy's maximum is NaN where any speed is.
        speed = float(np.max([np.abs(v).max() for v in (*new.velocities, new.hub.velocity)]))
        if not speed < settings.speed_limit_mm_per_s:  # NaN compares false
            raise StepError(
                f"a node moves at {speed:.3g} mm/s, expected less than "
                f"{settings.speed_limit_mm_per_s:g}"
            )
        return new

    def contact_numbers(self, points: Sequence[np.ndarray]) -> np.ndarray:
        """Numbers among all contact points of the given ones of each body, (contact,)."""
        numbers: np.ndarray = np.concatenate(
            [start + each for start, each in zip(self._contact_starts, points, strict=True)]
        )
        return numbers

    def points_near(self, state: FullRobotState, time_step_s: float) -> list[np.ndarray]:
        """Points of each body that could reach the floor within a step of this length [s]."""
        velocities = [
            leg.contact_weights @ v for leg, v in zip(self.legs, state.velocities, strict=True)
        ]
        hub_map = self.hub.point_map(state.hub, self.hub.contact_points)
        velocities.append((hub_map @ state.hub.velocity).reshape(-1, 3))
        near = []
        for position, velocity in zip(self.contact_positions(state), velocities, strict=True):
            normal = self.floor.frames(position)[:, 0]
            speed = np.einsum("pa,pa->p", normal, velocity)
            coming = self.floor.gap(position) + time_step_s * np.minimum(speed, 0.0)
            near.append(np.flatnonzero(coming < self.settings.contact_margin_mm))
        return near

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
            The last sound state, and the trajectory; its status is ``diverged`` when a step failed
            in its smallest parts, and its metadata then says why.

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
        status, reason = "completed", None
        for number in trange(len(commands), disable=not progress, unit="step"):
            try:
                state = self.step(state, commands[number])
            except StepError as error:
                status, reason = "diverged", str(error)
                break
            recorder.watch(state)
            if observe is not None:
                observe(state)
            if (number + 1) % record_every == 0 or number + 1 == len(commands):
                recorder.record(number + 1, commands[number], state)
        return state, recorder.trajectory(status, reason, description)

    def settled_state(self, step_count: int = 15) -> FullRobotState:
        """Let the robot fall and settle without pressure, 15 steps in the paper's episodes.

        Raises:
            StepError: A step fails even in the smallest parts.
        """
        state, rest = self.initial_state(), np.zeros(self.settings.regulator_count)
        for _ in range(step_count):
            state = self.step(state, rest)
        return state
