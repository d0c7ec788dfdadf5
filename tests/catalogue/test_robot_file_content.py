"""A run means the robot that its file described when it began."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from pneumorph.base.layers import layered
from pneumorph.base.settings import settings_from_dict, settings_to_dict
from pneumorph.catalogue.robot_options import RobotOptions

PLATE = Path(__file__).parents[2] / "examples" / "plate.toml"


@pytest.fixture
def kite(tmp_path: Path) -> Path:
    return Path(shutil.copyfile(PLATE, tmp_path / "kite.toml"))


def length_mm(options: RobotOptions) -> float | None:
    assert options.description is not None
    return options.description.hub.length_mm


def chosen(file: Path) -> RobotOptions:
    return layered(RobotOptions(), [{"described": str(file)}])


def test_a_changed_file_changes_no_run_that_has_begun(kite: Path) -> None:
    kept = settings_to_dict(chosen(kite))
    kite.write_text(kite.read_text().replace("length_mm = 150", "length_mm = 140"))
    assert length_mm(settings_from_dict(RobotOptions, kept)) == 150
    assert length_mm(layered(RobotOptions(), [kept])) == 150
    # Asked for again, it is what the file has now, over a run's settings as well.
    assert length_mm(chosen(kite)) == 140
    assert length_mm(layered(RobotOptions(), [kept, {"described": str(kite)}])) == 140
    assert settings_to_dict(chosen(kite)) != kept
    # What it has no more is gone, and nothing of it is asked where a run has its own.
    kite.write_text(kite.read_text().replace('usual = "b1.0.2.2.0.b1"\n', "payload = 1\n"))
    assert length_mm(layered(RobotOptions(), [kept])) == 150
    kite.write_text(kite.read_text().replace("payload = 1\n", ""))
    again = layered(RobotOptions(), [kept, {"described": str(kite)}]).description
    assert again is not None
    assert again.designs.usual is None
    assert hash(chosen(kite))


def test_a_run_needs_its_robots_file_no_more(kite: Path) -> None:
    kept = settings_to_dict(chosen(kite))
    kite.unlink()
    again = settings_from_dict(RobotOptions, kept)
    assert length_mm(again) == 150
    assert again.spec().name == "plate"
    assert layered(RobotOptions(), [kept]) == again


def test_runs_of_earlier_versions_have_what_the_file_has(kite: Path) -> None:
    kept = settings_to_dict(chosen(kite))
    del kept["file_text"]
    assert settings_from_dict(RobotOptions, kept) == chosen(kite)
