"""A training that is watched: the expert beside it, and the physics of what is shown."""

from __future__ import annotations

from dataclasses import asdict, replace
from pathlib import Path

import numpy as np
import pytest
from helpers.result_example import example
from helpers.run_folders import write_run

from pneumorph.gait.phase_sweep import PhaseSweep
from pneumorph.learn.checkpoint import CheckpointMetadata, save_checkpoint
from pneumorph.learn.snapshot import TrainingSnapshot
from pneumorph.report.watched_run import WatchedRun
from pneumorph.study.baseline import SWEEP_FILE
from pneumorph.study.training_options import TrainingOptions


@pytest.mark.parametrize(
    ("distance_cm", "best"), [([1.0, np.nan, 2.5], 2.5), ([np.nan] * 3, None), (None, None)]
)
def test_the_experts_best_phase_is_that_of_those_that_did_not_fail(
    distance_cm: list[float] | None, best: float | None, tmp_path: Path
) -> None:
    run = WatchedRun(write_run(tmp_path / "run", "coopt", TrainingOptions()))
    if distance_cm is not None:
        counted = np.array(distance_cm)
        zero = np.zeros(3)
        sweep = PhaseSweep(zero, counted, zero, np.zeros(2), np.zeros((2, 3)), {})
        sweep.save(run.folder / SWEEP_FILE)
    assert run._baseline() == best


@pytest.mark.parametrize(("randomize", "around"), [(False, ""), (True, "worlds drawn around ")])
def test_a_watched_training_says_its_physics(randomize: bool, around: str, tmp_path: Path) -> None:
    options = TrainingOptions(randomize=randomize)
    run = WatchedRun(write_run(tmp_path / "run", "coopt", options))
    told = run._view(TrainingSnapshot([], [], None, 9, None))
    name = options.robot.physics_name
    assert f"Robots walk in {around}{name} physics, " in told["status"]


def test_the_task_of_ones_own_is_known_from_the_first_checkpoint_on(tmp_path: Path) -> None:
    folder = write_run(tmp_path / "run", "coopt", TrainingOptions(), own_task="Diagonal")
    snapshot = TrainingSnapshot([], [], None, 9, None)
    finished = WatchedRun(folder)
    assert "the task Diagonal" in finished._view(snapshot)["status"]
    assert finished._moment(snapshot).own_task == "Diagonal"
    (folder / "summary.json").unlink()
    going_on = WatchedRun(folder)
    assert going_on._moment(snapshot).own_task is None
    begun = replace(example(CheckpointMetadata), provenance={"environment": "Straight"})
    save_checkpoint(folder / "training", {}, asdict(begun))
    assert going_on._moment(snapshot).own_task == "Straight"
    assert WatchedRun(write_run(tmp_path / "usual", "coopt", TrainingOptions()))._own_task() is None
