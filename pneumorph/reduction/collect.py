"""Collect all snapshots of a part over processes, resuming where an earlier run stopped."""

from __future__ import annotations

import multiprocessing
import os
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from pneumorph.artefact import ArtefactError
from pneumorph.fem.part_model import PartModel
from pneumorph.fem.rigid_hub import RigidHub
from pneumorph.fem.soft_hub import SoftHub
from pneumorph.geometry.pose import Pose
from pneumorph.reduction.snapshots import Snapshots
from pneumorph.reduction.static_snapshots import (
    StaticSnapshotSettings,
    bend_snapshots,
    load_snapshots,
)
from pneumorph.reduction.walk_snapshots import WalkSnapshotSettings, walk_snapshots
from pneumorph.settings import settings_to_dict

Progress = Callable[[int, int, str], None]

# Loads of one task: small enough to resume and to share out, large enough to be worth a file.
_LOADS_PER_TASK = 12


@dataclass(frozen=True)
class SnapshotSettings:
    """Which states of the full-order model a reduction learns from."""

    static: StaticSnapshotSettings = field(default_factory=StaticSnapshotSettings)
    """A single part at rest under load."""
    walk: WalkSnapshotSettings = field(default_factory=WalkSnapshotSettings)
    """Parts that carry a robot."""
    process_count: int = 2
    """Processes that compute at the same time."""


@dataclass(frozen=True, eq=False)
class _Problem:
    part: PartModel
    hub: RigidHub | SoftHub
    poses: tuple[Pose, ...]
    settings: SnapshotSettings


def collect_snapshots(
    part: PartModel,
    hub: RigidHub | SoftHub,
    poses: Sequence[Pose],
    settings: SnapshotSettings,
    folder: Path,
    progress: Progress | None = None,
) -> Snapshots:
    """Compute the snapshots the settings ask for.

    Each task writes a file into ``folder``; a file that was made from the same mesh with the same
    settings is not made again.

    Args:
        part: The full-order part.
        hub: Carries the parts of walking robots.
        poses: Places of parts in the robot's frame.
        settings: Protocols and number of processes.
        folder: Where the files go.
        progress: Called with tasks done, tasks in all and a message.
    """
    problem = _Problem(part, hub, tuple(poses), settings)
    load_tasks = -(-settings.static.load_count // _LOADS_PER_TASK)
    walks = [f"walk_{number}" for number in range(len(settings.walk.leg_counts))]
    # The longest first, so that processes end together.
    walks.sort(key=lambda name: -settings.walk.leg_counts[_number(name)])
    names = ["bend", *walks, *(f"load_{number}" for number in range(load_tasks))]
    missing = [name for name in names if _saved(problem, folder, name) is None]

    def report(name: str) -> None:
        if progress:
            progress(len(names) - len(missing), len(names), f"snapshots: {name}")

    if "bend" in missing:  # loads start from these
        report("bend")
        _run(problem, folder, "bend")
        missing.remove("bend")
    if settings.process_count == 1:
        for name in list(missing):
            report(name)
            _run(problem, folder, name)
            missing.remove(name)
    elif missing:
        with _single_threaded_children():
            context = multiprocessing.get_context("spawn")
            with ProcessPoolExecutor(
                settings.process_count, context, initializer=_remember, initargs=(problem, folder)
            ) as pool:
                futures = {pool.submit(_run_remembered, name): name for name in missing}
                report(f"{len(missing)} tasks")
                for future in as_completed(futures):
                    future.result()
                    missing.remove(futures[future])
                    report(f"{futures[future]} done")
    pieces = [_saved(problem, folder, name) for name in sorted(names, key=_canonical)]
    return Snapshots.joined([piece for piece in pieces if piece is not None and len(piece)])


def _canonical(name: str) -> tuple[int, int]:
    # The order of snapshots does not depend on the order of computing.
    kind = name.split("_")[0]
    return ["bend", "load", "walk"].index(kind), _number(name)


def _number(name: str) -> int:
    return int(name.split("_")[1]) if "_" in name else 0


def _task_settings(problem: _Problem, name: str) -> dict[str, Any]:
    settings = problem.settings
    chosen = settings.walk if name.startswith("walk") else settings.static
    return {"task": name, **settings_to_dict(chosen)}


def _saved(problem: _Problem, folder: Path, name: str) -> Snapshots | None:
    path = folder / f"{name}.npz"
    if not path.exists():
        return None
    try:
        snapshots = Snapshots.load(path)
    except ArtefactError:  # an interrupted run's; made again
        return None
    same_mesh = snapshots.metadata.get("mesh_digest") == problem.part.mesh.digest()
    same_settings = snapshots.metadata.get("settings") == _task_settings(problem, name)
    return snapshots if same_mesh and same_settings else None


def _run(problem: _Problem, folder: Path, name: str) -> None:
    part, settings = problem.part, problem.settings
    if name == "bend":
        snapshots = bend_snapshots(part, settings.static)
    elif name.startswith("load"):
        first = _LOADS_PER_TASK * _number(name)
        numbers = np.arange(first, min(first + _LOADS_PER_TASK, settings.static.load_count))
        bend = _saved(problem, folder, "bend")
        snapshots = load_snapshots(part, settings.static, numbers.tolist(), bend)
    else:
        snapshots = walk_snapshots(part, problem.hub, problem.poses, settings.walk, _number(name))
    snapshots.metadata["settings"] = _task_settings(problem, name)
    snapshots.save(folder / f"{name}.npz")


_remembered: tuple[_Problem, Path] | None = None


def _remember(problem: _Problem, folder: Path) -> None:
    global _remembered
    _remembered = (problem, folder)


def _run_remembered(name: str) -> None:
    if _remembered is None:
        raise RuntimeError("the process was started without a problem to work on")
    _run(*_remembered, name)


@contextmanager
def _single_threaded_children() -> Iterator[None]:
    # Two BLAS threads in each of two processes stall each other on shared cores.
    names = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS")
    before = {name: os.environ.get(name) for name in names}
    os.environ.update(dict.fromkeys(names, "1"))
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value
