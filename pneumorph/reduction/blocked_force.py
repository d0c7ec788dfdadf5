"""Blocked force of a leg: what keeps its tip from moving while it is inflated.

The leg is held at its attachment, without gravity or floor. A force along the leg's z axis, even
over the outer end face, keeps the mean height of that face; the face may slide and turn. It is the
force that a scale under the tip would read.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np

from pneumorph.fem.part_model import PartModel
from pneumorph.fem.static import StaticSettings, rising_equilibria
from pneumorph.geometry.face_tie import FaceTie
from pneumorph.geometry.mesh import Mesh, MeshError
from pneumorph.physics.physics import Rotation
from pneumorph.reduction.modal_equilibrium import rising_modal_equilibria
from pneumorph.reduction.reduced_part import ReducedPart

_EQUILIBRIUM = StaticSettings(load_step_kPa=10.0, tolerance=1e-7)
"""A stiff sheet under a small force is balanced to no more than the rounding of its tension."""


@dataclass(frozen=True, eq=False)
class BlockedForce:
    """Force on the tip at one pressure."""

    pressure_kPa: float
    force_mN: float
    """Upwards on the tip, along the leg's z axis."""
    positions: np.ndarray
    """Of the nodes under it [mm], (node, 3)."""
    alpha: np.ndarray | None = None
    """Modal coordinates of a reduced leg, (mode,)."""


def blocked_forces(
    leg: ReducedPart | PartModel,
    mesh: Mesh,
    pressures_kPa: Iterable[float],
    rotation: Rotation = "edge",
    region: str = "outer_end_face",
) -> Iterator[BlockedForce]:
    """Blocked forces at rising pressures, up to the last before one is not found.

    Args:
        leg: The reduced leg, or its finite elements.
        mesh: The leg's mesh.
        pressures_kPa: Simulated pressures [kPa], positive.
        rotation: Where elements take their rotation from.
        region: Node set of the outer end face.

    Raises:
        MeshError: No face of the mesh's skin lies in the region.
    """
    weights = even_load(mesh, region)
    pressures = list(pressures_kPa)
    if isinstance(leg, ReducedPart):
        lift = np.einsum("n,nm->m", weights, leg.modes[:, 2])
        for pressure, small in zip(
            pressures, rising_modal_equilibria(leg, pressures, rotation, kept=lift), strict=False
        ):
            if not small.converged:
                return
            yield BlockedForce(pressure, small.keeping_mN, leg.positions(small.alpha), small.alpha)
        return
    exact = rising_equilibria(
        leg,
        pressures,
        FaceTie.of(mesh).nodes,
        kept=weights[:, None] * np.array([0.0, 0.0, 1.0]),
        rotation=rotation,
        settings=_EQUILIBRIUM,
    )
    for pressure, found in zip(pressures, exact, strict=False):
        if found.converged:
            yield BlockedForce(pressure, found.keeping_mN, found.positions)


def even_load(mesh: Mesh, region: str) -> np.ndarray:
    """Shares of an even traction over a flat face among the nodes, which add up to 1, (node,)."""
    load = mesh.node_areas(mesh.node_set(region))
    if not load.any():
        raise MeshError(f"no triangle of the skin lies in the node set {region}")
    result: np.ndarray = load / load.sum()
    return result
