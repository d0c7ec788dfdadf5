"""Answers of a part's tip to small forces, for modes to learn from.

In component mode synthesis they are attachment modes (Craig and Kurdila, Fundamentals of Structural
Dynamics, chapter 17), here of the whole tangent at several states of free bending. Equilibria under
large forces say little of how a part gives way under small ones in its bent states, and what a
robot's weight does to its legs is decided there.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pneumorph.fem.cavity import Pressure
from pneumorph.fem.part_model import PartModel
from pneumorph.fem.static_answers import UnstableError, static_answers
from pneumorph.geometry.face_tie import FaceTie
from pneumorph.physics.physics import Rotation
from pneumorph.reduction.blocked_force import even_load


@dataclass(frozen=True, eq=False)
class TipAnswers:
    """How the nodes move under 1 mN, even over the outer end face, along each axis."""

    positions: np.ndarray
    """Of the state that each is at [mm], (answer, node, 3)."""
    moved: np.ndarray
    """[mm], (answer, node, 3)."""


def answers_at(
    part: PartModel,
    x: np.ndarray,
    pressure_kPa: Pressure,
    rotation: Rotation = "edge",
    region: str = "outer_end_face",
) -> np.ndarray:
    """Displacements under 1 mN, even over the outer end face, along each axis [mm], (node, 3,
    axis); arguments and errors as of `tip_compliance`."""
    forces = even_load(part.mesh, region)[:, None, None] * np.eye(3)
    held = FaceTie.of(part.mesh).nodes
    return static_answers(part, x, pressure_kPa, held, forces, rotation)


def tip_answers(
    part: PartModel,
    displacement: np.ndarray,
    pressure_kPa: np.ndarray,
    rotation: Rotation = "edge",
) -> TipAnswers:
    """Find the answers at equilibria; those that are not stable are left out.

    Args:
        part: The part, with a node set ``outer_end_face``.
        displacement: The equilibria [mm], (state, node, 3), a stable one among them.
        pressure_kPa: Pressure of each cavity, (state, cavity).
        rotation: Where elements take their rotation from.

    Raises:
        MeshError: No face of the mesh's skin lies in that node set, or there is none.
    """
    positions, moved = [], []
    for u, kPa in zip(displacement, pressure_kPa, strict=True):
        x = part.rest_nodes + u
        try:
            answers = answers_at(part, x, kPa, rotation)
        except UnstableError:
            continue
        positions += 3 * [x]
        moved += list(np.moveaxis(answers, 2, 0))
    return TipAnswers(np.array(positions), np.array(moved))
