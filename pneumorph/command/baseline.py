"""Walk the expert's gait at every phase shift: the baseline that learning has to beat.

The design is that of the paper, 1.0.0.2.2.0.0.1: two fore legs on regulator 1, two hind legs on
regulator 2. Both follow a sine wave, the hind legs later by the phase. All phases are simulated
side by side.

Writes phase_sweep.npz and baseline_trajectory.npz, the walk of the best phase.

Example: pneumorph baseline --phase-step-deg 20 --out runs/baseline
"""

from __future__ import annotations

import time
from dataclasses import dataclass, field, replace
from typing import Annotated, Any

import tyro

from pneumorph.command.robots import RobotOptions, Workshop
from pneumorph.command.run_folder import RunFolder
from pneumorph.command.verb import Verb
from pneumorph.gait.expert_gait import ExpertGait
from pneumorph.gait.phase_sweep import PhaseSweep, PhaseSweepSettings, sweep_phases
from pneumorph.report.skin import with_skin_only
from pneumorph.robot.design import Design

flat = tyro.conf.arg(name="")

SWEEP_FILE = "phase_sweep.npz"
TRAJECTORY_FILE = "baseline_trajectory.npz"


@dataclass(frozen=True)
class BaselineOptions:
    """Phases to try, and the robots."""

    sweep: Annotated[PhaseSweepSettings, flat] = field(default_factory=PhaseSweepSettings)
    robot: Annotated[RobotOptions, flat] = field(default_factory=RobotOptions)


def baseline(options: BaselineOptions, folder: RunFolder) -> dict[str, Any]:
    """Sweep the phases and return the distance of each."""
    start = time.monotonic()
    workshop = Workshop(options.robot)
    sweep = swept(workshop, options.sweep, folder)
    return {
        **sweep_summary(sweep, options.sweep),
        "damping": options.robot.simulation.damping,
        "calibration": workshop.calibration_description,
        "leg": workshop.leg_description,
        "wall_s": time.monotonic() - start,
    }


def swept(workshop: Workshop, settings: PhaseSweepSettings, folder: RunFolder) -> PhaseSweep:
    """Sweep the phases; save the sweep and the trajectory of its best phase in the folder."""
    folder.progress.stage("walking the expert's gait at every phase")
    sweep = sweep_phases(
        workshop.robot,
        workshop.simulator,
        settings,
        time_step_s=workshop.options.simulation.time_step_s,
        progress=folder.progress,
    )
    sweep.save(folder / SWEEP_FILE)
    gait: ExpertGait = replace(settings.gait, phase_deg=sweep.best_phase_deg)
    trajectory = workshop.recorded(
        Design.parse(settings.design),
        gait,
        settling_steps=settings.settling_step_count,
        description={"gait": f"expert, {gait.phase_deg:g}°"},
    )
    with_skin_only(trajectory).save(folder / TRAJECTORY_FILE)
    return sweep


def sweep_summary(sweep: PhaseSweep, settings: PhaseSweepSettings) -> dict[str, Any]:
    """Return what a summary says of a sweep."""
    return {
        "baseline_design": settings.design,
        "baseline_best_distance_cm": sweep.best_distance_cm,
        "baseline_best_phase_deg": sweep.best_phase_deg,
        "phases_deg": sweep.phase_deg.tolist(),
        "distances_cm": sweep.distance_cm.tolist(),
        "backsliding_cm": sweep.backsliding_cm.tolist(),
    }


VERB = Verb(BaselineOptions, baseline)
