"""Gaits that are known already, walked in the worlds that policies are evaluated in."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import cycle

import numpy as np

from pneumorph.base.progress import ProgressReport
from pneumorph.environment.training_environment import TrainingEnvironment
from pneumorph.learn.design_gait_pair import DesignGaitPair
from pneumorph.learn.evaluation import InWorlds, evaluation_seeds, filled_batch, walk_in_worlds
from pneumorph.learn.objective import Objective
from pneumorph.robot.design_space import DesignSpace


def walk_open_loop(
    environment: TrainingEnvironment,
    space: DesignSpace,
    design: np.ndarray,
    action: np.ndarray,
    objective: Objective,
    seeds: Sequence[int | None],
    report: Callable[[int], None] | None = None,
    world_count: int | None = None,
) -> InWorlds:
    """Walk designs with a gait each.

    Args:
        environment: Where to walk; its designs are replaced.
        space: The design space.
        design: Indices of the designs, (design,), no more than the environment has room for.
        action: Their gaits, each in [-1, 1], (design, action, regulator).
        objective: How many worlds each design walks in.
        seeds: Of the rounds; see `walk_in_worlds`.
        report: Told the number of actions done, of one episode.
        world_count: As of `walk_in_worlds`.
    """
    worlds = objective.worlds_per_design
    filled = action[filled_batch(np.arange(len(design)), environment.num_envs // worlds)]
    actions = cycle(np.moveaxis(np.repeat(filled, worlds, axis=0), 1, 0))
    return walk_in_worlds(
        environment,
        space,
        design,
        lambda _: next(actions),
        objective,
        seeds,
        report,
        world_count,
    )


def best_of_each_design(
    pairs: Sequence[DesignGaitPair],
    environment: TrainingEnvironment,
    space: DesignSpace,
    objective: Objective,
    progress: ProgressReport | None = None,
) -> dict[int, DesignGaitPair]:
    """Each design's best pair of these by the objective over the worlds of an evaluation, with what
    it achieves there; designs whose simulation failed in all worlds are left out. An objective for
    one world has the first of them alone, as where policies are evaluated.

    Args:
        pairs: Designs and gaits; what they say of distances is not used.
        environment: Where to walk; its designs are replaced.
        space: The design space.
        objective: What counts.
        progress: Told how many pairs have walked.
    """
    if not objective.is_robust:
        objective = replace(objective, evaluation_worlds=1)
    count = environment.num_envs // objective.worlds_per_design
    best: dict[int, DesignGaitPair] = {}
    for begin in range(0, len(pairs), count):
        if progress is not None:
            progress(begin, len(pairs), "walking the best once more")
        batch = pairs[begin : begin + count]
        walked = walk_open_loop(
            environment,
            space,
            np.array([pair.design for pair in batch]),
            environment.task.action(np.array([pair.held_kPa for pair in batch])),
            objective,
            evaluation_seeds(objective),
            world_count=objective.evaluation_worlds,
        )
        scores = objective.of(walked.return_cm)
        for place, pair in enumerate(batch):
            known = best.get(pair.design)
            if walked.failed[place].all() or (known and known.score_cm >= scores[place]):
                continue
            best[pair.design] = replace(
                pair,
                distance_cm=float(walked.distance_cm[place].mean()),
                score_cm=float(scores[place]),
                achieved=float(walked.achieved[place].mean()),
            )
    return best
