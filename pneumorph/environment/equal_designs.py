"""Refuse to count designs as one that a goal tells apart."""

from __future__ import annotations

from pneumorph.environment.goal import Goal
from pneumorph.physics.start_pose import StartPose
from pneumorph.robot.design_space import DesignSpace


def check_equal_designs(space: DesignSpace, goal: Goal, start: StartPose) -> None:
    """Refuse symmetries of a space that turn the goal or the start into another one.

    A mirror image goes as far forward, to the other side, and turns the other way round; what is
    turned about z goes another way, and turns alike.

    Args:
        space: Designs, those that its symmetries turn into each other being one.
        goal: What is asked of them.
        start: How they are put on the floor.

    Raises:
        ValueError: One of two such designs may achieve what the other cannot.
    """
    forward, left, turn = (abs(each) > 1e-9 for each in goal.direction)
    for symmetry in space.symmetries:
        if not (start.has_mirror if symmetry == "mirror" else start.is_upright):
            raise ValueError(
                f"designs that are each other under {symmetry!r} count as one, and robots start "
                f"with heading {start.heading_deg:g}, pitch {start.pitch_deg:g} and roll "
                f"{start.roll_deg:g} degrees, in which they are not, expected no such symmetry: "
                "leave it out of designs.same of the robot's file, or of space.symmetries"
            )
        if (left or turn) if symmetry == "mirror" else (forward or left):
            image = "its mirror image" if symmetry == "mirror" else "itself turned about z"
            raise ValueError(
                f"a design and {image} count as one, and the goal {goal.name!r} tells them apart, "
                "expected no such symmetry: leave it out of designs.same of the robot's file, or "
                "of space.symmetries"
            )
