"""Files of a run's robot that were written again since are told by their names."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from helpers.run_folders import write_run
from helpers.synthetic_part import synthetic_reduced_part

from pneumorph.base.result import result_to_dict
from pneumorph.base.run_folder import RunFolder
from pneumorph.catalogue.robot_options import RobotOptions
from pneumorph.physics.calibration import Calibration
from pneumorph.reduction.reduced_part import ReducedPart
from pneumorph.robot.scaled_part import scaled_part
from pneumorph.simulation.randomisation import Randomisation
from pneumorph.simulation.randomised_simulator import _part_of, reduction_digests
from pneumorph.study import training_options
from pneumorph.study.finished_run import FinishedRun
from pneumorph.study.training_options import TrainingOptions, train_once


@pytest.fixture
def options(tmp_path: Path) -> TrainingOptions:
    """A training on a part and a calibration by their files."""
    part = synthetic_reduced_part(mode_count=4, cells=(4, 4, 4)).save(tmp_path / "leg.npz")
    file = Calibration(modulus_factor=1.1, friction=1.0).save(tmp_path / "calibration.json")
    robot = replace(RobotOptions.of("published"), part=part, calibration=file)
    return replace(TrainingOptions(), robot=robot)


def _leg(folder: Path, modulus_factor: float = 0.97) -> None:
    file = folder / "leg.npz"
    scaled_part(ReducedPart.load(file), modulus_factor, 1.0).save(file)


def _friction(folder: Path) -> None:
    Calibration(modulus_factor=1.1, friction=0.9).save(folder / "calibration.json")


def _modulus(folder: Path) -> None:
    Calibration(modulus_factor=1.2, friction=1.0).save(folder / "calibration.json")


def _both(folder: Path) -> None:
    _modulus(folder)
    _leg(folder)


CHANGES = [
    (_leg, ["leg.npz"]),
    (_friction, ["calibration.json"]),
    (_modulus, ["calibration.json"]),  # which makes all legs stiffer, and none another
    (_both, ["leg.npz", "calibration.json"]),
]


@pytest.mark.parametrize(("change", "named"), CHANGES)
def test_a_later_verb_is_told_of_what_it_takes_over_that_changed(
    options: TrainingOptions, tmp_path: Path, change: Callable[[Path], None], named: list[str]
) -> None:
    folder = write_run(tmp_path / "run", "coopt", options)
    described = options.robot.spec().describe()
    known = {name: result_to_dict(described[name]) for name in ("leg", "calibration")}
    summary = json.loads((folder / "summary.json").read_text())
    (folder / "summary.json").write_text(json.dumps({**summary, **known}))
    assert FinishedRun.read(folder).handed_on({}).said.endswith("damping)")
    change(tmp_path)
    said = FinishedRun.read(folder).handed_on({}).said
    for name in ("leg.npz", "calibration.json"):
        assert (f"{tmp_path / name} is not what it was then" in said) == (name in named)


def _finished(options: TrainingOptions, monkeypatch: pytest.MonkeyPatch, **told: Any) -> None:
    """Have the folder hold a finished training of the files as they are."""
    described = options.robot.spec().describe()
    usual = {"shown": (), "own_task": None, "ranked_by": None, "randomisation": None}
    there = {**usual, "certificate": None, **described, **told}
    found = SimpleNamespace(**there)
    monkeypatch.setattr(training_options, "study_once", lambda *_, **__: found)


@pytest.mark.parametrize(("change", "named"), CHANGES)
def test_a_finished_training_of_other_files_of_the_same_names_is_refused(
    options: TrainingOptions,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    change: Callable[[Path], None],
    named: list[str],
) -> None:
    _finished(options, monkeypatch)
    folder = RunFolder(tmp_path / "run", "coopt")
    train_once(options, folder)
    change(tmp_path)
    what = {"calibration.json": "calibration", "leg.npz": "reduced leg"}[named[-1]]
    said = rf"run holds a training with another {what} \(.*{named[-1]} was \w{{12}} and is \w{{12}}"
    with pytest.raises(ValueError, match=said):
        train_once(options, folder)


def test_what_a_training_of_an_earlier_version_does_not_say_is_not_asked(
    options: TrainingOptions, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    leg = replace(options.robot.spec().describe()["leg"], digest=None)
    _finished(options, monkeypatch, leg=leg, calibration=None)
    _both(tmp_path)
    train_once(options, RunFolder(tmp_path / "run", "coopt"))


def test_a_finished_training_in_worlds_of_other_reductions_is_refused(
    options: TrainingOptions, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    other = scaled_part(ReducedPart.load(tmp_path / "leg.npz"), 1.1, 1.0)
    drawn = Randomisation(reductions=(other.save(tmp_path / "other.npz"),))
    asked = replace(options, randomisation=drawn)
    digests, folder = reduction_digests(drawn), RunFolder(tmp_path / "run", "coopt")
    for told in (
        {"randomisation": {"reduction_digests": digests}},
        {"certificate": SimpleNamespace(reduction_digests=digests)},
    ):
        _finished(asked, monkeypatch, **told)
        train_once(asked, folder)
        scaled_part(other, 1.2, 1.0).save(tmp_path / "other.npz")
        _part_of.cache_clear()
        with pytest.raises(ValueError, match=r"another reduction that worlds have \(.*other.npz"):
            train_once(asked, folder)
        other.save(tmp_path / "other.npz")
        _part_of.cache_clear()
