"""Snapshots of full robots that walk given gaits, such as those that were learned.

A learned robot leans, drags and presses as no robot drawn at random does. A leg that is reduced
once more from such walks follows them closer; it is the one to re-evaluate what was learned with.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Literal

import numpy as np

from pneumorph.artefact import ArtefactError
from pneumorph.command.gait_source import find_gait
from pneumorph.executor import ExecutorSettings, run_tasks
from pneumorph.fem.part_model import PartModel
from pneumorph.gait.expert_gait import ExpertGait
from pneumorph.gait.open_loop_gait import sample_commands
from pneumorph.presets import paper_full_robot
from pneumorph.pressure import PressureMap
from pneumorph.reduction.compressed_snapshots import CompressedSnapshots
from pneumorph.reduction.leg_recorder import record_walk
from pneumorph.reduction.snapshot_files import read_header
from pneumorph.reduction.snapshots import Snapshots
from pneumorph.robot.design import Design
from pneumorph.simulation.simulation_settings import Damping, SimulationSettings

Progress = Callable[[int, int, str], None]


@dataclass(frozen=True)
class GaitWalkSettings:
    """Which gaits are walked, and how their states are kept."""

    gaits: tuple[Path, ...] = ()
    """Gait files that name their designs, or coopt runs (the best pair)."""
    duration_s: float = 12.0
    """Time of each gait that is walked, from its start [s]."""
    record_every: int = 4
    """Steps between snapshots."""
    compression: float = 3e-4
    """As of `WalkSnapshotSettings`."""
    damping: Damping = "published"
    """Damping of the robots."""

    def __post_init__(self) -> None:
        if not self.duration_s > 0.0 or self.record_every < 1:
            raise ValueError(
                "walks of gaits need a positive duration_s and record_every of at least 1, got "
                f"{self.duration_s} and {self.record_every}"
            )


@dataclass(frozen=True, eq=False)
class _Walkers:
    """What every walk is simulated with."""

    leg: PartModel
    hub: Literal["soft", "rigid"]
    simulation: SimulationSettings
    settings: GaitWalkSettings


@dataclass(frozen=True, eq=False)
class _Walk:
    name: str
    design: Design
    commands_kPa: np.ndarray
    """Real, (step, regulator)."""
    settling_steps: int


def collect_gait_walks(
    leg: PartModel,
    hub: Literal["soft", "rigid"],
    pressure_map: PressureMap,
    settings: GaitWalkSettings,
    folder: Path,
    executor: ExecutorSettings | None = None,
    progress: Progress | None = None,
    say: Callable[[str], None] | None = None,
) -> list[Path]:
    """Walk each gait as finite elements and record the legs.

    A walk's file is named after everything that it depends on, so that one which is there is not
    made again.

    Args:
        leg: The full-order leg.
        hub: What carries the legs.
        pressure_map: Of the gaits' real pressures.
        settings: The gaits.
        folder: Where the files go.
        executor: Where they are computed.
        progress: Called with done, total and a message.
        say: Told how long the missing walks take, before they begin.

    Raises:
        FileNotFoundError: No such gait.
        ValueError: A gait file is damaged.
    """
    simulation = SimulationSettings(damping=settings.damping, pressure_map=pressure_map)
    walkers = _Walkers(leg, hub, simulation, settings)
    walks = [_walk(path, walkers) for path in settings.gaits]
    paths = [folder / f"gait_{_digest(walk, walkers)}.npz" for walk in walks]
    missing = [number for number, path in enumerate(paths) if not _is_whole(path)]
    if say and missing:
        say(
            f"{len(missing)} full robots walk {settings.duration_s:g} s of a gait, about five "
            "minutes of a processor each; stop at any time, finished walks are kept"
        )
    made = run_tasks(_record, walkers, [walks[number] for number in missing], executor)
    for done, (number, snapshots) in enumerate(made, 1):
        snapshots.save(paths[missing[number]])
        if progress:
            progress(done, len(missing), "full robots that walk the gaits")
    return paths


def _walk(path: Path, walkers: _Walkers) -> _Walk:
    source = find_gait(path, None, ExpertGait())
    step_s = walkers.simulation.time_step_s
    steps = max(round(min(walkers.settings.duration_s, source.gait.duration_s) / step_s), 1)
    commands = sample_commands(source.gait, step_s, steps)
    return _Walk(f"{source.design} {source.name}", source.design, commands, source.settling_steps)


def _digest(walk: _Walk, walkers: _Walkers) -> str:
    leg, settings = walkers.leg, walkers.settings
    depends_on = {
        "mesh": leg.mesh.digest(),
        "material": asdict(leg.material),
        "membranes": [asdict(membrane) for membrane in leg.membranes],
        "mass_kg": leg.mass_kg,
        "hub": walkers.hub,
        "simulation": asdict(walkers.simulation),
        "record_every": settings.record_every,
        "compression": settings.compression,
        "design": str(walk.design),
        "commands_kPa": walk.commands_kPa.tolist(),
        "settling_steps": walk.settling_steps,
    }
    return hashlib.sha256(json.dumps(depends_on, sort_keys=True).encode()).hexdigest()[:16]


def _is_whole(path: Path) -> bool:
    if not path.exists():
        return False
    try:
        read_header(path)
    except (ArtefactError, json.JSONDecodeError):
        return False
    return True


def _record(walkers: _Walkers, walk: _Walk) -> Snapshots | CompressedSnapshots:
    simulation = replace(walkers.simulation, regulator_count=walk.commands_kPa.shape[1])
    robot = paper_full_robot(walk.design, simulation, hub=walkers.hub, leg=walkers.leg)
    settings = walkers.settings
    return record_walk(
        robot,
        walk.commands_kPa,
        f"gait {walk.name}",
        settling_steps=walk.settling_steps,
        record_every=settings.record_every,
        compression=settings.compression,
    )
