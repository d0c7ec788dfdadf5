"""What the best robot of a coopt run achieved, over the time that was simulated until then."""

from __future__ import annotations

from pathlib import Path

from pneumorph.base.run_folder import TRAINING_FOLDER
from pneumorph.learn.metrics import read_metrics
from pneumorph.study.finished_run import FinishedRun
from pneumorph.study.training_result import TrainingResult


def learning_curve(run: Path) -> tuple[list[float], list[float]]:
    """Return simulated time of all robots [s] and the best until then [unit of the run's goal: cm,
    or degrees], one for each time; both are empty where no robot survived.

    A point a round of training, whose robots act with the policy's noise, and one at the end of
    fine-tuning with the most of these and of the best pair that the run reports, which is less
    where pairs are not ranked by what they achieve.

    Args:
        run: Folder of a coopt run.

    Raises:
        ArtefactError: The folder holds no finished run, or its files are damaged.
    """
    learned = FinishedRun.read(run)
    found = learned.result(TrainingResult)
    action_s = learned.task.action_s(learned.robot.physics.time_step_s)
    points = [
        (line["timestep"] * action_s, best)
        for line in read_metrics(run / TRAINING_FOLDER)
        # Of earlier versions, which knew no goal but the distance.
        if (best := line.get("best_achieved", line["best_distance_cm"])) is not None
    ]
    reported = found.best_distance_cm if found.goal.is_forward else found.best_achieved
    seen = [best for _, best in points] + ([] if reported is None else [reported])
    if not seen:
        return [], []
    points.append(((found.timesteps + found.finetuning_timesteps) * action_s, max(seen)))
    return [time_s for time_s, _ in points], [best for _, best in points]
