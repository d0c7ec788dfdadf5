"""What a campaign refuses that it would drop, and the pages of its runs."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import pytest
from helpers.run_folders import write_run

from pneumorph.base.run_folder import RunFolder
from pneumorph.cli import run
from pneumorph.command import campaign as verb
from pneumorph.study.campaign import CampaignSettings
from pneumorph.study.training_options import TrainingOptions


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("[coopt]\nseed = 7\n", "coopt.seed is 7"),
        ("[robot.executor]\nprocess_count = 4\n", "robot.executor is ExecutorSettings("),
        ("resume = true\n", "resume is True"),
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
    assert settings.idle_settings() == {}
    assert settings.bases()["drawn"].world_count == 3
    alone = CampaignSettings(run=TrainingOptions()).idle_settings()
    assert alone["run.world_count"] == "without --randomize"


def test_each_run_gets_its_page_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Where its settings ask for one, and where it has none of what it found; what cannot be drawn
    costs the others nothing."""
    drawn: list[str] = []

    def write(made: Any, page: Path) -> None:
        drawn.append(made.folder.name)
        if made.folder.name == "damaged-0":
            raise ValueError("nothing can be drawn")
        page.parent.mkdir(parents=True, exist_ok=True)
        page.write_text("")

    names = ("damaged-0", "without-0", "usual-0", "again-0")
    runs = [_Run(name) for name in names]
    for name in names:
        write_run(tmp_path / name, "coopt", TrainingOptions(page=name != "without-0"))
    older = tmp_path / "again-0" / "report" / "page.html"
    older.parent.mkdir()
    older.write_text("")
    os.utime(older, (0.0, 0.0))
    monkeypatch.setattr(verb, "write_run_page", write)
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
