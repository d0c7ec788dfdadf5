"""Run one reference file's robot at full order and compare it row by row.

Writes CASE-NAME.json with our rows and the differences, and a checkpoint beside it each second of
the run: the same command goes on from there, and a longer --duration-s extends it. NAME tells
variants apart: several of them make the spread that figure.py draws.

Example: python reproduce/reference/compare.py --reference ../shared/reference --case two_leg
--name gmsh --variant.leg file --variant.file leg_gmsh.npz --variant.rim-corner-count 16
"""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # before NumPy: BLAS threads would stall

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

import checkpoint
import numpy as np
import tyro
from reference_case import CASES, STEPS_PER_ROW, TIME_STEP_S, commands_kPa, read_columns
from robot_variant import RobotVariant
from tqdm import trange

from pneumorph.base.artefact import write_json
from pneumorph.base.settings import settings_to_dict
from pneumorph.fem.full_robot import FullRobot
from pneumorph.fem.full_robot_state import FullRobotState

SETTLING_STEPS = 15
STEPS_PER_CHECKPOINT = 100
POSE = ("x", "y", "z", "yaw_deg", "pitch_deg", "roll_deg")


@dataclass(frozen=True)
class CompareOptions:
    """What to run."""

    reference: Path
    """Folder of the reference's CSV files."""
    case: Literal["baseline", "hamiltonian", "two_leg", "zero_action", "six_leg"]
    """Which of them."""
    name: str = "shipped"
    """What to call this variant."""
    duration_s: float = 10.0
    """How much of it to run [s]."""
    out: Path = Path("runs/reference")
    """Folder for the results."""
    variant: RobotVariant = field(default_factory=RobotVariant)
    """Meshes of the robot."""


def row(robot: FullRobot, state: FullRobotState, time_s: float) -> dict[str, float]:
    """The robot as the reference's columns have it, and its contact forces.

    ``grip_k`` is the k-th leg's friction over its normal force (the hub's for the last one):
    the friction coefficient where all of it slides one way.
    """
    rotation, _ = robot.hub.frame(state.hub)
    point = robot.tracked_point_mm(state)
    angles = (
        np.arctan2(rotation[1, 0], rotation[0, 0]),
        -np.arcsin(rotation[2, 0]),
        np.arctan2(rotation[2, 1], rotation[2, 2]),
    )
    values = {"t": time_s, **dict(zip(POSE, (*point, *np.degrees(angles)), strict=True))}
    ends = np.cumsum([leg.contact_count for leg in robot.legs])
    for number, impulses in enumerate(np.split(state.impulses, ends)):
        normal, *tangent = impulses.sum(axis=0)
        values[f"normal_{number}_mN"] = normal / TIME_STEP_S
        values[f"grip_{number}"] = float(np.hypot(*tangent)) / max(normal, 1e-12)
    values["contacts"] = float(np.count_nonzero(state.impulses[:, 0] > 0.0))
    return {name: float(value) for name, value in values.items()}


def differences(rows: list[dict[str, float]], columns: dict[str, np.ndarray]) -> dict[str, Any]:
    """How far our rows are from the reference's at the same times."""
    count = min(len(rows), len(columns["t"]))
    ours = {name: np.array([each[name] for each in rows[:count]]) for name in POSE}
    path = np.stack([ours[name] - columns[name][:count] for name in ("x", "y", "z")], axis=1)
    distance = np.linalg.norm(path, axis=1)
    beyond = np.flatnonzero(distance > 1.0)
    return {
        "compared_s": float(columns["t"][count - 1]),
        "settled_mm": float(distance[0]),
        "path_rms_mm": float(np.sqrt(np.mean(distance**2))),
        "path_rms_on_floor_mm": float(np.sqrt(np.mean(np.sum(path[:, :2] ** 2, axis=1)))),
        "largest_mm": float(distance.max()),
        "first_beyond_1_mm_s": float(columns["t"][beyond[0]]) if len(beyond) else None,
        "forward_cm": float(ours["x"][-1] - ours["x"][0]) / 10.0,
        "reference_forward_cm": float(columns["x"][count - 1] - columns["x"][0]) / 10.0,
        "angles_rms_deg": {
            name: float(np.sqrt(np.mean((ours[name] - columns[name][:count]) ** 2)))
            for name in POSE[3:]
        },
    }


def compare(options: CompareOptions) -> dict[str, Any]:
    """Run the case as far as it is not there yet, save it and return what was saved."""
    case = CASES[options.case]
    columns = read_columns(options.reference / case.file)
    robot = options.variant.robot(case)
    duration_s = min(options.duration_s, float(columns["t"][-1]))
    steps = STEPS_PER_ROW * round(duration_s / TIME_STEP_S / STEPS_PER_ROW)
    commands = commands_kPa(case, columns, steps)
    stem = options.out / f"{options.case}-{options.name}"
    variant = settings_to_dict(options.variant)
    if stem.with_suffix(".npz").exists():
        state, there = checkpoint.load(stem.with_suffix(".npz"), robot)
        rows = there["rows"]
        if there["variant"] != variant:
            raise ValueError(f"{stem}.npz is of another variant; give this one another --name")
    else:
        state = robot.settled_state(SETTLING_STEPS)
        rows = [row(robot, state, 0.0)]
    result = {
        "case": options.case,
        "name": options.name,
        "variant": variant,
        "differences": differences(rows, columns),
        "rows": rows,
    }
    for number in trange(STEPS_PER_ROW * (len(rows) - 1), steps, unit="step"):
        state = robot.step(state, commands[number])
        if (number + 1) % STEPS_PER_ROW == 0:
            rows.append(row(robot, state, (number + 1) * TIME_STEP_S))
        if (number + 1) % STEPS_PER_CHECKPOINT == 0 or number + 1 == steps:
            result["differences"] = differences(rows, columns)
            write_json(stem.with_suffix(".json"), result)
            checkpoint.save(stem.with_suffix(".npz"), state, {"variant": variant, "rows": rows})
    return result


def main(options: CompareOptions) -> None:
    """Run, and print the differences."""
    for name, value in compare(options)["differences"].items():
        print(f"{name}: {value}")


if __name__ == "__main__":
    main(tyro.cli(CompareOptions, description=__doc__))
