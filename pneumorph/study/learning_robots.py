"""The robots that learn: with fewer modes, and with fewer sampled points for these modes.

Points are chosen on states that such robots go through themselves: some of the design space walk
under pressures drawn at random, as robots do when learning begins.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from pneumorph.base.progress import Progress
from pneumorph.catalogue.module import Module
from pneumorph.catalogue.robot_spec import RobotSpec
from pneumorph.environment.crawling_simulator import RUNNING
from pneumorph.environment.training_environment import EnvironmentFactory
from pneumorph.learn.settings import CooptSettings

_ROBOTS_PER_MODULE = 24
_MOST_ROBOTS = 96
_ACTIONS = 8
_READINGS = 4
"""Of each action."""
_LEVELS = 4
"""Pressures that are drawn from."""
_STATES = 160
"""Of each module, and least number to choose points on."""


def learning_robots(
    spec: RobotSpec, settings: CooptSettings, progress: Progress | None = None
) -> RobotSpec:
    """The robots that learn: with fewer modes and points, where the settings say so and no gait
    counts for what it did while it was learned; the robots themselves elsewhere.

    Args:
        spec: The robots.
        settings: Of the training.
        progress: Told which points they learn on.
    """
    learning = _with_fewer_modes(spec, settings)
    if not settings.objective.is_robust or settings.learning_tolerance == 0.0:
        return learning
    if progress is not None:
        progress.stage("choosing points that robots learn on")
    seen = {
        module: states[np.linspace(0, len(states) - 1, _STATES).astype(int)]
        for module, states in states_of_modules(learning, settings).items()
        if len(states) >= _STATES  # robots are seldom made of others, or fail
    }
    fewer = learning.with_fewer_points(seen, settings.learning_tolerance)
    if progress is not None:
        for before, after in zip(learning.modules, fewer.modules, strict=True):
            part = before.reduced
            count = len(part.tetrahedron_index) + len(part.membrane_index)
            left = "all" if after.points is None else after.points.count
            progress.say(f"{before.name}: {left} of its {count} points")
    return fewer if any(module.points for module in fewer.modules) else learning


def states_of_modules(
    spec: RobotSpec, settings: CooptSettings, seed: int = 0
) -> dict[Module, np.ndarray]:
    """What the modules of a training's robots go through under pressures drawn at random.

    Args:
        spec: The robots.
        settings: Of the training.
        seed: Of designs and pressures; not the training's, so that all have the same points.

    Returns:
        Modal coordinates of each module, (state, mode), without those of robots that failed.
    """
    task, space, random = settings.task, settings.space, np.random.default_rng(seed)
    count = min(_ROBOTS_PER_MODULE * len(spec.modules), _MOST_ROBOTS)
    robots = [spec.assembly(space[int(index)]) for index in space.drawn(count, random)]
    simulator = spec.simulator(robots)
    levels = np.linspace(task.minimum_pressure_kPa, task.maximum_pressure_kPa, _LEVELS)
    shape = (count, task.regulator_count)
    simulator.reset()
    simulator.advance(np.zeros(shape), task.settling_step_count)
    of_parts: dict[int, list[np.ndarray]] = {id(each.reduced): [] for each in spec.modules}
    for _ in range(_ACTIONS):
        command = random.choice(levels, size=shape)
        for _ in range(_READINGS):
            simulator.advance(command, max(1, task.action_step_count // _READINGS))
            modes = simulator.read("modes")
            for number in np.flatnonzero(simulator.status == RUNNING):
                for mount, alpha in zip(robots[number].mounts, modes[number], strict=False):
                    of_parts[id(mount.part)].append(alpha[: mount.part.mode_count])
    return {
        module: np.reshape(of_parts[id(module.reduced)], (-1, module.reduced.mode_count))
        for module in spec.modules
    }


def learning_and_judged(
    make: Callable[[RobotSpec], EnvironmentFactory], spec: RobotSpec, learning: RobotSpec
) -> tuple[EnvironmentFactory, EnvironmentFactory | None]:
    """What makes the environment that robots learn in, and that in which they are ranked; None for
    the latter where they are the same.

    Args:
        make: Makes what makes the environments of robots.
        spec: The robots.
        learning: Those that learn.
    """
    return make(learning), None if learning is spec else make(spec)


def _with_fewer_modes(spec: RobotSpec, settings: CooptSettings) -> RobotSpec:
    return spec.with_fewer_modes(settings.learning_modes if settings.objective.is_robust else 0)
