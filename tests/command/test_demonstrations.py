"""A training that is shown a gait, by its verb."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from helpers.short_training import SHORT_TRAINING

from pneumorph.cli import run

PULSE = """# design: 1.0.0.2.2.0.0.1
time_s,regulator_1_kPa,regulator_2_kPa
0.0,90.0,0.0
0.2,0.0,90.0
0.4,0.0,90.0
"""


def test_a_run_is_shown_a_gait_and_goes_on_with_that_alone(
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
    gait.write_text(PULSE.replace("90.0,0.0", "80.0,0.0"))
    capsys.readouterr()
    assert run([*asked.split(), "--resume"]) == 1
    told = capsys.readouterr().err
    assert "was trained with other settings (shown" in told
