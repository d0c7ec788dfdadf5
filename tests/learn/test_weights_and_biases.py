"""Weights & Biases is logged to where it is asked for, and never asks back."""

import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from pneumorph.learn.metrics import MetricsLog


class _Recorder:
    """Stands for the package: notes how a run is opened and what it is told."""

    def __init__(self) -> None:
        self.opened: dict[str, Any] = {}
        self.logged: list[tuple[dict[str, Any], int]] = []
        self.finished = False
        self.Settings = SimpleNamespace

    def init(self, **options: Any) -> "_Recorder":
        self.opened = options
        return self

    def log(self, values: dict[str, Any], step: int) -> None:
        self.logged.append((values, step))

    def finish(self) -> None:
        self.finished = True


@pytest.mark.parametrize(
    ("environment", "mode"),
    [
        ({}, "offline"),
        ({"WANDB_MODE": "online"}, "offline"),
        ({"WANDB_API_KEY": "0" * 40}, "online"),
        ({"WANDB_API_KEY": "0" * 40, "WANDB_MODE": "disabled"}, "disabled"),
    ],
)
def test_it_is_online_only_where_no_question_is_left(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    environment: dict[str, str],
    mode: str,
) -> None:
    for name in ("WANDB_MODE", "WANDB_API_KEY"):
        monkeypatch.delenv(name, raising=False)
    for name, value in environment.items():
        monkeypatch.setenv(name, value)
    recorder = _Recorder()
    monkeypatch.setitem(sys.modules, "wandb", recorder)  # type: ignore[arg-type]
    log = MetricsLog(tmp_path, wandb_project="crawlers")
    log.write({"timestep": 7, "return_mean_cm": 0.5, "score_histogram": [1.0]})
    log.close()
    assert recorder.opened["mode"] == mode
    assert recorder.opened["project"] == "crawlers"
    assert recorder.logged == [({"return_mean_cm": 0.5}, 7)]
    assert recorder.finished


def test_missing_package_is_said_with_its_extra(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "wandb", None)  # type: ignore[arg-type]
    with pytest.raises(ImportError, match=r"pip install 'pneumorph\[wandb\]'"):
        MetricsLog(tmp_path, wandb_project="crawlers")


def test_the_package_itself_writes_offline(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("wandb")
    monkeypatch.delenv("WANDB_API_KEY", raising=False)
    monkeypatch.setattr("sys.stdin", None)  # a question would fail
    log = MetricsLog(tmp_path / "run" / "training", wandb_project="crawlers")
    log.write({"timestep": 7, "return_mean_cm": 0.5})
    log.close()
    assert list((tmp_path / "run" / "training" / "wandb").glob("offline-run-*/*.wandb"))
