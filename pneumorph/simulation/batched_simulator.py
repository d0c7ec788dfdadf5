"""Many reduced robots advanced side by side: the Python face of the compiled stepper."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields
from enum import IntEnum
from typing import Any

import numpy as np

import pneumorph._engine as _engine
from pneumorph.base.heading import heading_deg
from pneumorph.base.machine import processor_count
from pneumorph.physics.physics import Physics
from pneumorph.reduction.reduced_part import ReducedPart
from pneumorph.robot.robot import Hub, Robot
from pneumorph.simulation.engine_arrays import (
    conditions,
    contact_friction,
    engine_settings,
    floor_height,
    ground_arrays,
    part_arrays,
    pressure_rates,
)
from pneumorph.simulation.randomisation import World
from pneumorph.simulation.reduced_state import ReducedState
from pneumorph.simulation.stepper_settings import StepperSettings

STAGES = ("elements", "inertia", "factorisation", "contact_setup", "friction", "integration")
"""What the stepper's time is spent on, in the order of a step."""


_STATE = tuple(each.name for each in fields(ReducedState) if each.name != "memory")


class RobotStatus(IntEnum):
    """How a robot's simulation stands."""

    RUNNING = 0
    DIVERGED = 1
    """Not finite or too fast; the robot stands still where it was last sound."""
    SINGULAR = 2
    """Its system was not positive definite; likewise."""


class BatchedSimulator:
    """Robots advanced in parallel over threads, each alone: one that diverges harms no other.

    The same robot gives the same bits with any number of threads, and in any batch of parts that
    have as many modes, rounded up to whole eights; beside larger ones sums are grouped otherwise.
    """

    def __init__(
        self,
        robots: Sequence[Robot],
        physics: Physics | None = None,
        stepper: StepperSettings | None = None,
        thread_count: int = 0,
        worlds: Sequence[World] | None = None,
    ) -> None:
        """Put robots at rest in the pose that their physics start in, with no pressure.

        Args:
            robots: The robots; parts may be shared between them.
            physics: What acts on them; None for the published physics.
            stepper: How steps are computed; None for the usual numerics.
            thread_count: Threads to use; 0 takes every processor this process may run on.
            worlds: The world of each robot, see `set_robots`; None for one that is as it stands.

        Raises:
            FileNotFoundError: No file of a ground.
            ValueError: No robot, another number of worlds, a ground whose file is no grid of
                heights, an unknown regulator, or a part of too many modes, of a law that the
                compiled stepper does not know, or that relaxes under published damping.
        """
        self.physics = physics or Physics()
        self.stepper = stepper or StepperSettings()
        self.thread_count = thread_count or processor_count()
        self._parts: list[ReducedPart] = []
        self._batch: Any = None
        self.set_robots(robots, worlds)

    def set_robots(self, robots: Sequence[Robot], worlds: Sequence[World] | None = None) -> None:
        """Replace all robots; every one starts from rest. A refused call changes nothing, and what
        was simulated before makes no difference.

        Friction, slope, ground, air, damping and the factors on moduli and masses are each robot's
        own, without a copy of its parts or of a ground: (44) of docs/physics.md. A world's lag,
        mounting angle and reduction are seen to by `RandomisedSimulator`.

        Args:
            robots: The robots.
            worlds: The world of each; None for one that is as it stands.

        Raises:
            FileNotFoundError: As of the constructor.
            ValueError: Likewise.
        """
        if not robots:
            raise ValueError("robots is empty, expected at least one robot")
        if worlds is not None and len(worlds) != len(robots):
            raise ValueError(
                f"got {len(worlds)} worlds for {len(robots)} robots, expected one for each"
            )
        of_world = {world: world.applied_to(self.physics) for world in set(worlds or ())}
        physics = [of_world[world] for world in worlds] if worlds else [self.physics] * len(robots)
        used = {id(mount.part): mount.part for robot in robots for mount in robot.mounts}
        hubs: dict[int, tuple[int, Hub]] = {}
        for robot in robots:
            hubs.setdefault(id(robot.hub), (len(hubs), robot.hub))
        frictions = [
            contact_friction(robot, own) for robot, own in zip(robots, physics, strict=True)
        ]
        uneven = dict.fromkeys(own.ground for own in physics if not own.ground.is_plane)
        grounds = {ground: (number, ground.grid()) for number, ground in enumerate(uneven)}
        heights = [floor_height(*each) for each in zip(robots, physics, strict=True)]
        starts = [
            own.start_pose(robot.standing_points)
            for robot, own in zip(robots, physics, strict=True)
        ]
        batch, parts = self._batch, self._parts
        if batch is None or used.keys() != {id(part) for part in parts}:
            parts = list(used.values())
            batch = _engine.Batch(
                [part_arrays(part, self.physics) for part in parts],
                engine_settings(self.physics, self.stepper),
                self.stepper.element_precision == "single",
                self.stepper.instruction_set,
            )
        number_of = {id(part): number for number, part in enumerate(parts)}
        batch.set_robots(
            [
                (hub.mass, hub.first_moment, hub.second_moment, hub.contact_points)
                for _, hub in hubs.values()
            ],
            [
                (
                    hubs[id(robot.hub)][0],
                    [
                        (
                            number_of[id(mount.part)],
                            np.ascontiguousarray(mount.pose.rotation, dtype=float),
                            np.ascontiguousarray(mount.pose.translation, dtype=float),
                            list(mount.regulators),
                        )
                        for mount in robot.mounts
                    ],
                    pressure_rates(robot, own),
                    friction,
                    conditions(own, worlds[number] if worlds else None, heights[number]),
                    grounds[own.ground][0] if own.ground in grounds else -1,
                )
                for number, (robot, friction, own) in enumerate(
                    zip(robots, frictions, physics, strict=True)
                )
            ],
            [ground_arrays(grid) for _, grid in grounds.values()],
        )
        self._batch, self._parts = batch, parts
        self.robots, self._starts = tuple(robots), starts
        self._tracked = np.array([robot.hub.tracked_point for robot in robots])
        for number in range(len(robots)):
            self._place(number)

    def reset(self, active: np.ndarray | None = None) -> None:
        """Put robots back to rest in the pose that their physics start in.

        Args:
            active: Which robots, (robot,) bool; None for all.
        """
        for robot in np.flatnonzero(self._mask(active)):
            self._batch.reset(int(robot))
            self._place(int(robot))

    def forget_range(self, active: np.ndarray | None = None) -> None:
        """Begin `range_ratio` afresh, such as once robots have settled.

        Args:
            active: Which robots, (robot,) bool; None for all.
        """
        for robot in np.flatnonzero(self._mask(active)):
            self._batch.forget_range(int(robot))

    def _place(self, robot: int) -> None:
        # The engine resets robots to the frame of their file.
        if (pose := self._starts[robot]) is not None:
            self.write(robot, "position", pose.translation)
            self.write(robot, "rotation", pose.rotation)

    def advance(
        self,
        command_kPa: np.ndarray,
        step_count: int,
        active: np.ndarray | None = None,
        profile: bool = False,
    ) -> None:
        """Hold a command for some time steps.

        Args:
            command_kPa: Real pressure asked of each regulator [kPa], (robot, regulator).
            step_count: Number of time steps.
            active: Which robots move, (robot,) bool; None for all.
            profile: Add the time of each stage to `stage_seconds`.

        Raises:
            ValueError: Wrong shape, or a pressure that is negative or not finite.
        """
        command = np.ascontiguousarray(command_kPa, dtype=float)
        shape = (len(self.robots), self.physics.regulator_count)
        if command.shape != shape:
            raise ValueError(
                f"command_kPa has shape {command.shape}, expected (robot, regulator) = {shape}"
            )
        if not np.all(np.isfinite(command)) or np.any(command < 0.0):
            worst = command[~np.isfinite(command) | (command < 0.0)][0]
            raise ValueError(
                f"command_kPa must be finite and not negative [kPa], got {worst}; a regulator can "
                "only inflate"
            )
        if step_count < 0:
            raise ValueError(f"step_count must not be negative, got {step_count}")
        self._batch.advance(command, step_count, self._mask(active), self.thread_count, profile)

    def _mask(self, active: np.ndarray | None) -> np.ndarray:
        if active is None:
            return np.ones(len(self.robots), dtype=bool)
        mask = np.ascontiguousarray(active, dtype=bool)
        if mask.shape != (len(self.robots),):
            raise ValueError(f"active has shape {mask.shape}, expected ({len(self.robots)},)")
        return mask

    def read(self, name: str) -> np.ndarray:
        """One quantity of every robot, robot axis first.

        Args:
            name: ``position`` [mm], ``rotation``, ``velocity`` [mm/s], ``angular_velocity``
                [rad/s] of the hub; ``modes``, ``mode_rates`` (robot, mount, mode), padded with
                zeros; ``regulated`` [real kPa]; ``impulses`` [mN s] (robot, contact point, 3),
                hub's points first, along z, x, y, or the normal and tangents of the ground below
                the point; ``springs`` (robot, mount, branch, point, 6) of
                parts that relax, as in `ReducedState`; ``active_contacts`` (points the
                friction was solved for), ``newton_steps``, ``sweeps``, ``contact_residual`` [mm/s]
                of the last step; and since `clear_counters` ``step_count``, ``contact_total``,
                ``newton_total``, ``sweep_total``, ``tangent_total`` (stiffnesses found afresh, of
                all mounts), ``unconverged_total`` (steps whose friction ended above the
                tolerance), ``worst_residual`` [mm/s] and ``worst_penetration`` [mm];
                ``tangent_error_total`` (predictions of what a kept stiffness lacks that were wrong
                by more than the tolerance, of all mounts) and ``worst_tangent_error`` [mm/s].
        """
        values: np.ndarray = self._batch.read(name)
        return values

    def write(self, robot: int, name: str, values: np.ndarray) -> None:
        """Overwrite position, rotation, velocity, angular_velocity, modes (mount, padded mode),
        mode_rates, regulated, impulses or, after the modes, springs of one robot, which forgets its
        kept stiffnesses."""
        self._batch.write(robot, name, np.ascontiguousarray(values, dtype=float).ravel())

    def memory(self, robot: int) -> bytes:
        """What one robot keeps of its last step: its legs' stiffness, and springs to the last bit.

        With it a robot goes on to the same bits elsewhere; for simulators of this process only.
        """
        return bytes(self._batch.memory(robot))

    def set_memory(self, robot: int, memory: bytes) -> None:
        """Take over what `memory` gave, after everything was written; empty to forget.

        Raises:
            ValueError: It is of another robot, precision or instruction set.
        """
        self._batch.set_memory(robot, memory)

    def state(self, robot: int) -> ReducedState:
        """The state of one robot, with its memory."""
        hub, mounts = self.robots[robot].hub, self.robots[robot].mounts
        points = len(hub.contact_points) + sum(len(m.part.contact_points) for m in mounts)
        own = dict.fromkeys(("modes", "mode_rates", "springs"), len(mounts)) | {"impulses": points}
        values = {name: self.read(name)[robot][: own.get(name)] for name in _STATE}
        return ReducedState(**values, memory=self.memory(robot))

    def set_state(self, robot: int, state: ReducedState) -> None:
        """Let one robot go on from a state, also one whose simulation failed.

        Raises:
            ValueError: The state is of another robot, precision or instruction set.
        """
        own = self.state(robot)
        for name in _STATE:
            told, expected = np.size(getattr(state, name)), np.size(getattr(own, name))
            if told != expected:
                raise ValueError(
                    f"{name} has {told} numbers, expected {expected}; the state is of another robot"
                )
        self.set_memory(robot, state.memory)  # refused before anything else is written
        if self.status[robot] != RobotStatus.RUNNING:
            self._batch.reset(robot)
        for name in _STATE:
            self.write(robot, name, getattr(state, name))
        self.set_memory(robot, state.memory)

    @property
    def tracked_point_mm(self) -> np.ndarray:
        """World position of each hub's tracked point [mm], (robot, 3)."""
        return self.read("position") + np.einsum("rij,rj->ri", self.read("rotation"), self._tracked)

    @property
    def forward_position_mm(self) -> np.ndarray:
        """How far forward (x) each robot's tracked point is [mm], (robot,)."""
        return self.tracked_point_mm[:, 0]

    @property
    def left_position_mm(self) -> np.ndarray:
        """How far left (y) each robot's tracked point is [mm], (robot,)."""
        return self.tracked_point_mm[:, 1]

    @property
    def heading_deg(self) -> np.ndarray:
        """Direction of each hub's x axis in the plane, from x to y [degrees], (robot,); NaN of one
        that is tipped over, see `pneumorph.base.heading`."""
        return heading_deg(self.read("rotation"))

    @property
    def tilt_deg(self) -> np.ndarray:
        """Angle between each hub's upward axis and the floor's normal [degrees], (robot,)."""
        upward: np.ndarray = self.read("rotation")[:, 2, 2]
        return np.degrees(np.arccos(np.clip(upward, -1.0, 1.0)))

    @property
    def status(self) -> np.ndarray:
        """`RobotStatus` of each robot, (robot,) uint8."""
        return self.read("status").astype(np.uint8)

    @property
    def range_ratio(self) -> np.ndarray:
        """How far any leg of each robot has been from rest since it was reset, or since
        `forget_range`, relative to the furthest snapshot it was reduced from, (robot,).

        Above 1 the reduced leg extrapolates, see `left_range`; NaN where no leg knows its range.
        """
        return self.read("range_ratio")

    @property
    def hub_load_share(self) -> np.ndarray:
        """Share of the floor's normal force on each robot that its hub bears in the last step,
        (robot,); 0 where nothing touches."""
        normal = self.read("impulses")[:, :, 0]
        hub_counts = np.array([len(robot.hub.contact_points) for robot in self.robots])
        on_hub = np.arange(normal.shape[1]) < hub_counts[:, None]
        total, hub = normal.sum(axis=1), np.where(on_hub, normal, 0.0).sum(axis=1)
        share: np.ndarray = np.divide(hub, total, out=np.zeros(len(total)), where=total > 0.0)
        return share

    @property
    def stage_seconds(self) -> dict[str, float]:
        """Thread time of each stage since `clear_counters`, where profiling was asked for [s]."""
        return dict(zip(STAGES, self._batch.stages(), strict=True))

    def clear_counters(self) -> None:
        """Set the counters, the stages' times and the worst values to zero."""
        self._batch.clear_counters()

    @property
    def instruction_set(self) -> str:
        """Which build of the stepper runs."""
        return str(self._batch.instruction_set)
