"""Random designs under random gaits, which no reduction has seen."""

from __future__ import annotations

import numpy as np

from pneumorph.environment.crawling_task import CrawlingTask
from pneumorph.gait.held_gait import HeldGait
from pneumorph.robot.design_space import DesignSpace
from pneumorph.study.animations import Animation

ACTION_S = 1.0
"""How long a random pressure is held: an action's length [s]."""
HELDOUT_SEED = 20211115
"""Far from the seeds that snapshots are drawn with."""


def heldout_animations(
    count: int, duration_s: float, space: DesignSpace | None = None, seed: int = HELDOUT_SEED
) -> list[Animation]:
    """Draw designs and gaits; each depends on the seed and its own number only.

    A gait holds pressures for an action's length, uniform between the task's limits and independent
    for each regulator, as a policy does that knows nothing.

    Args:
        count: How many.
        duration_s: Length of each [s].
        space: Designs to draw from; the paper's by default.
        seed: Seed of designs and gaits.

    Raises:
        ValueError: A duration that is not positive.
    """
    if not duration_s > 0:
        raise ValueError(f"duration_s is {duration_s}, expected above 0")
    space = space or DesignSpace()
    task = CrawlingTask()
    start_s = ACTION_S * np.arange(int(np.ceil(duration_s / ACTION_S - 1e-9)))
    drawn = []
    for number in range(count):
        rng = np.random.default_rng([seed, number])
        design = space[int(space.drawn(1, rng)[0])]
        # Drawn for as long as anyone may ask, so that a longer gait begins like a shorter one.
        held = rng.uniform(
            task.minimum_pressure_kPa, task.maximum_pressure_kPa, (1000, space.regulator_count)
        )[: len(start_s)]
        drawn.append(
            Animation(f"heldout_{number:02d}", design, HeldGait(start_s, held, duration_s))
        )
    return drawn
