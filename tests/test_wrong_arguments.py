"""What Python's users may pass by mistake is told in their words, before anything is simulated."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import pneumorph as pm

ANY: Any = pm
DESIGN = "1.0.0.2.2.0.0.1"
FIVE = pm.HeldGait.evenly(np.full((2, 5), 10.0))


@pytest.fixture(scope="module")
def robot() -> Any:
    return pm.paper_robot()


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (
            lambda r: ANY.rollout(r, pm.ExpertGait()),
            "model is a RobotSpec, .* of a design",
        ),
        (
            lambda r: ANY.rollout(r.reduced(DESIGN), None),
            "commands_kPa is None, expected",
        ),
        (
            lambda r: ANY.rollout(r.reduced(DESIGN), "g.csv"),
            "commands_kPa is 'g.csv', .* gait",
        ),
        (lambda r: r.reduced(None), r"design is None, expected text such as 1\.0\.0"),
        (lambda r: r.reduced(3), "design is 3, expected text"),
        (
            lambda r: ANY.paper_robot(3),
            "leg is 3, expected a Module, or .* published",
        ),
        (lambda r: ANY.make_env(num_envs=2, design=3), "design is 3, expected text"),
        (lambda r: ANY.make_env(num_envs=2, robot="x"), r"robot is 'x', expected a RobotSpec such"),
        (lambda r: ANY.train(changes=["seed"]), r"changes is \['seed'\], expected .* dictionaries"),
    ],
)
def test_a_wrong_kind_is_told(call: Callable[[Any], Any], message: str, robot: Any) -> None:
    with pytest.raises(TypeError, match=message):
        call(robot)


def test_a_gait_for_more_regulators_than_the_robot_has_is_told(robot: Any) -> None:
    with pytest.raises(ValueError, match=r"the gait commands 5 regulators, expected at most .* 3"):
        pm.rollout(robot.reduced(DESIGN), FIVE)


def test_a_number_of_settling_steps_below_zero_is_told(robot: Any) -> None:
    with pytest.raises(ValueError, match="settling_steps is -1, expected at least 0"):
        pm.rollout(robot.reduced(DESIGN), FIVE, settling_steps=-1)


def test_commands_may_be_a_list(robot: Any) -> None:
    steps = [[10.0, 0.0, 0.0]] * 3
    ways = [pm.rollout(robot.reduced(DESIGN), each)[1] for each in (steps, np.array(steps))]
    np.testing.assert_array_equal(ways[0].hub_position_mm, ways[1].hub_position_mm)
