"""Robots in worlds that differ, side by side in one batch."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cache, partial
from pathlib import Path
from typing import Any

import numpy as np

from pneumorph.physics.physics import Physics
from pneumorph.reduction.fewer_modes import MODE_LIMIT, with_fewer_modes
from pneumorph.reduction.reduced_part import ReducedPart
from pneumorph.robot.mounting_angle import tilted
from pneumorph.robot.robot import Robot
from pneumorph.robot.scaled_part import factors_between, with_factors
from pneumorph.simulation.batched_simulator import BatchedSimulator
from pneumorph.simulation.randomisation import Randomisation, World
from pneumorph.simulation.regulator_lag import RegulatorLag
from pneumorph.simulation.stepper_settings import StepperSettings
from pneumorph.simulation.told_readings import ToldReadings


class RandomisedSimulator(ToldReadings):
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
        make: Makes what simulates robots in worlds, as `simulator_in_worlds` does, somewhere else;
            None for this process.
        nominal_until: What is redrawn by a lower number is the nominal world.

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
        make: Callable[[Sequence[Robot], Sequence[World]], Any] | None = None,
        nominal_until: int = 0,
    ) -> None:
        if world_count < 1:
            raise ValueError(f"world_count is {world_count}, expected at least 1")
        self._randomisation, self._seed, self._world_count = randomisation, seed, world_count
        self._make = make or partial(
            simulator_in_worlds, physics=physics, stepper=stepper, thread_count=thread_count
        )
        self._nominal, self._nominal_until = World.nominal(physics), nominal_until
        self._simulator: LaggingSimulator | None = None
        self._robots: Sequence[Robot] = robots
        self.redraw(0)

    def redraw(self, number: int) -> None:
        """Draw the worlds of a number and put every robot back to its start in them."""
        count = self._world_count
        if number < self._nominal_until:
            self.worlds = [self._nominal] * count
        else:
            self.worlds = worlds_of_round(self._randomisation, self._seed, number, count)
        self.set_robots(self._robots)

    def set_robots(self, robots: Sequence[Robot]) -> None:
        """Replace every robot (any count) and reset all; the worlds stay."""
        worlds = [self.worlds[robot % self._world_count] for robot in range(len(robots))]
        if self._simulator is None:
            self._simulator = self._make(robots, worlds)
        else:
            self._simulator.set_robots(robots, worlds)
        self._robots = robots

    def reset(self, active: np.ndarray | None = None) -> None:
        """Put robots back to their initial state, (robot,) bool; None for all."""
        self._lagging.reset(active)

    def forget_range(self, active: np.ndarray | None = None) -> None:
        """As `BatchedSimulator.forget_range` does."""
        self._lagging.forget_range(active)

    def advance(
        self, command_kPa: np.ndarray, step_count: int, active: np.ndarray | None = None
    ) -> None:
        """Hold a command [real kPa], (robot, regulator), for some time steps."""
        self._lagging.advance(command_kPa, step_count, active)

    def _told(self, name: str) -> np.ndarray:
        reading: np.ndarray = getattr(self._lagging, name)
        return reading

    @property
    def _lagging(self) -> LaggingSimulator:
        assert self._simulator is not None, "made by the first draw"
        return self._simulator


def worlds_of_round(
    randomisation: Randomisation, seed: int, number: int, count: int
) -> list[World]:
    """The worlds that `RandomisedSimulator.redraw` draws for a number.

    Args:
        randomisation: What to draw.
        seed: Of the simulator.
        number: Of the draw.
        count: Worlds side by side.
    """
    rng = np.random.default_rng([seed, number])
    return [randomisation.draw(rng) for _ in range(count)]


class LaggingSimulator(ToldReadings):
    """A simulator whose regulators lag, each robot's as its world has it (`RegulatorLag`)."""

    def __init__(self, simulator: BatchedSimulator, worlds: Sequence[World]) -> None:
        self.simulator = simulator
        self._begin(worlds)

    def _begin(self, worlds: Sequence[World]) -> None:
        physics = self.simulator.physics
        self._worlds = worlds
        lag_s = np.array([world.regulator_lag_s for world in worlds])
        self._lags = bool(lag_s.any())
        self._lag = RegulatorLag(lag_s, physics.regulator_count, physics.time_step_s)

    def reset(self, active: np.ndarray | None = None) -> None:
        """Put robots back to their initial state."""
        self.simulator.reset(active)
        self._lag.reset(self._chosen(active))

    def forget_range(self, active: np.ndarray | None = None) -> None:
        """As `BatchedSimulator.forget_range` does."""
        self.simulator.forget_range(active)

    def set_robots(self, robots: Sequence[Robot], worlds: Sequence[World] | None = None) -> None:
        """Replace every robot and reset all.

        Args:
            robots: The robots.
            worlds: The world of each; None for those of the robots before, of as many.
        """
        worlds = self._worlds if worlds is None else worlds
        placed = [robot_in_world(robot, own) for robot, own in zip(robots, worlds, strict=True)]
        self.simulator.set_robots(placed, worlds)
        self._begin(worlds)

    def advance(
        self, command_kPa: np.ndarray, step_count: int, active: np.ndarray | None = None
    ) -> None:
        """Hold a command for some time steps while the regulators approach it."""
        if not self._lags:
            self.simulator.advance(command_kPa, step_count, active)
            return
        command, moving = np.asarray(command_kPa, dtype=float), self._chosen(active)
        while step_count > 0:
            self._lag.ask(command, moving)
            count = min(self._lag.steps_left(moving), step_count)
            self.simulator.advance(self._lag.held_kPa(), count, active)
            self._lag.go_on(count, moving)
            step_count -= count

    def _chosen(self, active: np.ndarray | None) -> np.ndarray:
        if active is None:
            return np.ones(len(self._worlds), dtype=bool)
        return np.asarray(active, dtype=bool)

    def _told(self, name: str) -> np.ndarray:
        reading: np.ndarray = getattr(self.simulator, name)
        return reading


def simulator_in_worlds(
    robots: Sequence[Robot],
    worlds: Sequence[World],
    physics: Physics,
    stepper: StepperSettings | None = None,
    thread_count: int = 0,
) -> LaggingSimulator:
    """A simulator of robots, each in its world; parts are shared by all.

    Raises:
        ValueError: As `BatchedSimulator`, or a world names a reduction of other cavities.
    """
    placed = [robot_in_world(robot, own) for robot, own in zip(robots, worlds, strict=True)]
    batch = BatchedSimulator(placed, physics, stepper, thread_count, worlds)
    return LaggingSimulator(batch, worlds)


def robot_in_world(robot: Robot, world: World) -> Robot:
    """The robot with its legs mounted and reduced as in a world; the same where that is as usual.

    Raises:
        ValueError: A leg's own part has another number of cavities than the world's reduction.
    """
    if not world.reduction and world.mounting_angle_deg == 0.0:
        return robot
    mounts = []
    for mount in robot.mounts:
        part = mount.part if not world.reduction else _alike(world.reduction, mount.part)
        pose = tilted(mount.pose, part.rest_nodes, world.mounting_angle_deg)
        mounts.append(replace(mount, part=part, pose=pose))
    return replace(robot, mounts=tuple(mounts))


def reduction_digests(randomisation: Randomisation) -> dict[str, str]:
    """What tells the reductions that worlds may have from others, by their files."""
    return {str(file): digest_of_part(str(file)) for file in randomisation.reductions}


def digest_of_part(file: str) -> str:
    """Hash of the content of a reduction that worlds may have."""
    return part_of_file(file).digest()


def part_of_file(file: str) -> ReducedPart:
    """A reduction that worlds may have, read again where its file was written since: what tells
    runs apart asks for it as they begin, and all that they draw is of what was read then.

    Raises:
        FileNotFoundError: No such file.
    """
    known = _written_ns.get(file)
    if known is not None and known != _last_written_ns(file):
        _part_of.cache_clear()
        _changed.cache_clear()
    return _part_of(file)


def _alike(file: str, own: ReducedPart) -> ReducedPart:
    """The reduction of a file as the robot's own leg is."""
    return _changed(file, own.metadata.get(MODE_LIMIT), *factors_between(_part_of(file), own))


_written_ns: dict[str, int] = {}
"""When each file had been written that was read [ns]."""


def _last_written_ns(file: str) -> int:
    """When a file was written last [ns]; 0 without one, which loading it tells."""
    return Path(file).stat().st_mtime_ns if Path(file).exists() else 0


@cache
def _changed(file: str, mode_limit: int | None, *factors: float) -> ReducedPart:
    part = _part_of(file)
    part = part if mode_limit is None else with_fewer_modes(part, mode_limit)
    return with_factors(part, *factors)


@cache
def _part_of(file: str) -> ReducedPart:
    _written_ns[file] = _last_written_ns(file)
    return ReducedPart.load(file)
