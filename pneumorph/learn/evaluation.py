"""How far designs travel when the policy acts without noise."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from pneumorph.environment.crawling_environment import CrawlingEnvironment
from pneumorph.environment.crawling_simulator import RUNNING
from pneumorph.gait.walk import Progress
from pneumorph.learn.design_gait_pair import DesignGaitPair
from pneumorph.learn.networks import Policy
from pneumorph.learn.objective import Objective
from pneumorph.learn.sac import Sac
from pneumorph.robot.design_space import DesignSpace

EVALUATION_SEED = 2**40
"""Worlds of an evaluation are drawn by seeds from here on; those of training by its timestep."""


def evaluate_policy(
    environment: CrawlingEnvironment,
    space: DesignSpace,
    policy: Policy,
    learner: Sac,
    designs: np.ndarray,
    *,
    timestep: int = 0,
    progress: Progress | None = None,
    objective: Objective | None = None,
) -> list[DesignGaitPair]:
    """Walk designs for one episode each with the policy's deterministic actions.

    Args:
        environment: Where to walk; its designs are replaced.
        space: The design space.
        policy: The policy.
        learner: Gives the policy's actions.
        designs: Indices of designs, shape (n,); walked in batches of the environment's size.
        timestep: Timestep of training, noted in the pairs.
        progress: Told how far the evaluation is.
        objective: What counts where designs walk in several worlds; None for one world.

    Returns:
        A pair for each design whose simulation did not fail, in the order asked for.
    """
    objective = objective or Objective()
    count = environment.num_envs // objective.worlds_per_design
    action_count = environment.task.action_count
    pairs: list[DesignGaitPair] = []
    for begin in range(0, len(designs), count):
        batch = designs[begin : begin + count]

        def report(action: int, begin: int = begin) -> None:
            if progress is not None:
                done = begin * action_count + action * min(count, len(designs) - begin)
                progress(done, len(designs) * action_count, "evaluating")

        pairs += walk_batch(
            environment,
            space,
            batch,
            lambda observation: learner.mode_actions(policy, observation),
            timestep,
            report,
            objective,
        )
    return pairs


def walk_batch(
    environment: CrawlingEnvironment,
    space: DesignSpace,
    batch: np.ndarray,
    act: Callable[[np.ndarray], np.ndarray],
    timestep: int,
    report: Callable[[int], None] | None = None,
    objective: Objective | None = None,
) -> list[DesignGaitPair]:
    """Walk no more designs than the environment has robots, for one episode; where designs walk in
    several worlds each, no more than it then has room for, in all worlds of an evaluation.

    Args:
        environment: Where to walk; its designs are replaced.
        space: The design space.
        batch: Indices of the designs, shape (n,).
        act: Turns observations (robot, observation) into actions (robot, regulator).
        timestep: Timestep of training, noted in the pairs; it seeds physics that are drawn.
        report: Told the number of actions done, of one episode.
        objective: What counts of distances in several worlds; None for one world.

    Returns:
        A pair for each design whose simulation did not fail, in the order asked for. Of several
        worlds, a design's distance in one where its simulation failed is zero, or less if it was
        behind its start; one that failed in all has no pair, and the gait is that of a world where
        it did not fail.
    """
    if objective is not None and objective.is_robust:
        return _walk_in_worlds(environment, space, batch, act, timestep, report, objective)
    commands, distance_cm, failed = walk_episode(
        environment, space, filled_batch(batch, environment.num_envs), act, report, timestep
    )
    return [
        DesignGaitPair(
            int(design), commands[:, place], float(distance_cm[place]), "policy", timestep
        )
        for place, design in enumerate(batch)
        if not failed[place]
    ]


def _walk_in_worlds(
    environment: CrawlingEnvironment,
    space: DesignSpace,
    batch: np.ndarray,
    act: Callable[[np.ndarray], np.ndarray],
    timestep: int,
    report: Callable[[int], None] | None,
    objective: Objective,
) -> list[DesignGaitPair]:
    """Pairs whose distance is the objective over the worlds of an evaluation; see `walk_batch`."""
    side_by_side = objective.worlds_per_design
    designs = filled_batch(batch, environment.num_envs // side_by_side)
    distances, failures, asked = [], [], []
    for number in range(-(-objective.evaluation_worlds // side_by_side)):
        commands, distance_cm, failed = walk_episode(
            environment,
            space,
            np.repeat(designs, side_by_side),
            act,
            report if number == 0 else None,
            EVALUATION_SEED + number,
        )
        distances.append(np.where(failed, np.minimum(distance_cm, 0.0), distance_cm))
        failures.append(failed)
        asked.append(commands)
    shape = (len(distances), len(designs), side_by_side)
    by_world = np.moveaxis(np.reshape(distances, shape), 1, 0).reshape(len(designs), -1)
    fallen = np.moveaxis(np.reshape(failures, shape), 1, 0).reshape(len(designs), -1)
    # A robot that fails begins its episode anew: its gait is that of the first world without.
    rounds, places = np.divmod(np.argmin(fallen, axis=1), side_by_side)
    scores = objective.of(by_world[:, : objective.evaluation_worlds])
    return [
        DesignGaitPair(
            int(design),
            asked[rounds[place]][:, place * side_by_side + places[place]],
            float(scores[place]),
            "policy",
            timestep,
        )
        for place, design in enumerate(batch)
        if not fallen[place].all()
    ]


def filled_batch(batch: np.ndarray, count: int) -> np.ndarray:
    """As many entries as an environment has robots: what is missing repeats the first."""
    return np.concatenate([batch, np.full(count - len(batch), batch[0])])


def walk_episode(
    environment: CrawlingEnvironment,
    space: DesignSpace,
    designs: np.ndarray,
    act: Callable[[np.ndarray], np.ndarray],
    report: Callable[[int], None] | None = None,
    seed: int | None = None,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Let every robot of the environment walk one episode.

    Args:
        environment: Where to walk.
        space: The design space.
        designs: Index of each robot's design, shape (robot,).
        act: Turns observations (robot, observation) into actions (robot, regulator).
        report: Told the number of actions done.
        seed: Where physics are drawn, of what is drawn; None goes on with the environment's own.

    Returns:
        Real pressures [kPa] (action, robot, regulator), distance [cm] (robot,), failed (robot,).
    """
    observation, _ = environment.reset(
        seed=seed, options={"designs": [space[int(i)] for i in designs]}
    )
    commands = []
    distance_cm = np.zeros(len(designs))
    failed = np.zeros(len(designs), dtype=bool)
    for number in range(environment.task.action_count):
        observation, reward, _, _, info = environment.step(act(observation))
        failed |= info["status"] != RUNNING
        distance_cm += np.where(failed, 0.0, reward)
        commands.append(info["command_kPa"])
        if report is not None:
            report(number + 1)
    return np.array(commands), distance_cm, failed
