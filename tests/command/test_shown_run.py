"""A training that is shown a gait, by its verb."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pytest
from helpers.short_training import SHORT_TRAINING

from pneumorph.base.settings import settings_from_dict
from pneumorph.cli import run
from pneumorph.study.study_once import study_folder
from pneumorph.study.training_options import TrainingOptions, train_once

PULSE = """# design: 1.0.0.2.2.0.0.1
time_s,regulator_1_kPa,regulator_2_kPa
0.0,90.0,0.0
0.2,0.0,90.0
0.4,0.0,90.0
"""


def test_a_run_is_shown_a_gait_and_is_read_and_goes_on_with_that_alone(
    leg: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    gait, out = tmp_path / "pulse.csv", tmp_path / "run"
    gait.write_text(PULSE)
    asked = (
        f"coopt --preset quick --part {leg} --out {out} {SHORT_TRAINING} --task.action-count 3 "
        f"--demonstrations {gait} --certified-world-count 0"
    )
    assert run(asked.split()) == 0
    said = json.loads((out / "settings.json").read_text())
    assert said["demonstrations"] == [str(gait)]
    # Another training is shown the best pair of this one.
    again = [str(out) if each == str(gait) else each for each in asked.split()]
    again[again.index(str(out))] = str(tmp_path / "again")
    assert run(again) == 0
    best = json.loads((out / "summary.json").read_text())["best_design"]
    (shown,) = json.loads((tmp_path / "again/summary.json").read_text())["shown"]
    assert shown.startswith(f"{best} ")
    # What decides is the gait and not where it lies.
    options = settings_from_dict(TrainingOptions, said)
    moved = gait.rename(tmp_path / "moved.csv")
    asked_again = replace(options, demonstrations=(moved,))
    assert train_once(asked_again, study_folder(out, "coopt")).best_design == best
    gait.write_text(PULSE.replace("90.0,0.0", "80.0,0.0"))
    with pytest.raises(ValueError, match="holds a training that was shown"):
        train_once(options, study_folder(out, "coopt"))
    with pytest.raises(ValueError, match="holds a training that was shown"):
        train_once(replace(options, demonstrations=()), study_folder(out, "coopt"))
    capsys.readouterr()
    assert run([*asked.split(), "--resume"]) == 1
    told = capsys.readouterr().err
    assert "was trained with other settings (shown" in told
