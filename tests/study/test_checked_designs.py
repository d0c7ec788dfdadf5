"""Designs, task and robot that do not go together are refused before anything walks."""

from __future__ import annotations

from dataclasses import replace

import pytest

from pneumorph.catalogue.paper_robot import paper_robot
from pneumorph.environment.crawling_task import CrawlingTask
from pneumorph.environment.equal_grounds import roughness_note
from pneumorph.environment.reward import RewardWeights
from pneumorph.physics.air import Air
from pneumorph.physics.ground import Ground, RoughGround
from pneumorph.physics.physics import Physics
from pneumorph.robot.design_space import DesignSpace
from pneumorph.simulation.randomisation import Randomisation
from pneumorph.study.checked_designs import check_designs

SPACE, TASK = DesignSpace(), CrawlingTask()


def quiet(_: str) -> None: ...


@pytest.mark.parametrize(
    ("task", "space", "said"),
    [
        (replace(TASK, regulator_count=2), SPACE, "the task has 2 regulators and the simulation 3"),
        (TASK, DesignSpace(regulator_count=2), "the design space has 2 regulators and the sim"),
    ],
)
def test_other_numbers_of_regulators_are_refused(
    task: CrawlingTask, space: DesignSpace, said: str
) -> None:
    with pytest.raises(ValueError, match=said):
        check_designs(paper_robot("published"), space, task, quiet)


def test_one_rough_surface_for_designs_and_their_images_is_told() -> None:
    """Unless each world draws its own."""
    physics = Physics(ground=Ground(rough=RoughGround(roughness_mm=1.0)))
    robot, said = paper_robot("published", physics), list[str]()
    note = roughness_note(SPACE, physics, redrawn=False)
    assert check_designs(robot, SPACE, TASK, said.append) == (note,)
    assert said == [note]
    drawn = Randomisation(ground_roughness_mm="U(0,2)")
    assert check_designs(robot, SPACE, TASK, quiet, worlds=drawn) == ()


def test_a_supply_must_reach_the_experts_pressures_as_well() -> None:
    robot = paper_robot("published", Physics(air=Air("orifice", supply_kPa=100.0)))
    assert check_designs(robot, SPACE, TASK, quiet, expert_kPa=100.0) == ()
    with pytest.raises(ValueError, match="asks for 110 kPa from a supply of 100 kPa"):
        check_designs(robot, SPACE, TASK, quiet, expert_kPa=110.0)


def test_of_a_task_of_ones_own_the_goal_tells_no_designs_apart() -> None:
    """But a side that terms depend on does."""
    task = replace(TASK, reward=RewardWeights(goal="turn_left"))
    space = DesignSpace(symmetries=("mirror",))
    robot = paper_robot("published")
    with pytest.raises(ValueError, match="goal 'turn_left' tells them apart"):
        check_designs(robot, space, task, quiet)
    assert check_designs(robot, space, task, quiet, by_goal=False) == ()
    assert check_designs(robot, space, TASK, quiet) == ()
    with pytest.raises(ValueError, match="with terms of its own"):
        check_designs(robot, space, TASK, quiet, sided_reward=True)
