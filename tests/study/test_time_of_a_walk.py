"""A walk of finite elements that was stopped tells the time of all processes that were at it."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers.boxes import box_robot

from pneumorph.base.run_folder import RunFolder
from pneumorph.gait.gait_file import write_gait
from pneumorph.gait.held_gait import HeldGait
from pneumorph.study import recorded_walk
from pneumorph.study.simulated_walk import WalkSettings, simulate
from pneumorph.trajectory import Trajectory


def test_a_walk_that_goes_on_tells_the_time_of_what_was_stopped(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Once the last process's alone, as that of all."""
    whole = recorded_walk.resumable_rollout

    def went_on(*asked: Any, resumed: Callable[[float], None], **settings: Any) -> Trajectory:
        resumed(1e4)
        return whole(*asked, **settings)

    monkeypatch.setattr(recorded_walk, "resumable_rollout", went_on)
    gait = HeldGait.evenly(np.array([[20.0, 0.0], [5.0, 30.0]]), 0.04)
    file = write_gait(tmp_path / "gait.csv", gait, {"design": "1.2"})
    asked = WalkSettings(gait=file, model="full")
    found = simulate(asked, box_robot(), RunFolder(tmp_path / "out", "simulate"))
    assert found.status == "completed"
    assert 1e4 < found.simulation_wall_s <= found.wall_s < 2e4
