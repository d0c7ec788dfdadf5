"""Walks of a batch: the environment's distances, and backsliding from its definition."""

import numpy as np
import pytest
from helpers.ranged_crawler import RangedCrawler

from pneumorph.environment.crawling_environment import CrawlingEnvironment
from pneumorph.environment.viscous_crawler import ViscousCrawler, viscous_crawler_robot
from pneumorph.gait.expert_gait import ExpertGait
from pneumorph.gait.held_gait import HeldGait
from pneumorph.gait.walk import Walk, walk
from pneumorph.robot.design import Design

DESIGNS = [Design.parse("1.0.0.2.2.0.0.1"), Design.parse("1.2.0.0.3.0.0.0")]

UNKNOWN = np.full(2, np.nan)
"""These robots know no range."""


def test_walk_of_held_gaits_equals_the_environments_episode() -> None:
    environment = CrawlingEnvironment(DESIGNS, viscous_crawler_robot, ViscousCrawler)
    environment.reset()
    actions = np.random.default_rng(0).uniform(-1, 1, (20, 2, 3))
    for action in actions:
        info = environment.step(action)[4]
    pressures = environment.task.pressure_kPa(actions)
    gaits = [HeldGait.evenly(pressures[:, robot]) for robot in range(2)]
    result = walk(ViscousCrawler(DESIGNS), gaits, duration_s=20.0, time_step_s=0.01)
    np.testing.assert_allclose(result.distance_cm, info["distance_cm"], atol=1e-12)  # rounding
    assert result.time_s[0] == 0.0
    assert result.time_s[-1] == 20.0
    np.testing.assert_array_equal(result.forward_cm[0], 0.0)


def test_a_range_is_that_of_the_walk_and_not_of_settling() -> None:
    gaits = [HeldGait.evenly(np.full((2, 3), 40.0))] * 2
    walked = walk(RangedCrawler(DESIGNS), gaits, duration_s=2.0, time_step_s=0.01)
    np.testing.assert_array_equal(walked.range_ratio, 0.5)
    environment = CrawlingEnvironment(DESIGNS, viscous_crawler_robot, RangedCrawler)
    environment.reset()
    environment.step(np.ones((2, 3)))
    np.testing.assert_array_equal(environment.motion.range_ratio, 0.5)


def test_recording_interval_does_not_change_the_walk() -> None:
    gaits = [ExpertGait(phase_deg=phase) for phase in (40.0, 110.0)]
    coarse, fine = (
        walk(
            ViscousCrawler(DESIGNS),
            gaits,
            duration_s=8.0,
            time_step_s=0.01,
            record_step_count=count,
        )
        for count in (50, 1)
    )
    assert len(fine.time_s) == 801
    np.testing.assert_array_equal(coarse.forward_cm, fine.forward_cm[::50])


def test_backsliding_is_the_furthest_slide_back_of_a_cycle() -> None:
    time_s = np.linspace(0, 8, 801)
    # Two cycles of 4 s: up by 3, back by 1, up by 1; then up by 2, back by 0.5, up by 1.
    forward = np.interp(time_s, [0, 1, 2, 4, 5, 6, 8], [0, 3, 2, 3, 5, 4.5, 5.5])
    monotone = time_s
    result = Walk(time_s, np.stack([forward, monotone], axis=1), np.zeros(2, np.uint8), UNKNOWN)
    np.testing.assert_allclose(result.backsliding_cm(4.0), [0.75, 0.0], atol=1e-12)  # rounding
    with pytest.raises(ValueError, match=r"period is 0\.001 s, expected at least the 0\.01 s from"):
        result.backsliding_cm(0.001)
    with pytest.raises(ValueError, match="lasts 8 s, expected at least one period of 9 s"):
        result.backsliding_cm(9.0)


def test_failed_robots_have_no_distance() -> None:
    result = Walk(
        np.array([0.0, 1.0]), np.array([[0.0, 0.0], [1.0, np.nan]]), np.array([0, 1]), UNKNOWN
    )
    np.testing.assert_array_equal(result.distance_cm, [1.0, np.nan])


def test_gaits_must_agree_on_the_regulators() -> None:
    gaits = [ExpertGait(), ExpertGait(regulator_count=2)]
    with pytest.raises(ValueError, match=r"gaits command \[2, 3\] regulators"):
        walk(ViscousCrawler(DESIGNS), gaits, duration_s=1.0, time_step_s=0.01)


class Righting(ViscousCrawler):
    """Robots that lie on their backs until they stand up, and turn on from there."""

    _number = 0
    course_deg = np.array([[np.nan, 30.0], [np.nan, np.nan], [120.0, 40.0], [150.0, np.nan]])

    def advance(self, command_kPa, step_count, active=None) -> None:
        super().advance(command_kPa, step_count, active)
        self._number += command_kPa.any()

    @property
    def left_position_mm(self) -> np.ndarray:
        return np.zeros(2)

    @property
    def heading_deg(self) -> np.ndarray:
        return self.course_deg[self._number]


def test_a_robot_that_starts_on_its_back_turns_from_where_it_first_faces() -> None:
    gaits = [HeldGait.evenly(np.full((3, 3), 40.0))] * 2
    result = walk(Righting(DESIGNS), gaits, duration_s=3.0, time_step_s=1.0, record_step_count=1)
    expected = [[0.0, 0.0], [0.0, 0.0], [0.0, 10.0], [30.0, 10.0]]
    np.testing.assert_allclose(result.turned_deg, expected, atol=1e-12)
