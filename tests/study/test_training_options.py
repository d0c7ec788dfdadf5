"""What a choice of physics brings with it for a training."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from pneumorph.base.layers import layered
from pneumorph.base.settings import settings_from_dict, settings_to_dict
from pneumorph.catalogue.measured_worlds import measured_worlds
from pneumorph.catalogue.robot_options import RobotOptions
from pneumorph.catalogue.robot_spec import RobotSpec
from pneumorph.environment.training_environment import EnvironmentFactory
from pneumorph.learn.environments import crawling
from pneumorph.learn.objective import Objective
from pneumorph.learn.settings import ROBUST_OBJECTIVE, CooptSettings, fast_settings, quick_settings
from pneumorph.study.learning_robots import learning_and_judged, learning_robots
from pneumorph.study.search_options import SearchOptions
from pneumorph.study.training_options import (
    PRESETS,
    TrainingOptions,
    measured_training,
    quick_training,
    train_as_asked,
)
from pneumorph.study.training_run import _of_single_worlds
from pneumorph.study.training_worlds import simulator_factory


def test_measured_robots_are_trained_in_the_worlds_that_may_be() -> None:
    usual = TrainingOptions(coopt=fast_settings(), robot=RobotOptions.of("published"))
    measured = layered(usual, [{"robot": {"based_on": "measured"}}])
    assert measured.randomize
    assert measured.certified_world_count > usual.certified_world_count == 0
    assert measured.randomisation == measured_worlds()
    assert measured.coopt.objective == ROBUST_OBJECTIVE
    assert measured.coopt.task.reward.tilt > usual.coopt.task.reward.tilt == 0.0
    assert measured.coopt.total_timesteps == usual.coopt.total_timesteps
    assert measured.coopt.learning_modes > usual.coopt.learning_modes == 0
    # The published physics is as it was, and what is asked for is had.
    assert layered(usual, [{"robot": {"based_on": "published"}}]) == usual
    asked = {"robot": {"based_on": "measured"}, "randomize": False}
    asked["coopt"] = {"objective": {"worlds_per_design": 1}}
    single = layered(usual, [asked])
    assert (single.randomize, single.coopt.objective.is_robust) == (False, False)
    assert not quick_settings().objective.is_robust
    # It is what every preset has; another choice takes all of it back, the same one none of it.
    assert measured_training(fast_settings()) == measured
    assert layered(measured, [{"robot": {"based_on": "published"}}]) == usual
    quick = quick_training()
    assert layered(quick, [{"robot": {"based_on": "measured"}}]) == quick


def test_whole_settings_of_an_earlier_version_begin_once() -> None:
    """A run's settings, written before there were restarts, laid over a preset that has them."""
    fast = PRESETS["fast"]()
    assert fast.coopt.restarts > 1
    written = settings_to_dict(fast)
    del written["coopt"]["restarts"], written["coopt"]["objective"]["nominal_until_timestep"]
    del written["coopt"]["learning_modes"], written["coopt"]["learning_tolerance"]
    objective = replace(fast.coopt.objective, nominal_until_timestep=0)
    assert layered(fast, [written]).coopt == replace(
        fast.coopt, restarts=1, objective=objective, learning_modes=0, learning_tolerance=0.0
    )
    shorter = layered(fast, [{"coopt": {"total_timesteps": 500}}]).coopt
    assert shorter == replace(fast.coopt, total_timesteps=500)


def test_ranking_by_the_luck_of_one_world_is_told() -> None:
    assert _of_single_worlds(worlds_per_design=4, drawn=4) is None
    assert _of_single_worlds(worlds_per_design=1, drawn=1) is None
    told = _of_single_worlds(worlds_per_design=1, drawn=8)
    assert told is not None
    assert "each design walks in one of 8 drawn worlds" in told


def test_several_worlds_for_a_design_ask_for_worlds(tmp_path) -> None:
    asked = TrainingOptions(coopt=CooptSettings(objective=Objective(worlds_per_design=4)))
    with pytest.raises(ValueError, match="worlds_per_design is 4 and 1 worlds are drawn"):
        train_as_asked(asked, tmp_path)


def test_robots_learn_on_fewer_modes_where_no_gait_counts_as_it_is_seen() -> None:
    spec = RobotOptions().spec()
    settings = replace(quick_training().coopt, learning_tolerance=0.0)
    made: list[int] = []

    def make(robots: RobotSpec) -> EnvironmentFactory:
        made.append(robots.module.reduced.mode_count)
        return crawling(robots.assembly, simulator_factory(robots, None, 0), settings)

    learners = learning_robots(spec, settings)
    learning, judged = learning_and_judged(make, spec, learners)
    assert (made, judged is not None) == ([16, 40], True)
    assert learning is not judged
    for whole in (
        replace(settings, objective=Objective()),
        replace(settings, learning_modes=0),
        replace(settings, learning_modes=40),
    ):
        made.clear()
        learners = learning_robots(spec, whole)
        assert learning_and_judged(make, spec, learners)[1] is None
        assert made == [40]


def test_the_number_of_regulators_is_asked_for_in_one_place() -> None:
    """The robot's; designs, task, expert's gait and searches have as many."""
    four = {"robot": {"physics": {"regulator_count": 4}}}
    training = layered(PRESETS["quick"](), [four])
    counts = {
        training.coopt.space.regulator_count,
        training.coopt.task.regulator_count,
        training.baseline.gait.regulator_count,
    }
    assert counts == {4}
    found = layered(SearchOptions(), [four]).search
    assert (found.space.regulator_count, found.task.regulator_count) == (4, 4)
    own = {**four, "coopt": {"space": {"regulator_count": 2}}}
    with pytest.raises(ValueError, match="space has 2 regulators and the task 4"):
        layered(PRESETS["quick"](), [own])


@pytest.mark.parametrize("physics", ["published", "measured"])
def test_a_choice_of_physics_asks_for_no_number_of_regulators(physics: str) -> None:
    """That of a settings file below stays."""
    two = {"regulator_count": 2}
    below = {"robot": {"physics": two}, "coopt": {"space": two, "task": two}}
    training = layered(PRESETS["quick"](), [below, {"robot": {"based_on": physics}}])
    assert training.robot.physics.regulator_count == training.coopt.space.regulator_count == 2


def test_a_group_beside_its_settings_and_in_them_is_one() -> None:
    """As flags have it, `task` may stand beside `coopt`; neither hides what the other says."""
    usual = TrainingOptions()
    asked = {
        "coopt": {"task": {"action_count": 2}},
        "task": {"reward": {"goal": "turn_left"}},
    }
    task = layered(usual, [asked]).coopt.task
    assert (task.action_count, task.reward.goal) == (2, "turn_left")
    for group, wrong in (("task", {"reward": {"gaol": "forward"}}), ("sac", {"batch": 3})):
        with pytest.raises(ValueError, match="unknown setting"):
            layered(usual, [{"coopt": {group: {}, "seed": 1}, group: wrong}])
    twice = {"coopt": {"sac": {"batch_size": 8}}, "sac": {"batch_size": 16}}
    with pytest.raises(ValueError, match=r"coopt\.sac\.batch_size is 8, and .* beside it 16"):
        layered(usual, [twice])
    twice["sac"]["batch_size"] = 8
    assert layered(usual, [twice]).coopt.sac.batch_size == 8


def test_a_direction_goes_with_its_goal() -> None:
    """Alone it is refused; another goal over it has none; a run of before keeps what it has."""
    alone = {"coopt": {"task": {"reward": {"heading_deg": -90.0}}}}
    with pytest.raises(
        ValueError, match=r"heading_deg is -90\.0 and goal is forward, expected goal"
    ):
        layered(TrainingOptions(), [alone])
    aside = {"task": {"reward": {"goal": "heading", "heading_deg": -90.0}}}
    turning = {"coopt": {"task": {"reward": {"goal": "turn_left"}}}}
    assert layered(TrainingOptions(), [aside]).coopt.task.reward.heading_deg == -90.0
    assert layered(TrainingOptions(), [aside, alone]).coopt.task.reward.heading_deg == -90.0
    reward = layered(TrainingOptions(), [aside, turning]).coopt.task.reward
    assert (reward.goal, reward.heading_deg) == ("turn_left", 0.0)
    before = settings_to_dict(TrainingOptions().coopt)
    before["task"]["reward"]["heading_deg"] = 450.0
    assert settings_from_dict(CooptSettings, before).task.reward.counted.is_forward


def test_robots_of_a_file_and_other_goals_try_every_phase() -> None:
    """Only the paper's robot is known to go forward best at a phase of its first half circle."""
    usual = quick_training()
    plate = Path(__file__).parents[2] / "examples" / "plate.toml"
    turning = {"coopt": {"task": {"reward": {"goal": "turn_left"}}}}
    whole = tuple(range(0, 360, 20))
    for asked in ({"robot": {"described": str(plate)}}, turning):
        assert layered(usual, [asked]).baseline.phases_deg == whole
        said = {"baseline": {"last_phase_deg": 40.0}}
        assert layered(usual, [{**asked, **said}]).baseline.phases_deg == (0, 20, 40)
    assert usual.baseline.phases_deg == tuple(range(0, 181, 20))
    assert layered(usual, [{"robot": {"based_on": "published"}}]).baseline.last_phase_deg == 180.0
