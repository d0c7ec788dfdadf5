"""Refuse to count designs as one, or as mirror images, that what they walk on tells apart."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from pneumorph.geometry.pose import Pose
from pneumorph.physics.ground import RoughGround
from pneumorph.physics.physics import Physics
from pneumorph.robot.design_space import DesignSpace
from pneumorph.robot.said_symmetry import said_symmetry

_ALIKE_MM = 0.1
_ALIKE = 0.02
"""Of the map's range: what grey levels and splines make of a ground that is meant to be its own
image."""


def check_equal_grounds(space: DesignSpace, physics: Physics, poses: Sequence[Pose] = ()) -> None:
    """Refuse symmetries of a space, and mirror images, that the floor has not.

    Roughness that is drawn does not count: it is no more to one side than to another, see
    `roughness_note`.

    Args:
        space: Designs, those that its symmetries turn into each other being one.
        physics: What they walk in.
        poses: Each site's frame in the robot's, by which messages name a turn.

    Raises:
        FileNotFoundError: No file of the ground.
        ValueError: A height map is another to the left of the robot's start than to the right, or
            designs count as one that are turned about z, and the floor has a slope, a map or steps.
    """
    ground, start = physics.ground, physics.start
    turns = [each for each in space.symmetries if each != "mirror"]
    lies_forward = {
        f"slope of {physics.floor_slope_deg:g} degrees": physics.floor_slope_deg != 0.0,
        "height map": ground.map.path is not None,
        "steps": ground.steps.rise_mm != 0.0,
    }
    for said, is_there in lies_forward.items():
        if turns and is_there:
            raise ValueError(
                f"designs count as one under {said_symmetry(turns[0], poses)}, a turn about z, and "
                f"the floor has a {said}, which is somewhere else then; expected no such symmetry: "
                "leave it out of designs.same of the robot's file, or of space.symmetries"
            )
    if not (space.has_mirror or "mirror" in space.symmetries) or ground.map.path is None:
        return
    grid = replace(ground, rough=RoughGround()).grid()
    # To the edge that is further away: beyond the nearer one the map goes on level.
    reach = max(float(grid.y_mm[-1] - start.y_mm), float(start.y_mm - grid.y_mm[0]))
    halves = round(2.0 * reach / grid.spacing_mm)  # of the distance between nodes
    aside = np.linspace(0.0, reach, 1 + min(halves, 2 * len(grid.y_mm)))
    x, y = np.meshgrid(grid.x_mm, aside, indexing="ij")
    left, right = grid.height(x, start.y_mm + y), grid.height(x, start.y_mm - y)
    apart_mm, range_mm = float(np.abs(left - right).max()), float(np.ptp(left) + np.ptp(right))
    if apart_mm > max(_ALIKE_MM, _ALIKE * range_mm):
        raise ValueError(
            f"designs have mirror images, and the height map {ground.map.path} differs by up to "
            f"{apart_mm:.3g} mm between the left and the right of where robots start (y = "
            f"{start.y_mm:g} mm); expected a map that is its own image, or space.mirror = "
            '"none" (mirror = false in a robot\'s file) and mirror_transitions = false'
        )


def roughness_note(space: DesignSpace, physics: Physics, redrawn: bool) -> str | None:
    """What to say where all learn on one rough surface, which is not its own image; None where
    each world draws its own, and of spaces without symmetries.

    Args:
        space: Designs.
        physics: What they walk in.
        redrawn: Whether worlds draw a surface of their own.
    """
    if redrawn or physics.ground.rough.roughness_mm == 0.0:
        return None
    if not space.has_mirror and not space.symmetries:
        return None
    return (
        "all robots walk on one rough surface, and what is learned of a design is taken for its "
        "mirror image's and those that count as one with it, which holds on such surfaces on "
        "average and not on this one: let each world draw its own by "
        '--randomisation.ground-roughness-mm, or have space.mirror = "none", '
        "mirror_transitions = false and no symmetries"
    )
