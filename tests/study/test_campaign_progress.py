"""How far a campaign is, from what its runs have written so far."""

from __future__ import annotations

import io
import json
import time
from dataclasses import replace
from pathlib import Path

from pneumorph.base.executor import ExecutorSettings
from pneumorph.base.progress import Progress
from pneumorph.base.settings import settings_from_dict
from pneumorph.environment.crawling_task import CrawlingTask
from pneumorph.learn.settings import CooptSettings, FinetuningSettings
from pneumorph.study.campaign import CampaignSettings
from pneumorph.study.campaign_progress import campaign_progress, timesteps_made

# Rounds of 40 timesteps: ten of training, three for each of two finalists.
SETTINGS = replace(
    CooptSettings(),
    environment_count=8,
    task=CrawlingTask(action_count=5),
    total_timesteps=400,
    finetuning=FinetuningSettings(finalist_count=2, timesteps=100),
)


def trained(folder: Path, timestep: int) -> None:
    (folder / "training").mkdir(parents=True, exist_ok=True)
    (folder / "training" / "metrics.jsonl").write_text(json.dumps({"timestep": timestep}) + "\n")


def test_training_finetuning_and_finished_runs_count(tmp_path: Path) -> None:
    assert timesteps_made(tmp_path, SETTINGS) == 0
    trained(tmp_path, 400)
    assert timesteps_made(tmp_path, SETTINGS) == 400
    (tmp_path / "training" / "finetuned").mkdir()
    (tmp_path / "training" / "finetuned" / "1.0.0.2.npz").touch()
    assert timesteps_made(tmp_path, SETTINGS) == 520
    (tmp_path / "summary.json").touch()
    assert timesteps_made(tmp_path, SETTINGS) == 640


def test_all_runs_are_shown_together(tmp_path: Path) -> None:
    trained(tmp_path / "run-0", 320)
    shown = Terminal()
    runs = {"run-0": SETTINGS, "run-1": SETTINGS}
    with campaign_progress(tmp_path, runs, Progress(shown), 0.02) as say:
        say("run-0: finished")
        end = time.monotonic() + 20.0
        while "25 %" not in shown.getvalue():
            assert time.monotonic() < end
            time.sleep(0.02)
    assert "timesteps of all runs" in shown.getvalue()
    after = shown.getvalue()
    time.sleep(0.1)
    assert shown.getvalue() == after


def test_the_last_word_is_that_all_is_done(tmp_path: Path) -> None:
    shown = Terminal()
    with campaign_progress(tmp_path, {"run-0": SETTINGS}, Progress(shown)):
        (tmp_path / "run-0").mkdir()
        (tmp_path / "run-0" / "summary.json").touch()
    assert "100 %" in shown.getvalue()


class Terminal(io.StringIO):
    """A stream that renews its last line."""

    def isatty(self) -> bool:
        return True


def test_the_executor_of_an_earlier_campaign_is_that_of_its_robots() -> None:
    earlier = {"seeds": [4], "executor": {"backend": "ray", "process_count": 3}}
    found = settings_from_dict(CampaignSettings, earlier)
    assert found.seeds == (4,)
    assert found.run.robot.executor == ExecutorSettings("ray", 3)
