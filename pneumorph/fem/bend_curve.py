"""How far a held leg bends at rising pressure, and what the pressure does meanwhile."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from pneumorph.fem.bend import end_face_bend_deg
from pneumorph.fem.part_model import PartModel
from pneumorph.fem.rotation import Rotation
from pneumorph.fem.static import StaticSettings, static_equilibrium


@dataclass(frozen=True)
class BendCurve:
    """Equilibria of a held leg without gravity or floor; all lists run over the pressures."""

    pressure_kPa: list[float]
    """Pressure in the cavity [kPa]; ends early where no equilibrium was found."""
    bend_deg: list[float]
    """Turn of the outer end face [degrees]."""
    cavity_volume_mm3: list[float]
    """Volume of the cavity [mm^3]."""
    pressure_work_mJ: list[float]
    """Work done by the pressure since rest, the integral of p dV by the trapezoidal rule [mJ]."""
    converged: bool
    """Whether the last pressure asked for was reached."""


def bend_curve(
    part: PartModel,
    pressures_kPa: Sequence[float],
    *,
    held: str = "inner_end_face",
    face: str = "outer_end_face",
    rotation: Rotation = "edge",
    settings: StaticSettings | None = None,
    progress: Callable[[int, int, str], None] | None = None,
) -> BendCurve:
    """Raise the pressure in a leg and follow its bend.

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
    x, reached = part.rest_nodes, 0.0
    volume, work = part.cavity_volume(x), 0.0
    found: list[tuple[float, float, float, float]] = []
    for pressure in pressures:
        result = static_equilibrium(
            part,
            float(pressure),
            nodes,
            start=x,
            start_pressure_kPa=reached,
            rotation=rotation,
            settings=settings,
        )
        if not result.converged:
            break
        x = result.positions
        now = part.cavity_volume(x)
        work += 0.5 * (reached + pressure) * (now - volume)
        volume, reached = now, float(pressure)
        # kPa mm^3 = mN mm = 1e-3 mJ
        found.append((reached, end_face_bend_deg(part.mesh, x, face), volume, 1e-3 * work))
        if progress is not None:
            progress(len(found), len(pressures), "bending the leg")
    done, bends, volumes, works = np.array(found).reshape(-1, 4).T.tolist()
    return BendCurve(done, bends, volumes, works, converged=len(found) == len(pressures))
