"""Gaits of a training's designs, fine-tuned on robots of another reduction."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from pneumorph.base.run_folder import TRAINING_FOLDER, RunFolder
from pneumorph.catalogue.robot_spec import RobotSpec
from pneumorph.gait.gait_file import write_gait
from pneumorph.learn.checkpoint import has_checkpoint
from pneumorph.learn.cooptimise import GAIT_FOLDER
from pneumorph.learn.environments import crawling
from pneumorph.learn.finetuning import FINETUNED_FOLDER, finetune
from pneumorph.learn.settings import CooptSettings
from pneumorph.learn.training import Training
from pneumorph.robot.design import Design
from pneumorph.study.finished_run import FinishedRun
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
        settings, worlds = run.structured("coopt", CooptSettings), None
        if run.worlds is not None:
            worlds = TrainingWorlds.of_objective(
                run.worlds, settings.objective, run.of_settings("world_count", int)
            )
        return cls(folder, settings, worlds) if settings.finetuning.timesteps else None


@dataclass(frozen=True)
class LearnedAgain:
    """Designs with the gaits of their fine-tuned policies."""

    pairs: tuple[FoundPair, ...]
    """The highest score first; those whose simulation failed are left out."""
    timesteps: int
    wall_s: float


def learned_again(
    trained: Trained, spec: RobotSpec, designs: Sequence[Design], folder: RunFolder
) -> LearnedAgain:
    """Fine-tune a training on each of its designs, as its own end did, with robots of another
    reduction; made once, and a stopped one goes on with the next design.

    Args:
        trained: The training.
        spec: The robots.
        designs: The designs.
        folder: Receives ``finetuned/DESIGN.npz`` and ``gaits/L1.csv`` ...

    Raises:
        ValueError: The folder holds the same of other robots or designs.
    """
    settings, worlds = trained.settings, trained.worlds
    step_s = spec.physics.time_step_s

    def make() -> LearnedAgain:
        factory = simulator_factory(spec, worlds, settings.seed)
        training = Training(crawling(spec.assembly, factory, settings), settings)
        found = finetune(
            training,
            [settings.space.index(design) for design in designs],
            trained.folder,
            folder.path / FINETUNED_FOLDER,
            step_s,
            folder.progress,
        )
        pairs = []
        for rank, pair in enumerate(found.pairs, start=1):
            design, file = str(settings.space[pair.design]), f"{GAIT_FOLDER}/L{rank}.csv"
            gait = pair.gait(settings.task.action_step_count * step_s, settings.task)
            comments = {"design": design, "distance_cm": f"{pair.distance_cm:.3f}"}
            write_gait(folder / file, gait, comments)
            pairs.append(
                FoundPair(
                    design, pair.distance_cm, file, pair.timestep, pair.score_cm, pair.achieved
                )
            )
        return LearnedAgain(tuple(pairs), found.timesteps, found.wall_s)

    asked = {
        "coopt": settings,
        "worlds": worlds,
        "leg": spec.reduction_digest(),
        "physics": spec.physics,
        "designs": [str(design) for design in designs],
    }
    return study_once(folder, LearnedAgain, asked, make, begun=True)
