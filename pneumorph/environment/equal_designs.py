"""Refuse to count designs as one that a goal, or how robots start, tells apart."""

from __future__ import annotations

from collections.abc import Sequence

from pneumorph.environment.goal import Goal
from pneumorph.geometry.pose import Pose
from pneumorph.physics.start_pose import StartPose
from pneumorph.robot.design_space import DesignSpace
from pneumorph.robot.said_symmetry import said_symmetry


def check_equal_starts(space: DesignSpace, start: StartPose, poses: Sequence[Pose] = ()) -> None:
    """Refuse symmetries of a space, and mirror images, that turn the start into another one.

    Args:
        space: Designs, those that its symmetries turn into each other being one.
        start: How they are put on the floor.
        poses: Each site's frame in the robot's, by which messages name a turn.

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
                f"designs count as one under {said_symmetry(symmetry, poses)}, and {told}, "
                "expected no such symmetry: leave it out of designs.same of the robot's file, or "
                "of space.symmetries"
            )
    if space.has_mirror and not start.has_mirror:
        raise ValueError(
            f'designs have mirror images, and {told}, expected space.mirror = "none" and '
            "mirror_transitions = false"
        )


def lost_mirror_note(
    space: DesignSpace, start: StartPose, allowed: DesignSpace | None = None
) -> str | None:
    """What to say of robots that are their own mirror images and do not start so, which took the
    mirror from their designs; None of others.

    Args:
        space: Designs as they are searched.
        start: How they are put on the floor.
        allowed: Designs as the robot's file has them; None for the paper's robot.
    """
    if space.has_mirror or start.has_mirror or not (allowed is None or allowed.has_mirror):
        return None
    return (
        f"robots start with heading {start.heading_deg:g} and roll {start.roll_deg:g} degrees, in "
        "which they are not their own mirror images: a design and its image are two, of which each "
        "learns for itself (space.mirror is none"
        + (", whatever mirror of [designs] says)" if allowed is not None else ")")
    )


def check_equal_designs(
    space: DesignSpace, goal: Goal, sided_reward: bool = False, poses: Sequence[Pose] = ()
) -> None:
    """Refuse symmetries of a space that turn the goal into another one.

    A mirror image goes as far forward, to the other side, and turns the other way round; what is
    turned about z goes another way, and turns alike.

    Args:
        space: Designs, those that its symmetries turn into each other being one.
        goal: What is asked of them.
        sided_reward: Whether a reward of one's own depends on the side besides.
        poses: Each site's frame in the robot's, by which messages name a turn.

    Raises:
        ValueError: One of two such designs may achieve what the other cannot.
    """
    forward, left, turn = (abs(each) > 1e-9 for each in goal.direction)
    for symmetry in space.symmetries:
        if (left or turn or sided_reward) if symmetry == "mirror" else (forward or left):
            image = "its mirror image" if symmetry == "mirror" else "itself turned about z"
            told = f"the goal {goal.name!r}{' with terms of its own' if sided_reward else ''}"
            raise ValueError(
                f"a design and {image} count as one, and {told} tells them apart, expected no such "
                f"symmetry: leave {said_symmetry(symmetry, poses)} out of designs.same of the "
                "robot's file, or of space.symmetries"
            )
