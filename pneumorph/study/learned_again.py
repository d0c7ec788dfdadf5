"""Gaits of a training's designs on robots of another reduction: those that were there, and those of
policies fine-tuned on these robots, whichever score higher."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from pneumorph.base.run_folder import TRAINING_FOLDER, RunFolder
from pneumorph.catalogue.robot_identity import reduction_digest, resume_identity
from pneumorph.catalogue.robot_spec import RobotSpec
from pneumorph.environment.training_environment import EnvironmentFactory
from pneumorph.learn.checkpoint import has_checkpoint
from pneumorph.learn.cooptimise import GAIT_FOLDER
from pneumorph.learn.demonstrations import known_pair
from pneumorph.learn.design_gait_pair import BestPairs
from pneumorph.learn.environments import crawling
from pneumorph.learn.evaluated_gaits import best_of_each_design
from pneumorph.learn.finetuning import FINETUNED_FOLDER, finetune
from pneumorph.learn.settings import CooptSettings
from pneumorph.learn.training import Training
from pneumorph.simulation.randomised_simulator import reduction_digests
from pneumorph.study.finished_run import FinishedRun, Pair
from pneumorph.study.learning_robots import learning_and_judged, learning_robots
from pneumorph.study.search_findings import FoundPair
from pneumorph.study.study_once import study_once
from pneumorph.study.training_worlds import TrainingWorlds, simulator_factory


@dataclass(frozen=True, eq=False)
class Trained:
    """A training that has ended, to go on from.

    Attributes:
        folder: Of the training, with its checkpoint.
        settings: What it was made with.
        worlds: Worlds that it was made in; None for one.
    """

    folder: Path
    settings: CooptSettings
    worlds: TrainingWorlds | None

    @classmethod
    def of_run(cls, run: FinishedRun) -> Trained | None:
        """That of a finished run; None where it fine-tuned nothing, has lost its checkpoint, or had
        a task of its own, which no file holds."""
        folder = run.folder / TRAINING_FOLDER
        own = run.summary.get("own_task") is not None
        if "coopt" not in run.settings or own or not has_checkpoint(folder):
            return None
        settings = run.structured("coopt", CooptSettings)
        worlds = TrainingWorlds.of_run(run, settings.objective)
        return cls(folder, settings, worlds) if settings.finetuning.timesteps else None


@dataclass(frozen=True)
class LearnedAgain:
    """Designs with the better of their gaits, that of before and that of the fine-tuned policy."""

    pairs: tuple[FoundPair, ...]
    """The highest score first; those whose simulation failed are left out."""
    timesteps: int
    wall_s: float


def learned_again(
    trained: Trained, spec: RobotSpec, pairs: Sequence[Pair], folder: RunFolder
) -> LearnedAgain:
    """Fine-tune a training on each of its designs, as its own end did, with robots of another
    reduction; made once, and a stopped one goes on with the next design.

    Fine-tuning may make a gait worse: the pairs as they were walk in the same worlds of an
    evaluation, and the better gait of each design is kept.

    Args:
        trained: The training.
        spec: The robots.
        pairs: The designs, with their gaits of before.
        folder: Receives ``finetuned/DESIGN.npz`` and ``gaits/L1.csv`` ...

    Raises:
        ValueError: The folder holds the same of other robots or designs.
    """
    settings, worlds = trained.settings, trained.worlds
    step_s = spec.physics.time_step_s

    def make() -> LearnedAgain:
        def environments(robots: RobotSpec) -> EnvironmentFactory:
            factory = simulator_factory(robots, worlds, settings.seed)
            return crawling(robots.assembly, factory, settings)

        learners = learning_robots(spec, settings, folder.progress)
        learning, judged = learning_and_judged(environments, spec, learners)
        training = Training(learning, settings, judged)
        space, task = settings.space, settings.task
        action_s = task.action_s(step_s)
        found = finetune(
            training,
            [space.index(pair.design) for pair in pairs],
            trained.folder,
            folder.path / FINETUNED_FOLDER,
            step_s,
            folder.progress,
        )
        before = best_of_each_design(
            [known_pair(pair.gait, pair.design, space, task, action_s, "before") for pair in pairs],
            training.judged,
            space,
            settings.objective,
            folder.progress,
        )
        best = BestPairs(space, len(pairs), training.environment.is_symmetric)
        best.offer([*before.values(), *found.pairs])
        kept = []
        for rank, pair in enumerate(best.pairs, start=1):
            design, file = str(space[pair.design]), f"{GAIT_FOLDER}/L{rank}.csv"
            pair.write(folder / file, space[pair.design], action_s, task)
            kept.append(
                FoundPair(
                    design, pair.distance_cm, file, pair.timestep, pair.score_cm, pair.achieved
                )
            )
        return LearnedAgain(tuple(kept), found.timesteps, found.wall_s)

    drawn = None if worlds is None else worlds.randomisation
    asked = {
        "coopt": settings,
        "worlds": worlds,
        "leg": reduction_digest(spec),
        "physics": spec.physics,
        "designs": [str(pair.design) for pair in pairs],
        # None where they are usual, which folders of earlier versions are taken to be of.
        "hub_and_map": resume_identity(spec, drawn) or None,
        "stepper": spec.stepper,
        "reductions": {} if drawn is None else reduction_digests(drawn),
    }
    said_now = ("stepper", "reductions")
    return study_once(folder, LearnedAgain, asked, make, begun=True, later=said_now)
