"""Figures draw the numbers of the artefacts they are given."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from pneumorph.environment.goal import Goal
from pneumorph.environment.reward import RewardWeights
from pneumorph.report.learning_figures import (
    entropy_figure,
    phase_figure,
    reward_figure,
)
from pneumorph.report.plan import Plan, paper_plan
from pneumorph.report.plan_view import plan_view_figure
from pneumorph.report.reduction_figures import bend_figure
from pneumorph.report.style import regulator_colour, save_figure
from pneumorph.report.walk_figures import distance_figure, path_figure, pressure_figure
from pneumorph.robot.design import Design
from pneumorph.study.training_result import LearnedPair

DESIGN = "1.0.0.2.2.0.0.1"


def test_distance_is_in_centimetres_from_the_start(make_trajectory) -> None:
    figure = distance_figure({"learned": make_trajectory(speed_mm_per_s=20.0)})
    line = figure.axes[0].lines[0]
    assert line.get_ydata()[[0, -1]] == pytest.approx([0.0, 4.0])


def test_the_legend_of_distances_lies_on_nothing_that_is_drawn(make_trajectory) -> None:
    """Robots that go backward are where it was."""
    figure = distance_figure({"learned": make_trajectory(), "expert": make_trajectory(DESIGN, -9)})
    figure.draw_without_rendering()
    (legend,) = figure.legends
    assert figure.axes[0].get_legend() is None
    assert legend.get_window_extent().y0 >= figure.axes[0].get_window_extent().y1


def test_pressures_have_a_panel_for_each_regulator(make_trajectory) -> None:
    trajectory = make_trajectory()
    figure = pressure_figure(trajectory, regulator_count=2)
    assert len(figure.axes) == 2
    assert np.array_equal(figure.axes[1].lines[1].get_ydata(), trajectory.regulated_kPa[:, 1])


def test_best_phase_is_marked_and_failures_are_left_out() -> None:
    figure = phase_figure([0, 10, 20, 30], [0.5, np.nan, 2.0, 1.0], learned=6.0)
    marked = figure.axes[0].lines[1]
    assert (marked.get_xdata()[0], marked.get_ydata()[0]) == (20, 2.0)
    with pytest.raises(ValueError, match="every simulation of the sweep failed"):
        phase_figure([0.0], [np.nan])
    with pytest.raises(ValueError, match="2 phases and 1 distances"):
        phase_figure([0.0, 1.0], [1.0])


def test_plan_view_draws_a_leg_for_each_regulator_entry() -> None:
    from matplotlib.colors import to_hex

    figure = plan_view_figure(paper_plan(Design.parse("1.0.2.0.0.3.0.0")), "1.0.2.0.0.3.0.0")
    *legs, _disk = figure.axes[0].patches
    colours = [to_hex(leg.get_facecolor()).upper() for leg in legs]
    assert colours == [regulator_colour(regulator) for regulator in (1, 2, 3)]
    assert [text.get_text() for text in figure.axes[0].texts if text.get_text()] == list("123")
    # The first leg points 22.5 degrees left of forward.
    centre = legs[0].get_xy()[:4].mean(axis=0)
    assert np.degrees(np.arctan2(centre[1], centre[0])) == pytest.approx(22.5)


def test_plan_view_tells_kinds_of_modules() -> None:
    figure = plan_view_figure(paper_plan(Design.parse("c1.0.0.2+3.0.0.0.b2")))
    told = [text.get_text() for text in figure.axes[0].texts if text.get_text()]
    assert told == ["c1", "2+3", "b2"]


def test_a_leg_of_several_regulators_has_a_band_of_each() -> None:
    """Away from the hub, in the order of its name, and together the leg's area."""
    from matplotlib.colors import to_hex

    figure = plan_view_figure(paper_plan(Design.parse("2+3.0.0.1.0.0.0.0")))
    inner, outer, other, _disk = figure.axes[0].patches
    colours = [to_hex(each.get_facecolor()).upper() for each in (inner, outer, other)]
    assert colours == [regulator_colour(regulator) for regulator in (2, 3, 1)]

    def area(patch) -> float:
        x, y = patch.get_xy()[:-1].T
        return 0.5 * abs(x @ np.roll(y, -1) - y @ np.roll(x, -1))

    assert area(inner) + area(outer) == pytest.approx(area(other), rel=1e-9)
    assert area(inner) == pytest.approx(area(outer), rel=1e-9)
    far = [np.linalg.norm(each.get_xy()[:-1].mean(axis=0)) for each in (inner, outer)]
    assert far[0] < far[1]


def test_path_and_bend(make_trajectory, tmp_path: Path) -> None:
    figure = path_figure({"a": make_trajectory()})
    assert figure.axes[0].lines[0].get_xdata()[-1] == pytest.approx(1.0)
    assert len(bend_figure([0, 100], [0, 30], [0, 31]).axes[0].lines) == 2


def test_a_path_ends_at_the_tracked_point_of_the_robot_that_is_drawn(
    make_trajectory, monkeypatch: pytest.MonkeyPatch
) -> None:
    """One whose nose, 60 mm ahead of its origin, is tracked, and that turned to the left."""
    walk = make_trajectory()
    rotation = np.array(walk.hub_rotation)
    rotation[-1] = [[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]
    nose = walk.hub_position_mm + rotation @ [60.0, 0.0, 0.0]
    turned = replace(walk, hub_rotation=rotation, tracked_point_mm=nose)
    drawn = []
    monkeypatch.setattr(
        "pneumorph.report.walk_figures.draw_plan_view",
        lambda _, plan, place, heading, **size: drawn.append((*place, heading)),
    )
    end = path_figure({"a": turned}).axes[0].lines[0].get_xydata()[-1]
    ((x, y, heading),) = drawn
    assert heading == pytest.approx(np.pi / 2)
    np.testing.assert_allclose(end, [x, y + 6.0])


def test_a_robot_of_long_reach_is_in_the_picture_of_its_path(
    make_trajectory, monkeypatch: pytest.MonkeyPatch
) -> None:
    leg = np.array([[0.0, -9.0], [-250.0, -9.0], [-250.0, 9.0], [0.0, 9.0]])
    plan = Plan(np.zeros((0, 2)), (leg,), ((1,),), ("",), ((leg,),))
    monkeypatch.setattr("pneumorph.report.walk_figures.plan_of_walk", lambda _: plan)
    (axes,) = path_figure({"far": make_trajectory()}).axes
    assert axes.get_xlim()[0] <= -25.0


def test_a_robot_that_went_far_is_in_the_picture_of_its_path(make_trajectory) -> None:
    slow = make_trajectory()
    figure = path_figure({"slow": slow, "fast": make_trajectory(speed_mm_per_s=200.0)})
    for axes in figure.axes:
        legs = [patch.get_xy()[:, 0].max() for patch in axes.patches if hasattr(patch, "get_xy")]
        assert max(legs) < axes.get_xlim()[1]
    assert figure.axes[0].get_xlim()[1] > 40.0
    assert path_figure({"slow": slow}).axes[0].get_xlim() == (-18.0, 32.0)


def test_figures_are_saved_in_each_format_and_alike_each_time(tmp_path: Path) -> None:
    figure = bend_figure([0, 100], [0, 30], [0, 31])
    first = save_figure(figure, tmp_path / "one" / "bend", ("png", "pdf", "svg"))
    assert [path.suffix for path in first] == [".png", ".pdf", ".svg"]
    again = save_figure(bend_figure([0, 100], [0, 30], [0, 31]), tmp_path / "bend", ("svg",))
    assert again[0].read_bytes() == first[2].read_bytes()


def test_training_is_drawn_beside_the_baseline() -> None:
    metrics = [
        {
            "timestep": 100 * number,
            "best_distance_cm": None if number == 1 else float(number),
            "return_mean_cm": 0.5 * number,
            "design_entropy": 9.0 - number,
            "design_entropy_target": 8.5 - number,
            "score_histogram": [0.25, 0.75],
        }
        for number in (1, 2, 3)
    ]
    figure = reward_figure(metrics, [-1.0, 0.0, 4.0], baseline=1.5, learned=4.0)
    labels = [text.get_text() for text in figure.legends[0].get_texts()]
    assert labels == ["best so far", "mean of the round", "expert's best phase: 1.5 cm"]
    axes = figure.axes[0]
    assert axes.lines[0].get_ydata()[1:].tolist() == [2.0, 3.0]
    assert axes.get_ylim()[1] > 4.0
    target, entropy = entropy_figure(metrics).axes[0].lines
    assert target.get_ydata().tolist() == [7.5, 6.5, 5.5]
    assert entropy.get_ydata().tolist() == [8.0, 7.0, 6.0]
    reward_figure(metrics, [-1.0, 0.0, 4.0, 8.0])  # a run from before the bins were extended
    with pytest.raises(ValueError, match="no metrics"):
        reward_figure([], [0.0, 1.0])
    with pytest.raises(ValueError, match="2 bins, expected fewer than the 2 edges"):
        reward_figure(metrics, [0.0, 1.0])


ROUNDS = [
    {
        "timestep": 100 * number,
        "best_distance_cm": 9.0,
        "return_mean_cm": 0.5 * number,
        "return_maximum_cm": most,
        "score_histogram": [0.25, 0.75],
    }
    for number, most in ((1, None), (2, 3.0), (3, 2.0))
]


def test_rewards_of_a_task_of_ones_own_are_drawn_and_no_distance() -> None:
    """Also of one that is added to turning: its rewards are in cm."""
    pairs = [LearnedPair(DESIGN, 9.0, "policy", 300, None, score, 9.0) for score in (1.25, 0.75)]
    turn = Goal("turn_left", cm_per_unit=0.1)
    figure = reward_figure(
        ROUNDS, [-1.0, 0.0, 4.0], 1.5, 1.25, pairs, goal=turn, own_task="Diagonal"
    )
    *views, axes = figure.axes
    assert axes.get_ylabel() == "reward of Diagonal (cm)"
    labels = [text.get_text() for text in figure.legends[0].get_texts()]
    assert labels == ["best episode so far", "mean of the round"]
    best, mean = (line.get_ydata().tolist() for line in axes.lines[:2])
    assert best[1:] == [3.0, 3.0]
    assert mean == [0.5, 1.0, 1.5]
    assert [view.get_title(loc="center") for view in views] == ["L1: 1.25 cm", "L2: 0.75 cm"]
    assert 3.0 < axes.get_ylim()[1] < 9.0


def test_rewards_that_something_is_taken_off_are_told_beside_the_distance() -> None:
    assert RewardWeights(tilt=0.05).takes_off
    assert not RewardWeights(goal="turn_left").takes_off
    figure = reward_figure(ROUNDS, [-1.0, 0.0, 4.0], 1.5, penalised=True)
    assert figure.axes[0].get_ylabel() == "reward and distance (cm)"
    labels = [text.get_text() for text in figure.legends[0].get_texts()]
    assert labels == [
        "distance of the best so far", "mean reward of the round", "expert's best phase: 1.5 cm"
    ]  # fmt: skip
