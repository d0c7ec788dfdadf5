"""What the mesh of a leg does to how far robots walk: reduced legs of three meshes, twelve gaits.

    python reproduce/measured_bend/distances.py --out runs/mesh_distances

All legs are reduced alike, from states of rest alone, and walk the periodic gaits of random
designs that `pneumorph compare` has, 20 s in the nominal world of the measured physics. Resumable;
writes distances.json.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import tyro

from pneumorph.base.artefact import write_json
from pneumorph.base.executor import ExecutorSettings
from pneumorph.catalogue.leg_kinds import leg_kind
from pneumorph.catalogue.leg_module import module_of_leg
from pneumorph.catalogue.paper_robot import paper_robot
from pneumorph.gait.walk import walk
from pneumorph.geometry.face_tie import tied_over_face
from pneumorph.geometry.netgen_mesher import MesherSettings
from pneumorph.geometry.pneunet import PneuNetShape, mesh_pneunet
from pneumorph.geometry.quadratic import quadratic_mesh
from pneumorph.reduction.walk_snapshots import WalkSnapshotSettings
from pneumorph.study.heldout import periodic_animations
from pneumorph.study.reduce_settings import ReduceSettings
from pneumorph.study.reduction import PART_FILE, Reduction, reduce
from pneumorph.study.reduction_options import measured
from pneumorph.study.study_once import study_folder, study_once

DURATION_S = 20.0


def reduced_leg(size_mm: float, out: Path, processes: int) -> Path:
    """File of the measured leg of a mesh, reduced as the leg that ships but for its walks."""
    preset, kind = measured(), leg_kind("measured")
    made = mesh_pneunet(PneuNetShape(), MesherSettings(size_mm=size_mm, grading=0.9))
    mesh = tied_over_face(quadratic_mesh(made))
    mesh.save(out / "mesh.npz")
    leg = module_of_leg("measured", mesh=mesh, masses=preset.masses)
    robot = paper_robot(
        leg, kind.physics, preset.masses, hub_model=preset.hub, full_order=kind.full_order
    )
    snapshots = replace(
        preset.snapshots,
        walk=WalkSnapshotSettings(leg_counts=()),
        executor=ExecutorSettings(process_count=processes),
    )
    settings = ReduceSettings(snapshots, reduction=preset.reduction)
    folder = study_folder(out, "reduce")
    asked = {"size_mm": size_mm, "reduction": settings.reduction}
    study_once(folder, Reduction, asked, lambda: reduce(robot, folder, settings))
    return out / PART_FILE


def main(
    out: Path = Path("runs/mesh_distances"),
    sizes_mm: tuple[float, ...] = (6.0, 4.0, 3.0),
    processes: int = 1,
) -> None:
    """Reduce the legs, walk, and compare.

    Args:
        out: Folder of the legs and of distances.json.
        sizes_mm: Largest edges of the meshes, coarser ones first [mm].
        processes: How many snapshots are computed at the same time.
    """
    walks = periodic_animations(12, DURATION_S)
    found = {}
    for size in sizes_mm:
        part = reduced_leg(size, out / f"{size:g}", processes)
        spec = paper_robot(module_of_leg("measured", part), leg_kind("measured").physics)
        walked = walk(
            spec.simulator([each.design for each in walks]),
            [each.gait for each in walks],
            duration_s=DURATION_S,
            time_step_s=spec.physics.time_step_s,
        )
        found[f"{size:g}"] = walked.distance_cm
    content = {
        "designs": [str(each.design) for each in walks],
        "distance_cm": {size: far.tolist() for size, far in found.items()},
        "mean_distance_cm": {size: float(np.abs(far).mean()) for size, far in found.items()},
        "apart": {
            f"{coarse}, {fine}": _apart(found[coarse], found[fine])
            for coarse, fine in pairwise(found)
        },
    }
    print(write_json(out / "distances.json", content), content)


def _apart(coarse: np.ndarray, fine: np.ndarray) -> dict[str, float]:
    """How far the distances of two meshes are apart [cm]."""
    apart = np.abs(coarse - fine)
    return {
        "mean_cm": float(apart.mean()),
        "median_cm": float(np.median(apart)),
        "most_cm": float(apart.max()),
    }


if __name__ == "__main__":
    tyro.cli(main, description=__doc__)
