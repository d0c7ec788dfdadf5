"""What a beginning makes of what finished trainings saw, without training these again.

    python reproduce/restarts/pooled.py runs/quick_0 runs/quick_1 runs/quick_2 runs/quick_3

Each of --count beginnings has new weights, learns from the transitions of the trainings and of the
beginnings before it, and knows what their best designs scored. With --without-scores it learns from
the transitions alone, as in Nikishin et al. (2022). Prints the best pairs of each.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import tyro

from pneumorph.base.run_folder import TRAINING_FOLDER
from pneumorph.learn.checkpoint import load_checkpoint
from pneumorph.learn.design_gait_pair import DesignGaitPair
from pneumorph.learn.learned import below
from pneumorph.learn.settings import CooptSettings
from pneumorph.learn.training import Training
from pneumorph.robot.design import Design
from pneumorph.study.finished_run import FinishedRun
from pneumorph.study.learning_robots import learning_and_judged, learning_robots
from pneumorph.study.own_task import environments_of
from pneumorph.study.training_worlds import TrainingWorlds


def main(
    runs: tyro.conf.Positional[tuple[Path, ...]],
    seed: int = 0,
    count: int = 3,
    without_scores: bool = False,
) -> None:
    """Let beginnings learn from what trainings saw.

    Args:
        runs: Folders of finished coopt runs with their checkpoints, all of one preset.
        seed: Of what is drawn.
        count: How many beginnings, each of which the next ones learn from.
        without_scores: Know nothing of what designs scored.
    """
    first = FinishedRun.read(runs[0])
    settings = first.structured("coopt", CooptSettings)
    settings = replace(settings, seed=seed, restarts=len(runs) + count, pooled_restarts=count)
    worlds = TrainingWorlds.of_run(first, settings.objective)
    spec = first.spec()
    learning, judged = learning_and_judged(
        lambda robots: environments_of(settings, robots, worlds, None),
        spec,
        learning_robots(spec, settings),
    )
    training = Training(learning, settings, judged)
    for folder in runs:
        arrays = load_checkpoint(folder / TRAINING_FOLDER).arrays
        training.pool.add(below(arrays, "buffer/"))
        if not without_scores:
            training.pool.note(_pairs(FinishedRun.read(folder), training))
    training.restart = len(runs) - 1
    training.timestep = len(runs) * settings.restart_timesteps
    for number in range(1, count + 1):
        training.begin_again()
        while not training.is_restart_over:
            training.run_round()
        pairs = training.evaluate()
        if not without_scores:
            training.pool.note(pairs)
        for pair in pairs[:3]:
            print(
                f"{number}: {training.space[pair.design]}, score {pair.score_cm:.1f} cm, "
                f"mean {pair.distance_cm:.1f} cm",
                flush=True,
            )


def _pairs(run: FinishedRun, training: Training) -> list[DesignGaitPair]:
    """The best pairs of a run; of their gaits nothing is needed."""
    return [
        DesignGaitPair(
            training.space.index(Design.parse(pair["design"])),
            np.empty((0, 0)),
            pair["distance_cm"],
            pair["score_cm"],
            "before",
            0,
            pair["achieved"],
        )
        for pair in run.of_summary("pairs", list)
    ]


if __name__ == "__main__":
    tyro.cli(main, description=__doc__)
