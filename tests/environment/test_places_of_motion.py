"""Places that terms of a reward are told: from where each robot lay when its episode began."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
import pytest
from helpers.beside_images import steps_beside_images
from helpers.toy_coopt import SPACE, TASK, TIME_STEP_S, toy_settings

import pneumorph as pm
from pneumorph.environment.crawling_environment import CrawlingEnvironment
from pneumorph.environment.training_environment import TaskWrapper
from pneumorph.environment.viscous_crawler import ViscousCrawler, viscous_crawler_robot
from pneumorph.learn.environments import crawling
from pneumorph.learn.training import Training
from pneumorph.physics.start_pose import StartPose

USUAL = StartPose()
ELSEWHERE = StartPose(x_mm=200.0, y_mm=50.0)
TRACKED_MM = 12.0
"""How far in front of a robot's place its tracked point is."""


class Wanderer(ViscousCrawler):
    """Each step of a robot is 0.5 mm forward, 0.25 mm to the left and a degree to the left, and
    twice that far where its first regulator is asked for more than 50 kPa; above 80 it fails."""

    def __init__(self, robots: Any, start: StartPose = USUAL) -> None:
        self._pose = start
        super().__init__(robots, time_step_s=TIME_STEP_S)

    def set_robots(self, robots: Any) -> None:
        super().set_robots(robots)
        self._steps = np.zeros(len(robots))

    def reset(self, active: Any = None) -> None:
        super().reset(active)
        self._steps[slice(None) if active is None else active] = 0.0

    def advance(self, command_kPa: np.ndarray, step_count: int, active: Any = None) -> None:
        super().advance(command_kPa, step_count, active)
        first_kPa = np.asarray(command_kPa)[:, 0]
        gone = step_count * np.where(first_kPa > 50.0, 2.0, 1.0)
        gone = np.where(first_kPa > 80.0, np.nan, gone)
        self._steps += gone if active is None else np.where(active, gone, 0.0)
        self._status[np.isnan(self._steps)] = 1

    @property
    def forward_position_mm(self) -> np.ndarray:
        return self._pose.x_mm + TRACKED_MM + 0.5 * self._steps

    @property
    def left_position_mm(self) -> np.ndarray:
        return self._pose.y_mm + 0.25 * self._steps

    @property
    def heading_deg(self) -> np.ndarray:
        return (self._pose.heading_deg + self._steps + 180.0) % 360.0 - 180.0


def made(start: StartPose) -> CrawlingEnvironment:
    """Two robots that begin in a place; actions last 12 steps, and they settle for one."""
    environment = CrawlingEnvironment(
        [SPACE[0], SPACE[1]], viscous_crawler_robot, partial(Wanderer, start=start), TASK
    )
    environment.reset()
    return environment


@pytest.mark.parametrize("start", [USUAL, ELSEWHERE, replace(ELSEWHERE, heading_deg=90.0)])
def test_places_are_from_where_a_robot_lay(start: StartPose) -> None:
    """Not from the floor's origin, nor from where the tracked point was while it settled; headings
    are those of the floor."""
    environment = made(start)
    for number in range(3):
        environment.step(np.zeros((2, 2), np.float32))
        motion = environment.motion
        for place, actions in ((motion.before, number), (motion.after, number + 1)):
            np.testing.assert_array_equal(place.forward_mm, 6.0 * actions)
            np.testing.assert_array_equal(place.left_mm, 3.0 * actions)
            np.testing.assert_array_equal(
                place.heading_deg, start.heading_deg + TASK.settling_step_count + 12.0 * actions
            )
        image = motion.mirrored()
        np.testing.assert_array_equal(image.after.left_mm, -motion.after.left_mm)
        np.testing.assert_array_equal(image.after.forward_mm, motion.after.forward_mm)
        np.testing.assert_array_equal(image.after.heading_deg, -motion.after.heading_deg)
        assert image.moved.left_mm.tolist() == [-3.0, -3.0]


def test_how_robots_moved_is_the_simulators_to_the_bit() -> None:
    """Also where places of doubles begin somewhere that rounds them."""
    environment = made(StartPose(x_mm=0.1, y_mm=0.1))
    simulator, before, rounded = environment.simulator, None, False
    for _ in range(8):
        environment.step(np.zeros((2, 2), np.float32))
        motion = environment.motion
        after = (simulator.forward_position_mm, simulator.left_position_mm)
        if before is not None:
            np.testing.assert_array_equal(motion.moved.forward_mm, after[0] - before[0])
            np.testing.assert_array_equal(motion.moved.left_mm, after[1] - before[1])
            image = motion.mirrored().moved
            np.testing.assert_array_equal(image.left_mm, before[1] - after[1])
            told = motion.before.to(motion.after)
            rounded |= bool((told.left_mm != motion.moved.left_mm).any())
        before = after
    assert rounded  # places from the start differ by other bits
    np.testing.assert_allclose(motion.before.to(motion.after).left_mm, 3.0, atol=1e-12)


def test_a_robot_that_begins_anew_begins_at_its_start() -> None:
    """The first fails in its second action; the other goes on, and both begin anew at the end."""
    environment = made(ELSEWHERE)
    gentle, broken = np.full((2, 2), -1.0, np.float32), np.full((2, 2), -1.0, np.float32)
    gentle[1, 0] = 0.5  # 67.5 kPa
    broken[0, 0] = 1.0
    forward_mm = []
    for action in (gentle, broken, gentle, gentle):
        environment.step(action)
        forward_mm.append(environment.motion.after.forward_mm)
    np.testing.assert_array_equal(forward_mm[0], [6.0, 12.0])
    np.testing.assert_array_equal(forward_mm[2:], [[6.0, 30.0], [12.0, 42.0]])
    for _ in range(4, TASK.action_count + 2):
        environment.step(gentle)
    # The first failed in action 2 and its episode ends two later than the other's.
    np.testing.assert_array_equal(environment.motion.after.forward_mm, [96.0, 24.0])
    environment.reset(options={"designs": [SPACE[2], SPACE[3]]})
    environment.step(gentle)
    np.testing.assert_array_equal(environment.motion.after.forward_mm, [6.0, 12.0])


def _to_point(motion: Any) -> np.ndarray:
    distance: np.ndarray = np.hypot(motion.after.forward_mm - 30.0, motion.after.left_mm - 40.0)
    return distance


class ToThePoint(TaskWrapper):
    """Nearer to a point in front and to the left; and not off the line, to whichever side."""

    terms = (
        pm.RewardTerm("to_point", "mm", -0.1, _to_point, depends_on_side=True),
        pm.RewardTerm("off_line", "mm", -0.1, lambda motion: np.abs(motion.after.left_mm)),
    )


def test_a_training_learns_the_same_wherever_robots_start() -> None:
    """From robots and their images: what is stored of a round is the same to the bit."""
    settings = replace(toy_settings(round_count=4), sided_reward=True)
    stored = []
    for start in (USUAL, ELSEWHERE):
        usual = crawling(viscous_crawler_robot, partial(Wanderer, start=start), settings)
        training = Training(lambda designs, usual=usual: ToThePoint(usual(designs)), settings)
        training.walk_and_learn(np.arange(16) % len(SPACE), 0)
        stored.append(training.learned.buffer.arrays()["reward"])
    np.testing.assert_array_equal(stored[0], stored[1])
    assert np.ptp(stored[0]) > 0.1


def test_the_image_is_rewarded_where_it_starts() -> None:
    """Reduced robots beside their images, all put down to the left of the axis; friction is solved
    so that they differ by less than 2e-3 cm."""
    task = pm.CrawlingTask(action_step_count=50)
    apart = 0.0
    for _, info, own in steps_beside_images(task, seed=1, wrap=ToThePoint, start=ELSEWHERE):
        np.testing.assert_allclose(info["mirrored_reward_cm"], own, atol=2e-3)
        apart = max(apart, np.abs(info["mirrored_reward_cm"] - info["rewarded_cm"]).max())
        assert np.abs(info["off_line_cm"]).max() < 1.0  # and not the start's 5 cm
    assert apart > 0.05  # the point is nearer to some than to their images
