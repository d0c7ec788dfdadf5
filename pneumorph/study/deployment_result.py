"""What was commanded of a rig, and how each trial went."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from pneumorph.catalogue.robot_mass import RobotMass
from pneumorph.environment.goal import Goal
from pneumorph.hardware.deployment import DeploymentReport
from pneumorph.physics.calibration import UsedCalibration
from pneumorph.physics.physics import Physics
from pneumorph.reduction.part_summary import PartsSummary

BENDS_FILE = "bends.csv"
"""Measurements of a bend test, in the run's folder."""


@dataclass(frozen=True)
class TrialOutcome(DeploymentReport):
    """How one trial went."""

    trial: str
    """Its folder."""
    distance_cm: float | None = None
    """Forward travel of the marker; None on a real rig, whose track comes later, and of a trial
    that was stopped before it moved."""
    turned_deg: float | None = None
    """Its turn to the left, whole circles counted; None likewise."""
    achieved: float | None = None
    """What of the gait's goal was achieved [its unit]; None likewise."""
    range_ratio: float | None = None
    """How far a leg of the virtual rig's reduced robot went relative to its furthest snapshot; None
    where that is not known."""


@dataclass(frozen=True)
class DeployedGait:
    """What was commanded, and how it went; what a dry run or a bend test lacks stays None."""

    gait: str
    """Where the gait is from."""
    driver: str
    rig: dict[str, Any]
    duration_s: float
    """Length of the gait [s]."""
    command_count: int
    damping: str
    calibration: UsedCalibration
    wall_s: float = 0.0
    """Wall time of all [s]."""
    design: str | None = None
    """None of a bend test."""
    highest_meant_kPa: float | None = None
    """What the gait asks for with this calibration, where that is beyond the limit."""
    cut_off_at_kPa: float | None = None
    """And that limit: of the channel that it exceeds most, or of what any gait may command."""
    schedule: tuple[str, ...] = ()
    """What a dry run would have commanded, line by line."""
    model: str | None = None
    """Robot behind a virtual rig."""
    virtual_seed: int | None = None
    leg: PartsSummary | None = None
    """Its reduced leg."""
    bends: str | None = None
    """File of a bend test's measurements."""
    measurement_count: int | None = None
    trials: tuple[TrialOutcome, ...] = ()
    mean_distance_cm: float | None = None
    """Mean over trials, forward."""
    spread_cm: float | None = None
    """Standard deviation over trials; None of a single one."""
    goal: Goal | None = None
    """What the gait was made for: forward where it is from a file of its own."""
    learned_for: str | None = None
    """Task of one's own that the gait was learned for; None for one of the package's."""
    mean_achieved: float | None = None
    """Mean over trials of what of the goal was achieved [its unit]."""
    physics: Physics | None = None
    """What the robots were simulated in; None in files of earlier versions."""
    mass: RobotMass | None = None
    """What they weigh; None in files of earlier versions."""
    notes: tuple[str, ...] = ()
