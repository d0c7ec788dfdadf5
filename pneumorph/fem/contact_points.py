"""The floor as a step sees it: a plane below each contact point."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pneumorph.physics.floor import Floor


@dataclass(frozen=True, eq=False)
class Contacts:
    """Contact points near the floor, with the floor linearised. Axes: body, contact."""

    points: tuple[np.ndarray, ...]
    """Numbers of the points of each body that take part, each (contact of the body,)."""
    frames: tuple[np.ndarray, ...]
    """Rows normal, tangent, tangent of each, each (contact of the body, 3, 3)."""
    gaps: np.ndarray
    """Gap at the end of the step of a point that does not move in it [mm], (contact,): the gap to
    the plane that touches the floor where the frames were taken."""


def linearise_contacts(
    floor: Floor,
    points: Sequence[np.ndarray],
    positions: Sequence[np.ndarray],
    moved: Sequence[np.ndarray],
) -> Contacts:
    """Take the floor's plane at each point, where the points are now within a step.

    Near the trial a point of velocity v has the gap g + h n . (v - v_trial), with the gap g and the
    normal n where it is now: g - h n . v_trial is what the step's velocities are added to. A point
    of a body that turns has not moved by h v_trial but along an arc; at the end of the iterations,
    where v is v_trial, the gap is that of its true place.

    Args:
        floor: What the points stand on.
        points: Numbers of the points of each body that take part.
        positions: World positions of all points of each body now [mm], each (point, 3).
        moved: h v_trial of them [mm], each (point, 3).
    """
    frames, gaps = [], []
    for chosen, position, way in zip(points, positions, moved, strict=True):
        near = position[chosen]
        frames.append(np.asarray(floor.frames(near)))
        gaps.append(floor.gap(near) - np.einsum("pa,pa->p", frames[-1][:, 0], way[chosen]))
    return Contacts(tuple(points), tuple(frames), np.concatenate(gaps))
