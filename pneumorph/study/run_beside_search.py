"""A training's policy and best pairs, walked where a search judges gaits."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from pneumorph.base.run_folder import TRAINING_FOLDER, RunFolder
from pneumorph.environment.crawling_environment import CrawlingEnvironment
from pneumorph.learn.cooptimise import POLICY_FILE
from pneumorph.learn.demonstrations import known_pair
from pneumorph.learn.design_gait_pair import DesignGaitPair
from pneumorph.learn.evaluated_gaits import best_of_each_design
from pneumorph.learn.evaluation import evaluate_policy
from pneumorph.learn.objective import Objective
from pneumorph.learn.policy_file import load_policy
from pneumorph.learn.sac import Sac
from pneumorph.robot.design_space import DesignSpace
from pneumorph.study.finished_run import FinishedRun

PAIRS_OF_RUN = 5
"""Best pairs of a run whose designs are searched."""


def policy_pairs(
    environment: CrawlingEnvironment,
    space: DesignSpace,
    learned: FinishedRun | None,
    designs: list[int],
    folder: RunFolder,
    objective: Objective,
) -> tuple[dict[int, DesignGaitPair], tuple[str, ...]]:
    """What the run's one policy does with each design without noise.

    Args:
        environment: Where the search judges.
        space: The design space.
        learned: The run; None for none.
        designs: Indices of designs of the space.
        folder: Is told what goes on.
        objective: What counts where designs walk in several worlds.

    Returns:
        The pairs by their designs, and what is to be said: a policy that observes what only its own
        task shows is left out.

    Raises:
        ArtefactError: The policy is damaged.
        FileNotFoundError: The run has lost it.
    """
    if learned is None or not designs:
        return {}, ()
    policy, settings, _ = load_policy(learned.folder / TRAINING_FOLDER / POLICY_FILE)
    observed = settings.task.state_size + space.feature_count
    if policy.observation_size != observed:
        note = (
            f"the policy of {learned.folder} is left out: it observes {policy.observation_size} "
            f"numbers, and robots that crawl here show {observed}; it learned a task of its own"
        )
        folder.progress.say(note)
        return {}, (note,)
    folder.progress.stage("walking the designs with the learned policy")
    learner = Sac(observed, settings.task.regulator_count, settings.sac)
    pairs = evaluate_policy(
        environment,
        space,
        policy,
        learner,
        np.array(designs),
        progress=folder.progress,
        objective=objective,
    )
    return {pair.design: pair for pair in pairs}, ()


def own_pairs(
    environment: CrawlingEnvironment,
    space: DesignSpace,
    learned: FinishedRun | None,
    designs: list[int],
    action_s: float,
    folder: RunFolder,
    objective: Objective,
) -> dict[int, DesignGaitPair]:
    """The run's best pairs by their designs, with what they achieve where the search judges: the
    worlds of the run may have been others.

    Args:
        environment: Where the search judges.
        space: The design space.
        learned: The run; None for none.
        designs: Those whose gaits are searched; without any, nothing stands beside.
        action_s: How long an action is held [s].
        folder: Is told what goes on.
        objective: What counts where designs walk in several worlds.
    """
    if learned is None or not designs:
        return {}
    folder.progress.stage("walking the run's pairs")
    task, pairs = environment.task, []
    for rank, pair in enumerate(learned.pairs(PAIRS_OF_RUN), 1):
        try:
            pairs.append(known_pair(pair.gait, pair.design, space, task, action_s, "policy"))
        except ValueError as error:  # of a task with lower pressures, say
            folder.progress.say(f"L{rank} of the run does not walk beside the search: {error}")
    return best_of_each_design(pairs, environment, space, objective)


def same_worlds_note(own: Mapping[int, DesignGaitPair], objective: Objective) -> tuple[str, ...]:
    """What to say of the run's pairs beside the gaits that were found."""
    if not own:
        return ()
    several = f"in the same {objective.evaluation_worlds} worlds"
    where = several if objective.is_robust else "in the world as it stands"
    return (
        f"own gait, shared policy and fine-tuned policy of a design are {where}: the run's pairs "
        "walked again there",
    )
