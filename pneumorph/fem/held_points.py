"""Points of a leg that the floor presses, held near a trial where its matrix is indefinite.

A corner that is pressed may give way where nothing holds it, and then the matrix of its leg, which
knows of no floor, is indefinite. At the end of a step the floor holds it, so iterations with the
point held converge as without.
"""

from __future__ import annotations

import numpy as np

from pneumorph.fem.mounted_leg import MountedLeg

HELD = 1.0
"""Times the largest entry of its diagonal a leg is held where the floor presses it."""
STICKING = 0.999
"""Share of the most that friction can do up to which a point counts as sticking."""


def hold_pressed(
    leg: MountedLeg,
    data: np.ndarray,
    points: np.ndarray,
    frames: np.ndarray,
    impulses: np.ndarray,
    friction: np.ndarray,
) -> None:
    """Add to A of a leg, in place, what holds pressed points: along the normal, and all ways where
    they stick.

    Args:
        leg: The leg.
        data: A in the pattern of the part's assembly [kg], (entry,).
        points: Numbers of its points that take part, (contact,).
        frames: Rows normal, tangent, tangent of each, (contact, 3, 3).
        impulses: What presses them at the trial along these [mN s], (contact, 3).
        friction: Coefficient at each, (contact,).
    """
    stiffness = HELD * float(data[leg.part.assembly.diagonal].max())
    for point, frame, impulse, most in zip(points, frames, impulses, friction, strict=True):
        if impulse[0] > 0.0:
            sticks = np.hypot(impulse[1], impulse[2]) < STICKING * most * impulse[0]
            axes = frame if sticks else frame[:1]
            leg.add_stiffness(data, point, stiffness * axes.T @ axes)
