"""Refuse to count designs as one that a goal, or how robots start, tells apart."""

from __future__ import annotations

from pneumorph.environment.goal import Goal
from pneumorph.physics.start_pose import StartPose
from pneumorph.robot.design_space import DesignSpace


def check_equal_starts(space: DesignSpace, start: StartPose) -> None:
    """Refuse symmetries of a space, and mirror images, that turn the start into another one.

    Args:
        space: Designs, those that its symmetries turn into each other being one.
        start: How they are put on the floor.

    Raises:
        ValueError: Two such designs start otherwise than as each other's images.
    """
    told = (
        f"robots start with heading {start.heading_deg:g}, pitch {start.pitch_deg:g} and roll "
        f"{start.roll_deg:g} degrees, in which they are not each other's images"
    )
    for symmetry in space.symmetries:
        if not (start.has_mirror if symmetry == "mirror" else start.is_upright):
            raise ValueError(
                f"designs count as one under {symmetry!r}, and {told}, expected no such symmetry: "
                "leave it out of designs.same of the robot's file, or of space.symmetries"
            )
    if space.has_mirror and not start.has_mirror:
        raise ValueError(
            f'designs have mirror images, and {told}, expected space.mirror = "none" and '
            "mirror_transitions = false"
        )


def check_equal_designs(space: DesignSpace, goal: Goal, sided_reward: bool = False) -> None:
    """Refuse symmetries of a space that turn the goal into another one.

    A mirror image goes as far forward, to the other side, and turns the other way round; what is
    turned about z goes another way, and turns alike.

    Args:
        space: Designs, those that its symmetries turn into each other being one.
        goal: What is asked of them.
        sided_reward: Whether a reward of one's own depends on the side besides.

    Raises:
        ValueError: One of two such designs may achieve what the other cannot.
    """
    forward, left, turn = (abs(each) > 1e-9 for each in goal.direction)
    for symmetry in space.symmetries:
        if (left or turn or sided_reward) if symmetry == "mirror" else (forward or left):
            image = "its mirror image" if symmetry == "mirror" else "itself turned about z"
            told = f"the goal {goal.name!r}{' with terms of its own' if sided_reward else ''}"
            raise ValueError(
                f"a design and {image} count as one, and {told} tells them apart, "
                "expected no such symmetry: leave it out of designs.same of the robot's file, or "
                "of space.symmetries"
            )
