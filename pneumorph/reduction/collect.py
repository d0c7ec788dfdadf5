"""Collect all snapshots of a part, resuming where an earlier run stopped.

The work is cut into tasks, each of which makes one file: the free bending, a dozen loads, or the
walk of one robot. Where they run is the executor's choice; the files are written here, so that
workers need no common disk.
"""

from __future__ import annotations

import hashlib
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from pneumorph.base.artefact import ArtefactError
from pneumorph.base.executor import ExecutorSettings, run_tasks
from pneumorph.base.progress import ProgressReport
from pneumorph.base.settings import settings_from_dict, settings_to_dict
from pneumorph.fem.hub_body import HubBody
from pneumorph.fem.part_ingredients import ingredients
from pneumorph.fem.part_model import PartModel
from pneumorph.geometry.pose import Pose
from pneumorph.reduction.blocked_snapshots import BlockedSnapshotSettings, blocked_snapshots
from pneumorph.reduction.compressed_snapshots import CompressedSnapshots
from pneumorph.reduction.snapshot_files import SnapshotFiles, read_header
from pneumorph.reduction.snapshots import BEND, Snapshots, SnapshotSet, details_of
from pneumorph.reduction.static_snapshots import (
    StaticSnapshotSettings,
    bend_snapshots,
    load_snapshots,
)
from pneumorph.reduction.walk_snapshots import (
    WalkPhysics,
    WalkSnapshotSettings,
    leg_step_seconds,
    walk_plan,
    walk_snapshots,
)

# Loads of one task: small enough to resume and to share out, large enough to be worth a file.
_LOADS_PER_TASK = 12
# What an equilibrium costs, in steps of one leg: some twenty Newton steps with a general solver.
_LEG_STEPS_PER_EQUILIBRIUM = 50


@dataclass(frozen=True)
class SnapshotSettings:
    """Which states of the full-order model a reduction learns from."""

    static: StaticSnapshotSettings = field(default_factory=StaticSnapshotSettings)
    """A single leg at rest: free bending, and under loads."""
    blocked: BlockedSnapshotSettings = field(default_factory=BlockedSnapshotSettings)
    """A single leg, inflated while its tip is held down."""
    walk: WalkSnapshotSettings = field(default_factory=WalkSnapshotSettings)
    """The legs of walking robots."""
    executor: ExecutorSettings = field(default_factory=ExecutorSettings)
    """Where the walking robots are simulated."""


@dataclass(frozen=True, eq=False)
class _Problem:
    part: PartModel
    hub: HubBody
    poses: tuple[Pose, ...]
    settings: SnapshotSettings
    acting: WalkPhysics
    bend: Snapshots | None = None
    """Free bending, which loads start from."""


def collect_snapshots(
    part: PartModel,
    hub: HubBody,
    poses: Sequence[Pose],
    settings: SnapshotSettings,
    folder: Path,
    progress: ProgressReport | None = None,
    say: Callable[[str], None] | None = None,
    acting: WalkPhysics | None = None,
) -> SnapshotFiles:
    """Compute the snapshots the settings ask for.

    Each task writes a file into ``folder``; a file that was made from the same part with the same
    settings, and of a walk on the same hub, is not made again.

    Args:
        part: The full-order part.
        hub: Carries the parts of walking robots.
        poses: Places of parts in the robot's frame.
        settings: Protocols, and where they run.
        folder: Where the files go.
        progress: Called with the work done, the work in all and a message.
        say: Told how long the missing tasks will take, before they begin.
        acting: What acts on walking robots; None for the published physics.

    Raises:
        ArtefactError: The settings ask for no snapshots at all.
        ValueError: Robots are to walk that the places do not allow, or with pressures that are
            held for no step.
    """
    problem = _Problem(part, hub, tuple(poses), settings, acting or WalkPhysics())
    names = _task_names(settings, len(poses))
    missing = [name for name in names if not _is_there(problem, folder, name)]
    cost = {name: _leg_steps(problem, name) for name in names}
    total = sum(cost.values())

    def report(message: str) -> None:
        if progress:
            progress(total - sum(cost[name] for name in missing), total, f"snapshots: {message}")

    if "bend" in missing:  # loads start from these
        report("bend")
        bend = _task(problem, "bend")
        _save(problem, folder, "bend", bend)
        missing.remove("bend")
        for note in short_bend_notes(bend, settings):
            if say:
                say(note)
    if any(name.startswith("load") for name in missing):
        problem = replace(problem, bend=Snapshots.load(folder / "bend.npz"))
    if say and any(name.startswith("walk") for name in missing):
        say(_estimate(problem, sum(cost[name] for name in missing), len(missing)))
    # The longest first, so that workers end together.
    tasks = sorted(missing, key=lambda name: -cost[name])
    report(f"{len(missing)} tasks")
    for number, snapshots in run_tasks(_task, problem, tasks, settings.executor):
        _save(problem, folder, tasks[number], snapshots)
        missing.remove(tasks[number])
        report(f"{tasks[number]} done")
    # The order of snapshots does not depend on the order of computing.
    return SnapshotFiles([folder / f"{name}.npz" for name in names])


def short_bend_notes(snapshots: SnapshotSet, settings: SnapshotSettings) -> list[str]:
    """What to say of free bends that end well below what was asked for, of all cavities and of each
    alone.

    Args:
        snapshots: Free bends, perhaps among others.
        settings: What was asked for.
    """
    alone, sources = f"{BEND} of ", np.array(snapshots.sources)
    told = []
    for source in dict.fromkeys(snapshots.sources):
        if source == BEND or source.startswith(alone):
            own = np.isin(snapshots.source, np.flatnonzero(sources == source))
            reached_kPa = float(snapshots.pressure_kPa[own].max(initial=0.0))
            cavity = None if source == BEND else source.removeprefix(alone)
            told.append(short_bend_note(reached_kPa, settings, cavity))
    return [note for note in told if note is not None]


def short_bend_note(
    reached_kPa: float, settings: SnapshotSettings, cavity: str | None = None
) -> str | None:
    """What to say of free bends that end well below what was asked for; None of others.

    Args:
        reached_kPa: The highest pressure at which there is one [kPa].
        settings: What was asked for.
        cavity: What alone is inflated; None for all cavities.
    """
    asked_kPa, count = settings.static.bend_pressure_kPa, settings.static.bend_count
    if reached_kPa >= asked_kPa * (1.0 - 1.5 / count):  # the last may have no equilibrium
        return None
    inflated = "" if cavity is None else f" with {cavity} alone inflated"
    return (
        f"free bends{inflated} were found up to {reached_kPa:.4g} kPa alone, of {asked_kPa:.4g} "
        "asked for: "
        "the leg balloons or buckles beyond, and snapshots there are missing; ask for a lower "
        "largest pressure, or make its walls thicker"
    )


def sound_files(collected: SnapshotFiles) -> tuple[list[Path], list[str]]:
    """Files of snapshots without those of walks that did not come to their end, whose robots were
    in no state that a leg should be reduced from; and what to say of these and of loads without an
    equilibrium.

    Args:
        collected: What `collect_snapshots` found.
    """
    sound, left_out, failed, loads = [], [], 0, 0
    for path in collected.paths:
        arrays, metadata = read_header(path)
        details = [each or {} for each in details_of(metadata)]
        # Walks of the first versions do not say how they ended.
        ended = {str(each.get("status", "completed")) for each in details}
        if ended - {"completed"}:
            left_out.append(f"{', '.join(metadata['sources'])} ({', '.join(sorted(ended))})")
            continue
        sound.append(path)
        without = sum(len(each.get("failed", ())) for each in details)
        if path.stem.startswith("load"):
            failed, loads = failed + without, loads + without + len(arrays["source"])
    told = []
    if left_out:
        told.append(
            f"{len(left_out)} of the robots that walked for snapshots did not come to the end and "
            f"are left out: {'; '.join(left_out)}"
        )
    if failed:
        told.append(
            f"{failed} of {loads} loads had no equilibrium and are missing among the snapshots"
        )
    return sound, told


def _task_names(settings: SnapshotSettings, place_count: int) -> list[str]:
    loads = -(-settings.static.load_count // _LOADS_PER_TASK)
    return [
        "bend",
        *(f"load_{number}" for number in range(loads)),
        *(["blocked"] if settings.blocked.count else []),
        *(f"walk_{number}" for number in range(settings.walk.robot_count(place_count))),
    ]


def _number(name: str) -> int:
    return int(name.split("_")[1])


def _load_numbers(settings: StaticSnapshotSettings, name: str) -> list[int]:
    first = _LOADS_PER_TASK * _number(name)
    return list(range(first, min(first + _LOADS_PER_TASK, settings.load_count)))


def _leg_steps(problem: _Problem, name: str) -> int:
    """Cost of a task, in steps of one leg."""
    settings = problem.settings
    if name == "bend":
        return settings.static.bend_count * _LEG_STEPS_PER_EQUILIBRIUM
    if name == "blocked":
        return settings.blocked.count * _LEG_STEPS_PER_EQUILIBRIUM
    if name.startswith("load"):
        return len(_load_numbers(settings.static, name)) * _LEG_STEPS_PER_EQUILIBRIUM
    plan = walk_plan(settings.walk, _number(name), len(problem.poses))
    step_s = problem.acting.physics.time_step_s
    return plan.step_count(settings.walk, step_s) * len(plan.places)


def _estimate(problem: _Problem, leg_steps: int, task_count: int) -> str:
    settings = problem.settings
    seconds = leg_step_seconds(
        problem.part, problem.hub, problem.poses, settings.walk, problem.acting
    )
    hours = leg_steps * seconds / 3600.0
    shared = settings.executor.at_once()
    return (
        f"{task_count} tasks with {leg_steps} steps of a leg, {1000.0 * seconds:.0f} ms each here: "
        f"{hours:.1f} processor hours, about {hours / shared:.1f} h on {shared} processors; "
        "stop at any time, finished tasks are kept"
    )


def _settings_of(
    settings: SnapshotSettings, name: str
) -> StaticSnapshotSettings | BlockedSnapshotSettings | WalkSnapshotSettings:
    if name == "blocked":
        return settings.blocked
    return settings.walk if name.startswith("walk") else settings.static


def _origin(problem: _Problem, name: str) -> dict[str, Any]:
    """What a task's snapshots depend on."""
    settings, part = problem.settings, problem.part
    walks = name.startswith("walk")
    chosen = _settings_of(settings, name)
    carried = carried_identity(problem.hub, problem.poses) if walks else None
    return {
        "settings": {"task": name, **settings_to_dict(chosen)},
        "part": ingredients(part),
        **({"acting": problem.acting.described(), "carried": carried} if walks else {}),
        **({"rotation": settings.static.rotation} if name == "blocked" else {}),
    }


def carried_identity(hub: HubBody, poses: Sequence[Pose]) -> str:
    """Hash of what carries the legs of walking robots, and where, in hexadecimal.

    Args:
        hub: Carries them.
        poses: Places of legs in the robot's frame.
    """
    content = hashlib.sha256(b"rigid" if hub.rigid else b"soft")
    placed = [array for pose in poses for array in (pose.rotation, pose.translation)]
    for array in (*hub.identity(), *placed):
        content.update(np.ascontiguousarray(array, dtype=float).tobytes())
    return content.hexdigest()


def _is_there(problem: _Problem, folder: Path, name: str) -> bool:
    path = folder / f"{name}.npz"
    if not path.exists():
        return False
    try:
        _, metadata = read_header(path)
        saved = dict(metadata["settings"])
        if saved.pop("task") != name:
            return False
        settings = problem.settings
        wanted = _settings_of(settings, name)
        # A setting that the file does not know had its default's meaning.
        same_settings = settings_from_dict(type(wanted), saved) == wanted
    except (ArtefactError, KeyError, ValueError):  # an interrupted run's or another's; made again
        return False
    origin = _origin(problem, name)
    same_physics = metadata.get("acting", {}) == origin.get("acting", {})
    # What files of earlier versions do not say is taken to be the same.
    same_rest = all(
        metadata.get(each, origin.get(each)) == origin.get(each)
        for each in ("part", "carried", "rotation")
    )
    return (
        same_settings
        and same_physics
        and same_rest
        and metadata.get("mesh_digest") == problem.part.mesh.digest()
    )


def _save(
    problem: _Problem, folder: Path, name: str, snapshots: Snapshots | CompressedSnapshots
) -> None:
    snapshots.metadata.update(_origin(problem, name))
    snapshots.save(folder / f"{name}.npz")


def _task(problem: _Problem, name: str) -> Snapshots | CompressedSnapshots:
    """Compute one task and note how long it took."""
    part, settings = problem.part, problem.settings
    wall, processor = time.perf_counter(), time.process_time()
    snapshots: Snapshots | CompressedSnapshots
    if name == "bend":
        snapshots = bend_snapshots(part, settings.static)
    elif name == "blocked":
        snapshots = blocked_snapshots(part, settings.blocked, settings.static.rotation)
    elif name.startswith("load"):
        numbers = _load_numbers(settings.static, name)
        snapshots = load_snapshots(part, settings.static, numbers, problem.bend)
    else:
        number = _number(name)
        snapshots = walk_snapshots(
            part, problem.hub, problem.poses, settings.walk, number, problem.acting
        )
    snapshots.metadata["seconds"] = {
        "wall": time.perf_counter() - wall,
        "processor": time.process_time() - processor,
    }
    return snapshots
