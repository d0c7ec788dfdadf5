"""What robots of a physics are asked for where nothing else is said: worlds, objective, reward."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from pneumorph.base.settings import laid_over, settings_from_dict, settings_to_dict
from pneumorph.catalogue.measured_worlds import measured_worlds
from pneumorph.catalogue.robot_description import RobotDescription
from pneumorph.catalogue.robot_settings import described_robot
from pneumorph.learn.objective import Objective
from pneumorph.learn.settings import ROBUST_OBJECTIVE
from pneumorph.physics.start_pose import StartPose
from pneumorph.simulation.randomisation import Randomisation

TILT_CM_PER_DEGREE = 0.05
"""Legs as soft as they are stand a robot up, and falling over goes 10 cm once: what a search finds
first and seldom leaves. On its side a robot leans by 50 degrees and more, which costs 1 cm in each
action: as much as good ones gain in it."""


def other_physics(content: Mapping[str, Any], below: Mapping[str, Any]) -> Any:
    """The physics that settings ask for, if it is another than those below them have, else None."""
    asked = _asked_physics(content)
    return None if asked == _asked_physics(below) else asked


def usual_worlds(physics: Any) -> dict[str, Any]:
    """Settings of what worlds are drawn from: those that robots as their materials were measured
    may turn out to live in; the published physics is one."""
    return settings_to_dict(measured_worlds() if physics == "measured" else Randomisation())


def implied_worlds(content: Mapping[str, Any], below: Mapping[str, Any]) -> dict[str, Any]:
    """Settings of what worlds are drawn from that a choice of physics brings where they are not
    set, or else the robot's file; nothing where neither is chosen.

    Args:
        content: Settings as nested dictionaries, with a group ``robot``.
        below: All settings below them.
    """
    physics, robot = other_physics(content, below), described_robot(content)
    of_physics = {} if physics is None else usual_worlds(physics)
    of_robot = {} if robot is None else robot.worlds_settings().get("randomisation", {})
    return laid_over(of_physics, of_robot)


def usual_aim(physics: Any) -> dict[str, Any]:
    """Settings of objective and task: what a sixth of the worlds falls short of, less what falling
    over costs; the distance alone in the published physics."""
    measured = physics == "measured"
    return {
        "objective": settings_to_dict(ROBUST_OBJECTIVE if measured else Objective()),
        "task": {"reward": {"tilt": TILT_CM_PER_DEGREE if measured else 0.0}},
    }


def starts_to_a_side(content: Mapping[str, Any], robot: RobotDescription | None) -> bool:
    """Whether settings, or the robot's file that they name, turn the start so that it is not its
    own mirror image: a design and its image are two then, unless the file says that they count as
    one, which is refused.

    Args:
        content: Settings as nested dictionaries, with a group ``robot``.
        robot: What the file says; None without one.
    """
    if robot is not None and "mirror" in robot.space.symmetries:
        return False
    own = {} if robot is None else settings_to_dict(robot.physics.physics.start)
    asked = content.get("robot", {}).get("physics", {})
    start = asked.get("start", {}) if isinstance(asked, Mapping) else {}
    if not isinstance(start, Mapping):
        return False  # refused where it is read
    return not settings_from_dict(StartPose, {**own, **start}).has_mirror


def _asked_physics(content: Mapping[str, Any]) -> Any:
    """The physics by name that settings ask for; None where nothing is asked."""
    robot = described_robot(content)
    return content.get("robot", {}).get("based_on") if robot is None else robot.physics.based_on
