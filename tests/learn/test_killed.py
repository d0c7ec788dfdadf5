"""A process that is killed at any moment loses at most one checkpoint period, and says so."""

import os
import re
import shutil
import signal
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from helpers.killed_run import SETTINGS, finish
from helpers.toy_coopt import make_simulator

from pneumorph.environment.viscous_crawler import viscous_crawler_robot
from pneumorph.learn.checkpoint import load_checkpoint
from pneumorph.learn.cooptimise import learn_in_folder
from pneumorph.learn.environments import crawling
from pneumorph.learn.metrics import read_metrics

HELPERS = Path(__file__).parents[1] / "helpers"
PERIOD = SETTINGS.checkpoint_interval_timesteps


@pytest.fixture(scope="module")
def straight(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("straight")
    finish(folder)
    return folder


@pytest.mark.parametrize(
    ("moment", "lost_rounds"),
    [
        ("in an action of round 6", 1),
        ("while the second checkpoint is written", 2),
        ("between the renames of the second checkpoint", 2),
    ],
)
@pytest.mark.filterwarnings("ignore:the previous checkpoint is used")
def test_killed_process_goes_on_to_the_same_bits(
    tmp_path: Path, straight: Path, moment: str, lost_rounds: int
) -> None:
    child = subprocess.run(
        [sys.executable, str(HELPERS / "killed_run.py"), str(tmp_path), moment],
        check=False,
        env={**os.environ, "PYTHONPATH": str(HELPERS.parent)},
        capture_output=True,
    )
    assert child.returncode == -signal.SIGKILL, child.stderr.decode()
    reached = read_metrics(tmp_path)[-1]["timestep"]
    said: list[str] = []
    summary = finish(tmp_path, said)
    assert said == list(summary.remarks)
    resumed = re.search(r"resumed at timestep (\d+)", said[-1])
    assert resumed is not None
    lost = reached - int(resumed[1])
    assert lost == lost_rounds * SETTINGS.timesteps_per_round <= PERIOD
    assert f"{lost} timesteps after the last checkpoint were lost" in said[-1]
    ours, theirs = (load_checkpoint(folder) for folder in (tmp_path, straight))
    for name in theirs.arrays:
        np.testing.assert_array_equal(ours.arrays[name], theirs.arrays[name], err_msg=name)
    assert ours.metadata["random_state"] == theirs.metadata["random_state"]


def test_a_run_that_died_before_its_first_checkpoint_says_that_it_begins_again(
    tmp_path: Path,
) -> None:
    class Died(Exception):
        pass

    def die(done: int, total: int, message: str) -> None:
        raise Died

    rare = replace(SETTINGS, checkpoint_interval_timesteps=10**6)
    with pytest.raises(Died):
        learn_in_folder(
            crawling(viscous_crawler_robot, make_simulator, rare), rare, tmp_path, progress=die
        )
    copy = tmp_path / "copy"
    shutil.copytree(tmp_path, copy)
    summary = learn_in_folder(
        crawling(viscous_crawler_robot, make_simulator, rare), rare, tmp_path, resume=True
    )
    one_round = SETTINGS.timesteps_per_round
    lost = f"{one_round} timesteps after the last checkpoint were lost and are made again"
    assert summary.remarks == (f"began again: {lost}",)
    # What is not gone on with is not called so.
    (remark,) = finish(copy).remarks
    assert remark.startswith("began anew: a training with other settings")
