"""Gaits that are known before learning begins, which the first robots of a beginning walk.

What a policy finds is a matter of the gaits that it comes upon first. A gait that works already
fills the replay buffer with what it is worth, as in learning from demonstrations (Vecerik et al.,
*Leveraging Demonstrations for Deep Reinforcement Learning*, 2017), and nothing else of the learner
changes.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pneumorph.environment.crawling_task import CrawlingTask
from pneumorph.gait.held_gait import HeldGait
from pneumorph.learn.design_gait_pair import DesignGaitPair
from pneumorph.physics.open_loop_gait import OpenLoopGait
from pneumorph.robot.design import Design
from pneumorph.robot.design_space import DesignSpace

ACTION_NOISE = 0.2
"""Standard deviation of what is added to the actions of all but the first robot that walks a gait:
a tenth of the range of pressures, so that what is near it is seen as well."""


_BEFORE_S = 1e-6
"""An action ends before the next one's pressures begin [s]."""


def known_pair(
    gait: OpenLoopGait,
    design: Design,
    space: DesignSpace,
    task: CrawlingTask,
    action_s: float,
    source: str,
) -> DesignGaitPair:
    """A gait as the actions of an episode, as yet without what it achieves.

    Args:
        gait: The gait, of which an action commands what it has come to by the action's end; a
            shorter one begins again.
        design: Whose regulators it commands; the pair has the design that stands for it.
        space: The design space.
        task: Has the number of actions and the range of pressures.
        action_s: How long an action is held [s].
        source: Where it is from, see `DesignGaitPair`.

    Raises:
        ValueError: The space has no such design, the design has a regulator that the gait does not
            command, or a pressure is beyond the task's.
    """
    design.check_regulators(gait.regulator_count)
    ends_s = ((np.arange(task.action_count) + 1.0) * action_s - _BEFORE_S) % gait.duration_s
    commanded = np.array([gait.pressure_kPa(time_s) for time_s in ends_s])
    place = space.index(design)
    held_kPa = np.full((task.action_count, task.regulator_count), task.minimum_pressure_kPa)
    for ours, theirs in enumerate(space.form(design)[1]):
        if theirs <= gait.regulator_count:
            held_kPa[:, ours] = commanded[:, theirs - 1]
    HeldGait.evenly(held_kPa, action_s, task)
    unknown = float("nan")
    return DesignGaitPair(place, held_kPa, unknown, unknown, source, 0, unknown)


def check_room(demonstrations: Sequence[DesignGaitPair], design_count: int) -> None:
    """Refuse more demonstrations than half of a round's designs.

    Args:
        demonstrations: The gaits.
        design_count: Designs of the first round.

    Raises:
        ValueError: There are more.
    """
    if len(demonstrations) > design_count // 2:
        raise ValueError(
            f"{len(demonstrations)} gaits are shown, expected at most {design_count // 2}: half of "
            f"the {design_count} designs of a beginning's first round walk them"
        )


def shown_first(
    demonstrations: Sequence[DesignGaitPair],
    designs: np.ndarray,
    task: CrawlingTask,
    rng: np.random.Generator,
) -> tuple[np.ndarray, np.ndarray]:
    """The first round of a beginning, half of whose designs walk what is shown, in turn.

    Args:
        demonstrations: The gaits, one or more.
        designs: Indices of the designs that were drawn for the round, (design,).
        task: Turns pressures into actions.
        rng: What noise is drawn by.

    Returns:
        The round's designs, (design,), the first of which are those shown; and the actions of
        these, (action, shown design, regulator).
    """
    count = len(designs) // 2
    turns = [demonstrations[place % len(demonstrations)] for place in range(count)]
    action = np.stack([task.action(pair.held_kPa) for pair in turns], axis=1)
    noise = ACTION_NOISE * rng.standard_normal(action.shape)
    noise[:, : len(demonstrations)] = 0.0
    shown = np.array([pair.design for pair in turns])
    return np.concatenate([shown, designs[count:]]), np.clip(action + noise, -1.0, 1.0)
