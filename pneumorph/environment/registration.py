"""Crawling robots by name, as Gymnasium finds them: ``gymnasium.make("pneumorph/Crawl-v0")``.

``import pneumorph`` registers the name, as Gymnasium 1.x asks of a package, so this file must stay
light: robots are imported when an environment is made.
"""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING

import gymnasium

if TYPE_CHECKING:
    from pneumorph.catalogue.robot_spec import RobotSpec
    from pneumorph.environment.crawling_environment import CrawlingEnvironment
    from pneumorph.environment.crawling_task import CrawlingTask
    from pneumorph.environment.single_crawling_environment import SingleCrawlingEnvironment
    from pneumorph.robot.design import Design
    from pneumorph.robot.robot import Robot


ENVIRONMENT_ID = "pneumorph/Crawl-v0"


def register_environments() -> None:
    """Register `ENVIRONMENT_ID` with Gymnasium; a name that is registered already stays."""
    if ENVIRONMENT_ID in gymnasium.registry:
        return
    gymnasium.register(
        ENVIRONMENT_ID,
        entry_point="pneumorph.environment.registration:make_single_env",
        vector_entry_point="pneumorph.environment.registration:make_env",
    )


def make_env(
    num_envs: int | None = None,
    design: Design | str | Sequence[Design | str] | None = None,
    robot: RobotSpec | None = None,
    task: CrawlingTask | None = None,
) -> CrawlingEnvironment:
    """Robots that crawl side by side, as a Gymnasium vector environment.

    Args:
        num_envs: How many robots; None for as many as there are designs.
        design: The design of every robot, or one for each; None for the expert's, which is one of
            the paper's robot: of others it must be named. One that the robot's description does not
            allow walks with a warning, also where it comes by ``reset``. Observations have room for
            as many regulators of a leg as these have at most: a design with more cannot follow by
            ``reset``.
        robot: What the robots are; None for the paper's.
        task: Actions, episode, pressures and reward; None for the paper's with the robot's
            regulators, of legs that were reduced for lower pressures with those. Its reward is
            forward travel alone in every physics: in the measured one ``pneumorph coopt`` takes off
            0.05 cm for each degree beyond 30 that the hub leans, which is
            ``CrawlingTask(regulator_count=..., reward=RewardWeights(tilt=0.05))``.

    Raises:
        TypeError: A design or the robot is of another kind.
        ValueError: No robot, another number of designs than robots, no design of a robot of other
            sites than the paper's, a task of other regulators than the robot has, or one whose
            largest pressure the robot's supply has not.
    """
    from pneumorph.environment.crawling_environment import CrawlingEnvironment

    robot = _robot(robot)
    if design is None:
        _refuse_unnamed(robot)
    if isinstance(design, Sequence) and not isinstance(design, str):
        designs = [_parsed(each) for each in design]
    else:
        designs = [_parsed(design)]
    count = len(designs) if num_envs is None else num_envs
    if count < 1:
        raise ValueError(f"num_envs is {count}, expected at least 1")
    if len(designs) not in (1, count):
        raise ValueError(
            f"got {len(designs)} designs for num_envs = {count}, expected one design for all or "
            "one for each"
        )
    chosen = designs * count if len(designs) == 1 else designs
    told = _told(robot, chosen)
    return CrawlingEnvironment(
        chosen, partial(_assembled, robot), robot.simulator, _task_of(robot, task), **told
    )


def make_single_env(
    design: Design | str | None = None,
    robot: RobotSpec | None = None,
    task: CrawlingTask | None = None,
) -> SingleCrawlingEnvironment:
    """One crawling robot; arguments as of `make_env`."""
    from pneumorph.environment.single_crawling_environment import SingleCrawlingEnvironment

    robot = _robot(robot)
    if design is None:
        _refuse_unnamed(robot)
    chosen = _parsed(design)
    told = _told(robot, [chosen])
    return SingleCrawlingEnvironment(
        chosen, partial(_assembled, robot), robot.simulator, _task_of(robot, task), **told
    )


def _task_of(robot: RobotSpec, task: CrawlingTask | None) -> CrawlingTask:
    """The task; where none is given, one with the robot's regulators and the usual pressures, or
    those that its legs' snapshots end with, if they are lower."""
    from pneumorph.catalogue.unseen_pressure import lowest_seen_kPa
    from pneumorph.environment.crawling_task import CrawlingTask

    count = robot.physics.regulator_count
    if task is not None and task.regulator_count != count:
        raise ValueError(
            f"the task has {task.regulator_count} regulators and the robot {count}, expected the "
            f"same number: CrawlingTask(regulator_count={count})"
        )
    if task is None:
        task = CrawlingTask(regulator_count=count)
        seen_kPa = lowest_seen_kPa(module.reduced for module in robot.modules)
        task = task if seen_kPa is None else replace(task, maximum_pressure_kPa=seen_kPa)
    robot.physics.air.check_supply(task.maximum_pressure_kPa)
    return task


def _told(robot: RobotSpec, designs: Sequence[Design]) -> dict[str, int]:
    """What observations tell designs apart by, see `Design.one_hot`: a policy of a space that has
    all these designs' modules is told the same."""
    cavities = (len(each.regulators) for design in designs for each in design.fittings)
    return {
        "module_count": max(len(site.modules) for site in robot.sites),
        "cavity_count": max(cavities, default=1),
    }


def _assembled(robot: RobotSpec, design: Design) -> Robot:
    """The robot of a design; warns of one that its description does not allow."""
    from pneumorph.catalogue.description_notes import forbidden_of_space

    assembled = robot.assembly(design)
    if robot.allowed_designs is not None:
        names = [site.name for site in robot.sites]
        note = forbidden_of_space(robot.allowed_designs, names, robot.name, design)
        if note is not None:
            warnings.warn(note, stacklevel=2)
    return assembled


def _parsed(design: Design | str | None) -> Design:
    from pneumorph.catalogue.paper_designs import BASELINE_DESIGN
    from pneumorph.robot.design import Design

    return Design.parse(BASELINE_DESIGN if design is None else design)


def _refuse_unnamed(robot: RobotSpec) -> None:
    """Refuse to take the expert's design for a robot of other sites than the paper's.

    Raises:
        ValueError: It has others.
    """
    from pneumorph.catalogue.paper_designs import BASELINE_DESIGN
    from pneumorph.robot.design import Design

    expected, count = Design.parse(BASELINE_DESIGN).location_count, len(robot.sites)
    if count != expected:
        raise ValueError(
            f"design is None, which is {BASELINE_DESIGN} of the paper's robot with {expected} "
            f"sites, and {robot.name or 'the robot'} has {count}: expected a design, such as the "
            "usual_design of its RobotDescription"
        )


def _robot(asked: RobotSpec | None) -> RobotSpec:
    """What is asked for, or the paper's robot."""
    from pneumorph.catalogue.paper_robot import paper_robot
    from pneumorph.catalogue.robot_spec import RobotSpec

    if asked is None:
        return paper_robot()
    if not isinstance(asked, RobotSpec):
        raise TypeError(
            f"robot is {asked!r:.60}, expected a RobotSpec such as paper_robot() or "
            "RobotDescription.read(file).spec()"
        )
    return asked
