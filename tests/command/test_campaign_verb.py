"""What a campaign refuses that it would drop, and the pages of its runs."""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from helpers.result_example import example
from helpers.run_folders import write_run

from pneumorph.base.executor import ExecutorSettings
from pneumorph.base.progress import Progress
from pneumorph.base.run_folder import RunFolder
from pneumorph.catalogue.robot_options import RobotOptions
from pneumorph.cli import run
from pneumorph.command import campaign as verb
from pneumorph.command import coopt
from pneumorph.learn.settings import quick_settings
from pneumorph.report import run_page
from pneumorph.report.run_page import RunPage
from pneumorph.study.campaign import CampaignSettings
from pneumorph.study.training_options import TrainingOptions
from pneumorph.study.training_result import TrainingResult


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("[coopt]\nseed = 7\n", "--seed: expected to be left out of a variant"),
        ("[robot.executor]\nprocess_count = 4\n", "--executor.process-count: expected to be left"),
        ("resume = true\n", "--resume: expected to be left out of a variant"),
        ("world_count = 3\n", "--world-count: expected to be left out with --objective.worlds-per"),
    ],
)
def test_what_a_variant_cannot_say_is_refused_by_file_and_name(
    text: str, said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Before anything is trained: two seeds would be the same runs under two names."""
    file = tmp_path / "v.toml"
    file.write_text(text)
    asked = ["campaign", "--variants", str(file), "--out", str(tmp_path / "out")]
    assert run(asked) == 1
    told = capsys.readouterr().err
    assert f"settings file {file}: {said}" in told
    assert "would be ignored" in told


def test_the_seed_of_all_runs_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(["campaign", "--seed", "5", "--out", str(tmp_path / "out")]) == 1
    assert "coopt.seed (--seed) is 5, expected it to be left out" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_a_variant_may_use_what_the_others_ignore(tmp_path: Path) -> None:
    """Worlds of all variants, in one of which robots are trained in the nominal world."""
    nominal = tmp_path / "nominal.toml"
    nominal.write_text("randomize = false\ncertified_world_count = 0\n")
    drawn = tmp_path / "drawn.toml"
    drawn.write_text("randomize = true\nworld_count = 3\n")
    settings = CampaignSettings(variants=(nominal, drawn))
    assert "run.world_count" not in settings.idle_settings()
    assert settings.bases()["drawn"].world_count == 3
    alone = CampaignSettings(run=TrainingOptions()).idle_settings()
    assert alone["run.world_count"] == "without --randomize"


def test_what_all_variants_ignore_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A variant of something else gives it no meaning."""
    files = [tmp_path / "few.toml", tmp_path / "many.toml"]
    for updates, file in enumerate(files, start=1):
        file.write_text(f"[coopt]\nupdates = {updates}\n")
    shared = ["--physics", "published", "--world-count", "3"]
    asked = ["campaign", *shared, "--variants", *map(str, files), "--out", str(tmp_path / "out")]
    assert run(asked) == 1
    told = "--world-count: expected to be left out without --randomize: it would be ignored"
    assert told in capsys.readouterr().err
    # One that is not there is told by its name.
    assert run([*asked[:-2], "--variants", str(tmp_path / "gone.toml"), *asked[-2:]]) == 1
    assert "gone.toml" in capsys.readouterr().err


def test_settings_of_a_run_are_a_variant(tmp_path: Path) -> None:
    """They hold a seed, an executor and what its own settings ignored: nobody chose those here."""
    learner, robot = replace(quick_settings(), seed=7, updates=9), RobotOptions.of("published")
    executor = ExecutorSettings(process_count=4)
    made = TrainingOptions(
        resume=True, world_count=3, coopt=learner, robot=replace(robot, executor=executor)
    )
    file = write_run(tmp_path / "made", "coopt", made) / "settings.json"
    options = CampaignSettings(variants=(file,)).bases(tmp_path / "out")
    assert options["settings"].coopt.updates == 9


@pytest.mark.parametrize("begun", [0, 2])
def test_what_any_seed_of_a_variant_was_begun_with_goes_on(begun: int, tmp_path: Path) -> None:
    """An earlier version took what would be ignored; the first seed may be new, or have failed."""
    file = tmp_path / "v.toml"
    file.write_text("world_count = 3\n")
    settings = CampaignSettings(variants=(file,))
    with pytest.raises(ValueError, match="world-count"):
        settings.bases(tmp_path)
    (tmp_path / "v-0").mkdir()
    write_run(tmp_path / f"v-{begun}", "coopt", replace(settings.run, world_count=3))
    assert settings.bases(tmp_path)["v"].world_count == 3


def test_a_page_that_cannot_be_drawn_costs_a_training_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def write(*_: Any) -> None:
        raise ValueError("nothing can be drawn")

    found = example(TrainingResult)
    monkeypatch.setattr(run_page, "write_run_page", write)
    monkeypatch.setattr(coopt, "train_as_asked", lambda *_: found)
    learned = coopt.run(TrainingOptions(), RunFolder(tmp_path, "coopt", Progress()))
    assert isinstance(learned, coopt.Learned)
    assert (learned.page, learned.best_design) == (None, found.best_design)
    told = f"no page of {tmp_path}: nothing can be drawn; `pneumorph report {tmp_path}` draws it"
    assert told in capsys.readouterr().err


def test_each_run_gets_its_page_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Where its settings ask for one, and where it has none of what it found; what cannot be drawn
    costs the others nothing."""
    drawn: list[str] = []

    def write(made: Any, page: Path) -> RunPage:
        drawn.append(made.folder.name)
        if made.folder.name == "damaged-0":
            raise ValueError("nothing can be drawn")
        page.parent.mkdir(parents=True, exist_ok=True)
        page.write_text("")
        return RunPage(str(page), 0, (), str(made.folder), "coopt", 0.0)

    names = ("damaged-0", "without-0", "usual-0", "again-0")
    runs = [_Run(name) for name in names]
    for name in names:
        write_run(tmp_path / name, "coopt", TrainingOptions(page=name != "without-0"))
    older = tmp_path / "again-0" / "report" / "page.html"
    older.parent.mkdir()
    older.write_text("")
    os.utime(older, (0.0, 0.0))
    monkeypatch.setattr(run_page, "write_run_page", write)
    monkeypatch.setattr(verb, "campaign", lambda *_: _Found(runs))
    for _ in range(2):
        verb.run(CampaignSettings(), RunFolder(tmp_path, "campaign"))
    assert drawn == ["damaged-0", "usual-0", "again-0", "damaged-0"]


class _Run:
    def __init__(self, name: str) -> None:
        self.name = name


class _Found:
    def __init__(self, runs: list[_Run]) -> None:
        self.runs = runs
