"""Over which frictions an analysis walks, and what it says of a task that it does not know."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest

from pneumorph.base.run_folder import RunFolder
from pneumorph.simulation.distribution import Distribution
from pneumorph.study.analysis import AnalysisSettings, analyse, walk_file
from pneumorph.study.recorded_trajectories import recorded_trajectories

RUN = Path(__file__).parents[2] / "reproduce" / "paper_scale"
DRAWN = Distribution.parse("U(0.25, 1.2)")


def test_frictions_are_those_of_the_runs_worlds() -> None:
    found = AnalysisSettings().frictions(0.55, DRAWN)
    assert found[:2] == (0.25, 0.35)
    assert found[-2:] == (1.15, 1.2)
    assert AnalysisSettings().frictions(1.5, DRAWN)[-1] == 1.5  # of other physics than the run


@pytest.mark.parametrize("drawn", [None, Distribution.parse("0.55")])
def test_of_a_run_in_one_world_they_are_half_to_twice_its_own(drawn: Distribution | None) -> None:
    found = AnalysisSettings(friction_step=0.5).frictions(0.5, drawn)
    assert found == (0.25, 0.75, 1.0)


def test_frictions_that_are_asked_for_come_first() -> None:
    both = AnalysisSettings(lowest_friction=0.6, highest_friction=1.4)
    assert both.frictions(0.55, DRAWN) == (0.6, 0.7, 0.8, 0.9, 1.0, 1.1, 1.2, 1.3, 1.4)
    assert AnalysisSettings(lowest_friction=1.0).frictions(0.55, DRAWN) == (1.0, 1.1, 1.2)
    with pytest.raises(
        ValueError, match="lowest_friction is 2, expected at most highest_friction, 1"
    ):
        AnalysisSettings(lowest_friction=2.0).frictions(0.55, DRAWN)
    with pytest.raises(
        ValueError, match="lowest_friction is 2, expected at most highest_friction, 1"
    ):
        AnalysisSettings(lowest_friction=2.0, highest_friction=1.0)


def test_an_analysis_says_that_it_does_not_know_the_task_and_walks_in_the_runs_frictions(
    tmp_path: Path,
) -> None:
    run = tmp_path / "run"
    run.mkdir()
    shutil.copytree(RUN / "gaits", run / "gaits")
    settings = json.loads((RUN / "settings.json").read_text())
    settings |= {"randomize": True, "randomisation": {"friction": "U(1, 1.3)"}}
    summary = json.loads((RUN / "summary.json").read_text()) | {"own_task": "Diagonal"}
    (run / "settings.json").write_text(json.dumps(settings))
    (run / "summary.json").write_text(json.dumps(summary))
    asked = AnalysisSettings(pair_count=1, friction_step=1.0)
    folder = RunFolder(tmp_path / "out", "analyse")
    for label in ("L1", "L2"):  # of an earlier analysis of more pairs
        (folder / walk_file(label)).write_bytes(b"earlier")
    found = analyse(run, asked, folder=folder)
    (recorded,) = recorded_trajectories(folder.path).values()
    assert list(recorded) == [each.label for each in found.robots] == ["B", "L1"]
    assert any("Diagonal, the task that was learned" in note for note in found.notes)
    assert found.frictions == (1.0, 1.3)
    assert len(found.robots[0].over_friction) == 2
