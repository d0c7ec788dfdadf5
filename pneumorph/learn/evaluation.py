"""How far designs travel when the policy acts without noise."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from pneumorph.base.progress import ProgressReport
from pneumorph.environment.crawling_task import CrawlingTask
from pneumorph.environment.training_environment import ToldStep, TrainingEnvironment
from pneumorph.learn.design_gait_pair import DesignGaitPair
from pneumorph.learn.environments import check_finite
from pneumorph.learn.failed_walks import with_failed
from pneumorph.learn.networks import Policy
from pneumorph.learn.objective import Objective
from pneumorph.learn.sac import Sac
from pneumorph.robot.design_space import DesignSpace

EVALUATION_SEED = 2**40
"""Worlds of an evaluation are drawn by seeds from here on; those of training by its timestep."""


@dataclass(frozen=True, eq=False)
class Episode:
    """How robots fared in an episode; nothing counts from the action on in which one failed, or
    after that in which its episode ended.

    Attributes:
        command_kPa: Real pressures [kPa], (action, robot, regulator).
        return_cm: Sum of the rewards [cm], (robot,).
        distance_cm: Forward travel [cm], (robot,).
        achieved: What of the task's goal they achieved [its unit], (robot,).
        failed: Whether its simulation failed, (robot,) bool.
    """

    command_kPa: np.ndarray
    return_cm: np.ndarray
    distance_cm: np.ndarray
    achieved: np.ndarray
    failed: np.ndarray


def evaluate_policy(
    environment: TrainingEnvironment,
    space: DesignSpace,
    policy: Policy,
    learner: Sac,
    designs: np.ndarray,
    *,
    timestep: int = 0,
    progress: ProgressReport | None = None,
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
    environment: TrainingEnvironment,
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
        timestep: Timestep of training, noted in the pairs.
        report: Told the number of actions done, of one episode.
        objective: What counts of distances in several worlds; None for one world.

    Returns:
        A pair for each design whose simulation did not fail, in the order asked for. Of several
        worlds, a design's distance and return in one where its simulation failed are as
        `with_failed` has them; one that failed in all has no pair, and the gait is that of a world
        where it did not fail.

    Raises:
        ValueError: An observation or a reward is not finite.
    """
    if objective is not None and objective.is_robust:
        return _walk_in_worlds(environment, space, batch, act, timestep, report, objective)
    walked = walk_episode(
        environment, space, filled_batch(batch, environment.num_envs), act, report, EVALUATION_SEED
    )
    return [
        DesignGaitPair(
            int(design),
            walked.command_kPa[:, place],
            float(walked.distance_cm[place]),
            float(walked.return_cm[place]),
            "policy",
            timestep,
            float(walked.achieved[place]),
        )
        for place, design in enumerate(batch)
        if not walked.failed[place]
    ]


def _walk_in_worlds(
    environment: TrainingEnvironment,
    space: DesignSpace,
    batch: np.ndarray,
    act: Callable[[np.ndarray], np.ndarray],
    timestep: int,
    report: Callable[[int], None] | None,
    objective: Objective,
) -> list[DesignGaitPair]:
    """Pairs whose score is the objective over the worlds of an evaluation; see `walk_batch`."""
    walked = walk_in_worlds(
        environment,
        space,
        batch,
        act,
        objective,
        evaluation_seeds(objective),
        report,
        objective.evaluation_worlds,
    )
    scores = objective.of(walked.return_cm)
    return [
        DesignGaitPair(
            int(design),
            walked.command_kPa[place],
            float(walked.distance_cm[place].mean()),
            float(scores[place]),
            "policy",
            timestep,
            float(walked.achieved[place].mean()),
        )
        for place, design in enumerate(batch)
        if not walked.failed[place].all()
    ]


def evaluation_seeds(objective: Objective) -> list[int]:
    """Seeds of the rounds whose worlds gaits are ranked in."""
    rounds = -(-objective.evaluation_worlds // objective.worlds_per_design)
    return [EVALUATION_SEED + number for number in range(rounds)]


def evaluation_timesteps(count: int, objective: Objective, task: CrawlingTask) -> int:
    """Actions of all robots where so many gaits are ranked, in whole rounds of their worlds."""
    robust = objective.is_robust
    worlds = len(evaluation_seeds(objective)) * objective.worlds_per_design if robust else 1
    return count * worlds * task.action_count


@dataclass(frozen=True, eq=False)
class InWorlds:
    """How designs fared in several worlds each.

    Attributes:
        return_cm: Sum of the rewards [cm], (design, world); where the simulation failed as
            `with_failed` has it.
        distance_cm: Forward travel [cm], (design, world); where it failed likewise.
        achieved: What of the task's goal was achieved [its unit], (design, world); likewise.
        failed: Whether the simulation failed, (design, world) bool.
        command_kPa: Real pressures in the first world where it did not [kPa],
            (design, action, regulator).
    """

    return_cm: np.ndarray
    distance_cm: np.ndarray
    achieved: np.ndarray
    failed: np.ndarray
    command_kPa: np.ndarray


def walk_in_worlds(
    environment: TrainingEnvironment,
    space: DesignSpace,
    batch: np.ndarray,
    act: Callable[[np.ndarray], np.ndarray],
    objective: Objective,
    seeds: Sequence[int | None],
    report: Callable[[int], None] | None = None,
    world_count: int | None = None,
) -> InWorlds:
    """Walk designs in `Objective.worlds_per_design` worlds for each seed.

    Args:
        environment: Where to walk; its designs are replaced.
        space: The design space.
        batch: Indices of the designs, (n,), no more than have room with all their worlds.
        act: Turns observations (robot, observation) into actions (robot, regulator), the worlds of
            each design together; the last design's missing companions repeat the first.
        objective: How many worlds.
        seeds: What each round's worlds are drawn by; None goes on with the environment's own.
        report: Told the number of actions done in the first round.
        world_count: Only the first worlds count, so many; None for all.
    """
    side_by_side = objective.worlds_per_design
    designs = filled_batch(batch, environment.num_envs // side_by_side)
    walked = [
        walk_episode(
            environment,
            space,
            np.repeat(designs, side_by_side),
            act,
            report if number == 0 else None,
            seed,
        )
        for number, seed in enumerate(seeds)
    ]

    def by_world(values: list[np.ndarray]) -> np.ndarray:
        """Of each round's robots in the worlds that count, (design, world)."""
        shaped = np.reshape(values, (len(walked), len(designs), side_by_side))
        return np.moveaxis(shaped, 1, 0).reshape(len(designs), -1)[: len(batch), :world_count]

    fallen = by_world([each.failed for each in walked])
    # A robot that fails begins its episode anew: its gait is that of the first world without.
    rounds, places = np.divmod(np.argmin(fallen, axis=1), side_by_side)
    returns, distances, achieved = (
        with_failed(by_world(each), fallen)
        for each in (
            [each.return_cm for each in walked],
            [each.distance_cm for each in walked],
            [each.achieved for each in walked],
        )
    )
    commands = [
        walked[of_round].command_kPa[:, design * side_by_side + place]
        for design, (of_round, place) in enumerate(zip(rounds, places, strict=True))
    ]
    return InWorlds(returns, distances, achieved, fallen, np.array(commands))


def filled_batch(batch: np.ndarray, count: int) -> np.ndarray:
    """As many entries as an environment has robots: what is missing repeats the first."""
    return np.concatenate([batch, np.full(count - len(batch), batch[0])])


def walk_episode(
    environment: TrainingEnvironment,
    space: DesignSpace,
    designs: np.ndarray,
    act: Callable[[np.ndarray], np.ndarray],
    report: Callable[[int], None] | None = None,
    seed: int | None = None,
) -> Episode:
    """Let every robot of the environment walk one episode.

    Args:
        environment: Where to walk.
        space: The design space.
        designs: Index of each robot's design, shape (robot,).
        act: Turns observations (robot, observation) into actions (robot, regulator).
        report: Told the number of actions done.
        seed: Where physics are drawn, of what is drawn; None goes on with the environment's own.

    Raises:
        ValueError: An observation is not finite, or a reward that counts.
    """
    observation, _ = environment.reset(
        seed=seed, options={"designs": [space[int(i)] for i in designs]}
    )
    check_finite(environment, "observation of reset", observation)
    commands = []
    return_cm, distance_cm, achieved = np.zeros((3, len(designs)))
    ended, failed = np.zeros((2, len(designs)), dtype=bool)
    for number in range(environment.task.action_count):
        action = act(observation)
        observation, reward, terminated, truncated, info = environment.step(action)
        told = ToldStep.of(info, action, reward, environment.task)
        failed |= ~ended & told.failed
        is_over = ended | failed
        counted_cm = np.where(is_over, 0.0, reward)
        check_finite(environment, f"observation after action {number + 1}", observation)
        check_finite(environment, f"reward of action {number + 1}", counted_cm)
        return_cm += counted_cm
        distance_cm += np.where(is_over, 0.0, told.distance_cm)
        achieved += np.where(is_over, 0.0, told.achieved)
        ended |= terminated | truncated
        commands.append(told.command_kPa)
        if report is not None:
            report(number + 1)
    return Episode(np.array(commands), return_cm, distance_cm, achieved, failed)
