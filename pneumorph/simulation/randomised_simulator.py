"""Robots in worlds that differ: groups of a batch, each with its own physics."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from pneumorph.physics.physics import Physics
from pneumorph.reduction.reduced_part import ReducedPart
from pneumorph.robot.robot import Hub, Mount, Robot
from pneumorph.robot.scaled_part import scaled_hub, scaled_part
from pneumorph.simulation.batched_simulator import BatchedSimulator
from pneumorph.simulation.randomisation import Randomisation, World
from pneumorph.simulation.stepper_settings import StepperSettings

LAG_STEPS = 5
"""A lagging command is renewed after this many time steps."""


class RandomisedSimulator:
    """A `CrawlingSimulator` whose robots live in different worlds.

    Robot i belongs to world i modulo the number of worlds. `redraw` draws new worlds; the worlds
    depend on the seeds alone, so a resumed training sees those that it would have seen.

    Args:
        robots: The robots.
        physics: Physics where nothing is drawn.
        randomisation: What to draw.
        seed: Of the draws.
        world_count: Worlds side by side.
        stepper: How steps are computed.
        thread_count: Threads of the engine; 0 takes every processor.

    Raises:
        ValueError: No robot or no world.
    """

    def __init__(
        self,
        robots: Sequence[Robot],
        physics: Physics,
        randomisation: Randomisation,
        seed: int = 0,
        world_count: int = 8,
        stepper: StepperSettings | None = None,
        thread_count: int = 0,
    ) -> None:
        if world_count < 1:
            raise ValueError(f"world_count is {world_count}, expected at least 1")
        self._physics, self._randomisation = physics, randomisation
        self._seed, self._world_count, self._threads = seed, world_count, thread_count
        self._stepper = stepper
        self._robots: Sequence[Robot] = robots
        self.redraw(0)

    def redraw(self, number: int) -> None:
        """Draw the worlds of a number and put every robot back to its start in them."""
        rng = np.random.default_rng([self._seed, number])
        self.worlds = [self._randomisation.draw(rng) for _ in range(self._world_count)]
        self.set_robots(self._robots)

    def set_robots(self, robots: Sequence[Robot]) -> None:
        """Replace every robot (any count) and reset all; the worlds stay."""
        if not robots:
            raise ValueError("robots is empty, expected at least one robot")
        self._robots = robots
        self._members = [
            np.arange(world, len(robots), self._world_count)
            for world in range(min(self._world_count, len(robots)))
        ]
        self._groups = [
            simulator_in_world(
                [robots[int(i)] for i in members],
                world,
                self._physics,
                self._stepper,
                self._threads,
            )
            for members, world in zip(self._members, self.worlds, strict=False)
        ]

    def reset(self, active: np.ndarray | None = None) -> None:
        """Put robots back to their initial state, (robot,) bool; None for all."""
        for members, group in zip(self._members, self._groups, strict=True):
            group.reset(None if active is None else np.asarray(active)[members])

    def advance(
        self, command_kPa: np.ndarray, step_count: int, active: np.ndarray | None = None
    ) -> None:
        """Hold a command [real kPa], (robot, regulator), for some time steps."""
        for members, group in zip(self._members, self._groups, strict=True):
            group.advance(
                np.asarray(command_kPa)[members],
                step_count,
                None if active is None else np.asarray(active)[members],
            )

    @property
    def forward_position_mm(self) -> np.ndarray:
        """How far forward each robot's tracked point is [mm], (robot,)."""
        return self._gathered([group.forward_position_mm for group in self._groups])

    @property
    def status(self) -> np.ndarray:
        """Status of each robot, (robot,) uint8."""
        return self._gathered([group.status for group in self._groups]).astype(np.uint8)

    @property
    def range_ratio(self) -> np.ndarray:
        """As `BatchedSimulator.range_ratio` has it, (robot,)."""
        return self._gathered([group.range_ratio for group in self._groups])

    def _gathered(self, values: list[np.ndarray]) -> np.ndarray:
        result = np.zeros(len(self._robots))
        for members, value in zip(self._members, values, strict=True):
            result[members] = value
        return result


class LaggingSimulator:
    """A simulator whose regulators follow their command like a first-order filter.

    The filter acts before the regulators' rate limit: after a time t of one command c the filtered
    one is c + (c_0 - c) exp(-t / lag).
    """

    def __init__(self, simulator: BatchedSimulator, lag_s: float) -> None:
        self._simulator, self._lag_s = simulator, lag_s
        self._filtered = self._zero()

    def reset(self, active: np.ndarray | None = None) -> None:
        """Put robots back to their initial state."""
        self._simulator.reset(active)
        chosen = np.ones(len(self._filtered), bool) if active is None else np.asarray(active, bool)
        self._filtered[chosen] = 0.0

    def set_robots(self, robots: Sequence[Robot]) -> None:
        """Replace every robot and reset all."""
        self._simulator.set_robots(robots)
        self._filtered = self._zero()

    def advance(
        self, command_kPa: np.ndarray, step_count: int, active: np.ndarray | None = None
    ) -> None:
        """Hold a command for some time steps while the regulators approach it."""
        if self._lag_s == 0.0:
            self._simulator.advance(command_kPa, step_count, active)
            return
        command = np.asarray(command_kPa, dtype=float)
        moving = np.ones(len(command), bool) if active is None else np.asarray(active, bool)
        for begin in range(0, step_count, LAG_STEPS):
            count = min(LAG_STEPS, step_count - begin)
            kept = math.exp(-count * self._simulator.physics.time_step_s / self._lag_s)
            new = command + (self._filtered - command) * kept
            self._filtered = np.where(moving[:, None], new, self._filtered)
            self._simulator.advance(self._filtered, count, active)

    @property
    def forward_position_mm(self) -> np.ndarray:
        """How far forward each robot's tracked point is [mm], (robot,)."""
        return self._simulator.forward_position_mm

    @property
    def status(self) -> np.ndarray:
        """Status of each robot, (robot,) uint8."""
        return self._simulator.status

    @property
    def range_ratio(self) -> np.ndarray:
        """As `BatchedSimulator.range_ratio` has it, (robot,)."""
        return self._simulator.range_ratio

    def _zero(self) -> np.ndarray:
        return np.zeros((len(self._simulator.robots), self._simulator.physics.regulator_count))


def simulator_in_world(
    robots: Sequence[Robot],
    world: World,
    physics: Physics,
    stepper: StepperSettings | None = None,
    thread_count: int = 0,
) -> LaggingSimulator:
    """A simulator of robots in a world; a part that robots share is scaled once."""
    parts: dict[int, ReducedPart] = {}
    hubs: dict[int, Hub] = {}

    def part_of(mount: Mount) -> ReducedPart:
        key = id(mount.part)
        if key not in parts:
            parts[key] = scaled_part(mount.part, world.modulus_factor, world.mass_factor)
        return parts[key]

    scaled = []
    for robot in robots:
        hub = hubs.setdefault(id(robot.hub), scaled_hub(robot.hub, world.mass_factor))
        mounts = tuple(Mount(part_of(m), m.pose, m.regulators) for m in robot.mounts)
        scaled.append(Robot(hub, mounts, robot.design))
    batch = BatchedSimulator(scaled, world.applied_to(physics), stepper, thread_count)
    return LaggingSimulator(batch, world.regulator_lag_s)
