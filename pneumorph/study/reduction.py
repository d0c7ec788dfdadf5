"""A part reduced once, for every robot it will be mounted on."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from pneumorph.base.run_folder import RunFolder
from pneumorph.catalogue.robot_spec import RobotSpec
from pneumorph.fem.soft_hub import SoftHub
from pneumorph.geometry.mirror_image import mirror_notes
from pneumorph.physics.air import Air
from pneumorph.physics.physics import Physics
from pneumorph.physics.pressure import PressureMap
from pneumorph.physics.start_pose import StartPose
from pneumorph.reduction.collect import (
    SnapshotSettings,
    collect_snapshots,
    short_bend_notes,
    sound_files,
)
from pneumorph.reduction.mount_stiffness import leg_mount_stiffness
from pneumorph.reduction.part_summary import PartSummary
from pneumorph.reduction.reduce import USUAL_REPORT_KPA, check_settings, reduce_part
from pneumorph.reduction.reduced_part import CAVITY_CENTRES
from pneumorph.reduction.reduction_report import ReductionReport
from pneumorph.reduction.snapshot_files import SnapshotFiles
from pneumorph.reduction.walk_snapshots import WalkPhysics
from pneumorph.robot.scaled_part import factors_reduced_in
from pneumorph.study.gait_walks import GaitWalks, collect_gait_walks, read_design_gaits
from pneumorph.study.reduce_settings import ReduceSettings, shipped_settings
from pneumorph.study.reduction_walkers import check_walkers_apart, lowest_mm, on_lower_floor

PART_FILE = "leg.npz"
DOUBTFUL_COMPLIANCE_PERCENT = 30.0
"""From such an error of the tip's compliance on it is told: legs that ship are 5 to 25 % off."""
DOUBTFUL_CURVE_PERCENT = 10.0
"""From such an error of the free bend or the blocked force on it is told: legs that ship are up to
6 % off."""


@dataclass(frozen=True)
class Reduction(ReductionReport):
    """A reduced part in its file, with its size and measured errors."""

    part: str
    part_bytes: int
    leg: PartSummary
    snapshot_wall_s: float
    """Of all snapshots, those of earlier runs included."""
    snapshot_processor_s: float
    snapshot_files_without_time: int
    walked_gait_count: int
    wall_s: float
    notes: tuple[str, ...] = ()
    """What to say of it, such as snapshots that end below the pressure that was asked for."""


def reduce(
    robot: RobotSpec,
    folder: RunFolder | Path | str,
    settings: ReduceSettings | None = None,
    metadata: Mapping[str, Any] | None = None,
    *,
    further: Sequence[Path] = (),
    snapshot_folder: Path | None = None,
) -> Reduction:
    """Reduce the module of a robot, save it, and return its size and errors.

    Snapshots are kept in the folder: the same call goes on where it stopped.

    Args:
        robot: Its module, given as finite elements, is what is reduced; hub, sites and physics say
            how it is carried while it walks.
        folder: Receives ``leg.npz`` and ``snapshots/``.
        settings: Snapshots, modes and elements; None for what made the leg of its physics that
            ships.
        metadata: What else the part's file shall say.
        further: Files of snapshots that are there already, such as those of a certificate's walks.
        snapshot_folder: Where snapshots are kept; None for ``snapshots`` in the folder.

    Raises:
        ValueError: Robots were to walk, and none came to its end; the settings ask for what the
            part has not.
    """
    start = time.monotonic()
    folder = folder if isinstance(folder, RunFolder) else RunFolder(Path(folder), "reduce")
    part_model, hub = robot.module.full, robot.hub.full(robot.hub_model)
    relaxes = part_model.branches is not None
    settings = settings or shipped_settings("measured" if relaxes else "published")
    gaits = read_design_gaits(settings.walked.gaits)
    poses = [site.pose_of(robot.module) for site in robot.sites]
    check_settings(part_model, settings.reduction, on_soft_mount=isinstance(hub, SoftHub))
    check_walkers_apart(part_model.mesh, poses, settings.snapshots.walk)
    unlike = mirror_notes(part_model.mesh)
    for note in unlike:
        folder.progress.say(note)
    lowest = lowest_mm(part_model.mesh, hub, poses)
    protocol = on_lower_floor(_protocol(robot.physics, settings.snapshots), lowest)
    robot = replace(robot, physics=on_lower_floor(robot.physics, lowest))
    folder.progress.stage("collecting snapshots of the full model")
    mount = None
    if isinstance(hub, SoftHub):
        mount = leg_mount_stiffness(part_model, hub.part, poses)
    snapshot_folder = snapshot_folder or (folder / "snapshots/bend.npz").parent
    collected = collect_snapshots(
        part_model,
        hub,
        poses,
        settings.snapshots,
        snapshot_folder,
        folder.progress,
        folder.progress.say,
        WalkPhysics(protocol, robot.full_order),
    )
    walks = collect_gait_walks(
        GaitWalks(robot, settings.walked),
        gaits,
        snapshot_folder,
        settings.snapshots.executor,
        folder.progress,
        folder.progress.say,
    )
    walks = [*walks, *further]
    sound, told = sound_files(collected)
    for note in told:
        folder.progress.say(note)
    snapshots = SnapshotFiles([*sound, *walks])
    if not (walks or any(path.stem.startswith("walk") for path in sound)):
        if settings.snapshots.walk.robot_count(len(poses)):
            raise ValueError(
                "none of the robots that walk for snapshots came to its end, expected at least "
                "one: they are driven harder than the leg bears, or its elements turn inside out; "
                "ask for a lower largest pressure, or for a reduction without such walks "
                "(snapshots.walk.leg_counts empty)"
            )
        folder.progress.say("no robot walks: the part is reduced from equilibria alone")
    folder.progress.stage("choosing modes and elements")
    part, report = reduce_part(
        part_model,
        snapshots,
        settings.reduction,
        folder.progress,
        report_pressure_kPa=max(USUAL_REPORT_KPA, settings.snapshots.static.bend_pressure_kPa),
        mount_stiffness=mount,
    )
    part.metadata.update(metadata or {})
    short = short_bend_notes(snapshots, settings.snapshots) if part_model.cavities else []
    path = part.save(folder / PART_FILE)
    seconds = snapshots.metadata["seconds"]
    return Reduction(
        **vars(report),
        part=str(path),
        part_bytes=path.stat().st_size,
        leg=part.describe(str(path)),
        snapshot_wall_s=seconds["wall"],
        snapshot_processor_s=seconds["processor"],
        snapshot_files_without_time=seconds["files_without"],
        walked_gait_count=len(walks),
        wall_s=time.monotonic() - start,
        notes=(*short, *told, *doubts(report, settings), *unlike),
    )


def said_of_further(robot: RobotSpec) -> dict[str, Any]:
    """What the file of a further reduction of a robot's module, as it is now, shall say: what the
    leg was made of before it was calibrated or resized, and by which factors it was. Who reads the
    file calibrates and resizes it as is asked for then, once."""
    full, own = robot.module.full, robot.module.reduced
    known, factors = own.metadata, factors_reduced_in(own)
    size = factors.get("size_factor", 1.0)
    said = {str(name): known[name] for name in ("materials", "masses") if name in known}
    if "materials" in said:
        said["materials"] = {**said["materials"], "mass_kg": full.mass_kg / size**3}
    if size != 1.0:
        said[CAVITY_CENTRES] = (full.cavity_centres_mm / size).tolist()
    return {**said, **factors}


def doubts(report: ReductionReport, settings: ReduceSettings) -> list[str]:
    """What to tell of a reduction that a robot should not be trusted with."""
    told = []
    if not report.sampling_converged:
        ecsw = settings.reduction.ecsw
        told.append(
            f"the sampled points stop at {report.sampling_residual:.2g}, expected "
            f"{ecsw.hyperreduction_tolerance:g} or less: allow more of them "
            f"(reduction.ecsw.element_limit, {ecsw.element_limit})"
        )
    for what, limit, error in (
        ("bends freely", "static.bend_count", report.bend_error_percent),
        ("pushes with its tip held", "blocked.count", report.blocked_error_percent),
    ):
        if error is None or error <= DOUBTFUL_CURVE_PERCENT:
            continue
        found = (
            f"{what} by up to {error:.0f} % otherwise than the finite elements"
            if np.isfinite(error)
            else f"finds no equilibrium where it {what} at some of the pressures"
        )
        told.append(
            f"the reduced leg {found}: it lacks modes (reduction.mode_limit), sampled points "
            f"(reduction.ecsw.element_limit) or snapshots (snapshots.{limit})"
        )
    compliance = report.compliance_error_percent
    if (
        compliance is not None
        and np.isfinite(compliance)
        and compliance > DOUBTFUL_COMPLIANCE_PERCENT
    ):
        told.append(
            f"the reduced tip gives way to small forces by {compliance:.0f} % otherwise than that "
            "of the finite elements: it lacks modes (reduction.mode_limit) or snapshots of loads "
            "(snapshots.static.load_count)"
        )
    if report.heldout_node_error_mm is None:
        told.append(
            "no snapshot was held out, so errors are of what it was made from alone: collect more "
            "of loads and walks"
        )
    return told


def _protocol(physics: Physics, settings: SnapshotSettings) -> Physics:
    """A robot's physics with what is the protocol's: regulators, start and the friction of loads.
    A leg for any floor is pushed sideways as hard by walks as it is by loads."""
    return replace(
        physics,
        pressure_map=PressureMap(),
        air=Air(),
        friction=settings.static.friction,
        friction_by_surface=(),
        start=StartPose(),
    )
