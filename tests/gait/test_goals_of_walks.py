"""What of a goal a walk achieves: of a batch, of a recorded robot, and beyond a whole circle."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from helpers.turner import Turner

from pneumorph.catalogue.paper_robot import paper_robot
from pneumorph.environment.goal import FORWARD, Goal
from pneumorph.environment.reward import RewardWeights
from pneumorph.environment.viscous_crawler import ViscousCrawler
from pneumorph.gait.expert_gait import ExpertGait
from pneumorph.gait.walk import walk
from pneumorph.robot.design import Design
from pneumorph.simulation.rollout import rollout

DESIGN = Design.parse("1.0.2.0")
LEFT, RIGHT = Goal("turn_left"), Goal("turn_right")


@pytest.mark.parametrize("record_step_count", [7, 50])
def test_a_turn_of_more_than_a_circle_counts_whole(record_step_count: int) -> None:
    """3 degrees a step over 200 steps, 150 from record to record; a pose alone says -120."""
    walked = walk(
        Turner([DESIGN]),
        [ExpertGait(duration_s=2.0)],
        duration_s=2.0,
        time_step_s=0.01,
        record_step_count=record_step_count,
    )
    np.testing.assert_allclose(walked.achieved(LEFT), 600.0)
    np.testing.assert_allclose(walked.achieved(RIGHT), -600.0)
    np.testing.assert_allclose(walked.achieved(Goal("heading", 90.0)), 60.0)
    np.testing.assert_allclose(walked.achieved(Goal("heading", 180.0)), -40.0)
    np.testing.assert_array_equal(walked.achieved(FORWARD), walked.distance_cm)


def test_a_simulator_that_knows_no_heading_is_told() -> None:
    walked = walk(ViscousCrawler([DESIGN]), [ExpertGait(duration_s=2.0)], duration_s=2.0,
                  time_step_s=0.01)  # fmt: skip
    with pytest.raises(ValueError, match="'turn_left', expected 'forward'"):
        walked.achieved(LEFT)


def test_a_recorded_robot_achieves_what_it_does_in_a_batch() -> None:
    """And its mirror image under the mirrored gait turns as far to the other side. Friction is
    solved to 0.01 mm/s, so that a second parts images by hundredths of a degree."""
    spec, gait = paper_robot(), ExpertGait(duration_s=2.0)
    turner = Design.parse("1.1.0.0.0.0.2.0")
    image = turner.mirror()
    trajectory = rollout(spec.reduced(turner), gait, record_nodes=False)[1]
    walked = walk(spec.simulator([turner, image]), [gait] * 2, duration_s=2.0, time_step_s=0.01)
    for goal in (FORWARD, Goal("heading", 60.0), LEFT, RIGHT):
        wanted = goal.achieved(trajectory)
        assert wanted == pytest.approx(walked.achieved(goal)[0], abs=1e-3)
    assert trajectory.distance_cm == FORWARD.achieved(trajectory)
    assert goal.achieved(replace(trajectory, status="diverged")) is None
    left = walked.achieved(LEFT)
    assert left[0] == pytest.approx(-left[1], abs=0.05)
    assert abs(left[0]) > 1.0


def test_a_goal_says_its_unit() -> None:
    turns = RewardWeights(goal="turn_right", turn_cm_per_degree=0.2).counted
    assert (turns.unit, turns.said(123.4), turns.axis) == (
        "degrees",
        "123°",
        "turn to the right (°)",
    )
    assert turns.of_reward(20.0) == pytest.approx(100.0)
    along = RewardWeights(goal="heading", heading_deg=90.0).counted
    assert (along.unit, along.said(1.44)) == ("cm", "1.4 cm")
    assert along.axis == "travel to the left (cm)"
    assert (FORWARD.axis, FORWARD.label) == ("forward distance (cm)", "distance")
