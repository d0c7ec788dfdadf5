"""Reduce a leg: collect snapshots of the full model, choose modes and elements, measure the error.

Snapshots are free bending, equilibria under random contact forces, and legs that carry walking
robots. They are kept in RUN/snapshots: the same command with the same --out goes on where it
stopped, and other tolerances reuse them. Modes live in the frame of the hub (POD), elements are
sampled by ECSW.

Presets: paper (what made the leg that ships), hyperelastic (the silicone's own stiffness), quick
(equilibria alone), published: the paper's protocol and tolerances, all 255 robots through every
corner of their pressures. That is days of one processor; each robot is a task, and
--snapshots.executor shares them out over processes or, with Ray, machines. greedy: equilibria, and
then random robots, simulated in full one after another where the reduction's own error indicator is
worst, until held-out ones are met. learned: equilibria and the robots of --walked.gaits, with more
modes and elements: a leg to walk what was learned once more.

Writes leg.npz, which every other verb takes as --part.

Example: pneumorph reduce --mesh runs/tall-leg/mesh.npz --out runs/tall-leg-reduced
"""

from __future__ import annotations

import time
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any, Literal

import numpy as np

from pneumorph.command.gait_walks import (
    GaitWalks,
    GaitWalkSettings,
    collect_gait_walks,
    read_design_gaits,
)
from pneumorph.command.greedy_candidates import (
    CandidateModels,
    CandidateSettings,
    candidate_indicator,
    candidate_snapshots,
    draw_candidates,
)
from pneumorph.command.robots import part_description
from pneumorph.command.run_folder import RunFolder
from pneumorph.command.verb import Verb
from pneumorph.fem.material import DiskMaterials, LegMaterials
from pneumorph.fem.part_model import PartModel, disk_model
from pneumorph.fem.rigid_hub import RigidHub
from pneumorph.fem.soft_hub import SoftHub
from pneumorph.geometry.mesh import Mesh
from pneumorph.geometry.mounting import RadialMounting
from pneumorph.presets import (
    DISK_MASS_KG,
    HYPERELASTIC_MATERIALS,
    LegName,
    disk_rim_points,
    full_leg,
    paper_disk_mesh,
    pressure_map,
)
from pneumorph.reduction.collect import SnapshotSettings, collect_snapshots
from pneumorph.reduction.ecsw import EcswSettings
from pneumorph.reduction.greedy import (
    GreedyProblem,
    GreedyResult,
    GreedySettings,
    greedy_reduction,
)
from pneumorph.reduction.mount_stiffness import leg_mount_stiffness
from pneumorph.reduction.reduce import ReductionReport, ReductionSettings, reduce_part
from pneumorph.reduction.snapshot_files import SnapshotFiles
from pneumorph.reduction.static_snapshots import StaticSnapshotSettings
from pneumorph.reduction.walk_snapshots import WalkSnapshotSettings
from pneumorph.settings import settings_to_dict


@dataclass(frozen=True)
class ReduceOptions:
    """The leg, its snapshots, and how to reduce it."""

    leg: LegName = "paper"
    """Whose mesh that ships is taken where `mesh` names none, and whose pressure map gaits have."""
    mesh: Path | None = None
    """Mesh of the leg, as `pneumorph mesh` writes it."""
    materials: LegMaterials = field(default_factory=LegMaterials)
    hub: Literal["soft", "rigid"] = "soft"
    """What carries the legs of walking robots: the paper's disk, whose give at a leg's attachment
    becomes a stiffness of the reduced leg's mount, or a rigid one."""
    snapshots: SnapshotSettings = field(default_factory=SnapshotSettings)
    walked: GaitWalkSettings = field(default_factory=GaitWalkSettings)
    """Gaits that full robots walk besides, such as learned ones."""
    reduction: ReductionSettings = field(default_factory=ReductionSettings)
    greedy: GreedySettings = field(default_factory=GreedySettings)
    """Search for snapshots where the reduction is worst; needs the paper's leg places."""
    candidates: CandidateSettings = field(default_factory=CandidateSettings)
    """Motions of that search."""


def reduce(options: ReduceOptions, folder: RunFolder) -> dict[str, Any]:
    """Reduce a leg, save it, and return its size and errors."""
    start = time.monotonic()
    gaits = read_design_gaits(options.walked.gaits)
    mesh = None if options.mesh is None else Mesh.load(options.mesh)
    leg = full_leg(options.leg, mesh, options.materials)
    disk = paper_disk_mesh()
    mounting = RadialMounting()
    folder.progress.stage("collecting snapshots of the full model")
    poses = [mounting.pose(location) for location in range(mounting.location_count)]
    rim = disk_rim_points(disk)
    soft = disk_model(disk, DiskMaterials(mass_kg=DISK_MASS_KG))
    mount = leg_mount_stiffness(leg, soft, poses) if options.hub == "soft" else None
    snapshot_folder = (folder / "snapshots/bend.npz").parent
    snapshots = collect_snapshots(
        leg,
        RigidHub(disk, DISK_MASS_KG, rim) if mount is None else SoftHub(soft, rim),
        poses,
        options.snapshots,
        snapshot_folder,
        folder.progress,
        folder.progress.say,
    )
    walks = collect_gait_walks(
        GaitWalks(leg, options.hub, pressure_map(options.leg), options.walked),
        gaits,
        snapshot_folder,
        options.snapshots.executor,
        folder.progress,
        folder.progress.say,
    )
    snapshots = SnapshotFiles([*snapshots.paths, *walks])
    if not (walks or options.snapshots.walk.robot_count or options.greedy.round_limit):
        folder.progress.say("no robot walks: the leg is reduced from equilibria alone")
    folder.progress.stage("choosing modes and elements")
    search: dict[str, Any] = {}
    if options.greedy.round_limit > 0:
        found = _greedy(options, leg, snapshots, mount, folder)
        part, report, snapshots = found.part, found.report, SnapshotFiles(found.files)
        search = {
            "greedy_converged": found.converged,
            "greedy_rounds": [asdict(each) for each in found.rounds],
        }
    else:
        part, report = reduce_part(
            leg, snapshots, options.reduction, folder.progress, mount_stiffness=mount
        )
    seconds = snapshots.metadata["seconds"]
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
        **search,
        "stage_seconds": report.stage_seconds,
        # Of all snapshots, those of earlier runs included.
        "snapshot_wall_s": seconds["wall"],
        "snapshot_processor_s": seconds["processor"],
        "snapshot_files_without_time": seconds["files_without"],
        "walked_gait_count": len(walks),
        "wall_s": time.monotonic() - start,
    }


def hyperelastic() -> ReduceOptions:
    """The leg that follows `HYPERELASTIC_PRESSURE_MAP`: 90 real kPa are 108 simulated ones."""
    return ReduceOptions(
        leg="hyperelastic",
        materials=HYPERELASTIC_MATERIALS,
        hub="rigid",
        snapshots=SnapshotSettings(
            static=StaticSnapshotSettings(
                bend_pressure_kPa=114.0, load_count=48, load_pressure_kPa=110.0
            ),
            walk=WalkSnapshotSettings(
                leg_counts=(2, 3),
                corner_limit=4,
                amplitude_kPa=110.0,
                pressure_rate_kPa_per_s=187.0,
            ),
        ),
    )


def _greedy(
    options: ReduceOptions,
    leg: PartModel,
    snapshots: SnapshotFiles,
    mount: np.ndarray | None,
    folder: RunFolder,
) -> GreedyResult[ReductionReport]:
    """Add snapshots of random robots until the held-out ones are met."""
    training, heldout = draw_candidates(options.candidates)
    models = CandidateModels(leg, options.candidates, options.hub)
    problem = GreedyProblem(
        models, candidate_indicator, candidate_snapshots, training, heldout, models.identity()
    )
    return greedy_reduction(
        problem,
        lambda files: reduce_part(
            leg, files, options.reduction, folder.progress, mount_stiffness=mount
        ),
        snapshots.paths,
        options.greedy,
        (folder / "greedy/greedy.json").parent,
        options.snapshots.executor,
        folder.progress,
    )


VERB = Verb(
    ReduceOptions,
    reduce,
    {
        "paper": ReduceOptions,
        "hyperelastic": hyperelastic,
        "quick": lambda: ReduceOptions(
            snapshots=SnapshotSettings(
                static=StaticSnapshotSettings(bend_count=12, load_count=24),
                walk=WalkSnapshotSettings(leg_counts=()),
            )
        ),
        "greedy": lambda: ReduceOptions(
            snapshots=SnapshotSettings(walk=WalkSnapshotSettings(leg_counts=())),
            greedy=GreedySettings(round_limit=6),
        ),
        "learned": lambda: ReduceOptions(
            snapshots=SnapshotSettings(walk=WalkSnapshotSettings(leg_counts=())),
            reduction=ReductionSettings(
                mode_tolerance=0.001,
                mode_limit=32,  # as many as the batched simulator takes
                ecsw=EcswSettings(hyperreduction_tolerance=0.002, element_limit=800),
            ),
        ),
        "published": lambda: ReduceOptions(
            snapshots=SnapshotSettings(
                static=StaticSnapshotSettings(load_count=0),
                walk=WalkSnapshotSettings(
                    robots="all", corner_limit=None, hold_s=1.0, compression=3e-4
                ),
            ),
            # Free bending is computed for the report alone.
            reduction=ReductionSettings(
                norm="mass",
                mode_limit=32,  # as many as the batched simulator takes; the paper has 36
                symmetric=False,
                bend_share=0.0,
                load_share=0.0,
                ecsw=EcswSettings(
                    hyperreduction_tolerance=0.001, element_limit=1000, stiffness_state_count=0
                ),
            ),
        ),
    },
)
