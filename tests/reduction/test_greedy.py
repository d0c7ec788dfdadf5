"""The greedy search on a small part whose motions are single equilibria."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from synthetic_part import synthetic_part

from pneumorph.executor import ExecutorSettings
from pneumorph.fem.part_model import PartModel
from pneumorph.fem.static import static_equilibrium
from pneumorph.reduction import static_equilibrium as reduced_statics
from pneumorph.reduction.ecsw import EcswSettings
from pneumorph.reduction.error_indicator import ErrorIndicator, relative_imbalance
from pneumorph.reduction.greedy import GreedyProblem, GreedySettings, greedy_reduction
from pneumorph.reduction.reduce import ReductionSettings, reduce_part
from pneumorph.reduction.reduced_part import ReducedPart
from pneumorph.reduction.snapshot_files import SnapshotFiles
from pneumorph.reduction.snapshots import Snapshots
from pneumorph.reduction.static_snapshots import StaticSnapshotSettings, bend_snapshots

ONE = ExecutorSettings(process_count=1)


@dataclass(frozen=True)
class Push:
    """A force on the outer end [mN]."""

    force: tuple[float, float, float]

    def __str__(self) -> str:
        return "/".join(map(str, self.force))

    def on_nodes(self, part: PartModel) -> np.ndarray:
        external = np.zeros((part.node_count, 3))
        tip = part.mesh.node_set("outer_end_face")
        external[tip] = np.array(self.force) / len(tip)
        return external


def simulate(part: PartModel, push: Push) -> Snapshots:
    held = part.mesh.node_set("attachment")
    result = static_equilibrium(part, 0.0, held, external_force=push.on_nodes(part))
    return Snapshots(
        (result.positions - part.rest_nodes)[None].astype(np.float32),
        np.zeros(1),
        np.zeros(1, dtype=np.int32),
        {"mesh_digest": part.mesh.digest(), "sources": [f"load {push}"]},
    )


def indicate(shared: tuple[PartModel, ReducedPart], push: Push) -> float:
    part, reduced = shared
    external = reduced.modes.reshape(-1, reduced.mode_count).T @ push.on_nodes(part).ravel()
    found = reduced_statics.static_equilibrium(reduced, 0.0, external=external)
    displacement = reduced.positions(found.alpha) - part.rest_nodes
    return relative_imbalance(
        [ErrorIndicator(part).at_rest(displacement, 0.0, push.on_nodes(part))]
    )


def reduce(files: SnapshotFiles) -> tuple[ReducedPart, dict[str, Any]]:
    settings = ReductionSettings(
        mode_tolerance=1e-5,
        holdout_every=0,
        symmetric=False,
        ecsw=EcswSettings(hyperreduction_tolerance=1e-4, element_limit=2000),
    )
    part, report = reduce_part(synthetic_part((4, 4, 4)), files, settings)
    return part, report.to_dict()


@pytest.fixture(scope="module")
def start(tmp_path_factory: pytest.TempPathFactory) -> tuple[PartModel, Path]:
    part = synthetic_part((4, 4, 4))
    bend = bend_snapshots(part, StaticSnapshotSettings(bend_pressure_kPa=20.0, bend_count=2))
    return part, bend.save(tmp_path_factory.mktemp("start") / "bend.npz")


def problem(part: PartModel) -> GreedyProblem[PartModel, Push]:
    # Training pushes span all directions, one of them twice; the held-out one is a mixture.
    pushes = [(40.0, 0.0, 0.0), (0.0, 40.0, 0.0), (0.0, 0.0, 40.0), (0.0, 0.0, 39.0)]
    return GreedyProblem(
        part, indicate, simulate, [Push(push) for push in pushes], [Push((10.0, -20.0, 15.0))]
    )


def test_search_adds_what_is_missing_until_the_held_out_motion_is_met(
    start: tuple[PartModel, Path], tmp_path: Path
) -> None:
    part, bend = start
    settings = GreedySettings(round_limit=6, tolerance=0.05, additions_per_round=1)
    result = greedy_reduction(problem(part), reduce, [bend], settings, tmp_path, ONE)
    assert result.converged
    heldout = [each.heldout_worst for each in result.rounds]
    assert heldout[-1] <= 0.05 < heldout[-2]
    # Bending holds nothing sideways: the push across is worst by far and comes first.
    assert result.rounds[0].chosen == ("0.0/40.0/0.0",)
    assert heldout[0] > 0.5
    # Two pushes that differ by their size alone: once one is learned the other is no news.
    chosen = [name for each in result.rounds for name in each.chosen]
    assert len(chosen) == len(set(chosen)) == len(result.files) - 1
    assert not {"0.0/0.0/40.0", "0.0/0.0/39.0"} <= set(chosen)
    # The error that the indicator stands for has fallen as well.
    true = simulate(part, Push((10.0, -20.0, 15.0))).displacement[0]
    modes = result.part.modes.reshape(-1, result.part.mode_count)
    left = true.ravel() - modes @ np.linalg.lstsq(modes, true.ravel(), rcond=None)[0]
    assert np.linalg.norm(left) < 0.05 * np.linalg.norm(true)
    history = json.loads((tmp_path / "greedy.json").read_text())["rounds"]
    assert [each["heldout_worst"] for each in history] == heldout


def test_a_stopped_search_goes_on_without_simulating_again(
    start: tuple[PartModel, Path], tmp_path: Path
) -> None:
    part, bend = start
    settings = GreedySettings(round_limit=1, tolerance=1e-9, additions_per_round=2)
    first = greedy_reduction(problem(part), reduce, [bend], settings, tmp_path, ONE)
    assert not first.converged
    made = {path: path.stat().st_mtime_ns for path in first.files}
    again = greedy_reduction(problem(part), reduce, [bend], settings, tmp_path, ONE)
    assert again.rounds == first.rounds
    assert {path: path.stat().st_mtime_ns for path in again.files} == made
    # Snapshots of other materials are made again.
    other = GreedyProblem(**{**vars(problem(part)), "identity": {"mass_kg": 1.0}})
    greedy_reduction(other, reduce, [bend], settings, tmp_path, ONE)
    assert first.files[1].stat().st_mtime_ns != made[first.files[1]]


def diverging(shared: tuple[PartModel, ReducedPart], push: Push) -> float:
    return float("inf") if push.force[1] > 0.0 else indicate(shared, push)


def test_a_motion_that_diverges_is_the_worst(start: tuple[PartModel, Path], tmp_path: Path) -> None:
    part, bend = start
    breaking = GreedyProblem(**{**vars(problem(part)), "indicator": diverging})
    settings = GreedySettings(round_limit=1, tolerance=1e-9, additions_per_round=1)
    result = greedy_reduction(breaking, reduce, [bend], settings, tmp_path, ONE)
    assert result.rounds[0].chosen == ("0.0/40.0/0.0",)
    history = json.loads((tmp_path / "greedy.json").read_text())["rounds"]
    assert history[0]["training_worst"] is None


def test_a_search_without_held_out_motions_is_refused(
    start: tuple[PartModel, Path], tmp_path: Path
) -> None:
    part, bend = start
    without = GreedyProblem(part, indicate, simulate, [], [])
    with pytest.raises(ValueError, match="heldout must name at least one"):
        greedy_reduction(without, reduce, [bend], GreedySettings(), tmp_path, ONE)
    with pytest.raises(ValueError, match="needs round_limit of at least 0"):
        GreedySettings(tolerance=0.0)
