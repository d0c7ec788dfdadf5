"""What robots do before there is anything to learn from."""

from __future__ import annotations

import numpy as np

CYCLE_LENGTHS = (3, 4, 5, 6)
"""Actions of the cycles that robots repeat before learning starts."""


def random_cycles(
    robot_count: int, action_count: int, regulator_count: int, rng: np.random.Generator
) -> np.ndarray:
    """Gaits that repeat a cycle of lowest and highest pressures, (action, robot, regulator).

    Args:
        robot_count: Gaits, each with a cycle of its own.
        action_count: Actions of an episode.
        regulator_count: Regulators.
        rng: Draws their lengths and pressures.
    """
    lengths = rng.choice(CYCLE_LENGTHS, robot_count)
    extremes = rng.choice(
        np.array([-1.0, 1.0], np.float32), (max(CYCLE_LENGTHS), robot_count, regulator_count)
    )
    places = np.arange(action_count)[:, None] % lengths
    cycles: np.ndarray = extremes[places, np.arange(robot_count)]
    return cycles
