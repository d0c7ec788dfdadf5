"""Bend and blocked force of the measured leg, mesh by mesh, of quadratic and linear tetrahedra.

    python reproduce/measured_bend/meshes.py --out runs/measured_bend

One file for each mesh, so that a run that was stopped goes on; then meshes.json. The limit is
Richardson's, through the finest three, of an error that falls as the edge length, and as its
square; edges are taken to be as long as the number of nodes to the power of -1/3.
"""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import tyro

from pneumorph.base.artefact import write_json
from pneumorph.base.run_folder import made_once
from pneumorph.catalogue.leg_kinds import MEASURED_MATERIALS
from pneumorph.fem.leg_model import leg_model
from pneumorph.geometry.face_tie import tied_over_face
from pneumorph.geometry.netgen_mesher import MesherSettings
from pneumorph.geometry.pneunet import PneuNetShape, mesh_pneunet
from pneumorph.geometry.quadratic import quadratic_mesh
from pneumorph.reduction.blocked_force import blocked_forces
from pneumorph.reduction.held_bend import held_bends

SIZES_MM = (6.0, 4.0, 3.0, 2.4, 2.0)
"""Largest edges of the quadratic tetrahedra, whose grading is 0.9 [mm]; the first is the mesh that
ships."""
LINEAR_SIZES_MM = (6.0, 4.0, 3.0, 2.0)
"""The same of linear tetrahedra, which lock where the material hardly changes its volume."""
PRESSURE_KPA = 20.0


def leg(size_mm: float, linear: bool = False) -> dict[str, Any]:
    """Bend and blocked force of one mesh."""
    made = mesh_pneunet(PneuNetShape(), MesherSettings(size_mm=size_mm, grading=0.9))
    mesh = tied_over_face(made if linear else quadratic_mesh(made))
    part = leg_model(mesh, MEASURED_MATERIALS)
    ((bend, _),) = held_bends(part, mesh, [PRESSURE_KPA])
    (blocked,) = blocked_forces(part, mesh, [PRESSURE_KPA])
    return {"bend_deg": bend, "blocked_force_mN": blocked.force_mN, "nodes": part.node_count}


def limit(nodes: np.ndarray, values: np.ndarray, order: int) -> float:
    """Where the straight line of the finest three over the edge length to a power ends."""
    return float(np.polyfit(nodes[-3:] ** (-order / 3.0), values[-3:], 1)[1])


def main(out: Path = Path("runs/measured_bend")) -> None:
    """Bend the leg on all meshes.

    Args:
        out: Folder of a file for each mesh and of meshes.json.
    """
    found = []
    for size in SIZES_MM:
        path = out / "meshes" / f"{size:g}.json"
        found.append(made_once(path, partial(leg, size), size_mm=size, pressure_kPa=PRESSURE_KPA))
        print(found[-1], flush=True)
    linear = []
    for size in LINEAR_SIZES_MM:
        path = out / "meshes" / f"linear_{size:g}.json"
        make = partial(leg, size, linear=True)
        linear.append(made_once(path, make, size_mm=size, pressure_kPa=PRESSURE_KPA))
        print(linear[-1], flush=True)
    nodes = np.array([each["nodes"] for each in found], dtype=float)
    content: dict[str, Any] = {"meshes": found, "linear": linear}
    for name in ("bend_deg", "blocked_force_mN"):
        values = np.array([each[name] for each in found])
        limits = [limit(nodes, values, order) for order in (2, 1)]
        short = [float(100.0 * (values[0] / each - 1.0)) for each in limits]
        content[name] = {"limits": limits, "shipped_percent": short}
    write_json(out / "meshes.json", content)
    print({name: content[name] for name in ("bend_deg", "blocked_force_mN")})


if __name__ == "__main__":
    tyro.cli(main, description=__doc__)
