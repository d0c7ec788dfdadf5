"""Snapshots of a leg whose tip is kept down while it is inflated: its hardest push."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pneumorph.base.checked import Checked, CountOrNone, Positive
from pneumorph.fem.part_model import PartModel
from pneumorph.physics.physics import Rotation
from pneumorph.reduction.blocked_force import blocked_forces
from pneumorph.reduction.snapshots import Snapshots


@dataclass(frozen=True)
class BlockedSnapshotSettings(Checked):
    """Equilibria of a leg whose tip is held down while it is inflated."""

    count: CountOrNone = 0
    """Number of equilibria, evenly spaced in pressure."""
    pressure_kPa: Positive = 100.0
    """Highest simulated pressure, from 0 [kPa]."""
    face: str = "outer_end_face"
    """Node set of the tip; its mean height is held."""


def blocked_snapshots(
    part: PartModel, settings: BlockedSnapshotSettings, rotation: Rotation = "edge"
) -> Snapshots:
    """Equilibria at rising pressures.

    Args:
        part: The part, held at its attachment nodes.
        settings: Pressures.
        rotation: Where its elements take their rotation from.

    Raises:
        MeshError: The mesh has no such node set, or no face of its skin lies in it.
        ValueError: Not all were found.
    """
    pressures = np.linspace(0.0, settings.pressure_kPa, settings.count + 1)[1:]
    held = list(blocked_forces(part, part.mesh, pressures, rotation, settings.face))
    if len(held) < len(pressures):  # fewer would leave the reduction too stiff beyond them
        reached = held[-1].pressure_kPa if held else 0.0
        raise ValueError(
            f"equilibria with a blocked tip must be found up to {settings.pressure_kPa:g} kPa, got "
            f"none above {reached:g}: the leg balloons or buckles there, or steps are too large; "
            "ask for a lower largest pressure (snapshots.blocked.pressure_kPa is that of these "
            "alone), or for a larger snapshots.blocked.count"
        )
    states = np.array([each.positions - part.rest_nodes for each in held], dtype=np.float32)
    return Snapshots(
        states.reshape(-1, part.node_count, 3),
        np.array([each.pressure_kPa for each in held]),
        np.zeros(len(held), dtype=np.int32),
        {
            "mesh_digest": part.mesh.digest(),
            "sources": ["blocked"],
            "details": {"face": settings.face, "force_mN": [each.force_mN for each in held]},
        },
    )
