"""A rollout of a full-order robot that goes on where it was interrupted."""

from __future__ import annotations

import hashlib
import itertools
import json
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from pneumorph.base.artefact import load_artefact, reading, save_artefact
from pneumorph.base.result import result_from_dict
from pneumorph.fem.full_robot import FullRobot
from pneumorph.fem.full_robot_state import FullRobotState
from pneumorph.fem.part_ingredients import materials_text
from pneumorph.fem.rollout_report import ContactReport, StepReport
from pneumorph.fem.state_file import state_from_arrays, state_to_arrays
from pneumorph.physics.commands import HIGHEST_COMMAND_KPA, check_commands
from pneumorph.trajectory import Trajectory, check_record_every

FORMAT_VERSION = 1
STATE = "state:"
TELL_EVERY_S = 2.0
"""Wall time between steps within a piece that progress is told of [s]; a step may take ten."""


@dataclass(frozen=True)
class _Way:
    """What the way so far must say, for pieces to be joined to it."""

    contact: ContactReport
    steps: StepReport


@dataclass(frozen=True)
class _Header:
    """What a checkpoint must say beside its arrays."""

    identity: str
    done: int
    way: dict[str, Any]
    spent_s: float = 0.0
    """Wall time of this and earlier processes, each up to its last checkpoint."""


def resumable_rollout(
    robot: FullRobot,
    commands_kPa: np.ndarray,
    checkpoint: Path,
    *,
    settling_steps: int = 15,
    record_every: int = 5,
    record_nodes: bool = True,
    description: dict[str, Any] | None = None,
    checkpoint_every_s: float = 60.0,
    progress: Callable[[int, int, str], None] | None = None,
    watch: Callable[[Trajectory], None] | None = None,
    highest_kPa: float = HIGHEST_COMMAND_KPA,
    resumed: Callable[[float], None] | None = None,
    keep_checkpoint: bool = False,
) -> Trajectory:
    """Follow commands from the settled state, saving the way so far.

    The same commands and the same robot go on from the checkpoint; others start anew. It is removed
    at the end, unless it is to be kept until the way is saved.

    Args:
        robot: The robot.
        commands_kPa: Real pressure asked for in every step [kPa], (step, regulator).
        checkpoint: File to save the way so far in.
        settling_steps: Steps at zero pressure before the start.
        record_every: Steps between frames.
        record_nodes: Record every node's position.
        description: What else to note in the trajectory's metadata.
        checkpoint_every_s: Wall time between checkpoints, which are made at frames [s].
        progress: Told the steps made, those to make, and what goes on: after each piece, and where
            pieces take long within them and while the robot settles.
        watch: Told every piece of the way, times since its start; a piece begins with the last
            frame of the one before it.
        highest_kPa: Highest command that is allowed [kPa].
        resumed: Told the wall time that earlier processes spent on the way so far, each up to its
            last checkpoint [s], where there is one.
        keep_checkpoint: Leave the last checkpoint, some steps before the end: whoever saves the way
            removes it then, and a process that is stopped in between goes on from there.

    Raises:
        ValueError: A command is not finite, negative, or too high.
        ArtefactError: The checkpoint is damaged.
        StepError: The robot fails while it settles.
    """
    check_record_every(record_every)
    commands = np.atleast_2d(np.asarray(commands_kPa, dtype=float))
    check_commands(commands, highest_kPa)
    robot.physics.air.check_supply(commands)
    identity = _identity(robot, commands, settling_steps, record_every)
    if not record_nodes:
        identity += " without nodes"
    start = time.monotonic()
    done, state, pieces, spent_s = _loaded(robot, checkpoint, identity, len(commands))
    steps = _ToldSteps(progress)
    if state is None:
        state = robot.settled_state(
            settling_steps, observe=steps.within(range(settling_steps), settling_steps, "settling")
        )
    elif resumed is not None:
        resumed(spent_s)
    if watch is not None and pieces:
        watch(replace(pieces[0], metadata=pieces[0].metadata | (description or {})))
    saved_at, status = time.monotonic(), "completed"
    # Without a command there is the settled frame.
    while (done < len(commands) or not pieces) and status == "completed":
        end = min(done + record_every, len(commands))
        state, piece = robot.rollout(
            state,
            commands[done:end],
            record_every,
            record_nodes,
            observe=steps.within(range(done, end), len(commands), "simulating"),
        )
        pieces.append(piece)
        status = piece.status
        if watch is not None:
            start_s = done * robot.physics.time_step_s
            named = piece.metadata | (description or {})
            watch(replace(piece, time_s=piece.time_s + start_s, metadata=named))
        done = end
        steps.tell(done, len(commands), "simulating")
        if done < len(commands) and time.monotonic() - saved_at >= checkpoint_every_s:
            pieces = [joined(pieces)]
            so_far_s = spent_s + time.monotonic() - start
            _save(checkpoint, identity, done, state, pieces[0], so_far_s)
            saved_at = time.monotonic()
    if not keep_checkpoint:
        checkpoint.unlink(missing_ok=True)
    way = joined(pieces)
    way.metadata.update(description or {})
    return way


class _ToldSteps:
    """Tells how far a rollout is, of single steps now and then.

    Args:
        progress: Told the steps made, those to make, and what goes on; None for nobody.
    """

    def __init__(self, progress: Callable[[int, int, str], None] | None) -> None:
        self._progress = progress
        self._told_at = time.monotonic()

    def tell(self, done: int, total: int, what: str) -> None:
        """Tell of a step."""
        self._told_at = time.monotonic()
        if self._progress is not None:
            self._progress(done, total, what)

    def within(self, steps: range, total: int, what: str) -> Callable[[object], None]:
        """What is to be called after each of some steps, the last of which others tell of."""
        made = itertools.count(steps.start + 1)

        def observe(_: object) -> None:
            number = next(made)
            if number < steps.stop and time.monotonic() - self._told_at >= TELL_EVERY_S:
                self.tell(number, total, what)

        return observe


def _loaded(
    robot: FullRobot, checkpoint: Path, identity: str, step_count: int
) -> tuple[int, FullRobotState | None, list[Trajectory], float]:
    """Steps made, the state after them, the way so far, and the wall time that it took [s], if they
    are of this rollout."""
    if not checkpoint.exists():
        return 0, None, [], 0.0
    arrays, header = load_artefact(checkpoint, "FullRollout", FORMAT_VERSION)
    with reading(checkpoint, "FullRollout"):
        told = result_from_dict(_Header, header)
        if told.identity != identity:
            return 0, None, [], 0.0
        result_from_dict(_Way, told.way)
        if not 0 < told.done < step_count:
            raise ValueError(f"done is {told.done}, expected one of the {step_count} steps")
        kept = {k.removeprefix(STATE): v for k, v in arrays.items() if k.startswith(STATE)}
        recorded: dict[str, Any] = {k: v for k, v in arrays.items() if not k.startswith(STATE)}
        way = Trajectory(**recorded, shape=robot.shape[0], metadata=told.way)
        return told.done, state_from_arrays(robot, kept), [way], told.spent_s


def _save(
    checkpoint: Path,
    identity: str,
    done: int,
    state: FullRobotState,
    way: Trajectory,
    spent_s: float,
) -> None:
    arrays = {STATE + name: value for name, value in state_to_arrays(state).items()}
    header = {"identity": identity, "done": done, "way": way.metadata, "spent_s": spent_s}
    save_artefact(checkpoint, "FullRollout", FORMAT_VERSION, arrays | way.arrays(), header)


def joined(pieces: Sequence[Trajectory]) -> Trajectory:
    """One trajectory of several, each of which starts where the one before it ends.

    Args:
        pieces: The pieces; the last frame of one is the first of the next.
    """
    arrays: dict[str, Any] = {}
    for name, value in pieces[0].arrays().items():
        later = [piece.arrays()[name][1:] for piece in pieces[1:]]
        if name == "time_s":
            starts = np.cumsum([piece.time_s[-1] for piece in pieces])
            later = [each + start for each, start in zip(later, starts, strict=False)]
        arrays[name] = value if name == "skin_triangles" else np.concatenate([value, *later])
    steps = [piece.metadata["steps"] for piece in pieces]
    contact = [piece.metadata["contact"] for piece in pieces]
    share = np.array([each["count"] for each in steps], dtype=float)
    share /= max(share.sum(), 1.0)
    metadata = {
        **pieces[-1].metadata,
        "contact": {
            "floor": contact[0]["floor"],
            "worst_residual_mm_per_s": max(each["worst_residual_mm_per_s"] for each in contact),
            "unconverged_share": float(share @ [each["unconverged_share"] for each in contact]),
            "deepest_penetration_mm": max(each["deepest_penetration_mm"] for each in contact),
        },
        "steps": {
            "count": sum(each["count"] for each in steps),
            "halved": sum(each["halved"] for each in steps),
            "mean_iterations": float(share @ [each["mean_iterations"] for each in steps]),
        },
    }
    last = pieces[-1]
    return Trajectory(**arrays, shape=last.shape, status=last.status, metadata=metadata)


def _identity(
    robot: FullRobot, commands: np.ndarray, settling_steps: int, record_every: int
) -> str:
    """Digest of all that decides a rollout."""
    described: dict[str, Any] = {
        "settings": robot.settings,
        "floor": robot.floor.description,
        "steps": [settling_steps, record_every],
        "hub": type(robot.hub).__name__,
        "legs": [
            [
                leg.part.mesh.digest(),
                leg.regulators[0] if len(leg.regulators) == 1 else leg.regulators,
                *materials_text(leg.part),
            ]
            for leg in robot.legs
        ],
    }  # fmt: skip
    if (unusual := _unusual_hub_friction(robot)) is not None:
        described["hub_friction"] = unusual
    digest = hashlib.sha256(json.dumps(described, sort_keys=True).encode())
    # The floor where a robot may walk, and everything else that is numbers.
    across = np.linspace(-500.0, 500.0, 101)
    below = np.stack(np.meshgrid(across, across, [0.0]), axis=-1).reshape(-1, 3)
    numbers = [commands, robot.tracked_point, robot.floor.gap(below), *robot.hub.identity()]
    for leg in robot.legs:
        numbers += [leg.part.node_mass, leg.pose.rotation, leg.pose.translation]
    for each in numbers:
        digest.update(np.ascontiguousarray(each, dtype=float).tobytes())
    return digest.hexdigest()


def _unusual_hub_friction(robot: FullRobot) -> float | None:
    """Coefficient of the hub's points where it is not that of the surface ``hub``: the settings
    have those of surfaces by name, the meshes tell the legs' surfaces, and checkpoints of earlier
    versions say nothing of the hub's."""
    count = len(robot.hub.contact_points)
    if count == 0:
        return None
    physics = robot.physics
    own = float(physics.surface_friction(robot.contact_surfaces)[-1])
    return own if own != dict(physics.friction_by_surface).get("hub", physics.friction) else None
