"""The expert's gait at every phase: the baseline that learning has to beat."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace

from pneumorph.base.run_folder import RunFolder
from pneumorph.catalogue.paper_designs import BASELINE_DESIGN
from pneumorph.catalogue.robot_mass import RobotMass
from pneumorph.catalogue.robot_spec import RobotSpec
from pneumorph.catalogue.unseen_pressure import say_unseen_pressure
from pneumorph.environment.goal import FORWARD, Goal
from pneumorph.gait.phase_sweep import PhaseSweep, PhaseSweepSettings, sweep_phases
from pneumorph.physics.calibration import UsedCalibration
from pneumorph.physics.physics import Physics
from pneumorph.reduction.part_summary import PartsSummary
from pneumorph.robot.design import Design
from pneumorph.study.recorded_walk import recorded_walk
from pneumorph.study.toppled_note import walk_notes
from pneumorph.trajectory import Trajectory

SWEEP_FILE = "phase_sweep.npz"
TRAJECTORY_FILE = "baseline_trajectory.npz"
_SAME_PHASE_DEG = 1e-6


@dataclass(frozen=True, kw_only=True)
class BestPhase:
    """What later results say of a baseline; lists have an entry for each phase."""

    baseline_design: str = BASELINE_DESIGN
    """An earlier version, which had no other, did not name it."""
    baseline_best_distance_cm: float
    baseline_best_phase_deg: float
    phases_deg: tuple[float, ...]
    distances_cm: tuple[float, ...]
    """Forward [cm], (phase,); NaN where the simulation failed."""
    backsliding_cm: tuple[float, ...] = ()
    """Mean slide back in a cycle [cm], (phase,); empty in runs of an earlier version."""
    goal: Goal = FORWARD
    """What the phase is tuned for; distances are forward whatever it is."""
    baseline_best_achieved: float | None = None
    """What of it the best phase achieves [its unit]; None in runs of an earlier version."""
    phases_achieved: tuple[float, ...] = ()
    """Of each phase; empty likewise."""
    baseline_range_ratio: float | None = None
    """How far a leg went at any phase, relative to its furthest snapshot; None where that is not
    known."""

    baseline_lean_deg: float | None = None
    """How far the hub leaned at most at the best phase [degrees]; None in runs of an earlier
    version."""

    @property
    def expert_notes(self) -> tuple[str, ...]:
        """What to tell of the expert's robot: that it left its legs' snapshots, or toppled, and
        that phases which were not tried may be better."""
        notes = walk_notes("The expert's robot", self.baseline_range_ratio, self.baseline_lean_deg)
        return (*notes, *phase_notes(self.phases_deg, self.baseline_best_phase_deg))

    @property
    def best_achieved_by_expert(self) -> float:
        """What of the goal the best phase achieves [its unit], in files of any version."""
        known = self.baseline_best_achieved
        return self.baseline_best_distance_cm if known is None else known

    def __post_init__(self) -> None:
        for name in ("distances_cm", "backsliding_cm"):
            count = len(getattr(self, name))
            if count != len(self.phases_deg) and not (name == "backsliding_cm" and count == 0):
                raise ValueError(
                    f"{name} has {count} numbers for the {len(self.phases_deg)} of phases_deg"
                )

    @classmethod
    def of(cls, sweep: PhaseSweep, design: str, goal: Goal, walked: Trajectory) -> BestPhase:
        """That of a sweep with a design, for a goal, and of the walk of its best phase."""
        return cls(
            baseline_design=design,
            baseline_best_distance_cm=sweep.best_distance_cm,
            baseline_best_phase_deg=sweep.best_phase_deg,
            phases_deg=tuple(sweep.phase_deg.tolist()),
            distances_cm=tuple(sweep.distance_cm.tolist()),
            backsliding_cm=tuple(sweep.backsliding_cm.tolist()),
            goal=goal,
            baseline_best_achieved=float(sweep.counted[sweep.best]),
            phases_achieved=tuple(sweep.counted.tolist()),
            baseline_range_ratio=sweep.furthest_ratio,
            baseline_lean_deg=float(walked.lean_deg.max()),
        )


@dataclass(frozen=True, kw_only=True)
class Baseline(BestPhase):
    """The expert's gait at every phase, in one physics."""

    damping: str
    calibration: UsedCalibration
    leg: PartsSummary
    wall_s: float
    physics: Physics | None = None
    """What the robots were simulated in; None in files of earlier versions."""
    mass: RobotMass | None = None
    """What they weigh; None in files of earlier versions."""
    notes: tuple[str, ...] = ()


def baseline(spec: RobotSpec, settings: PhaseSweepSettings, folder: RunFolder) -> Baseline:
    """Walk the expert's gait at every phase; keep the sweep and the walk of its best phase."""
    start = time.monotonic()
    say_unseen_pressure(spec, 2.0 * settings.gait.amplitude_kPa, folder.progress.say)
    best = swept(spec, settings, folder)
    return Baseline(
        **vars(best),
        **spec.describe(design=settings.design),
        wall_s=time.monotonic() - start,
        notes=spec.calibration_notes + best.expert_notes,
    )


def swept(
    spec: RobotSpec, settings: PhaseSweepSettings, folder: RunFolder, goal: Goal = FORWARD
) -> BestPhase:
    """Sweep the phases; save the sweep and the trajectory of its best phase, which achieves most of
    the goal, in the folder."""
    spec.physics.air.check_supply(2.0 * settings.gait.amplitude_kPa)
    folder.progress.stage("walking the expert's gait at every phase")
    sweep = sweep_phases(
        spec.assembly,
        spec.simulator,
        settings,
        time_step_s=spec.physics.time_step_s,
        progress=folder.progress,
        goal=goal,
    )
    sweep.save(folder / SWEEP_FILE)
    gait = replace(settings.gait, phase_deg=sweep.best_phase_deg)
    trajectory = recorded_walk(
        spec,
        Design.parse(settings.design),
        gait,
        settling_steps=settings.settling_step_count,
        description={"gait": f"expert, {gait.phase_deg:g}°"},
    )
    trajectory.with_skin_only().save(folder / TRAJECTORY_FILE)
    return BestPhase.of(sweep, settings.design, goal, trajectory)


def phase_notes(phases_deg: Sequence[float], best_deg: float) -> tuple[str, ...]:
    """What to tell of a best phase at an end of the phases, which are not the whole circle.

    Args:
        phases_deg: Those that were tried, evenly apart [degrees].
        best_deg: The best of them [degrees].
    """
    first, last = phases_deg[0], phases_deg[-1]
    if len(phases_deg) < 3 or best_deg not in (first, last):
        return ()
    if last - first + (phases_deg[1] - first) >= 360.0 - _SAME_PHASE_DEG:
        return ()
    return (
        f"the expert's best phase, {best_deg:g} degrees, is at an end of those that were tried, "
        f"{first:g} to {last:g}: others may be better (first_phase_deg, last_phase_deg)",
    )
