"""Flags that would change nothing beside the others are refused where somebody gave them."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from helpers.run_folders import write_run

from pneumorph.cli import run
from pneumorph.learn.objective import Objective
from pneumorph.learn.settings import CooptSettings
from pneumorph.simulation.randomisation import Randomisation
from pneumorph.study.training_options import TrainingOptions, train

Ask = Callable[[str], Any]
IDLE = {
    "coopt --physics published --world-count 3": "--world-count: expected to be left out without "
    "--randomize: it would be ignored",
    "coopt --physics published --randomisation.friction 0.3": "--randomisation.friction: expected "
    "to be left out without --randomize or --certified-world-count",
    "coopt --physics published --rounds.limit 5": "--rounds.limit: expected to be left out "
    "without --certify",
    "coopt --world-count 3": "with --objective.worlds-per-design 4",
    "coopt --physics published --objective.kind worst_share": "where designs walk in one world",
    "coopt --objective.worlds-per-design 1 --objective.nominal-until-timestep 100": "-until-times",
    "coopt --objective.share 0.5": "without --objective.kind worst_share",
    "demo --physics published --world-count 3": "without --randomize",
    "campaign --physics published --world-count 3": "without --randomize",
    "search --physics published --randomisation.friction 0.3": "candidates walk in one world",
    "search --physics published --finalist-count 3": "candidates walk in one world",
    "search --physics published --objective.evaluation-worlds 3": "walk in one world",
    "search --objective.centring-rounds 4": "--objective.centring-rounds: expected to be left out "
    "of a search",
    "search --method genetic --gaits.population 4": "--gaits.population: expected to be left out "
    "without --method gaits",
    "search --method genetic --designs 1.0.0.2.2.0.0.1": "--designs: expected",
    "search --method random --random-design-count 9": "--random-design-count: expected",
    "search --method random --genetic.population 9": "without --method genetic",
    "search --kept-pair-count 9": "--kept-pair-count: expected",
    "evaluate {run} --world-count 10 --world-seed 3": "--world-count: expected to be left out "
    "without --randomize",
    "evaluate {run} --world-seed 3": "--world-seed: expected",
    "evaluate {run} --randomisation.friction 0.3": "--randomisation.friction: expected",
}


@pytest.fixture(scope="module")
def trained(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run in drawn worlds, with other settings than anybody's default."""
    options = TrainingOptions(
        randomize=True,
        randomisation=Randomisation(friction="0.4"),
        coopt=CooptSettings(objective=Objective(evaluation_worlds=7)),
    )
    return write_run(tmp_path_factory.mktemp("run"), "coopt", options)


@pytest.mark.parametrize("asked", IDLE)
def test_what_would_be_ignored_is_refused(
    asked: str, trained: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    command = asked.format(run=trained).split()
    assert run([*command, "--out", str(tmp_path / "out")]) == 1
    assert IDLE[asked] in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    "command",
    [
        "coopt --preset fast",
        "coopt --physics published",
        "coopt --objective.worlds-per-design 1 --world-count 3",
        "coopt --no-randomize --objective.worlds-per-design 1 --randomisation.friction 0.3",
        "coopt --physics published --certify --rounds.limit 5 --randomisation.friction 0.3",
        "coopt --physics published --world-count 8",  # the default, and nothing else
        "demo",
        "search --method genetic --genetic.population 8",
        "search --run {run}",
        "search --run {run} --method random",
        "evaluate {run}",
        "evaluate {run} --randomize --world-count 3 --randomisation.friction 0.3",
        "coopt --settings {run}/settings.json",
        "coopt --settings {run}/settings.json --no-randomize",
    ],
)
def test_what_has_a_meaning_or_nobody_set_is_taken(command: str, trained: Path, asked: Ask) -> None:
    assert asked(command.format(run=trained)) is not None


def test_changes_that_would_be_ignored_are_refused(tmp_path: Path) -> None:
    changes = {"robot": {"based_on": "published"}, "world_count": 3}
    with pytest.raises(ValueError, match="--world-count: expected to be left out without --random"):
        train(tmp_path / "run", changes=changes)
    assert not (tmp_path / "run").exists()
