"""Flags that would change nothing beside the others are refused where somebody gave them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from helpers.run_folders import write_run

from pneumorph.base.artefact import write_json
from pneumorph.base.layers import layered
from pneumorph.base.settings import settings_to_dict
from pneumorph.cli import run
from pneumorph.command import coopt
from pneumorph.learn.objective import Objective
from pneumorph.learn.settings import CooptSettings
from pneumorph.simulation.randomisation import Randomisation
from pneumorph.study.training_options import TrainingOptions, quick_training, train

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
    "coopt --physics published --restarts 2 --pooled-restarts 9": "--pooled-restarts: expected to "
    "be left out or to be at most 1, one less than --restarts, as the first beginning has nothing",
    "coopt --physics published --pooled-restarts 3": "or to be at most 0, one less",
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
    "fabricate 1.0.0.2.2.0.0.1 --hub-check.size-mm 3": "--hub-check.size-mm: expected to be left "
    "out without --check-hub: it would be ignored",
    "evaluate {run} --world-seed 3": "--world-seed: expected",
    "evaluate {run} --randomisation.friction 0.3": "--randomisation.friction: expected",
    "simulate --film-settings.width 240": "--film-settings.width: expected to be left out without "
    "--film: it would be ignored",
    "simulate --film --live-settings.port 8000": "--live-settings.port: expected to be left out "
    "without --live",
    "replay walk.npz --film.width 240": "--film.width: expected to be left out without --mp4 or",
    "bench full --robot-count 3": "--robot-count: expected to be left out of `bench full`",
    "bench full --space.minimum-legs 2": "--space.minimum-legs: expected",
    "bench engine --design 1.0.0.0.2.0.0.0": "--design: expected to be left out of `bench engine`",
    "bench --full-benchmark.timed-steps 3": "--full-benchmark.timed-steps: expected",
    "bench --expert.period-s 3": "--expert.period-s: expected",
    "watch {run} --once --port 8000": "--port: expected to be left out with --once",
    "explore {run} --space.minimum-legs 2": "--space.minimum-legs: expected to be left out beside",
    "catalogue list --shipped": "--shipped: expected to be left out without `build`",
    "catalogue --executor.process-count 1": "--executor.process-count: expected",
    "exchange shipped --to sofa --physics.friction 0.3": "--physics.friction: expected to be left "
    "out of a SOFA scene, which has only time step, gravity and damping numbers",
    "exchange shipped --to sofa --physics.air.law orifice": "--physics.air.law: expected",
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
        "coopt --preset fast --restarts 1",
        "search --objective.centring-rounds 0",
        "search --run {run} --objective.centring-rounds 0",
        "simulate --film --film-settings.width 240",
        "replay walk.npz --gif --film.width 240",
        "bench full --design 1.0.0.0.2.0.0.0",
        "bench engine --robot-count 3 --space.minimum-legs 2",
        "watch {run} --port 8000",
        "explore {run}",
        "explore --space.minimum-legs 2",
        "catalogue build --shipped",
        "exchange shipped --to sofa --physics.time-step-s 0.005 --physics.gravity-mm-per-s2 0",
    ],
)
def test_what_has_a_meaning_or_nobody_set_is_taken(command: str, trained: Path, asked: Ask) -> None:
    assert asked(command.format(run=trained)) is not None


FILES = {
    "pooled_restarts = 3": "--restarts 4",
    "restarts = 8\npooled_restarts = 3": "--restarts 2",
    '[objective]\nkind = "worst_share"\nworlds_per_design = 4\nevaluation_worlds = 16': (
        "--objective.worlds-per-design 1"
    ),
    "randomize = true\n[randomisation]\nfriction = '0.3'": "--physics published",
}
"""What has a meaning in a file, or with the flags, and the flags beside it."""


@pytest.mark.parametrize("text", FILES)
def test_a_file_may_be_the_base_of_flags(text: str, tmp_path: Path, asked: Ask) -> None:
    """Which may give its settings a meaning, or take it."""
    file = tmp_path / "own.toml"
    file.write_text(text)
    assert asked(f"coopt --settings {file} {FILES[text]}") is not None


def test_what_a_file_alone_would_ignore_is_refused_by_its_name(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "own.toml"
    file.write_text("world_count = 3\n")
    assert run(["coopt", "--settings", str(file), "--out", str(tmp_path / "out")]) == 1
    assert f"settings file {file}: --world-count: expected to be left" in capsys.readouterr().err


def test_what_an_earlier_version_began_with_too_many_pooled_beginnings_goes_on(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    begun = settings_to_dict(layered(quick_training(), [{"robot": {"based_on": "published"}}]))
    begun["coopt"]["pooled_restarts"] = 3
    write_json(tmp_path / "begun" / "settings.json", begun)
    flags = ["--physics", "published", "--pooled-restarts", "3", "--resume"]
    monkeypatch.setattr(coopt, "VERB", replace(coopt.VERB, run=lambda *_: {}))
    assert run(["coopt", *flags, "--out", str(tmp_path / "begun")]) == 0


def test_changes_that_would_be_ignored_are_refused(tmp_path: Path) -> None:
    changes = {"robot": {"based_on": "published"}, "world_count": 3}
    with pytest.raises(ValueError, match="--world-count: expected to be left out without --random"):
        train(tmp_path / "run", changes=changes)
    assert not (tmp_path / "run").exists()
