"""What a calibration keeps of bench tests when the robot that they were relative to changes."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
from helpers.published_pairs import PAPER_PAIRS

from pneumorph.cli import run
from pneumorph.physics.calibration import Calibration


@pytest.fixture
def earlier(tmp_path: Path) -> Path:
    """A calibration that a bench test found mass and modulus for."""
    file = tmp_path / "earlier.json"
    kept = {"modulus_factor": (1.06, 0.03), "mass_factor": (1.0, 0.02)}
    line = Calibration.load(_calibrated(tmp_path, "--pairs", PAPER_PAIRS, "first"))
    replace(line, measured=kept).save(file)
    return file


def _calibrated(folder: Path, flag: str, content: str, name: str, more: str = "") -> Path:
    table, out = folder / f"{name}.csv", folder / name
    table.write_text(content)
    asked = f"calibrate {flag} {table} --physics published {more} --out {out}"
    assert run(asked.split()) == 0
    return out / "calibration.json"


def test_a_new_line_of_pressures_forgets_the_modulus_of_before(
    earlier: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """It was relative to the leg of then: the new line has it in itself."""
    capsys.readouterr()
    file = _calibrated(tmp_path, "--pairs", PAPER_PAIRS, "again", f"--calibration {earlier}")
    assert Calibration.load(file).measured == {"mass_factor": (1.0, 0.02)}
    assert "modulus_factor that a bench test found before" in capsys.readouterr().err
