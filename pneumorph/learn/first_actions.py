"""What robots do before their policy has learned anything."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Literal

import numpy as np

FirstActions = Literal["uniform", "waves"]

SHORTEST_PERIOD, LONGEST_PERIOD = 2.0, 5.0
"""Of a wave [actions]. A shorter one cannot be told from a longer; a policy that remembers the last
four actions can go on with a wave of five."""


def uniform_actions(rng: np.random.Generator, robots: int, regulators: int) -> Iterator[np.ndarray]:
    """Each number of every action for itself (the paper).

    Yields:
        Actions from -1 to 1, shape (robot, regulator).
    """
    while True:
        yield rng.uniform(-1.0, 1.0, (robots, regulators)).astype(np.float32)


def wave_actions(rng: np.random.Generator, robots: int, regulators: int) -> Iterator[np.ndarray]:
    """Each robot has a period of its own and each of its regulators a phase, as the expert's gaits
    do: action k is sin(2 pi (k / period + phase)). What repeats adds up, so these robots go ten
    times as often somewhere as those whose actions have nothing to do with each other.

    Yields:
        Actions from -1 to 1, shape (robot, regulator).
    """
    period = rng.uniform(SHORTEST_PERIOD, LONGEST_PERIOD, (robots, 1))
    phase = rng.uniform(0.0, 1.0, (robots, regulators))
    number = 0
    while True:
        yield np.sin(2.0 * np.pi * (number / period + phase)).astype(np.float32)
        number += 1


FIRST_ACTIONS: dict[
    FirstActions, Callable[[np.random.Generator, int, int], Iterator[np.ndarray]]
] = {"uniform": uniform_actions, "waves": wave_actions}
"""Those of an episode by name, given the draws, and how many robots and regulators there are."""
