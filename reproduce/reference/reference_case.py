"""The reference trajectories that can be compared, and the commands that made them."""

from __future__ import annotations

import csv
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from pneumorph.gait.expert_gait import ExpertGait
from pneumorph.gait.open_loop_gait import sample_commands
from pneumorph.robot.design import Design

TIME_STEP_S = 0.01
STEPS_PER_ROW = 5
"""Every reference file has a row each 0.05 s."""


@dataclass(frozen=True)
class ReferenceCase:
    """One file of the reference and the robot that it is of."""

    file: str
    """Name of the CSV file."""
    design: Design
    """Which legs, and on which regulators."""
    gait: ExpertGait | None = None
    """The gait; None where the file's own command columns say it all, changing at rows only."""
    reduced: bool = False
    """The reference's legs were reduced in this file: 40 % too stiff in free bending."""


CASES = {
    "baseline": ReferenceCase(
        "baseline_full_phase110.csv", Design.parse("1.0.0.2.2.0.0.1"), ExpertGait(phase_deg=110.0)
    ),
    "two_leg": ReferenceCase("twoleg_full.csv", Design.parse("1.0.2.0.0.0.0.0")),
    "zero_action": ReferenceCase(
        "baseline_zero_action_reduced.csv", Design.parse("1.0.0.2.2.0.0.1"), reduced=True
    ),
    "six_leg": ReferenceCase(
        "sixleg_square_reduced.csv", Design.parse("1.0.2.2.2.3.0.1"), reduced=True
    ),
}


def read_columns(path: Path) -> dict[str, np.ndarray]:
    """Columns of a CSV file by name, each (row,).

    Raises:
        FileNotFoundError: No such file.
        ValueError: It has no rows.
    """
    with path.open(newline="") as stream:
        rows = list(csv.DictReader(stream))
    if not rows:
        raise ValueError(f"{path} has no rows, expected a header and one row each 0.05 s")
    return {name: np.array([float(row[name]) for row in rows]) for name in rows[0]}


def commands_kPa(case: ReferenceCase, columns: dict[str, np.ndarray], steps: int) -> np.ndarray:
    """Real pressure asked of each regulator in every step [kPa], (step, 3).

    A row's command is that of the step just done, so a step takes that of the row it leads to.
    """
    if case.gait is not None:
        commands: np.ndarray = sample_commands(case.gait, TIME_STEP_S, steps)
        return commands
    row = np.minimum(np.arange(steps) // STEPS_PER_ROW + 1, len(columns["t"]) - 1)
    return np.stack([columns[f"cmd{number}"][row] for number in (1, 2, 3)], axis=1)
