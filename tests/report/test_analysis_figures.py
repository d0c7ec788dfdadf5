"""An analysis draws the robots that walked, and what counts of their walks."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers.result_example import example

from pneumorph.base.run_folder import RunFolder
from pneumorph.catalogue.paper_robot import paper_robot
from pneumorph.environment.crawling_task import CrawlingTask
from pneumorph.environment.goal import Goal
from pneumorph.gait.expert_gait import ExpertGait
from pneumorph.geometry.pose import Pose
from pneumorph.report import analysis_figures, hardware_sections
from pneumorph.report.analysis_figures import draw_analysis
from pneumorph.report.plan import paper_plan
from pneumorph.robot.design import Design
from pneumorph.study.analysis import Analysis, AnalysisSettings, Walker, walk_file
from pneumorph.study.transfer import Transfer

DESIGN = Design.parse("1.0.0.2.2.0.0.1")
TURN = Goal("turn_left", cm_per_unit=0.1)


def test_an_analysis_draws_the_robots_own_plans_and_its_goal(
    make_trajectory, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The paper's robot with its legs 40 mm further out is no longer drawn as the paper's."""
    paper = paper_robot("published")
    outward = []
    for site in paper.sites:
        x, y, _ = site.pose.rotation[:, 0]
        moved = site.pose.translation + 40.0 * np.array([x, y, 0.0]) / np.hypot(x, y)
        outward.append(replace(site, pose=Pose(site.pose.rotation, moved)))
    spec = replace(paper, sites=tuple(outward))
    robot = replace(example(Analysis).robots[0], label="L1", status="completed")
    found = replace(example(Analysis), robots=(robot,), goal=TURN)
    folder = RunFolder(tmp_path, "analyse")
    make_trajectory().save(folder / walk_file("L1"))
    walker = Walker("L1", DESIGN, ExpertGait(phase_deg=60.0), 0)
    drawn: dict[str, Any] = {}

    def record(name: str) -> None:
        monkeypatch.setattr(
            analysis_figures, name, lambda *args, **named: drawn.update({name: (args, named)})
        )

    monkeypatch.setattr(analysis_figures, "walkers", lambda *_: [walker])
    for name in ("step_figure", "margin_figure", "friction_margin", "leg_friction",
                 "friction_figure", "pairs_figure", "cycle_figure", "save_figure"):  # fmt: skip
        record(name)

    class Run:
        task = CrawlingTask(action_step_count=100)

    run: Any = Run()
    draw_analysis(found, AnalysisSettings(), run, spec, folder)
    _, _, plan_of = drawn["pairs_figure"][0]
    mine, papers = plan_of(DESIGN), paper_plan(DESIGN)
    assert mine.reach_mm == pytest.approx(papers.reach_mm + 40.0, abs=3.0)
    assert drawn["cycle_figure"][0][2] == TURN


@pytest.mark.parametrize("goal", [Goal(), TURN])
def test_replays_of_a_transfer_tell_what_counts(
    goal: Goal, make_trajectory, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    make_trajectory().save(tmp_path / "walk.npz")
    robot = replace(example(Transfer).robots[0], trajectory="walk.npz")
    found = replace(example(Transfer), robots=(robot,), goal=goal)
    monkeypatch.setattr(hardware_sections, "_first_trial", lambda *_: None)
    shown: list[Any] = []

    class Sheet:
        def replayed(self, actors: Any, caption: str) -> str:
            shown.extend(actors)
            return caption

    class Run:
        folder = tmp_path

    sheet: Any = Sheet()
    run: Any = Run()
    (section,) = hardware_sections._replay_sections(found, run, sheet)
    (actor,) = shown
    assert actor.goal == goal
    assert ("Of the simulation turn to the left is told" in section.body) == goal.turns
