"""Snapshots of full robots that walk given gaits, such as those that were learned.

A learned robot leans, drags and presses as no robot drawn at random does. A leg that is reduced
once more from such walks follows them closer; it is the one to walk what was learned once more.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from pneumorph.base.artefact import ArtefactError
from pneumorph.base.checked import Checked, Count, Positive
from pneumorph.base.executor import ExecutorSettings, run_tasks
from pneumorph.base.progress import ProgressReport
from pneumorph.catalogue.robot_spec import RobotSpec
from pneumorph.fem.full_robot import FullRobot
from pneumorph.gait.gait_file import read_gait
from pneumorph.gait.held_gait import HeldGait
from pneumorph.physics.open_loop_gait import sample_commands
from pneumorph.physics.physics import Damping, Physics
from pneumorph.reduction.compressed_snapshots import CompressedSnapshots
from pneumorph.reduction.leg_recorder import record_walk
from pneumorph.reduction.snapshot_files import read_header
from pneumorph.reduction.snapshots import Snapshots
from pneumorph.reduction.tolerance import ToleranceOrNone
from pneumorph.robot.design import Design
from pneumorph.study.full_order_identity import carried_otherwise, gait_walk_identity


@dataclass(frozen=True)
class GaitWalkSettings(Checked):
    """Which gaits are walked, and how their states are kept."""

    gaits: tuple[Path, ...] = ()
    """Gait files that name their designs, such as RUN/training/gaits/L1.csv. They are walked in the
    physics of --leg."""
    duration_s: Positive = 12.0
    """How much of each gait is walked, from its start [s]."""
    record_every: Count = 4
    """Time steps between snapshots."""
    compression: ToleranceOrNone = 3e-4
    """Relative error, in the norm of the rest stiffness, at which a robot's snapshots are stored as
    combinations of few fields; 0 stores each in single precision."""
    damping: Damping | None = None
    """Another damping of the robots than the physics'; see `pneumorph simulate --help`."""

    def __post_init__(self) -> None:
        super().__post_init__()
        if not self.duration_s >= self.record_every * Physics.time_step_s:
            raise ValueError(
                f"duration_s must be at least the {self.record_every} steps between two snapshots, "
                f"got {self.duration_s} s"
            )


@dataclass(frozen=True, eq=False)
class DesignGait:
    """A gait and the design that walks it."""

    name: str
    design: Design
    gait: HeldGait


def read_design_gaits(paths: Sequence[Path]) -> list[DesignGait]:
    """Read gait files that name their designs.

    Raises:
        FileNotFoundError: No such file.
        ValueError: It is no gait file, names no design, or one that it has no regulators for.
    """
    return [_read(path) for path in paths]


def _read(path: Path) -> DesignGait:
    if path.is_dir():
        raise ValueError(f"{path} is a folder, expected a gait file such as training/gaits/L1.csv")
    gait, comments = read_gait(path)
    if "design" not in comments:
        raise ValueError(f"gait file {path} names no design, expected a line `# design: 1.0.2...`")
    design = Design.parse(comments["design"])
    design.check_regulators(gait.regulator_count)
    return DesignGait(f"{design} {path}", design, gait)


@dataclass(frozen=True, eq=False)
class GaitWalks:
    """Full robots that walk given gaits."""

    spec: RobotSpec
    """Their hub and physics, and as finite elements the leg to be reduced."""
    settings: GaitWalkSettings

    def robot(self, walk: DesignGait) -> FullRobot:
        """The robot of one gait."""
        physics = replace(
            self.spec.physics,
            damping=self.settings.damping or self.spec.physics.damping,
            regulator_count=walk.gait.regulator_count,
        )
        return replace(self.spec, physics=physics).full(walk.design)

    def commands_kPa(self, walk: DesignGait) -> np.ndarray:
        """Real pressures of every step [kPa], (step, regulator)."""
        step_s = self.spec.physics.time_step_s
        length_s = min(self.settings.duration_s, walk.gait.duration_s)
        return sample_commands(walk.gait, step_s, round(length_s / step_s))

    def identity(self, walk: DesignGait) -> dict[str, Any]:
        """What the snapshots of one gait depend on; as a file gives it back."""
        return gait_walk_identity(
            self.spec,
            self.robot(walk),
            walk.design,
            self.commands_kPa(walk),
            record_every=self.settings.record_every,
            compression=self.settings.compression,
            carried=self._carried,
        )

    @cached_property
    def _carried(self) -> dict[str, str]:
        return carried_otherwise(self.spec)


def collect_gait_walks(
    walks: GaitWalks,
    gaits: Sequence[DesignGait],
    folder: Path,
    executor: ExecutorSettings | None = None,
    progress: ProgressReport | None = None,
    say: Callable[[str], None] | None = None,
) -> list[Path]:
    """Walk each gait as finite elements and record the legs.

    A file is named after all that its walk depends on: one that is there is not made again. A walk
    that diverges is left out.

    Args:
        walks: The robots.
        gaits: The gaits; equal ones are walked once.
        folder: Where the files go.
        executor: Where they are computed.
        progress: Called with done, total and a message.
        say: Told what the missing walks cost, before they begin, and which ones diverged.

    Returns:
        The files of the walks that were completed, one for each different walk.
    """
    asked: dict[Path, tuple[DesignGait, dict[str, Any]]] = {}
    for gait in gaits:
        identity = walks.identity(gait)
        digest = hashlib.sha256(json.dumps(identity, sort_keys=True).encode()).hexdigest()
        asked[folder / f"gait_{digest[:16]}.npz"] = gait, identity
    missing = [path for path in asked if _header(path) is None]
    if say and missing:
        say(
            f"{len(missing)} full robots walk {walks.settings.duration_s:g} s of a gait; with the "
            "leg that ships a second takes some twenty of a processor; finished walks are kept"
        )
    if progress and missing:
        progress(0, len(missing), "full robots that walk the gaits")
    made = run_tasks(_record, walks, [asked[path][0] for path in missing], executor)
    for done, (number, snapshots) in enumerate(made, 1):
        path = missing[number]
        snapshots.metadata["identity"] = asked[path][1]
        snapshots.save(path)
        if progress:
            progress(done, len(missing), "full robots that walk the gaits")
    completed = []
    for path, (gait, _) in asked.items():
        details = (_header(path) or {}).get("details", {})
        if details.get("status") == "completed":
            completed.append(path)
        elif say:
            say(f"{gait.name} {details.get('status')} and is left out")
    return completed


def _header(path: Path) -> dict[str, Any] | None:
    """Metadata of a walk's file; None where there is none that can be read."""
    try:
        return read_header(path)[1]
    except (FileNotFoundError, ArtefactError):
        return None


def _record(walks: GaitWalks, walk: DesignGait) -> Snapshots | CompressedSnapshots:
    return record_walk(
        walks.robot(walk),
        walks.commands_kPa(walk),
        f"gait {walk.name}",
        record_every=walks.settings.record_every,
        compression=walks.settings.compression,
    )
