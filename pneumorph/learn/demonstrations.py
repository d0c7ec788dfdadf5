"""Gaits that are known before learning begins, which robots of its first round walk.

What a policy finds is a matter of the gaits that it comes upon first. A gait that works already
fills the replay buffer with what it is worth, as in learning from demonstrations (Vecerik et al.,
*Leveraging Demonstrations for Deep Reinforcement Learning*, 2017); the learner is the same.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pneumorph.environment.crawling_task import CrawlingTask
from pneumorph.learn.design_gait_pair import DesignGaitPair
from pneumorph.learn.settings import CooptSettings
from pneumorph.physics.commands import check_commands
from pneumorph.physics.open_loop_gait import OpenLoopGait
from pneumorph.robot.design import Design
from pneumorph.robot.design_space import DesignSpace

ACTION_NOISE = 0.2
"""Standard deviation of what is added to the actions of all but one of the robots that walk a gait:
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
    check_commands(held_kPa, task.maximum_pressure_kPa, task.minimum_pressure_kPa, "pressure_kPa")
    unknown = float("nan")
    return DesignGaitPair(place, held_kPa, unknown, unknown, source, 0, unknown)


def check_room(demonstrations: Sequence[DesignGaitPair], settings: CooptSettings) -> None:
    """Refuse more demonstrations than half of the designs of a beginning's first round.

    Args:
        demonstrations: The gaits.
        settings: Of the training.

    Raises:
        ValueError: There are more.
    """
    design_count = settings.environment_count // settings.objective.worlds_at(0)
    if len(demonstrations) > design_count // 2:
        raise ValueError(
            f"{len(demonstrations)} gaits are shown, expected at most {design_count // 2}: half of "
            f"the {design_count} designs of a beginning's first round walk them"
        )


@dataclass(frozen=True, eq=False)
class FirstRound:
    """The first round of a beginning that is shown gaits.

    Attributes:
        designs: Indices of the round's designs, (design,).
        action: What the last robots do, each in [-1, 1], (action, robot, regulator).
        exact: Whether each of these does just what is shown, (robot,) bool.
    """

    designs: np.ndarray
    action: np.ndarray
    exact: np.ndarray


def first_round(
    demonstrations: Sequence[DesignGaitPair],
    designs: np.ndarray,
    world_count: int,
    task: CrawlingTask,
    rng: np.random.Generator,
) -> FirstRound:
    """Let the last half of a round's designs walk what is shown, in turn. The last time that each
    is shown is without noise: what counts of a design that walks several times is the last.

    Args:
        demonstrations: The gaits, one or more.
        designs: Indices of the designs that were drawn for the round, (design,).
        world_count: Robots of each design.
        task: Turns pressures into actions.
        rng: What noise is drawn by.
    """
    count, distinct = len(designs) // 2, len(demonstrations)
    turns = [demonstrations[place % distinct] for place in range(count)]
    exact = np.arange(count) >= count - distinct
    action = np.stack([task.action(pair.held_kPa) for pair in turns], axis=1)
    noise = ACTION_NOISE * rng.standard_normal(action.shape)
    near = np.clip(action + np.where(exact[:, None], 0.0, noise), -1.0, 1.0)
    shown = np.array([pair.design for pair in turns])
    return FirstRound(
        np.concatenate([designs[: len(designs) - count], shown]),
        np.repeat(near, world_count, axis=1),
        np.repeat(exact, world_count),
    )
