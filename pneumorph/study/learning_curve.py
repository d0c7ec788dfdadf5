"""How far the best robot of a coopt run came, over the time that was simulated until then."""

from __future__ import annotations

from pathlib import Path

from pneumorph.base.run_folder import TRAINING_FOLDER
from pneumorph.learn.metrics import read_metrics
from pneumorph.study.finished_run import FinishedRun
from pneumorph.study.training_result import TrainingResult


def learning_curve(run: Path) -> tuple[list[float], list[float]]:
    """Return simulated time of all robots [s] and best distance so far [cm].

    A point a round of training, whose robots act with the policy's noise, and one at the end of
    fine-tuning with the best pair that the run reports.

    Args:
        run: Folder of a coopt run.
    """
    learned = FinishedRun.read(run)
    found = learned.result(TrainingResult)
    action_s = learned.task.action_step_count * learned.robot.physics.time_step_s
    metrics = read_metrics(run / TRAINING_FOLDER)
    points = [
        (line["timestep"] * action_s, line["best_distance_cm"])
        for line in metrics
        if line["best_distance_cm"] is not None
    ]
    end = (found.timesteps + found.finetuning_timesteps) * action_s
    seen = [distance for _, distance in points]
    best = max([*seen, *([] if found.best_distance_cm is None else [found.best_distance_cm])])
    simulated_s, distance_cm = zip(*points, (end, best), strict=True)
    return list(simulated_s), list(distance_cm)
