"""Toy trainings in a folder that are stopped after some rounds, and what equal ones have alike."""

from pathlib import Path
from typing import Any

import numpy as np

from helpers.toy_coopt import make_simulator
from pneumorph.environment.viscous_crawler import viscous_crawler_robot
from pneumorph.learn.checkpoint import load_checkpoint
from pneumorph.learn.coopt_result import CooptResult
from pneumorph.learn.cooptimise import learn_in_folder
from pneumorph.learn.environments import crawling
from pneumorph.learn.metrics import read_metrics
from pneumorph.learn.settings import CooptSettings
from pneumorph.learn.training import STAGES

TIMES = {*(f"{stage}_s" for stage in STAGES), "wall_s", "finetuning_wall_s", "remarks"}


class Killed(Exception):
    """Stands for the end of the process."""


def run(
    folder: Path, settings: CooptSettings, kill_after_round: int | None = None, **options: Any
) -> CooptResult:
    """Begin a training, or go on with it, to its end or to a round."""

    def progress(done: int, total: int, message: str) -> None:
        assert done <= total
        if kill_after_round is not None and done >= kill_after_round * settings.timesteps_per_round:
            raise Killed

    factory = crawling(viscous_crawler_robot, make_simulator, settings)
    return learn_in_folder(factory, settings, folder, progress=progress, **options)


def timeless(values: dict[str, Any]) -> dict[str, Any]:
    """Values without those that tell of time."""
    return {name: value for name, value in values.items() if name not in TIMES}


def assert_same(folder: Path, summary: CooptResult, straight: tuple[Path, CooptResult]) -> None:
    """Results, checkpoints and metrics are those of a training that was not stopped."""
    assert timeless(vars(summary)) == timeless(vars(straight[1]))
    ours, theirs = load_checkpoint(folder), load_checkpoint(straight[0])
    assert ours.arrays.keys() == theirs.arrays.keys()
    for name, value in theirs.arrays.items():
        np.testing.assert_array_equal(ours.arrays[name], value, err_msg=name)
    lines = zip(read_metrics(folder), read_metrics(straight[0]), strict=True)
    for mine, expected in lines:
        assert timeless(mine) == timeless(expected)
