"""Summaries tell of robots that left the range of their legs' snapshots."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from pneumorph.base.result import result_to_dict
from pneumorph.base.run_folder import RunFolder
from pneumorph.catalogue.paper_designs import BASELINE_DESIGN
from pneumorph.catalogue.paper_robot import paper_robot
from pneumorph.catalogue.robot_spec import RobotSpec
from pneumorph.environment.crawling_task import CrawlingTask
from pneumorph.gait.expert_gait import ExpertGait
from pneumorph.gait.phase_sweep import PhaseSweep, PhaseSweepSettings
from pneumorph.hardware.rig import RigSettings
from pneumorph.hardware.virtual_rig import VirtualRigSettings
from pneumorph.robot.design import Design
from pneumorph.study import baseline as baseline_study
from pneumorph.study import simulated_walk
from pneumorph.study.analysis import AnalysisSettings, analyse
from pneumorph.study.baseline import baseline
from pneumorph.study.certificate_notes import expert_notes
from pneumorph.study.certified_pairs import Band
from pneumorph.study.evaluation import EvaluationSettings, evaluate
from pneumorph.study.recorded_walk import recorded_walk
from pneumorph.study.robustness import robustness
from pneumorph.study.search import search
from pneumorph.study.search_settings import SearchSettings
from pneumorph.study.simulated_walk import WalkSettings, simulate
from pneumorph.study.toppled_note import toppled_share
from pneumorph.study.virtual_reality import VirtualReality

RUN = Path(__file__).parents[2] / "reproduce" / "paper_scale"
NEAR, FAR = 1e-3, 1.0
"""1 over the modal coordinate at the end of the range [kg^-1/2 mm^-1]: legs reach tens."""


def robot(scale: float) -> RobotSpec:
    """The paper's, its legs knowing a range that is a ball."""
    spec = paper_robot("published")
    part = spec.module.reduced
    known = replace(part, snapshot_range=scale * np.eye(part.mode_count))
    module = replace(spec.module, make_reduced=lambda: known)
    return replace(spec, sites=tuple(replace(site, modules=(module,)) for site in spec.sites))


def folder(tmp_path: Path) -> RunFolder:
    return RunFolder(tmp_path / "out", "test")


@pytest.mark.parametrize(("scale", "left"), [(NEAR, False), (FAR, True)])
def test_an_evaluation_notes_who_left_and_in_how_many_worlds(tmp_path, scale, left):
    settings = EvaluationSettings(pair_count=2, randomize=True, world_count=2)
    found = evaluate(RUN, settings, robot(scale), folder(tmp_path))
    told = [note for note in found.notes if "left the range of its legs' snapshots" in note]
    assert len(told) == (2 if left else 0)
    assert all((pair.range_ratio > 1.2) is left for pair in found.pairs)
    assert found.robustness.left_range_share == (1.0 if left else 0.0)
    assert (found.robustness.range_ratio > 1.2) is left
    said = result_to_dict(found)
    by_mean = sorted(found.robustness.pairs, key=lambda pair: -pair.mean)
    assert said["ranking_in_worlds"] == ", ".join(pair.label for pair in by_mean)
    assert said["first_mean_in_worlds_cm"] == by_mean[0].mean
    assert said["first_tenth_percentile_in_worlds_cm"] == by_mean[0].tenth_percentile


def test_a_walk_tells_that_it_left_the_range_and_comes_to_its_end(tmp_path):
    found = simulate(WalkSettings(), robot(FAR), folder(tmp_path))
    assert found.status == "completed"
    assert found.range_ratio > 1.2
    assert len(found.notes) == 1
    inside = simulate(WalkSettings(), robot(NEAR), folder(tmp_path))
    assert inside.notes == ()
    # The range is watched, not felt.
    assert inside.distance_cm == found.distance_cm


def test_an_analysis_names_the_robots_that_left(tmp_path):
    settings = AnalysisSettings(pair_count=1, lowest_friction=1.0, highest_friction=1.0)
    found = analyse(RUN, settings, robot(FAR), folder(tmp_path))
    assert [note.split()[0] for note in found.notes] == ["B", "L1"]


@pytest.mark.parametrize(("scale", "left"), [(NEAR, False), (FAR, True)])
def test_the_experts_phases_and_a_search_tell_that_they_left(tmp_path, scale, left):
    gait = ExpertGait(duration_s=4.0)
    sweep = PhaseSweepSettings(first_phase_deg=60.0, last_phase_deg=60.0, gait=gait)
    best = baseline(robot(scale), sweep, folder(tmp_path))
    assert (best.baseline_range_ratio > 1.2) is left
    assert [note.split(" left")[0] for note in best.notes] == ["The expert's robot"] * left
    kept = PhaseSweep.load(tmp_path / "out" / "phase_sweep.npz")
    assert kept.furthest_ratio == best.baseline_range_ratio
    task = CrawlingTask(action_count=2)
    asked = SearchSettings(method="random", timesteps=8, environment_count=2, task=task)
    found = search(asked, robot(scale), RunFolder(tmp_path / "search", "test"))
    told = [note for note in found.notes if "left the range of its legs' snapshots" in note]
    assert len(told) == (len(found.pairs) if left else 0)


@pytest.mark.parametrize(("scale", "left"), [(NEAR, False), (FAR, True)])
def test_a_virtual_rigs_reduced_robot_tells_that_it_left(scale, left):
    reality = VirtualReality(robot(scale), VirtualRigSettings(), "reduced")
    rig = reality.rig(Design.parse(BASELINE_DESIGN), RigSettings(), 1)
    rig.open()
    rig.command(np.array([60.0, 60.0, 60.0]))
    rig.clock.wait_until(1.0)
    rig.track()
    assert (rig.range_ratio > 1.2) is left


def test_a_robot_on_its_back_is_told_of(tmp_path, monkeypatch):
    """What it achieved is its fall."""
    spec, walk = paper_robot("published"), WalkSettings(expert=ExpertGait(duration_s=4.0))
    assert not any("toppled" in each for each in simulate(walk, spec, folder(tmp_path)).notes)
    monkeypatch.setattr(simulated_walk, "recorded_walk", fallen)
    (note,) = simulate(walk, spec, folder(tmp_path)).notes
    assert note.startswith("The robot toppled: its hub leaned by up to 143 degrees")
    sweep = PhaseSweepSettings(first_phase_deg=60.0, last_phase_deg=60.0, gait=walk.expert)
    assert baseline(spec, sweep, folder(tmp_path)).notes == ()
    monkeypatch.setattr(baseline_study, "recorded_walk", fallen)
    found = baseline(spec, sweep, folder(tmp_path))
    assert found.baseline_lean_deg == pytest.approx(143.0)
    assert [each[:26] for each in found.notes] == ["The expert's robot toppled"]


def fallen(*args, **keywords):
    """A walk whose hub lies on its back at the end."""
    walked = recorded_walk(*args, **keywords)
    lean, turned = np.radians(143.0), np.array(walked.hub_rotation)
    turned[-1] = [[np.cos(lean), 0.0, np.sin(lean)], [0, 1, 0], [-np.sin(lean), 0, np.cos(lean)]]
    return replace(walked, hub_rotation=turned)


def test_legs_that_do_not_know_are_not_flagged(tmp_path):
    found = simulate(WalkSettings(), paper_robot("published"), folder(tmp_path))
    assert found.range_ratio is None
    assert found.notes == ()
    assert found.leg.knows_range is False
    unknown = robustness(["L1"], np.ones(1), np.ones((2, 1)), range_ratios=np.full((2, 1), np.nan))
    assert unknown.left_range_share is None


def test_falls_are_counted_over_the_worlds_that_tell():
    lean_deg = np.array([12.0, 61.0, np.nan, 170.0])
    assert toppled_share(lean_deg) == pytest.approx(2.0 / 3.0)
    assert toppled_share(np.full(3, np.nan)) is None
    band = Band(0.0, 1.0, 2.0, 1.0, 0.5, 0)
    (told,) = expert_notes(band, 20.0, 20.0, 2.0 / 3.0)
    assert told.startswith("the expert's robot toppled in 67 % of the worlds")
    assert expert_notes(band, 20.0, 20.0, 0.0) == expert_notes(band, 20.0, 20.0, None) == []
