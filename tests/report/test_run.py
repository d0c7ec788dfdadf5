"""A run's trajectories stand beside those they belong with."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

from pneumorph.report.run import Run


def test_trajectories_are_grouped_by_what_they_are_compared_with(
    make_trajectory, tmp_path: Path
) -> None:
    for name in ("baseline_trajectory", "best_trajectory", "six_leg_full", "six_leg_reduced",
                 "trajectory_full_L1", "trajectory_full_L2"):  # fmt: skip
        make_trajectory().save(tmp_path / f"{name}.npz")
    np.savez(tmp_path / "phase_sweep.npz", a=1)  # no trajectory
    groups = Run(tmp_path, {}, {}).trajectories()
    assert {group: list(robots) for group, robots in groups.items()} == {
        "": ["learned", "expert", "L1", "L2"],
        "six leg": ["full", "reduced"],
    }


def test_the_run_it_looks_at_is_read_where_it_still_is(tmp_path: Path) -> None:
    (tmp_path / "summary.json").write_text(json.dumps({"baseline_best_distance_cm": 0.5}))
    here = Run(tmp_path, {"run": str(tmp_path)}, {})
    assert here.source["baseline_best_distance_cm"] == 0.5
    assert Run(tmp_path, {"run": str(tmp_path / "gone")}, {}).source == {}
    assert Run(tmp_path, {}, {}).source == {}
