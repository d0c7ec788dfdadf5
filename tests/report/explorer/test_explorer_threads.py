"""The engine's threads where the pairs of a run walk for its explorer."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from helpers.run_folders import write_run

from pneumorph.base.layers import layered
from pneumorph.base.run_folder import RunFolder
from pneumorph.catalogue.robot_spec import RobotSpec
from pneumorph.report.explorer import explored_run
from pneumorph.study.finished_run import FinishedRun
from pneumorph.study.training_options import TrainingOptions


class WalkedError(Exception):
    """Stands for the walks, which are not looked at here."""


@pytest.mark.parametrize(("asked", "taken"), [(0, 3), (1, 1)])
def test_pairs_walk_on_as_many_threads_as_asked_for_or_as_the_run(
    asked: int, taken: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def walk(_: FinishedRun, __: Any, robot: RobotSpec, ___: RunFolder) -> None:
        assert robot.thread_count == taken
        raise WalkedError

    scored = SimpleNamespace(probability=1.0, pairs=[1])
    monkeypatch.setattr(explored_run, "_scored", lambda *_: (scored, "", ""))
    monkeypatch.setattr(explored_run, "evaluate", walk)
    options = layered(TrainingOptions(), [{"robot": {"threads": 3}}])
    run = FinishedRun.read(write_run(tmp_path / "run", "coopt", options))
    with pytest.raises(WalkedError):
        explored_run.explore(RunFolder(tmp_path / "out", "explore"), run, threads=asked)
