"""How far a held leg bends at rising pressure."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pneumorph.base.progress import ProgressReport
from pneumorph.fem.bend import end_face_bend_deg
from pneumorph.fem.part_model import PartModel
from pneumorph.fem.static import StaticSettings, rising_equilibria
from pneumorph.physics.physics import Rotation


@dataclass(frozen=True)
class BendCurve:
    """Equilibria of a held leg without gravity or floor; all lists run over the pressures."""

    pressure_kPa: list[float]
    """Pressure in the cavity [kPa]; ends early where no equilibrium was found."""
    bend_deg: list[float]
    """Turn of the outer end face [degrees]."""
    converged: bool
    """Whether the last pressure asked for was reached."""
    reached_kPa: float
    """Highest pressure at which any equilibrium was found [kPa]."""
    iterations: int
    """Linear solves in all."""


def bend_curve(
    part: PartModel,
    pressures_kPa: Sequence[float],
    *,
    held: str = "inner_end_face",
    face: str = "outer_end_face",
    rotation: Rotation = "edge",
    settings: StaticSettings | None = None,
    progress: ProgressReport | None = None,
) -> BendCurve:
    """Raise the pressure in a leg and follow its bend.

    Usually the whole inner end face is held. A leg on a hub is held at its attachment alone
    (`pneumorph.reduction.held_bend`), where the paper's bends by 0.6 % more at up to 60 kPa.

    Args:
        part: The leg.
        pressures_kPa: Pressures, rising from above 0 [kPa].
        held: Node set that stays in place.
        face: Node set whose turn is the bend.
        rotation: Where corotational elements take their rotation from.
        settings: Steps and tolerance of the search.
        progress: Told how many pressures are done.

    Raises:
        ValueError: The pressures do not rise from above 0.
        MeshError: The mesh lacks a node set, or the part has no cavity.
    """
    pressures = np.asarray(pressures_kPa, dtype=float)
    if len(pressures) == 0 or pressures[0] <= 0.0 or np.any(np.diff(pressures) <= 0.0):
        raise ValueError(f"pressures_kPa must rise from above 0, got {list(pressures_kPa)}")
    nodes = part.mesh.node_set(held)
    part.mesh.node_set(face)
    done, bends, reached, iterations = [], [], 0.0, 0
    for result in rising_equilibria(part, pressures, nodes, rotation=rotation, settings=settings):
        reached, iterations = result.pressure_kPa, iterations + result.iterations
        if result.converged:
            done.append(result.pressure_kPa)
            bends.append(end_face_bend_deg(part.mesh, result.positions, face))
        if progress is not None:
            progress(len(done), len(pressures), "bending the leg")
    return BendCurve(done, bends, len(done) == len(pressures), reached, iterations)
