"""Robots of one batch, shared out over the workers of a Ray cluster.

Each worker advances some of the robots and answers with all that is asked of them, so that an
action costs one call of every worker. A robot has the same bits in any batch of parts that have as
many modes (see `BatchedSimulator`), hence for any number of workers; on machines with other
instruction sets only where `StepperSettings.instruction_set` names one that all have. A worker that
is lost costs its own robots' time: another one takes over the calls since they were last put back,
and is where the lost one was.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from pneumorph.base.executor import ExecutorSettings, WorkerError
from pneumorph.base.workers import RemoteObjects, remote_objects
from pneumorph.physics.physics import Physics
from pneumorph.reduction.reduced_part import ReducedPart
from pneumorph.robot.robot import Mount, Robot
from pneumorph.simulation.batched_simulator import BatchedSimulator
from pneumorph.simulation.randomisation import World
from pneumorph.simulation.randomised_simulator import LaggingSimulator, simulator_in_worlds
from pneumorph.simulation.stepper_settings import StepperSettings
from pneumorph.simulation.told_readings import TOLD, ToldReadings

Call = tuple[str, tuple[Any, ...]]
"""Name and arguments of a worker's method."""


class SharedSimulator(ToldReadings):
    """A `CrawlingSimulator` whose robots are on Ray's workers.

    Args:
        robots: The robots.
        worlds: The world of each; None for one that is as it stands.
        physics: What acts on them.
        stepper: How steps are computed; None for the usual numerics.
        executor: Which workers: one for each process, of one thread.

    Raises:
        ModuleNotFoundError: Ray is not installed.
        ValueError: As of `BatchedSimulator`.
        WorkerError: The workers of some robots died as often as is allowed.
    """

    def __init__(
        self,
        robots: Sequence[Robot],
        worlds: Sequence[World] | None,
        physics: Physics,
        stepper: StepperSettings | None,
        executor: ExecutorSettings,
    ) -> None:
        self._place = remote_objects(_Worker, executor.process_count, executor.address)
        arguments = (Path.cwd(), physics, stepper)
        self._workers = [
            _Remote(self._place, arguments, executor.attempt_limit)
            for _ in range(min(self._place.count, len(robots)))
        ]
        self._parts: dict[int, tuple[ReducedPart, Any]] = {}
        self._worlds = worlds
        self.set_robots(robots)

    def set_robots(self, robots: Sequence[Robot], worlds: Sequence[World] | None = None) -> None:
        """Replace every robot (any count) and reset all.

        Args:
            robots: The robots.
            worlds: The world of each; None for those of the robots before, of as many.
        """
        self._worlds = self._worlds if worlds is None else worlds
        for robot in robots:
            for mount in robot.mounts:
                part = mount.part
                if id(part) not in self._parts:  # kept, so that its identity stays its own
                    self._parts[id(part)] = part, self._place.put(part)
        self._slices = [
            slice(int(own[0]), int(own[-1]) + 1)
            for own in np.array_split(np.arange(len(robots)), len(self._workers))
            if len(own)
        ]
        self._answer(
            [self._placing(robots[own], self._worlds_of(own)) for own in self._slices], afresh=True
        )

    def _worlds_of(self, own: slice) -> Sequence[World] | None:
        return None if self._worlds is None else self._worlds[own]

    def _placing(self, robots: Sequence[Robot], worlds: Sequence[World] | None) -> Call:
        """The call that gives a worker its robots; their parts are sent once."""
        used = list({id(mount.part): None for robot in robots for mount in robot.mounts})
        described = [
            (
                robot.hub,
                [(used.index(id(mount.part)), mount.pose, mount.regulators)
                 for mount in robot.mounts],
                robot.design,
                robot.kin_surfaces,
            )
            for robot in robots
        ]  # fmt: skip
        return "set_robots", (described, worlds, *(self._parts[part][1] for part in used))

    def reset(self, active: np.ndarray | None = None) -> None:
        """Put robots back to their initial state, (robot,) bool; None for all."""
        if active is None or np.all(active):  # nothing that was before matters any more
            active = None
            for worker in self._workers:
                worker.history = worker.history[:1]
        self._answer_of("reset", active)

    def forget_range(self, active: np.ndarray | None = None) -> None:
        """As `BatchedSimulator.forget_range` does."""
        self._answer_of("forget_range", active)

    def advance(
        self, command_kPa: np.ndarray, step_count: int, active: np.ndarray | None = None
    ) -> None:
        """Hold a command [real kPa], (robot, regulator), for some time steps."""
        command = np.asarray(command_kPa, dtype=float)
        moving = np.ones(len(command), bool) if active is None else np.asarray(active, bool)
        self._answer([("advance", (command[own], step_count, moving[own])) for own in self._slices])

    def _told(self, name: str) -> np.ndarray:
        return self._readings[name]

    def _answer_of(self, method: str, active: np.ndarray | None) -> None:
        """Call a method of some robots, (robot,) bool; None for all."""
        chosen = None if active is None else np.asarray(active, dtype=bool)
        self._answer([(method, (None if chosen is None else chosen[own],)) for own in self._slices])

    def _answer(self, calls: Sequence[Call], afresh: bool = False) -> None:
        """Call the workers that have robots at the same time, and put their answers together."""
        workers = self._workers[: len(calls)]
        for worker, call in zip(workers, calls, strict=True):
            worker.begin(call, afresh)
        told = [worker.end() for worker in workers]
        self._readings = {name: np.concatenate([each[name] for each in told]) for name in TOLD}


class _Remote:
    """A worker, and the calls that another one must make to be where it is.

    Attributes:
        history: Calls since the robots were last put back, the first of which gives them.
    """

    def __init__(self, place: RemoteObjects, arguments: tuple[Any, ...], attempts: int) -> None:
        self._place, self._arguments, self._attempts = place, arguments, attempts
        self._object = place.make(*arguments)
        self.history: list[Call] = []
        self._reference: Any = None

    def begin(self, call: Call, afresh: bool) -> None:
        """Make a call.

        Args:
            call: The call.
            afresh: Whether nothing before it matters.
        """
        self.history = [call] if afresh else [*self.history, call]
        self._reference = self._place.call(self._object, *call)

    def end(self) -> dict[str, np.ndarray]:
        """Wait for the answer; a new worker makes the calls of one that is lost.

        Raises:
            WorkerError: Workers died as often as is allowed.
        """
        for attempt in range(1, self._attempts + 1):
            try:
                told: dict[str, np.ndarray] = self._place.fetch(self._reference)
                return told
            except self._place.deaths as death:
                if attempt == self._attempts:
                    raise WorkerError(
                        f"the worker of some robots died {attempt} times ({type(death).__name__}), "
                        "expected an answer; its machine may lack memory (executor.process_count)"
                    ) from death
                self._object = self._place.make(*self._arguments)
                for call in self.history:
                    self._reference = self._place.call(self._object, *call)
        raise AssertionError("attempts are at least one")


class _Worker:
    """Robots of one worker.

    Args:
        folder: The caller's, which its relative paths mean.
        physics: What acts on them.
        stepper: How steps are computed.
    """

    def __init__(self, folder: Path, physics: Physics, stepper: StepperSettings | None) -> None:
        if folder.is_dir():
            os.chdir(folder)
        self._physics, self._stepper = physics, stepper
        self._simulator: LaggingSimulator | BatchedSimulator | None = None

    def set_robots(
        self, described: Sequence[Any], worlds: Sequence[World] | None, *parts: ReducedPart
    ) -> dict[str, np.ndarray]:
        """Replace every robot.

        Args:
            described: Hub, mounts, design and surfaces of its kin of each; a mount is the number of
                its part, its pose and its regulators.
            worlds: The world of each.
            *parts: The parts.
        """
        robots = [
            Robot(hub, tuple(Mount(parts[part], *rest) for part, *rest in mounts), *design)
            for hub, mounts, *design in described
        ]
        if worlds is None:
            self._simulator = BatchedSimulator(robots, self._physics, self._stepper, 1)
        else:
            self._simulator = simulator_in_worlds(robots, worlds, self._physics, self._stepper, 1)
        return self._told()

    def reset(self, active: np.ndarray | None) -> dict[str, np.ndarray]:
        """Put robots back."""
        assert self._simulator is not None, "robots come first"
        self._simulator.reset(active)
        return self._told()

    def forget_range(self, active: np.ndarray | None) -> dict[str, np.ndarray]:
        """Begin the ratio of robots' ranges afresh."""
        assert self._simulator is not None, "robots come first"
        self._simulator.forget_range(active)
        return self._told()

    def advance(
        self, command_kPa: np.ndarray, step_count: int, active: np.ndarray
    ) -> dict[str, np.ndarray]:
        """Hold a command."""
        assert self._simulator is not None, "robots come first"
        self._simulator.advance(command_kPa, step_count, active)
        return self._told()

    def _told(self) -> dict[str, np.ndarray]:
        return {name: np.array(getattr(self._simulator, name)) for name in TOLD}
