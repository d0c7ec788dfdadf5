"""Robots that walk for other times than those beside them are told with their times."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers.result_example import example
from PIL import ImageDraw

from pneumorph.base.result import result_to_dict
from pneumorph.base.settings import settings_to_dict
from pneumorph.catalogue.robot_options import RobotOptions
from pneumorph.environment.crawling_task import CrawlingTask
from pneumorph.environment.goal import FORWARD, Goal
from pneumorph.gait.phase_sweep import PhaseSweepSettings
from pneumorph.learn.objective import Objective
from pneumorph.learn.settings import CooptSettings
from pneumorph.report import training_sections
from pneumorph.report.expert_words import Durations, durations_apart
from pneumorph.report.frame_painter import FilmSettings, FramePainter, _spread
from pneumorph.report.frames_figure import frames_figure
from pneumorph.report.run_page import _headline
from pneumorph.report.scene import Actor
from pneumorph.report.training_sections import evaluation_sections, sweep_sections
from pneumorph.report.verb_pages import PAGES
from pneumorph.report.walk_sections import replay_section
from pneumorph.study.evaluation import Evaluation
from pneumorph.study.finished_run import FinishedRun
from pneumorph.study.training_result import TrainingResult
from pneumorph.trajectory import Trajectory

HEADING = Goal("heading", heading_deg=45.0)


def settings(action_count: int, worlds: int, randomize: bool = True) -> dict[str, Any]:
    """Of a training whose expert walks for 20 s and whose pairs for an action a second."""
    coopt = CooptSettings(
        task=CrawlingTask(action_count=action_count),
        objective=Objective(worlds_per_design=worlds),
    )
    return {
        "coopt": settings_to_dict(coopt),
        "baseline": settings_to_dict(PhaseSweepSettings()),
        "robot": settings_to_dict(RobotOptions()),
        "randomize": randomize,
    }


def trained(folder: Path, asked: dict[str, Any], **changed: Any) -> FinishedRun:
    """The run of a training that is all the same but for these."""
    told = {"own_task": None, **changed}
    found = replace(example(TrainingResult), goal=FORWARD, **told)
    run = FinishedRun(folder, {"verb": "coopt", **result_to_dict(found)}, asked)
    (folder / "summary.json").write_text(json.dumps(run.summary))
    (folder / "settings.json").write_text(json.dumps(run.settings))
    return run


def tiles(run: FinishedRun, goal: Goal = FORWARD) -> list[str]:
    page = _headline(run.result(TrainingResult), run, PAGES["coopt"], goal)
    cells = page.replace("&#x27;", "'").split("<span>")[1:]
    return [cell.split("</span>")[0] for cell in cells]


def test_the_score_of_a_task_of_ones_own_comes_first_and_no_expert_beside_it(
    tmp_path: Path,
) -> None:
    pair = replace(example(TrainingResult).pairs[0], score_cm=3.25)
    run = trained(tmp_path, settings(10, 4), own_task="Diagonal", pairs=(pair,))
    told = tiles(run)
    assert told[0] == "score of the best pair, reward of Diagonal"
    assert not [each for each in told if "expert" in each]
    # The expert is in sections, and walks there for 20 s.
    assert "distance of the best pair, 10th percentile, in 10 s" in told
    assert sum(each.endswith(", in 10 s") for each in told) == 4
    equal = tiles(trained(tmp_path, settings(20, 4), own_task="Diagonal", pairs=(pair,)))
    assert len(equal) == len(told)
    assert not any(each.endswith(" s") for each in equal)
    page = _headline(run.result(TrainingResult), run, PAGES["coopt"], FORWARD)
    assert "3.25 cm" in page
    usual = tiles(trained(tmp_path, settings(10, 4)))
    assert not [each for each in usual if "score" in each]
    assert [each for each in usual if "expert" in each]


@pytest.mark.parametrize("goal", [FORWARD, HEADING])
def test_tiles_of_walks_that_last_unequally_name_how_long(goal: Goal, tmp_path: Path) -> None:
    run = trained(tmp_path, settings(10, 4))
    assert durations_apart(run) == Durations(10.0, 20.0)
    told = tiles(run, goal)
    (expert,) = [each for each in told if "expert's best phase in the world" in each]
    assert expert.endswith("in the world as it stands, in 20 s")
    # Median and 10th percentile of the pair and median of the expert, the mean, the nominal world.
    assert sum(each.endswith(", in 10 s") for each in told) == 5
    # The expert of a certificate walks as long as the pairs.
    (median,) = [each for each in told if "expert" in each and "median" in each]
    assert median.endswith(", in 10 s")
    equal = tiles(trained(tmp_path, settings(20, 4)), goal)
    assert len(equal) == len(told)
    assert not any(each.endswith(" s") for each in equal)


@pytest.mark.parametrize("goal", [FORWARD, HEADING])
@pytest.mark.parametrize(
    ("worlds", "randomize", "mean"), [(4, True, True), (1, True, False), (4, False, False)]
)
def test_a_mean_over_worlds_is_told_as_one(
    worlds: int, randomize: bool, mean: bool, goal: Goal, tmp_path: Path
) -> None:
    told = tiles(trained(tmp_path, settings(20, worlds, randomize)), goal)
    (trained_in,) = [each for each in told if "of the best pair in training" in each]
    assert trained_in.endswith(", mean over the training's worlds") == mean
    assert sum("mean over" in each for each in told) == mean


def test_an_evaluation_does_not_compare_walks_of_unequal_length(tmp_path: Path) -> None:
    found = replace(example(Evaluation), goal=FORWARD, robustness=None, model="reduced")
    pair = replace(found.pairs[0], design="1.0.0.2.2.0.0.1", gait="", distance_cm=10.0)
    found = replace(found, run=str(tmp_path), pairs=(pair,))
    unused: Any = None
    for action_count, compared in ((20, True), (10, False)):
        trained(tmp_path, settings(action_count, 1), physics=found.physics)
        run = FinishedRun(tmp_path, {"verb": "evaluate", **result_to_dict(found)}, {})
        body = evaluation_sections(found, run, unused)[0].body
        assert ("over the baseline" in body) == compared
        assert ("<td>B, in 20 s</td>" in body) != compared
        headline = _headline(found, run, PAGES["evaluate"], FORWARD)
        assert ("stands, in 20 s<" in headline) != compared
        assert ("best pair, in 10 s<" in headline) != compared


def test_the_sweep_says_how_long_the_expert_walked(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    class Sheet:
        def drawn(self, name: str, figure: Any, caption: str) -> str:
            return caption

    monkeypatch.setattr(training_sections, "phase_figure", lambda *_: None)
    sheet: Any = Sheet()
    run = trained(tmp_path, settings(10, 1))
    (section,) = sweep_sections(run.result(TrainingResult), run, sheet)
    assert section.body.endswith("what it achieves in 20 s, beside the learned pair in 10 s.")
    run = trained(tmp_path, settings(20, 1))
    (section,) = sweep_sections(run.result(TrainingResult), run, sheet)
    assert section.body.endswith("the second later by the phase.")


def test_a_run_that_does_not_tell_is_taken_as_it_is(tmp_path: Path) -> None:
    for asked in ({}, {"coopt": {}}, {"baseline": {}}):
        assert durations_apart(trained(tmp_path, asked)) is None


def longer(trajectory: Trajectory, factor: float) -> Trajectory:
    return replace(trajectory, time_s=factor * trajectory.time_s)


def test_frames_say_where_a_walk_was_over(make_trajectory: Callable[..., Trajectory]) -> None:
    short = Actor.of(make_trajectory(), "short")
    long = Actor.of(longer(make_trajectory(), 2.0), "long")
    figure = frames_figure([short, long], [0.0, 2.0, 4.0], 160)
    ended = [
        [any(text.get_text() == "ended at 2 s" for text in axes.texts) for axes in row]
        for row in np.reshape(np.array(figure.axes, dtype=object), (2, 3))
    ]
    assert ended == [[False, False, True], [False, False, False]]
    pale = [axes.images[0].get_alpha() < 0.5 for axes in figure.axes]
    assert pale == [False, False, True, False, False, False]


def test_a_caption_says_what_pale_robots_are(make_trajectory: Callable[..., Trajectory]) -> None:
    class Sheet:
        def drawn(self, name: str, figure: Any, caption: str) -> str:
            return caption

        def replayed(self, actors: Any, caption: str) -> str:
            return ""

    sheet: Any = Sheet()
    walk = make_trajectory()
    alike = replay_section("", {"a": walk, "b": walk}, sheet).body
    assert alike.endswith("lines are 5 cm apart.")
    apart = replay_section("", {"a": walk, "b": longer(walk, 2.0)}, sheet).body
    assert apart.endswith("lines are 5 cm apart; pale where a walk was over.")


def test_a_film_says_that_a_walk_was_over_and_whose_label_is_whose(
    make_trajectory: Callable[..., Trajectory], monkeypatch: pytest.MonkeyPatch
) -> None:
    written: list[tuple[str, float]] = []
    draw_text = ImageDraw.ImageDraw.text

    def text(self: ImageDraw.ImageDraw, place: Any, words: str, *args: Any, **more: Any) -> None:
        written.append((words, place[1]))
        draw_text(self, place, words, *args, **more)

    monkeypatch.setattr(ImageDraw.ImageDraw, "text", text)
    actors = [
        Actor.of(make_trajectory(), "short"),
        Actor.of(longer(make_trajectory(), 2.0), "long"),
    ]
    painter = FramePainter(actors, FilmSettings(480))  # on top of each other
    for time_s, ended in ((2.0, ""), (3.0, ", ended at 2 s")):
        written.clear()
        painter.paint(time_s)
        (short,), (long,) = (
            [each for each in written if each[0].startswith(name)] for name in ("short", "long")
        )
        assert short[0] == f"short\n+1.0 cm{ended}"
        assert "ended" not in long[0]
        assert long[1] - short[1] > 20.0  # two lines of 9 pixels


def test_labels_in_one_place_are_below_each_other() -> None:
    assert _spread([50.0, 150.0], [40.0, 40.0], 300.0) == [50.0, 150.0]
    assert _spread([150.0, 50.0], [40.0, 40.0], 300.0) == [150.0, 50.0]
    assert _spread([100.0] * 3, [40.0] * 3, 300.0) == [60.0, 100.0, 140.0]
    assert _spread([290.0] * 3, [40.0] * 3, 300.0) == [200.0, 240.0, 280.0]
    assert _spread([10.0] * 3, [40.0] * 3, 300.0) == [20.0, 60.0, 100.0]
