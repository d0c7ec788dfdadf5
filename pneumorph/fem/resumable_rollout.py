"""A rollout of a full-order robot that goes on where it was interrupted."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from pneumorph.artefact import load_artefact, save_artefact
from pneumorph.fem.full_robot import FullRobot
from pneumorph.fem.full_robot_state import FullRobotState
from pneumorph.fem.state_file import state_from_arrays, state_to_arrays
from pneumorph.settings import settings_to_dict
from pneumorph.trajectory import Trajectory

FORMAT_VERSION = 1
STATE = "state:"


def resumable_rollout(
    robot: FullRobot,
    commands_kPa: np.ndarray,
    checkpoint: Path,
    *,
    settling_steps: int = 15,
    record_every: int = 5,
    description: dict[str, Any] | None = None,
    checkpoint_every: int = 100,
    progress: Callable[[int, int, str], None] | None = None,
) -> Trajectory:
    """Follow commands from the settled state, saving the way so far; nothing is computed twice.

    The same commands and the same robot go on from the checkpoint; others start anew. It is removed
    at the end.

    Args:
        robot: The robot.
        commands_kPa: Real pressure asked for in every step [kPa], (step, regulator).
        checkpoint: File to save the way so far in.
        settling_steps: Steps at zero pressure before the start.
        record_every: Steps between frames, each with the nodes.
        description: What else to note in the trajectory's metadata.
        checkpoint_every: Steps between checkpoints; rounded up to whole frames.
        progress: Told the steps made, those to make, and what goes on.

    Raises:
        ValueError: A command is negative or not finite.
    """
    commands = np.atleast_2d(np.asarray(commands_kPa, dtype=float))
    if not np.all(np.isfinite(commands)) or np.any(commands < 0.0):
        raise ValueError("commands_kPa must be finite and not negative; a regulator only inflates")
    identity = _identity(robot, commands, settling_steps, record_every)
    done, state, way = 0, None, None
    if checkpoint.exists():
        arrays, header = load_artefact(checkpoint, "FullRollout", FORMAT_VERSION)
        if header["identity"] == identity:
            kept = {k.removeprefix(STATE): v for k, v in arrays.items() if k.startswith(STATE)}
            done, state = header["done"], state_from_arrays(robot, kept)
            recorded: dict[str, Any] = {k: v for k, v in arrays.items() if not k.startswith(STATE)}
            way = Trajectory(**recorded, **header["way"])
    if state is None:
        state = robot.settled_state(settling_steps)
    portion = record_every * -(-checkpoint_every // record_every)
    steps = done

    def count(_: FullRobotState) -> None:
        nonlocal steps
        steps += 1
        if progress is not None:
            progress(steps, len(commands), "simulating")

    while True:
        state, piece = robot.rollout(
            state, commands[done : done + portion], record_every, observe=count
        )
        way = piece if way is None else joined(way, piece)
        done += portion
        if done >= len(commands) or way.status != "completed":
            break
        saved = {STATE + name: value for name, value in state_to_arrays(state).items()}
        header = {"identity": identity, "done": done, "way": {"metadata": way.metadata}}
        save_artefact(checkpoint, "FullRollout", FORMAT_VERSION, saved | way.arrays(), header)
    checkpoint.unlink(missing_ok=True)
    way.metadata.update(description or {})
    return way


def joined(first: Trajectory, second: Trajectory) -> Trajectory:
    """One trajectory of two, the second of which starts where the first ends.

    Args:
        first: The earlier; its last frame is the second's first.
        second: The later.
    """
    kept: dict[str, Any] = first.arrays()
    for name, value in second.arrays().items():
        if name == "skin_triangles":
            continue
        later = value[1:] + (kept["time_s"][-1] if name == "time_s" else 0)
        kept[name] = np.concatenate([kept[name], later])
    one, other = first.metadata, second.metadata
    counts = np.array([one["steps"]["count"], other["steps"]["count"]], dtype=float)

    def mean(group: str, name: str) -> float:
        return float(counts @ [one[group][name], other[group][name]] / max(counts.sum(), 1.0))

    metadata = {
        **other,
        "contact": {
            **other["contact"],
            **{
                name: max(one["contact"][name], other["contact"][name])
                for name in ("worst_residual_mm_per_s", "deepest_penetration_mm")
            },
            "unconverged_share": mean("contact", "unconverged_share"),
        },
        "steps": {
            "count": int(counts.sum()),
            "halved": one["steps"]["halved"] + other["steps"]["halved"],
            "mean_iterations": mean("steps", "mean_iterations"),
        },
    }
    return Trajectory(**kept, status=second.status, metadata=metadata)


def _identity(
    robot: FullRobot, commands: np.ndarray, settling_steps: int, record_every: int
) -> str:
    """Digest of all that decides a rollout."""
    digest = hashlib.sha256(np.ascontiguousarray(commands).tobytes())
    described = {
        "settings": settings_to_dict(robot.settings),
        "floor": robot.floor.description,
        "hub": type(robot.hub).__name__,
        "steps": [settling_steps, record_every],
        "legs": [
            [
                leg.part.mesh.digest(),
                leg.regulator,
                leg.pose.rotation.tolist(),
                leg.pose.translation.tolist(),
                repr(leg.part.material),
                repr(leg.part.membranes),
                leg.part.mass_kg,
            ]
            for leg in robot.legs
        ],
    }
    digest.update(json.dumps(described, sort_keys=True).encode())
    return digest.hexdigest()
