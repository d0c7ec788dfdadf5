"""Reduce a leg: collect snapshots of the full model, choose modes and elements, measure the error.

Snapshots are free bending, equilibria under random contact forces, and legs that carry walking
robots. They are kept in RUN/snapshots: the same command with the same --out goes on where it
stopped, and other tolerances reuse them. Modes live in the frame of the hub (POD), elements are
sampled by ECSW.

Presets: paper (what made the leg that ships) and quick (equilibria alone, few of them).

Writes leg.npz, which every other verb takes as --part.

Example: pneumorph reduce --mesh runs/tall-leg/mesh.npz --out runs/tall-leg-reduced
"""

from __future__ import annotations

import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from pneumorph.command.robots import part_description
from pneumorph.command.run_folder import RunFolder
from pneumorph.command.verb import Verb
from pneumorph.fem.part_model import LegMaterials, leg_model
from pneumorph.fem.rigid_hub import RigidHub
from pneumorph.geometry.mesh import Mesh
from pneumorph.geometry.mounting import RadialMounting
from pneumorph.presets import DISK_MASS_KG, disk_rim_points, paper_disk_mesh, paper_leg_mesh
from pneumorph.reduction.collect import SnapshotSettings, collect_snapshots
from pneumorph.reduction.reduce import ReductionSettings, reduce_part
from pneumorph.reduction.static_snapshots import StaticSnapshotSettings
from pneumorph.reduction.walk_snapshots import WalkSnapshotSettings
from pneumorph.settings import settings_to_dict


@dataclass(frozen=True)
class ReduceOptions:
    """The leg, its snapshots, and how to reduce it."""

    mesh: Path | None = None
    """Mesh of the leg, as `pneumorph mesh` writes it; by default the one that ships."""
    materials: LegMaterials = field(default_factory=LegMaterials)
    snapshots: SnapshotSettings = field(default_factory=SnapshotSettings)
    reduction: ReductionSettings = field(default_factory=ReductionSettings)


def reduce(options: ReduceOptions, folder: RunFolder) -> dict[str, Any]:
    """Reduce a leg, save it, and return its size and errors."""
    start = time.monotonic()
    leg = leg_model(
        paper_leg_mesh() if options.mesh is None else Mesh.load(options.mesh), options.materials
    )
    disk = paper_disk_mesh()
    mounting = RadialMounting()
    folder.progress.stage("collecting snapshots of the full model")
    snapshots = collect_snapshots(
        leg,
        RigidHub(disk, DISK_MASS_KG, disk_rim_points(disk)),
        [mounting.pose(location) for location in range(mounting.location_count)],
        options.snapshots,
        (folder / "snapshots/bend.npz").parent,
        folder.progress,
    )
    collected_s = time.monotonic() - start
    folder.progress.stage("choosing modes and elements")
    part, report = reduce_part(leg, snapshots, options.reduction, folder.progress)
    part.metadata["materials"] = settings_to_dict(options.materials)
    path = part.save(folder / "leg.npz")
    numbers = {
        name: value
        for name, value in report.to_dict().items()
        if isinstance(value, int | float | bool)
    }
    return {
        "part": str(path),
        "part_bytes": path.stat().st_size,
        **numbers,
        "leg": part_description(part, str(path)),
        "stage_seconds": report.stage_seconds,
        "snapshot_wall_s": collected_s,
        "wall_s": time.monotonic() - start,
    }


VERB = Verb(
    ReduceOptions,
    reduce,
    {
        "paper": ReduceOptions,
        "quick": lambda: ReduceOptions(
            snapshots=SnapshotSettings(
                static=StaticSnapshotSettings(bend_count=12, load_count=24),
                walk=WalkSnapshotSettings(leg_counts=()),
            )
        ),
    },
)
