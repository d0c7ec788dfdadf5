"""Robots in worlds that differ, side by side in one batch."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cache, partial
from typing import Any

import numpy as np

from pneumorph.physics.physics import Physics
from pneumorph.reduction.fewer_modes import MODE_LIMIT, with_fewer_modes
from pneumorph.reduction.reduced_part import ReducedPart
from pneumorph.robot.mounting_angle import tilted
from pneumorph.robot.resized_part import resized_part
from pneumorph.robot.robot import Robot
from pneumorph.robot.scaled_part import factors_between, scaled_part
from pneumorph.simulation.batched_simulator import BatchedSimulator
from pneumorph.simulation.randomisation import Randomisation, World
from pneumorph.simulation.stepper_settings import StepperSettings

LAG_STEPS = 5
"""A lagging command is renewed after this many time steps, and held at its mean over them."""


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
        self._robots = robots
        worlds = [self.worlds[robot % self._world_count] for robot in range(len(robots))]
        if self._simulator is None:
            self._simulator = self._make(robots, worlds)
        else:
            self._simulator.set_robots(robots, worlds)

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

    @property
    def forward_position_mm(self) -> np.ndarray:
        """How far forward each robot's tracked point is [mm], (robot,)."""
        return self._lagging.forward_position_mm

    @property
    def left_position_mm(self) -> np.ndarray:
        """As `BatchedSimulator.left_position_mm` has it, (robot,)."""
        return self._lagging.left_position_mm

    @property
    def heading_deg(self) -> np.ndarray:
        """As `BatchedSimulator.heading_deg` has it, (robot,)."""
        return self._lagging.heading_deg

    @property
    def status(self) -> np.ndarray:
        """Status of each robot, (robot,) uint8."""
        return self._lagging.status

    @property
    def range_ratio(self) -> np.ndarray:
        """As `BatchedSimulator.range_ratio` has it, (robot,)."""
        return self._lagging.range_ratio

    @property
    def hub_load_share(self) -> np.ndarray:
        """As `BatchedSimulator.hub_load_share` has it, (robot,)."""
        return self._lagging.hub_load_share

    @property
    def tilt_deg(self) -> np.ndarray:
        """As `BatchedSimulator.tilt_deg` has it, (robot,)."""
        return self._lagging.tilt_deg

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


def lagging_commands(commands_kPa: np.ndarray, lag_s: float, time_step_s: float) -> np.ndarray:
    """Commands of a whole gait as `LaggingSimulator` passes them on [kPa], (step, regulator).

    Args:
        commands_kPa: Of the gait [kPa], (step, regulator).
        lag_s: Time constant [s]; 0 for none.
        time_step_s: Time step [s].
    """
    if lag_s == 0.0:
        return commands_kPa
    lagging = np.zeros_like(commands_kPa)
    kept, mean = _remaining(np.array(lag_s), LAG_STEPS * time_step_s)
    now = np.zeros(commands_kPa.shape[1])
    for begin in range(0, len(commands_kPa), LAG_STEPS):
        command = commands_kPa[begin]
        lagging[begin : begin + LAG_STEPS] = command + (now - command) * mean
        now = command + (now - command) * kept
    return lagging


def _remaining(lag_s: np.ndarray, time_s: float) -> tuple[np.ndarray, np.ndarray]:
    """Which share of its distance to a command a first-order filter still has after a time, and has
    on average until then: exp(-t / lag), and (1 - exp(-t / lag)) lag / t."""
    with np.errstate(divide="ignore"):  # without a lag nothing is kept
        kept = np.exp(-time_s / lag_s)
    return kept, (1.0 - kept) * lag_s / time_s


class LaggingSimulator:
    """A simulator whose regulators follow their command like a first-order filter, each robot's as
    its world has it.

    The filter acts before the regulators' rate limit or air: after a time t of one command c the
    filtered one is c + (c_0 - c) exp(-t / lag). For a few steps at a time its mean over them is
    passed on, so that commands come as late as they should.
    """

    def __init__(self, simulator: BatchedSimulator, worlds: Sequence[World]) -> None:
        self.simulator = simulator
        self._begin(worlds)

    def _begin(self, worlds: Sequence[World]) -> None:
        self._worlds = worlds
        self._lag_s = np.array([world.regulator_lag_s for world in worlds])[:, None]
        self._filtered = np.zeros((len(worlds), self.simulator.physics.regulator_count))

    def reset(self, active: np.ndarray | None = None) -> None:
        """Put robots back to their initial state."""
        self.simulator.reset(active)
        chosen = np.ones(len(self._filtered), bool) if active is None else np.asarray(active, bool)
        self._filtered[chosen] = 0.0

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
        if not self._lag_s.any():
            self.simulator.advance(command_kPa, step_count, active)
            return
        command = np.asarray(command_kPa, dtype=float)
        moving = np.ones(len(command), bool) if active is None else np.asarray(active, bool)
        for begin in range(0, step_count, LAG_STEPS):
            count = min(LAG_STEPS, step_count - begin)
            time_s = count * self.simulator.physics.time_step_s
            kept, mean = _remaining(self._lag_s, time_s)
            away = np.where(moving[:, None], self._filtered - command, 0.0)
            self.simulator.advance(command + away * mean, count, active)
            self._filtered = np.where(moving[:, None], command + away * kept, self._filtered)

    @property
    def forward_position_mm(self) -> np.ndarray:
        """How far forward each robot's tracked point is [mm], (robot,)."""
        return self.simulator.forward_position_mm

    @property
    def left_position_mm(self) -> np.ndarray:
        """As `BatchedSimulator.left_position_mm` has it, (robot,)."""
        return self.simulator.left_position_mm

    @property
    def heading_deg(self) -> np.ndarray:
        """As `BatchedSimulator.heading_deg` has it, (robot,)."""
        return self.simulator.heading_deg

    @property
    def status(self) -> np.ndarray:
        """Status of each robot, (robot,) uint8."""
        return self.simulator.status

    @property
    def range_ratio(self) -> np.ndarray:
        """As `BatchedSimulator.range_ratio` has it, (robot,)."""
        return self.simulator.range_ratio

    @property
    def hub_load_share(self) -> np.ndarray:
        """As `BatchedSimulator.hub_load_share` has it, (robot,)."""
        return self.simulator.hub_load_share

    @property
    def tilt_deg(self) -> np.ndarray:
        """As `BatchedSimulator.tilt_deg` has it, (robot,)."""
        return self.simulator.tilt_deg


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
    return _part_of(file).digest()


def _alike(file: str, own: ReducedPart) -> ReducedPart:
    """The reduction of a file as the robot's own leg is."""
    limit = own.metadata.get(MODE_LIMIT)
    return _changed(file, limit, *factors_between(_part_of(file), own))


@cache
def _changed(file: str, mode_limit: int | None, size: float, *factors: float) -> ReducedPart:
    part = _part_of(file)
    part = part if mode_limit is None else with_fewer_modes(part, mode_limit)
    part = part if size == 1.0 else resized_part(part, size)
    return part if factors == (1.0, 1.0, 1.0) else scaled_part(part, *factors)


@cache
def _part_of(file: str) -> ReducedPart:
    return ReducedPart.load(file)
