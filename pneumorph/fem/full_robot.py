"""A whole robot at full order: legs of finite elements on a hub, on a floor with friction.

One linearly implicit Euler step with Rayleigh damping (Baraff and Witkin 1998; the paper's
equation for dv), solved for the new velocity:

    ((1 + alpha h) M + h (h + beta) K) v_new = M v_old + h f + H^T lambda,

f elastic, pressure and weight at the old positions; lambda impulses that obey, at every contact,

    0 <= v_n + gap / h  perp  lambda_n >= 0,   |lambda_t| <= mu lambda_n, opposite to any sliding,

normal and tangents those of the floor below each point.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from pneumorph.fem.contact_points import Contacts, linearise_contacts
from pneumorph.fem.contact_solve import solve_contacts
from pneumorph.fem.floor import Floor
from pneumorph.fem.full_order_settings import FullOrderSettings
from pneumorph.fem.mounted_leg import CondensedLeg, MountedLeg
from pneumorph.fem.part_model import PartModel
from pneumorph.fem.rigid_hub import RigidHub, RigidHubState
from pneumorph.fem.soft_hub import SoftHub, SoftHubState
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
    """Contact impulses of the last step: normal, tangent, tangent (on a plane z, x, y) [mN s],
    (contact point, 3); legs' points first, then the hub's."""
    contact_velocities: np.ndarray
    """Velocities of the contact points after the last step, in the same rows [mm/s], (contact
    point, 3): a pressed point sticks where the tangents' are zero. Zero too for points that took no
    part."""
    active_contacts: int = 0
    """Contact points that took part in the last step."""
    contact_residual: float = 0.0
    """Contact law violated by at most this in the last step [mm/s]."""
    penetration_mm: float = 0.0
    """Depth of the deepest contact point below the floor [mm]."""


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

    def contact_positions(self, state: FullRobotState) -> tuple[np.ndarray, ...]:
        """Where the contact points of each leg, and last the hub's, are [mm], each (point, 3)."""
        legs = (leg.contact_weights @ x for leg, x in zip(self.legs, state.positions, strict=True))
        return (*legs, self.hub.point_positions(state.hub, self.hub.contact_points))

    def step(self, state: FullRobotState, command_kPa: np.ndarray) -> FullRobotState:
        """Advance by one time step.

        The floor is linearised at the step's start. Where a point ends too deep, because the floor
        bends or it came from beyond the margin, the step is solved again with the floor linearised
        at its end.

        Args:
            state: Where the robot is.
            command_kPa: Real pressure asked of each regulator [kPa], (regulator,).

        Raises:
            numpy.linalg.LinAlgError: A matrix of the step is not positive definite.
        """
        settings = self.settings
        regulated = rate_limit(
            state.regulated_kPa, command_kPa, settings.pressure_rate_kPa_per_s, settings.time_step_s
        )
        start = self.contact_positions(state)
        points = self._points_near(state, start)
        now, new = start, state
        for _ in range(settings.contact_passes):
            moved = [after - before for after, before in zip(now, start, strict=True)]
            contacts = linearise_contacts(self.floor, points, now, moved)
            new = self._step_on(state, regulated, contacts, new.impulses)
            now = self.contact_positions(new)
            gaps = [self.floor.gap(each) for each in now]
            deepest = max(0.0, *(-float(gap.min(initial=0.0)) for gap in gaps))
            if not deepest > settings.penetration_tolerance_mm:
                break
            points = [
                np.union1d(p, np.flatnonzero(g < 0.0)) for p, g in zip(points, gaps, strict=True)
            ]
        return replace(new, penetration_mm=deepest)

    def _step_on(
        self,
        state: FullRobotState,
        regulated: np.ndarray,
        contacts: Contacts,
        warm_start: np.ndarray,
    ) -> FullRobotState:
        """One step with the given pressures [real kPa] on a linearised floor."""
        settings, hub, active = self.settings, self.hub, contacts.points
        pressure = settings.pressure_map.simulated(regulated)

        matrix, right = hub.system(state.hub, settings)
        condensed: list[CondensedLeg] = []
        ties: list[np.ndarray] = []
        for leg, x, v, points, frames in zip(
            self.legs, state.positions, state.velocities, active, contacts.frames, strict=False
        ):
            share = leg.condense(x, v, float(pressure[leg.regulator]), points, frames, settings)
            tie = hub.point_map(state.hub, leg.attachment_in_hub)
            matrix += tie.T @ share.attachment_matrix @ tie
            right += tie.T @ share.attachment_right
            condensed.append(share)
            ties.append(tie)

        hub_points = contacts.frames[-1] @ hub.point_map(
            state.hub, hub.contact_points[active[-1]]
        ).reshape(-1, 3, hub.unknown_count)
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
        solution = solve_contacts(
            matrix,
            right,
            coupling,
            [share.delassus for share in condensed],
            np.concatenate(
                [*(share.contact_right for share in condensed), np.zeros(3 * len(hub_points))]
            ),
            contacts.gaps,
            warm_start[numbers],
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
        impulses, contact_velocities = np.zeros((2, self.contact_point_count, 3))
        impulses[numbers], contact_velocities[numbers] = solution.impulses, solution.velocities
        return FullRobotState(
            hub=new_hub,
            positions=tuple(positions),
            velocities=tuple(velocities),
            regulated_kPa=regulated,
            impulses=impulses,
            contact_velocities=contact_velocities,
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
            recorder.watch(state)
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

    def _points_near(
        self, state: FullRobotState, positions: Sequence[np.ndarray]
    ) -> list[np.ndarray]:
        """Points of each body, at these positions, that could reach the floor within the step."""
        velocities = [
            leg.contact_weights @ v for leg, v in zip(self.legs, state.velocities, strict=True)
        ]
        hub_map = self.hub.point_map(state.hub, self.hub.contact_points)
        velocities.append((hub_map @ state.hub.velocity).reshape(-1, 3))
        step, margin = self.settings.time_step_s, self.settings.contact_margin_mm
        near = []
        for position, velocity in zip(positions, velocities, strict=True):
            normal = self.floor.frames(position)[:, 0]
            speed = np.einsum("pa,pa->p", normal, velocity)
            coming = self.floor.gap(position) + step * np.minimum(speed, 0.0)
            near.append(np.flatnonzero(coming < margin))
        return near
