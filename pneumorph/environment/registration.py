"""Crawling robots by name, as Gymnasium finds them: ``gymnasium.make("pneumorph/Crawl-v0")``.

``import pneumorph`` registers the name, as Gymnasium 1.x asks of a package, so this file must stay
light: robots are imported when an environment is made.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import gymnasium

if TYPE_CHECKING:
    from pneumorph.catalogue.robot_spec import RobotSpec
    from pneumorph.environment.crawling_environment import CrawlingEnvironment
    from pneumorph.environment.crawling_task import CrawlingTask
    from pneumorph.environment.single_crawling_environment import SingleCrawlingEnvironment
    from pneumorph.robot.design import Design


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
        design: The design of every robot, or one for each; None for the expert's.
        robot: What the robots are; None for the paper's.
        task: Actions, episode and pressures; None for the paper's.

    Raises:
        ValueError: No robot, or another number of designs than robots.
    """
    from pneumorph.environment.crawling_environment import CrawlingEnvironment

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
    robot = robot or _paper_robot()
    chosen = designs * count if len(designs) == 1 else designs
    return CrawlingEnvironment(chosen, robot.assembly, robot.simulator, task)


def make_single_env(
    design: Design | str | None = None,
    robot: RobotSpec | None = None,
    task: CrawlingTask | None = None,
) -> SingleCrawlingEnvironment:
    """One crawling robot; arguments as of `make_env`."""
    from pneumorph.environment.single_crawling_environment import SingleCrawlingEnvironment

    robot = robot or _paper_robot()
    return SingleCrawlingEnvironment(_parsed(design), robot.assembly, robot.simulator, task)


def _parsed(design: Design | str | None) -> Design:
    from pneumorph.robot.design import BASELINE_DESIGN, Design

    design = BASELINE_DESIGN if design is None else design
    return Design.parse(design) if isinstance(design, str) else design


def _paper_robot() -> RobotSpec:
    from pneumorph.catalogue.paper_robot import paper_robot

    return paper_robot()
