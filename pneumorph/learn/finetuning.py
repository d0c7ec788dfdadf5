"""The best designs of a training, each with a policy that at the end learned on it alone.

The entropy schedule leaves one design at the end of training, for which the policy is fine-tuned
(paper, section III-A). Here each finalist gets that: learning goes on from the trained policy with
all robots of one design. Then every finalist walks once, driven by its own policy without noise.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from pneumorph.base.progress import ProgressReport
from pneumorph.learn.checkpoint import load_checkpoint
from pneumorph.learn.design_gait_pair import BestPairs, DesignGaitPair
from pneumorph.learn.evaluation import evaluation_timesteps, filled_batch, walk_batch
from pneumorph.learn.networks import Policy
from pneumorph.learn.policy_file import load_policy, save_policy
from pneumorph.learn.training import Training

FINETUNED_FOLDER = "finetuned"


@dataclass(frozen=True)
class Finetuned:
    """What fine-tuning came to.

    Attributes:
        pairs: A pair for each finalist whose simulation did not fail, the highest score first.
        timesteps: Actions of all robots for all finalists.
        wall_s: Wall time of all fine-tuning [s].
        evaluation_timesteps: Actions of the finalists' walks, which `timesteps` does not count.
    """

    pairs: list[DesignGaitPair]
    timesteps: int
    wall_s: float
    evaluation_timesteps: int = 0


def finetune(
    training: Training,
    designs: Sequence[int],
    folder: Path,
    policies_folder: Path,
    time_step_s: float = 0.01,
    progress: ProgressReport | None = None,
) -> Finetuned:
    """Fine-tune a finished training on each of some designs.

    The folder of policies receives ``DESIGN.npz``, a policy for each. Those that are there already
    are not made again, so that a stopped run goes on with the next.

    Args:
        training: Finished; it goes back to its last checkpoint. Its robots may be others than those
            of the run, such as ones of another reduction.
        designs: Indices of the designs, such as `finalists`.
        folder: The run folder, with that checkpoint.
        policies_folder: Receives the policies.
        time_step_s: The simulator's time step [s], noted in the policies.
        progress: Told (timesteps done, timesteps in all, message).
    """
    settings = training.settings
    checkpoint = load_checkpoint(folder)
    round_count = settings.finetuning.round_count(settings.timesteps_per_round)
    span = settings.finalist_timesteps
    policies, wall_s = [], 0.0
    for number, design in enumerate(designs):
        path = policies_folder / f"{training.space[design]}.npz"

        def report(done: int, before: int = number * span) -> None:
            if progress is not None:
                progress(before + done, len(designs) * span, "fine-tuning")

        if not path.exists():
            started = time.perf_counter()
            training.take_over(checkpoint)
            _learn_alone(training, design, round_count, report)
            save_policy(
                path,
                training.learned.state.policy,
                settings,
                timestep=training.timestep,
                time_step_s=time_step_s,
                wall_s=time.perf_counter() - started,
            )
        policy, _, metadata = load_policy(path)
        policies.append(policy)
        wall_s += metadata["wall_s"]
        report(span)
    training.take_over(checkpoint)
    pairs = _walked(training, designs, policies, training.timestep + span)
    ranked = sorted(pairs, key=lambda pair: pair.score_cm, reverse=True)
    walked = evaluation_timesteps(len(designs), settings.objective, settings.task)
    return Finetuned(ranked, len(designs) * span, wall_s, walked)


def finalists(training: Training, evaluated: Sequence[DesignGaitPair]) -> list[int]:
    """Designs of the pairs of highest score, seen in training or evaluated; one of images. After
    several beginnings only those evaluated: the policy knows no other beginning's gaits."""
    settings = training.settings
    seen = training.best.pairs if settings.restarts == 1 else []
    ranking = BestPairs(
        training.space, settings.finetuning.finalist_count, training.environment.is_symmetric
    )
    ranking.offer([*seen, *evaluated])
    return [pair.design for pair in ranking.pairs]


def _learn_alone(
    training: Training, design: int, round_count: int, report: Callable[[int], None]
) -> None:
    """Go on learning with all robots of one design."""
    settings = training.settings
    everywhere = np.full(settings.environment_count, design)
    for number in range(1, round_count + 1):
        training.walk_and_learn(everywhere, settings.finetuning.updates_per_vector_step)
        report(number * settings.timesteps_per_round)


def _walked(
    training: Training, designs: Sequence[int], policies: Sequence[Policy], timestep: int
) -> list[DesignGaitPair]:
    """Every design side by side, each driven by its own policy without noise."""
    pairs = []
    worlds = training.settings.objective.worlds_per_design
    count = training.judged.num_envs // worlds
    for begin in range(0, len(designs), count):
        batch = np.array(designs[begin : begin + count])
        drivers = np.repeat(filled_batch(np.arange(begin, begin + len(batch)), count), worlds)

        def act(observation: np.ndarray, drivers: np.ndarray = drivers) -> np.ndarray:
            action = np.empty((len(drivers), training.settings.task.regulator_count), np.float32)
            for driver in np.unique(drivers):
                rows = drivers == driver
                action[rows] = training.learner.mode_actions(policies[driver], observation[rows])
            return action

        pairs += walk_batch(
            training.judged,
            training.space,
            batch,
            act,
            timestep,
            objective=training.settings.objective,
        )
    return pairs
