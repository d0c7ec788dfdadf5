"""The reward is the travel in cm, and a failure never pays."""

from dataclasses import replace

import numpy as np
import pytest
from helpers.crawlers import PHYSICS, STEPPER, crawlers

from pneumorph.environment.crawling_environment import CrawlingEnvironment
from pneumorph.environment.crawling_task import CrawlingTask
from pneumorph.environment.reward import COSTS, GOAL_TERMS, RewardWeights, reward_terms
from pneumorph.environment.viscous_crawler import ViscousCrawler, viscous_crawler_robot
from pneumorph.robot.design import Design
from pneumorph.robot.robot import Hub, Robot
from pneumorph.simulation.batched_simulator import BatchedSimulator
from pneumorph.simulation.randomisation import World


def test_travel_is_paid_in_centimetres_and_failures_are_not_paid() -> None:
    travel_mm = np.array([25.0, -3.0, 1e6, np.nan, np.inf])
    failed = np.array([False, False, True, True, False])
    np.testing.assert_allclose(
        reward_terms(travel_mm, failed)["forward_travel_cm"], [2.5, -0.3, 0.0, 0.0, 0.0]
    )


class _Scripted:
    """Goes to given places [mm] every ten steps, its hub bearing given shares."""

    def __init__(self, robots: list[Design]) -> None:
        self.set_robots(robots)

    def set_robots(self, robots: list[Design]) -> None:
        self.steps, self.count = 0, len(robots)

    def reset(self, active: np.ndarray | None = None) -> None:
        self.steps = 0

    def advance(self, command_kPa, step_count, active=None) -> None:
        self.steps += step_count

    PLACES_MM = (0.0, 4.0, 1.0, 6.0, 5.0, 2.0, 7.0)
    SHARES = (0.0, 0.2, 0.4, 0.6, 0.0, 1.0, 0.5)
    TILTS = (0.0, 10.0, 20.0, 60.0, 50.0, 40.0, 0.0)

    @property
    def forward_position_mm(self) -> np.ndarray:
        return np.full(self.count, self.PLACES_MM[self.steps // 10])

    @property
    def hub_load_share(self) -> np.ndarray:
        return np.full(self.count, self.SHARES[self.steps // 10])

    @property
    def tilt_deg(self) -> np.ndarray:
        return np.full(self.count, self.TILTS[self.steps // 10])

    @property
    def status(self) -> np.ndarray:
        return np.zeros(self.count, np.uint8)


def _stepped(weights: RewardWeights) -> tuple[np.ndarray, list[dict]]:
    task = CrawlingTask(
        regulator_count=2, action_step_count=30, settling_step_count=0, reward=weights
    )
    environment = CrawlingEnvironment([Design.parse("1.2.0.0")], lambda d: d, _Scripted, task)
    environment.reset()
    actions = np.array([[[1.0, -1.0]], [[0.0, 0.0]]])  # 90 and 0 kPa, then 45 and 45
    stepped = [environment.step(action) for action in actions]
    return np.array([each[1][0] for each in stepped]), [each[4] for each in stepped]


def test_what_is_taken_off_has_a_weight_and_a_name() -> None:
    """The furthest slide of the first action is 4 to 1 mm, of the second 6 to 2; the hub bears 0.4
    and 0.5 on average and leans by 30 degrees twice; one regulator changes by its whole range, then
    two by half of it."""
    travel = np.array([0.6, 0.1])
    reward, infos = _stepped(RewardWeights(backsliding=2.0))
    np.testing.assert_allclose(reward, travel - 2.0 * np.array([0.3, 0.4]), atol=1e-12)
    np.testing.assert_allclose(infos[1]["backsliding_cm"], [-0.8])
    np.testing.assert_allclose(infos[1]["distance_cm"], [0.7])  # as it went
    reward, _ = _stepped(RewardWeights(hub_load=0.1))
    np.testing.assert_allclose(reward, travel - 0.1 * np.array([0.4, 0.5]))
    reward, infos = _stepped(RewardWeights(pressure_change=0.01))
    np.testing.assert_allclose(reward, travel - 0.01 * np.array([1.0, 1.0]))
    assert "hub_load_cm" not in infos[0]
    reward, infos = _stepped(RewardWeights(tilt=0.02, free_tilt_deg=15.0))  # 0, 5, 45 and 35, 25, 0
    np.testing.assert_allclose(reward, travel - 0.02 * np.array([50.0, 60.0]) / 3.0)
    np.testing.assert_allclose(infos[1]["tilt_cm"], [-0.4])
    reward, _ = _stepped(RewardWeights(1.0, 0.1, 0.01, 0.001, 0.0))
    np.testing.assert_allclose(
        reward, [0.6 - 0.3 - 0.04 - 0.01 - 0.03, 0.1 - 0.4 - 0.05 - 0.01 - 0.03]
    )
    assert _stepped(RewardWeights())[0] == pytest.approx(travel)


class _Winding(_Scripted):
    """Goes back and to the left as it goes forward elsewhere, and turns there and back."""

    @property
    def left_position_mm(self) -> np.ndarray:
        return -self.forward_position_mm

    @property
    def heading_deg(self) -> np.ndarray:
        # Across half a circle, where headings jump.
        turned = 175.0 + 10.0 * self.forward_position_mm
        return (turned + 180.0) % 360.0 - 180.0


@pytest.mark.parametrize(
    ("weights", "slid_cm", "images_cm"),
    [
        (RewardWeights(1.0, goal="heading", heading_deg=0.0), 0.3, 0.3),
        (RewardWeights(1.0, goal="heading", heading_deg=180.0), 0.6, 0.6),
        (RewardWeights(1.0, goal="heading", heading_deg=90.0), 0.6, 0.3),
        (RewardWeights(1.0, goal="turn_left"), 3.0, 6.0),
        (RewardWeights(2.0, goal="turn_right", turn_cm_per_degree=0.01), 1.2, 0.6),
    ],
)
def test_sliding_back_is_away_from_the_goal(
    weights: RewardWeights, slid_cm: float, images_cm: float
) -> None:
    """Places of 0, 4, 1 and 6 mm in the first action: the furthest way back is 3 mm of going
    forward, from 4 to 1, and 6 of the opposite. Mirrored, left and right change places."""
    task = CrawlingTask(
        regulator_count=2, action_step_count=30, settling_step_count=0, reward=weights
    )
    environment = CrawlingEnvironment([Design.parse("1.2.0.0")], lambda d: d, _Winding, task)
    environment.reset()
    _, _, _, _, info = environment.step(np.array([[1.0, -1.0]]))
    np.testing.assert_allclose(info["backsliding_cm"], [-slid_cm], atol=1e-9)
    image = info["mirrored_reward_cm"] - info["rewarded_cm"]
    gained = info["achieved"] * weights.counted.cm_per_unit
    mirrored = gained if weights.is_symmetric else -gained
    np.testing.assert_allclose(image, mirrored - gained - images_cm + slid_cm, atol=1e-9)


def test_what_may_be_taken_off_is_listed() -> None:
    one = np.ones(1)
    terms = reward_terms(
        one, one < 0, RewardWeights(1.0, 1.0, 1.0, 1.0), one, one, one, tilt_deg=one
    )
    assert set(terms) == {GOAL_TERMS["forward"], *COSTS}


def test_a_failure_costs_nothing_either() -> None:
    found = reward_terms(
        np.array([np.nan]), np.array([True]), RewardWeights(1.0, 1.0), np.ones(1), np.ones(1)
    )
    np.testing.assert_array_equal(sum(found.values()), [0.0])


@pytest.mark.parametrize("term", ["hub_load", "tilt"])
def test_a_simulator_that_does_not_know_what_a_term_needs_is_refused(term: str) -> None:
    task = CrawlingTask(regulator_count=2, reward=RewardWeights(**{term: 1.0}))
    environment = CrawlingEnvironment(
        [Design.parse("1.2.0.0")], viscous_crawler_robot, ViscousCrawler, task
    )
    environment.reset()
    with pytest.raises(ValueError, match=rf"{term} is 1, expected 0 .* ViscousCrawler"):
        environment.step(np.zeros((1, 2)))


def test_the_share_on_the_hub() -> None:
    """A hub alone on the floor bears all, with legs that hold it up none, in the air there is
    none to bear; the numbers of contact points differ."""
    points = np.array([[x, y, 0.0] for x in (-20.0, 20.0) for y in (-20.0, 20.0)])
    alone = Robot(Hub(0.1, np.zeros(3), 10.0 * np.eye(3), np.zeros(3), points), ())
    standing = crawlers()[0]
    physics = replace(PHYSICS, floor_height_mm=0.0)
    simulator = BatchedSimulator([alone, standing], physics, STEPPER, 1)
    np.testing.assert_array_equal(simulator.hub_load_share, [0.0, 0.0])
    simulator.advance(np.zeros((2, 2)), 100)
    np.testing.assert_array_equal(simulator.hub_load_share, [1.0, 0.0])
    # The load does not depend on what impulses are over.
    heavy = World(1.2, 1.0, 3.0, 0.0, 0.0)
    simulator.set_robots([alone, standing], [heavy, heavy])
    simulator.advance(np.zeros((2, 2)), 100)
    np.testing.assert_array_equal(simulator.hub_load_share, [1.0, 0.0])


def test_the_tilt_is_the_hub_s_from_the_floor_s_normal() -> None:
    angle = np.radians(25.0)
    about_y = np.array(
        [[np.cos(angle), 0.0, np.sin(angle)], [0.0, 1.0, 0.0], [-np.sin(angle), 0.0, np.cos(angle)]]
    )
    points = np.zeros((1, 3))
    hub = Hub(0.1, np.zeros(3), 10.0 * np.eye(3), np.zeros(3), points)
    simulator = BatchedSimulator([Robot(hub, ())], PHYSICS, STEPPER, 1)
    assert simulator.tilt_deg == pytest.approx([0.0])
    simulator.write(0, "rotation", about_y)
    assert simulator.tilt_deg == pytest.approx([25.0])
