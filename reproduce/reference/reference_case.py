"""The reference trajectories that can be compared, and the commands that made them."""

from __future__ import annotations

import csv
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from pneumorph.base.settings import load_settings
from pneumorph.catalogue.robot_options import RobotOptions
from pneumorph.gait.expert_gait import ExpertGait
from pneumorph.physics.open_loop_gait import sample_commands
from pneumorph.physics.physics import Physics
from pneumorph.physics.pressure import PressureMap
from pneumorph.robot.design import Design

PUBLISHED = load_settings(RobotOptions, Path(__file__).parent.parent / "published.toml")
TIME_STEP_S = PUBLISHED.physics.time_step_s
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
    corners: tuple[tuple[int, ...], ...] = ()
    """Regulators at 350 simulated kPa, without rate limit, in each 0.6 s; the file holds no
    pressures, but its heights say at which multiples of 0.6 s which leg rises or falls, and these
    are the sixteen corners of the hypercube, each once."""
    reduced: bool = False
    """The reference's legs were reduced in this file: 40 % too stiff in free bending."""


CASES = {
    "baseline": ReferenceCase(
        "baseline_full_phase110.csv", Design.parse("1.0.0.2.2.0.0.1"), ExpertGait(phase_deg=110.0)
    ),
    "hamiltonian": ReferenceCase(
        "hamiltonian_full.csv",
        Design.parse("1.0.0.2.3.0.0.4"),
        corners=(
            (),
            (),
            (1,),
            (1, 2),
            (1, 2, 3),
            (1, 2, 3, 4),
            (1, 2, 4),
            (1, 4),
            (4,),
            (3, 4),
            (1, 3, 4),
            (1, 3),
            (3,),
            (2, 3),
            (2, 3, 4),
            (2, 4),
            (2,),
        ),
    ),
    "two_leg": ReferenceCase("twoleg_full.csv", Design.parse("1.0.2.0.0.0.0.0")),
    "zero_action": ReferenceCase(
        "baseline_zero_action_reduced.csv", Design.parse("1.0.0.2.2.0.0.1"), reduced=True
    ),
    "six_leg": ReferenceCase(
        "sixleg_square_reduced.csv", Design.parse("1.0.2.2.2.3.0.1"), reduced=True
    ),
}


CORNER_S, CORNER_KPA = 0.6, 350.0


def case_physics(case: ReferenceCase) -> Physics:
    """Published physics; simulated pressures without rate limit where the case has corners."""
    if not case.corners:
        return PUBLISHED.physics
    return replace(
        PUBLISHED.physics,
        regulator_count=4,
        pressure_map=PressureMap(1.0, 0.0),
        pressure_rate_kPa_per_s=1e6,
    )


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
    """Real pressure asked of each regulator in every step [kPa], (step, regulator).

    A row's command is that of the step just done, so a step takes that of the row it leads to.
    """
    if case.gait is not None:
        commands: np.ndarray = sample_commands(case.gait, TIME_STEP_S, steps)
        return commands
    if case.corners:
        held = np.zeros((steps, 4))
        for step in range(steps):
            corner = min(int(step * TIME_STEP_S / CORNER_S + 1e-9), len(case.corners) - 1)
            held[step, [number - 1 for number in case.corners[corner]]] = CORNER_KPA
        return held
    row = np.minimum(np.arange(steps) // STEPS_PER_ROW + 1, len(columns["t"]) - 1)
    return np.stack([columns[f"cmd{number}"][row] for number in (1, 2, 3)], axis=1)
