"""Each command of the table of tasks in docs/own_robot.md, and each robot's file of the examples,
trains as it is, at a size that shows no result."""

from __future__ import annotations

import base64
import json
import re
import shlex
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pneumorph.cli import run

ROOT = Path(__file__).parents[2]
TINY = (
    "--total-timesteps 8 --environment-count 4 --task.action-count 2 --task.action-step-count 3 "
    "--task.settling-step-count 1 --learning-start-timestep 4 --updates 1 --sac.batch-size 4 "
    "--sac.hidden-sizes 4 4 --schedule.decay-start-timestep 4 --schedule.decay-end-timestep 6 "
    "--evaluated-design-count 2 --kept-pair-count 1 --certified-world-count 0 "
    "--finetuning.timesteps 0 --baseline.phase-step-deg 180 --baseline.gait.duration-s 0.2 "
    "--baseline.gait.period-s 0.2 --checkpoint-interval-timesteps 8"
)
TASKS = dict(
    re.findall(r"^\| ([^|]+) \| `(pneumorph coopt [^`]+)` \|$",
               (ROOT / "docs/own_robot.md").read_text(), re.MULTILINE)
)  # fmt: skip


def _asked(settings: dict[str, Any], task: str) -> bool:
    """Whether the settings of a run are those of the task."""
    reward, physics = settings["coopt"]["task"]["reward"], settings["robot"]["physics"]
    return {
        "forward": reward["goal"] == "forward",
        "a heading, here to the left": (reward["goal"], reward["heading_deg"]) == ("heading", 90),
        "backward": (reward["goal"], reward["heading_deg"]) == ("heading", 180),
        "turning in place": reward["goal"] == "turn_left",
        "climbing": physics["floor_slope_deg"] == 10.0,
        "carrying a payload": settings["robot"]["described"].endswith("payload.toml"),
        "rough ground": physics["ground"]["rough"]["roughness_mm"] == 3.0,
        "forward, put down facing left": (
            physics["start"]["heading_deg"] == 90.0 and not settings["coopt"]["mirror_transitions"]
        ),
    }[task]


def test_there_are_eight() -> None:
    assert len(TASKS) == 8


@pytest.mark.parametrize("task", TASKS)
def test_a_task_of_the_table_runs(
    task: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(ROOT)
    words = shlex.split(TASKS[task])[1:]
    words[words.index("--out") + 1] = str(tmp_path / "run")
    assert run([*words, *TINY.split(), "--no-page"]) == 0
    assert _asked(json.loads((tmp_path / "run/settings.json").read_text()), task)
    found = json.loads((tmp_path / "run/summary.json").read_text())
    assert found["pairs"]
    lost = "robots start with heading 90 and roll 0 degrees, in which they are not their own mirror"
    told = any(note.startswith(lost) for note in found["notes"])
    assert told == (task == "forward, put down facing left")


def test_the_page_of_the_plate_shows_the_plate(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its hub of 150 x 90 x 10 mm, where the paper's is a disk."""
    monkeypatch.chdir(ROOT)
    asked = f"coopt --preset quick --robot examples/plate.toml --out {tmp_path / 'run'}"
    assert run([*asked.split(), *TINY.split()]) == 0
    page = (tmp_path / "run/report/page.html").read_text()
    shown = re.findall(r'"hub_nodes_mm":"([^"]+)"', page)
    assert shown
    for hub in shown:
        nodes = np.frombuffer(base64.b64decode(hub), dtype="<f4").reshape(-1, 3)
        np.testing.assert_allclose(np.ptp(nodes, axis=0), [150.0, 90.0, 10.0], rtol=1e-6)


def test_two_chambers_train_as_their_file_says(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(ROOT)
    asked = "coopt --preset quick --robot examples/two_chambers.toml --task.reward.goal turn_left"
    words = [*asked.split(), "--out", str(tmp_path / "run"), *TINY.split(), "--no-page"]
    assert run(words) == 0
    found = json.loads((tmp_path / "run/summary.json").read_text())
    assert found["unit"] == "degrees"
    assert "+" in found["best_design"]
