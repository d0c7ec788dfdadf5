"""Refuse designs, tasks and worlds that do not fit a robot, before it learns or is searched."""

from __future__ import annotations

from collections.abc import Callable

from pneumorph.catalogue.mirror_check import unlike_sides_note
from pneumorph.catalogue.robot_spec import RobotSpec
from pneumorph.catalogue.space_check import check_space
from pneumorph.catalogue.unseen_pressure import say_unseen_pressure
from pneumorph.catalogue.worlds_check import check_worlds
from pneumorph.environment.crawling_task import CrawlingTask
from pneumorph.environment.equal_designs import (
    check_equal_designs,
    check_equal_starts,
    lost_mirror_note,
)
from pneumorph.environment.equal_grounds import check_equal_grounds, roughness_note
from pneumorph.robot.design_space import DesignSpace
from pneumorph.simulation.randomisation import Randomisation


def check_designs(
    robot: RobotSpec,
    space: DesignSpace,
    task: CrawlingTask,
    say: Callable[[str], None],
    *,
    worlds: Randomisation | None = None,
    expert_kPa: float = 0.0,
    by_goal: bool = True,
    sided_reward: bool = False,
    ranks_images: bool = True,
    learns: bool = True,
) -> tuple[str, ...]:
    """Refuse what does not go together, and say what is to be known before anything walks.

    Args:
        robot: What walks.
        space: Its designs.
        task: What is asked of them.
        say: Is told the notes, and of pressures that legs have no snapshots of.
        worlds: What worlds they walk in are drawn from; None for one world.
        expert_kPa: Highest pressure of the expert's gait beside the task's [kPa]; 0 without one.
        by_goal: Whether the goal says what a design is worth; if not, designs that count as one are
            taken to be rewarded alike.
        sided_reward: Whether terms of one's own depend on the side besides.
        ranks_images: Whether of a design and its mirror image one is ranked, so that both must be
            of the space.
        learns: Whether what a design does is learned from, for its mirror image as well.

    Returns:
        The notes, which a result keeps.

    Raises:
        FileNotFoundError: There is no file of the ground, or no reduction that worlds may have.
        ArtefactError: Such a reduction is none.
        ValueError: The designs are none of the robot's, no design uses one of the regulators, task
            or designs have other numbers of them than the robot, designs count as one, or as mirror
            images, that rules, goal, start or floor tell apart, the supply does not reach the
            pressures, or the robot cannot be in the worlds (as of `check_worlds`).
    """
    check_space(robot, space)
    theirs = robot.physics.regulator_count
    for what, ours in (("task", task.regulator_count), ("design space", space.regulator_count)):
        if ours != theirs:
            raise ValueError(
                f"the {what} has {ours} regulators and the simulation {theirs}, expected the same "
                "number"
            )
    if worlds is not None:
        check_worlds(robot, worlds)
    if ranks_images:
        space.check_images()
    poses, start = [site.pose for site in robot.sites], robot.physics.start
    if by_goal:
        check_equal_designs(space, task.goal, sided_reward, poses)
    check_equal_starts(space, start, poses)
    check_equal_grounds(space, robot.physics, poses)
    largest_kPa = max(task.maximum_pressure_kPa, expert_kPa)
    robot.physics.air.check_supply(largest_kPa)
    redrawn = worlds is not None and worlds.ground_roughness_mm != "0"
    told = (
        lost_mirror_note(space, start, robot.allowed_designs),
        roughness_note(space, robot.physics, redrawn) if learns else None,
        unlike_sides_note(robot.modules) if learns and space.has_mirror else None,
    )
    notes = robot.calibration_notes + tuple(note for note in told if note is not None)
    for note in notes:
        say(note)
    say_unseen_pressure(robot, largest_kPa, say)
    return notes
