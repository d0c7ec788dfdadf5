"""A run is read from any folder, and after it was moved with its files."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest
from helpers.run_folders import write_run

from pneumorph.base.layers import layered
from pneumorph.catalogue.paper_robot import paper_robot
from pneumorph.catalogue.shipped_data import data_file
from pneumorph.study.finished_run import FinishedRun
from pneumorph.study.training_options import TrainingOptions

FILE = (
    data_file("paper_robot.toml")
    .read_text()
    .replace('leg = "published"', 'leg = "published"\npart = "parts/own.npz"')
)


@pytest.fixture
def run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Of a robot with a part of one's own, made where its files lie."""
    home = tmp_path / "home"
    (home / "parts").mkdir(parents=True)
    paper_robot("published").module.reduced.save(home / "parts/own.npz")
    (home / "own.toml").write_text(FILE)
    shutil.copy(data_file("disk_mesh.npz"), home)
    monkeypatch.chdir(home)
    options = layered(TrainingOptions(), [{"robot": {"described": "own.toml"}}])
    return write_run(home / "runs/learned", "coopt", options)


def test_it_is_read_from_elsewhere_and_where_it_was_moved(
    run: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    named = FinishedRun.read(run)
    assert named.robot.described == Path("own.toml")
    mass = named.spec().module.reduced.mass
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    monkeypatch.chdir(elsewhere)
    assert FinishedRun.read(run).spec().module.reduced.mass == mass
    moved = shutil.move(tmp_path / "home", tmp_path / "moved")
    again = FinishedRun.read(Path(moved) / "runs/learned")
    assert again.spec().module.reduced.mass == mass
    assert again.taken_over("robot")["robot"]["described"] == str(Path(moved) / "own.toml")
    # What it was asked for stays what tells it from others.
    assert json.dumps(again.settings) == json.dumps(named.settings)


def test_a_file_that_is_gone_is_named_as_it_was(
    run: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    Path("parts/own.npz").unlink()
    monkeypatch.chdir(tmp_path)
    with pytest.raises(ValueError, match=r"parts/own\.npz does not exist"):
        FinishedRun.read(run).spec()


def test_files_of_another_run_do_not_stand_in_for_its_own(
    run: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    other = tmp_path / "other"
    other.mkdir()
    (other / "own.toml").write_text("name = 'another'\n")
    monkeypatch.chdir(other)
    assert FinishedRun.read(run).robot.described == tmp_path / "home/own.toml"
