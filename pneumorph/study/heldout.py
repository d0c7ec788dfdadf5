"""Random designs, which no reduction has seen, under random gaits and under periodic ones.

Random gaits hardly travel, so small errors do not show in their distances. Under periodic ones they
add up over the cycles.
"""

from __future__ import annotations

import numpy as np

from pneumorph.environment.crawling_task import CrawlingTask
from pneumorph.gait.expert_gait import ExpertGait
from pneumorph.gait.held_gait import HeldGait
from pneumorph.physics.open_loop_gait import OpenLoopGait
from pneumorph.robot.design import Design
from pneumorph.robot.design_space import DesignSpace
from pneumorph.study.animations import HIGH_KPA, Animation, repeated

ACTION_S = 1.0
"""How long a random pressure is held: an action's length [s]."""
HELDOUT_SEED = 20211115
"""Far from the seeds that snapshots are drawn with."""
_PERIODIC = 1
"""Tells the designs of periodic gaits from those of random ones."""
EXPERT_PHASES_DEG = (0.0, 90.0, 180.0, 270.0)
WAVES_S = (2.0, -2.0, 4.0, -4.0)
"""Periods of waves of inflation [s], positive ones from hind to fore legs."""


def heldout_animations(count: int, duration_s: float) -> list[Animation]:
    """Draw designs of the paper's robot and gaits; each depends on its own number only.

    A gait holds pressures for an action's length, uniform between the task's limits and independent
    for each regulator, as a policy does that knows nothing.

    Args:
        count: How many.
        duration_s: Length of each [s].

    Raises:
        ValueError: A duration that is not positive.
    """
    if not duration_s > 0:
        raise ValueError(f"duration_s is {duration_s}, expected above 0")
    space, task = DesignSpace(), CrawlingTask()
    start_s = ACTION_S * np.arange(int(np.ceil(duration_s / ACTION_S - 1e-9)))
    drawn = []
    for number in range(count):
        rng = np.random.default_rng([HELDOUT_SEED, number])
        design = space[int(space.drawn(1, rng)[0])]
        # Drawn for as long as anyone may ask, so that a longer gait begins like a shorter one.
        held = rng.uniform(
            task.minimum_pressure_kPa, task.maximum_pressure_kPa, (1000, space.regulator_count)
        )[: len(start_s)]
        drawn.append(
            Animation(f"heldout_{number:02d}", design, HeldGait(start_s, held, duration_s))
        )
    return drawn


def periodic_animations(count: int, duration_s: float) -> list[Animation]:
    """Draw designs of the paper's robot, each by its own number, under the periodic gaits in turn.

    These are the expert's at four phases and four waves of inflation (`inflation_wave`).

    Args:
        count: How many.
        duration_s: Length of each [s].
    """
    space = DesignSpace()
    drawn = []
    for number in range(count):
        rng = np.random.default_rng([HELDOUT_SEED, _PERIODIC, number])
        design = space[int(space.drawn(1, rng)[0])]
        turn = number % (len(EXPERT_PHASES_DEG) + len(WAVES_S))
        gait: OpenLoopGait
        if turn < len(EXPERT_PHASES_DEG):
            gait = ExpertGait(EXPERT_PHASES_DEG[turn], duration_s=duration_s)
        else:
            period_s = WAVES_S[turn - len(EXPERT_PHASES_DEG)]
            gait = inflation_wave(design, period_s, duration_s, space.regulator_count)
        drawn.append(Animation(f"periodic_{number:02d}", design, gait))
    return drawn


def inflation_wave(
    design: Design, period_s: float, duration_s: float, regulator_count: int
) -> HeldGait:
    """Regulators that inflate one after another, each for half of the period.

    Args:
        design: Whose regulators they are, in the order of how far forward their legs are on
            average.
        period_s: Length of a cycle [s]; of a negative one fore legs begin.
        duration_s: How long the gait lasts [s].
        regulator_count: Regulators of the rig; those without legs stay slack.
    """
    forward: dict[int, list[float]] = {}
    for location, regulator in design.legs:
        forward.setdefault(regulator, []).append(float(np.cos(design.angle_rad(location))))
    # Sums of cosines differ by rounding where legs are as far forward.
    order = sorted(forward, key=lambda each: (round(float(np.mean(forward[each])), 9), each))
    if period_s < 0.0:
        order.reverse()
    hold_s = abs(period_s) / (2 * len(order))
    cycle = np.zeros((2 * len(order), regulator_count))
    for place, regulator in enumerate(order):
        cycle[place : place + len(order), regulator - 1] = HIGH_KPA
    return repeated(cycle, hold_s, duration_s)
