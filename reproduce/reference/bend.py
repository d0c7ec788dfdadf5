"""Bend of a single leg as the reference measured it: 3 s at each pressure, no floor, no gravity.

The inner end face is held. Above 200 kPa the leg still creeps after 3 s, so an equilibrium is not
what the reference has there: the same 3 s are made. Up to --static-below-kPa the leg has come to
rest, and equilibria save the time.

Example: python reproduce/reference/bend.py --reference ../shared/reference
"""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # before NumPy: BLAS threads would stall

from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
import tyro
from reference_case import PUBLISHED, TIME_STEP_S, read_columns
from robot_variant import RobotVariant
from tqdm import trange

from pneumorph.base.artefact import write_json
from pneumorph.base.settings import settings_to_dict
from pneumorph.fem.bend import end_face_bend_deg
from pneumorph.fem.body_equations import linearly_implicit_equations
from pneumorph.fem.frontal_cholesky import FrontalCholesky, FrontPattern
from pneumorph.fem.part_model import PartModel
from pneumorph.fem.static import static_equilibrium

HELD_S = 3.0


@dataclass(frozen=True)
class BendOptions:
    """What to run."""

    reference: Path
    """Folder of the reference's CSV files."""
    name: str = "shipped"
    """What to call this variant."""
    largest_kPa: float = 340.0
    """Highest simulated pressure [kPa]."""
    static_below_kPa: float = 160.0
    """Up to this pressure the 3 s are replaced by the equilibrium [kPa]."""
    out: Path = Path("runs/reference")
    """Folder for the results."""
    variant: RobotVariant = field(default_factory=RobotVariant)
    """Mesh of the leg."""


def hold(part: PartModel, x: np.ndarray, v: np.ndarray, pressure_kPa: float) -> None:
    """Advance positions [mm] and velocities [mm/s], both (node, 3), in place by 3 s."""
    physics = replace(PUBLISHED.physics, gravity_mm_per_s2=0.0)
    held = part.mesh.node_set("inner_end_face")
    pattern = FrontPattern(part.assembly, held)
    for _ in trange(round(HELD_S / TIME_STEP_S), unit="step", desc=f"{pressure_kPa:g} kPa"):
        data, right = linearly_implicit_equations(part, x, v, pressure_kPa, physics)
        velocity = np.zeros(x.size)
        velocity[pattern.unknowns] = FrontalCholesky(pattern, data).solve(
            right[pattern.unknowns, None]
        )[:, 0]
        v[:] = velocity.reshape(-1, 3)
        x += TIME_STEP_S * v


def bend(options: BendOptions) -> dict[str, Any]:
    """Bend at each of the reference's pressures beside the reference's."""
    columns = read_columns(options.reference / "leg_bend_full.csv")
    part = options.variant.leg_part()
    held = part.mesh.node_set("inner_end_face")
    x, reached = part.rest_nodes.copy(), 0.0
    v = np.zeros_like(x)
    rows = []
    for pressure, theirs in zip(columns["p_sim_kPa"], columns["end_face_bend_deg"], strict=True):
        if not 0.0 < pressure <= options.largest_kPa:
            continue
        if pressure <= options.static_below_kPa:
            found = static_equilibrium(
                part, pressure, held, start=x, start_pressure_kPa=reached, rotation="edge"
            )
            if not found.converged:
                raise RuntimeError(f"no equilibrium at {pressure:g} kPa")
            x = found.positions
        else:
            hold(part, x, v, pressure)
        reached = pressure
        ours = end_face_bend_deg(part.mesh, x)
        rows.append({"kPa": pressure, "ours_deg": ours, "reference_deg": theirs})
        rows[-1]["difference_percent"] = 100.0 * (ours / theirs - 1.0)
        print({name: round(value, 3) for name, value in rows[-1].items()}, flush=True)
    return {"name": options.name, "variant": settings_to_dict(options.variant), "rows": rows}


def main(options: BendOptions) -> None:
    """Run unless it is there, and save."""
    path = options.out / f"bend-{options.name}.json"
    if path.exists():
        print(f"{path} is there already")
        return
    write_json(path, bend(options))


if __name__ == "__main__":
    main(tyro.cli(BendOptions, description=__doc__))
