"""A leg of another mesh and another reduction than the one that robots are trained with.

    python reproduce/robust/other_leg.py --out runs/other_leg

Its tetrahedra are smaller, it is seen at rest alone (no robot walks), and more of its elements are
sampled. Resumable; what hidden worlds walk on (`hidden_worlds.py`).
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import tyro

from pneumorph.base.executor import ExecutorSettings
from pneumorph.catalogue.leg_kinds import leg_kind
from pneumorph.catalogue.leg_module import module_of_leg
from pneumorph.catalogue.paper_robot import paper_robot
from pneumorph.geometry.face_tie import tied_over_face
from pneumorph.geometry.netgen_mesher import MesherSettings
from pneumorph.geometry.pneunet import PneuNetShape, mesh_pneunet
from pneumorph.geometry.quadratic import quadratic_mesh
from pneumorph.reduction.walk_snapshots import WalkSnapshotSettings
from pneumorph.study.reduce_settings import ReduceSettings
from pneumorph.study.reduction import PART_FILE, Reduction, reduce
from pneumorph.study.reduction_options import measured
from pneumorph.study.study_once import study_folder, study_once

SIZE_MM = 5.3
"""Largest edge; the mesh that ships has 6 mm."""
MESH_FILE = "mesh.npz"


def main(out: Path = Path("runs/other_leg"), processes: int = 1) -> None:
    """Mesh and reduce it.

    Args:
        out: Receives leg.npz and its mesh.
        processes: How many snapshots are computed at the same time.
    """
    preset, kind = measured(), leg_kind("measured")
    made = mesh_pneunet(PneuNetShape(), MesherSettings(size_mm=SIZE_MM, grading=0.9))
    mesh = tied_over_face(quadratic_mesh(made))
    mesh.save(out / MESH_FILE)
    leg = module_of_leg("measured", mesh=mesh, masses=preset.masses)
    robot = paper_robot(
        leg, kind.physics, preset.masses, hub_model=preset.hub, full_order=kind.full_order
    )
    settings = ReduceSettings(
        replace(
            preset.snapshots,
            walk=WalkSnapshotSettings(leg_counts=()),
            executor=ExecutorSettings(process_count=processes),
        ),
        reduction=replace(
            preset.reduction,
            ecsw=replace(preset.reduction.ecsw, hyperreduction_tolerance=0.004),
        ),
    )
    folder = study_folder(out, "reduce")
    asked = {"size_mm": SIZE_MM, "reduction": settings.reduction}
    found = study_once(folder, Reduction, asked, lambda: reduce(robot, folder, settings))
    print(f"{out / PART_FILE}: {found.leg}")


if __name__ == "__main__":
    tyro.cli(main, description=__doc__)
