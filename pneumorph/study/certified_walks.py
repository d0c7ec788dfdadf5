"""Finite elements beside the reduced robot, in the nominal world and in drawn ones."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from pneumorph.base.artefact import write_json
from pneumorph.base.executor import ExecutorSettings, run_tasks
from pneumorph.base.progress import Progress
from pneumorph.base.result import finite, in_cm
from pneumorph.base.run_folder import RunFolder, made_once
from pneumorph.base.settings import settings_to_dict
from pneumorph.catalogue.robot_spec import RobotSpec
from pneumorph.environment.goal import FORWARD, Goal
from pneumorph.fem.full_robot import FullRobot
from pneumorph.fem.resumable_rollout import resumable_rollout
from pneumorph.fem.time_integration import StepError
from pneumorph.physics.open_loop_gait import ChangedGait, OpenLoopGait, commands_of
from pneumorph.reduction.compressed_snapshots import CompressedSnapshots
from pneumorph.reduction.leg_recorder import LegRecorder
from pneumorph.reduction.snapshots import Snapshots
from pneumorph.simulation.randomisation import World
from pneumorph.simulation.regulator_lag import lagging_commands
from pneumorph.study.analysis import Walker
from pneumorph.study.full_order_identity import certified_walk_identity
from pneumorph.study.full_order_store import rollout_identity

COMPRESSION = 3e-4
"""Relative error, in the norm of the rest stiffness, at which states of walks are kept."""

AGREED_SHARE, AGREED = 0.03, {"cm": 0.3, "degrees": 3.0}
"""Reduced and full agree where they differ by no more than the share of what the full one achieves,
or than that in the goal's unit."""
REPEATED_SHARE, REPEATED = AGREED_SHARE, dict(AGREED)
"""A walk repeats itself where near worlds change it by no more than this, likewise."""


@dataclass(frozen=True)
class KeptWalk:
    """A walk as finite elements, as it is kept."""

    achieved: float | None
    """What of the goal [its unit]; None where it did not come to its end."""
    status: str
    wall_s: float
    """What it took, with processes that were stopped on its way, up to their last checkpoints."""
    states: str | None = None
    """File of its legs' states, from the folder; None where it was not kept: it did not come to its
    end, or legs differ."""
    reason: str | None = None
    """Why it did not come to its end; None where it did, or an earlier version did not keep it."""


@dataclass(frozen=True)
class FullOrderWalk:
    """A walk as finite elements beside that of the reduced robot."""

    world: int | None
    """Number of the drawn world; None for the world as it stands."""
    full: float | None = field(metadata=in_cm("full_cm"))
    """What of the goal it achieved [its unit]; None where it did not come to its end."""
    reduced: float | None = field(metadata=in_cm("reduced_cm"))
    """The same of the reduced robot on its own legs, also in a world that has another reduction of
    them."""
    error: float | None = field(metadata=in_cm("error_cm"))
    """Reduced less full; None where one of them is not known."""
    agrees: bool
    """Whether both models say as good as the same."""
    status: str
    wall_s: float = 0.0
    """What it took, with processes that were stopped on its way, up to their last checkpoints."""
    states: str | None = None
    """File of its legs' states, from the certificate's folder; None where it was not kept."""
    reason: str | None = None
    """Why it did not come to its end; None where it did, or where that was not kept."""
    near_low: float | None = field(default=None, metadata=in_cm("near_low_cm"))
    """The least that the reduced robot achieves in worlds that differ from this one by a thousandth
    (`pneumorph.study.near_worlds`); None in files of earlier versions."""
    near_high: float | None = field(default=None, metadata=in_cm("near_high_cm"))
    """The most that it achieves there."""
    repeats: bool = True
    """Whether that is as good as the same: otherwise the walk is chaotic, and the two models need
    not agree on it."""

    @property
    def parts(self) -> bool:
        """Whether finite elements know better."""
        return not self.agrees and self.full is not None and self.repeats

    @classmethod
    def of(
        cls,
        world: int | None,
        kept: KeptWalk,
        reduced: float | None,
        goal: Goal = FORWARD,
        near: np.ndarray | None = None,
    ) -> FullOrderWalk:
        """The walk in a world of that number beside what the reduced robot achieves there.

        Args:
            world: The number; None for the world as it stands.
            kept: The walk.
            reduced: What the reduced robot achieves there [the goal's unit]; None where it failed.
            goal: What counts.
            near: What it achieves in near worlds, (near world,), NaN where it failed, which counts
                as 0; None where that is not known.
        """
        full, error, agrees = kept.achieved, None, False
        if full is not None and reduced is not None:
            error = reduced - full
            agrees = abs(error) <= max(AGREED[goal.unit], AGREED_SHARE * abs(full))
        low, high, repeats = None, None, True
        if near is not None:
            counted = np.nan_to_num(near)
            low, high = float(counted.min()), float(counted.max())
            here = 0.0 if reduced is None else reduced
            least = max(REPEATED[goal.unit], REPEATED_SHARE * abs(here))
            repeats = max(high - here, here - low) <= least
        return cls(
            world,
            full,
            reduced,
            error,
            agrees,
            kept.status,
            kept.wall_s,
            kept.states,
            kept.reason,
            near_low=low,
            near_high=high,
            repeats=repeats,
        )


@dataclass(frozen=True, eq=False)
class LaggingGait(ChangedGait):
    """A gait as lagging regulators of a world pass it on."""

    commands_kPa: np.ndarray
    """Of each time step [kPa], (step, regulator)."""
    time_step_s: float

    @classmethod
    def of(cls, gait: OpenLoopGait, lag_s: float, time_step_s: float) -> LaggingGait:
        """The gait behind regulators of a time constant [s]."""
        commands = commands_of(gait, time_step_s, gait.regulator_count)
        return cls(gait, lagging_commands(commands, lag_s, time_step_s), time_step_s)

    def pressure_kPa(self, time_s: float) -> np.ndarray:
        """Real pressure commanded at a time [kPa], (regulator,)."""
        step = min(round(time_s / self.time_step_s), len(self.commands_kPa) - 1)
        commanded: np.ndarray = self.commands_kPa[step]
        return commanded


def full_order_identity(spec: RobotSpec, walker: Walker) -> str:
    """Digest of all that decides how a pair walks as finite elements in the world as it stands."""
    step_s, count = spec.physics.time_step_s, spec.physics.regulator_count
    commands = commands_of(walker.gait, step_s, count)
    made_of = certified_walk_identity(spec, walker.design, walker.settling_steps, None)
    return rollout_identity(made_of, commands)


def full_order_walks(
    spec: RobotSpec,
    asked: Sequence[tuple[Walker, World | None]],
    folder: RunFolder,
    executor: ExecutorSettings | None = None,
    goal: Goal = FORWARD,
) -> list[KeptWalk]:
    """Walk pairs as finite elements; walks that were stopped go on, finished ones are read.

    Files are named after all that a walk depends on.

    Args:
        spec: The robot in the world as it stands.
        asked: Design and gait, and a drawn world or None for the one as it stands, of each walk.
        folder: Keeps the walks, in ``full_order``.
        executor: Where walks are made that are not there yet.
        goal: What counts of them.
    """
    walks = [_AskedWalk.of(spec, walker, world, folder, goal) for walker, world in asked]
    missing = [walk for walk in walks if not walk.is_kept]
    executor = executor or ExecutorSettings()
    if len(missing) == 1 and executor.backend == "processes":
        executor = replace(executor, process_count=1)
    in_turn = executor.backend == "processes" and executor.process_count == 1
    tasks = [walk.task() for walk in missing]
    made = run_tasks(_walk, folder.progress if in_turn else None, tasks, executor)
    for done, (number, (walked, states)) in enumerate(made, start=1):
        if states is not None:
            states.save(missing[number].file.with_suffix(".npz"))
        write_json(missing[number].file, finite({"made_of": missing[number].made_of, **walked}))
        missing[number].checkpoint.unlink(missing_ok=True)
        if not in_turn:
            folder.progress(done, len(missing), "finite elements")
    kept = []
    for walk in walks:
        found = made_once(walk.file, dict, made_of=walk.made_of)  # is there now
        whole = found["status"] == "completed" and walk.records
        file = f"full_order/{walk.file.stem}.npz" if whole else None
        achieved = found["distance_cm" if goal.is_forward else "achieved"]
        reason = found.get("reason")
        kept.append(KeptWalk(achieved, found["status"], found["wall_s"], file, reason))
    return kept


@dataclass(frozen=True, eq=False)
class _AskedWalk:
    """A walk of finite elements.

    Attributes:
        file: What is kept of it.
        made_of: What it depends on but for its commands.
        spec: The robot in its world.
        walker: Design, and how long it settles.
        gait: What its regulators follow.
        goal: What counts of it.
    """

    file: Path
    made_of: dict[str, Any]
    spec: RobotSpec
    walker: Walker
    gait: OpenLoopGait
    goal: Goal

    @classmethod
    def of(
        cls, spec: RobotSpec, walker: Walker, world: World | None, folder: RunFolder, goal: Goal
    ) -> _AskedWalk:
        """The walk in a drawn world, or in the one as it stands."""
        own, gait = spec, walker.gait
        if world is not None:
            own = spec.in_world(world)
            gait = LaggingGait.of(gait, world.regulator_lag_s, spec.physics.time_step_s)
        commands = commands_of(gait, spec.physics.time_step_s, spec.physics.regulator_count)
        made_of = certified_walk_identity(spec, walker.design, walker.settling_steps, world)
        if not goal.is_forward:  # kept walks say what was achieved of it, not how they went
            made_of["goal"] = settings_to_dict(goal)
        file = folder / f"full_order/{rollout_identity(made_of, commands)[:16]}.json"
        return cls(file, made_of, own, walker, gait, goal)

    @property
    def is_kept(self) -> bool:
        """Whether it is there; one that ended for a reason that was not kept, when steps were
        halved less often, may come further now."""
        if not self.file.exists():
            return False
        found = made_once(self.file, dict, made_of=self.made_of)
        return found["status"] == "completed" or "reason" in found

    @property
    def checkpoint(self) -> Path:
        """Where its way is kept until it is there."""
        return self.file.with_name(f"{self.file.stem}_on_its_way.npz")

    @property
    def records(self) -> bool:
        """Whether its legs are all alike, so that their states are kept."""
        return len(self.spec.modules) == 1

    def task(self) -> _Task:
        """What a worker needs to make it."""
        robot = self.spec.full(self.walker.design)
        return _Task(robot, self.walker, self.gait, self.checkpoint, self.records, self.goal)


@dataclass(frozen=True, eq=False)
class _Task:
    robot: FullRobot
    walker: Walker
    gait: OpenLoopGait
    checkpoint: Path
    records: bool
    goal: Goal


def _walk(
    progress: Progress | None, task: _Task
) -> tuple[dict[str, Any], Snapshots | CompressedSnapshots | None]:
    """How a walk ended, as it is kept, and its legs' states where it came to its end."""
    start, robot = time.monotonic(), task.robot
    earlier_s: list[float] = []
    step_s, count = robot.physics.time_step_s, robot.physics.regulator_count
    try:
        trajectory = resumable_rollout(
            robot,
            commands_of(task.gait, step_s, count),
            task.checkpoint,
            settling_steps=task.walker.settling_steps,
            record_every=10,
            description={"design": str(task.walker.design)},
            progress=progress,
            highest_kPa=task.gait.maximum_pressure_kPa,
            resumed=earlier_s.append,
            keep_checkpoint=True,
        )
    except StepError as error:  # while it settles; the other walks are of use all the same
        wall_s = time.monotonic() - start
        return _ended("diverged", None, None, task.goal, wall_s, str(error)), None
    states = None
    if task.records and trajectory.status == "completed":
        recorder = LegRecorder(robot, compression=COMPRESSION)
        recorder.follow(trajectory)
        states = recorder.snapshots(f"walk {task.walker.design}", trajectory)
    achieved = task.goal.achieved(trajectory)
    ended = _ended(
        trajectory.status,
        trajectory.distance_cm,
        achieved,
        task.goal,
        sum(earlier_s) + time.monotonic() - start,
        trajectory.metadata.get("reason"),
    )
    return ended, states


def _ended(
    status: str,
    distance_cm: float | None,
    achieved: float | None,
    goal: Goal,
    wall_s: float,
    reason: str | None,
) -> dict[str, Any]:
    """How a walk ended, as it is kept."""
    told: dict[str, Any] = {} if goal.is_forward else {"achieved": achieved}
    if reason is not None:
        told["reason"] = reason
    return {"status": status, "distance_cm": distance_cm, **told, "wall_s": wall_s}
