"""Beginnings that learn from what finished trainings saw, made after these."""

import re
from pathlib import Path

import pytest
from helpers.experiment_scripts import script
from helpers.synthetic_part import synthetic_reduced_part

from pneumorph.cli import run

_SHORT = (
    "--total-timesteps 20 --environment-count 4 --task.action-count 5 --task.action-step-count 20 "
    "--learning-start-timestep 10 --updates 1 --sac.batch-size 8 --sac.hidden-sizes 8 8 "
    "--schedule.decay-start-timestep 5 --schedule.decay-end-timestep 18 "
    "--evaluated-design-count 4 --kept-pair-count 2 --baseline.phase-step-deg 180 "
    "--baseline.gait.duration-s 4 --certified-world-count 0"
)


def test_each_beginning_is_told(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    leg = synthetic_reduced_part(mode_count=4, cells=(4, 4, 4)).save(tmp_path / "leg.npz")
    folders = []
    for seed in (0, 1):
        folders.append(tmp_path / f"quick_{seed}")
        asked = f"coopt --preset quick --physics published --part {leg} --seed {seed} {_SHORT}"
        assert run([*asked.split(), "--out", str(folders[-1])]) == 0
    capsys.readouterr()
    script("restarts", "pooled").main(tuple(folders), seed=3, count=2)
    told = capsys.readouterr().out
    assert {line[0] for line in told.splitlines()} == {"1", "2"}
    assert re.search(r"^1: [0-3.]+, score -?\d+\.\d cm, mean -?\d+\.\d cm$", told, re.MULTILINE)
