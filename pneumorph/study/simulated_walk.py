"""One design walks one gait, in either model: its trajectory, and how it went."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TypeVar

from pneumorph.base.checked import Checked, Count
from pneumorph.base.result import result_from_dict
from pneumorph.base.run_folder import RunFolder
from pneumorph.catalogue.robot_mass import RobotMass
from pneumorph.catalogue.robot_spec import RobotSpec
from pneumorph.catalogue.unseen_pressure import say_unseen_pressure
from pneumorph.environment.goal import FORWARD, Goal
from pneumorph.fem.rollout_report import ContactReport, StepReport
from pneumorph.gait.expert_gait import ExpertGait
from pneumorph.physics.calibration import UsedCalibration
from pneumorph.physics.open_loop_gait import commands_of
from pneumorph.physics.physics import Physics
from pneumorph.reduction.part_summary import PartsSummary
from pneumorph.robot.design import MINIMUM_LEGS
from pneumorph.study.gait_source import find_gait
from pneumorph.study.recorded_walk import Model, recorded_walk
from pneumorph.study.toppled_note import walk_notes
from pneumorph.trajectory import Trajectory

TRAJECTORY_FILE = "trajectory.npz"


Report = TypeVar("Report")


@dataclass(frozen=True)
class WalkSettings(Checked):
    """Which design walks which gait, in which model."""

    design: str | None = None
    """Regulator of each location, 0 for no leg, such as 1.0.0.2.2.0.0.1; by default the design
    named in the gait's file, otherwise the expert's."""
    gait: Path | None = None
    """Gait file (CSV or sorotraj YAML), coopt run (its best pair) or policy (npz, with --design);
    by default the expert's gait."""
    model: Model = "reduced"
    """The reduced robot, or finite elements (up to an hour instead of a second; ten minutes with
    --physics published)."""
    record_every: Count = 10
    """Time steps between recorded frames."""
    expert: ExpertGait = field(default_factory=ExpertGait)


@dataclass(frozen=True)
class SimulatedWalk:
    """How a walk went."""

    status: str
    """``completed``, or why the walk stopped early."""
    design: str
    model: str
    distance_cm: float | None
    """Forward; None of a robot that did not come to the end of its walk."""
    simulated_s: float
    """Simulated time until the end, or until the robot diverged [s]."""
    mean_contact_count: float
    """Contact points that took part in the contact solve."""
    trajectory: str
    """File of the recorded walk."""
    damping: str
    simulation_wall_s: float
    """Wall time of the simulation alone [s], with processes that were stopped, up to their last
    checkpoints."""
    wall_s: float
    """Wall time of all [s], likewise."""
    left_cm: float | None = None
    """Travel to the left; None as of the distance, and in files of earlier versions."""
    turned_deg: float | None = None
    """Turn to the left, whole circles counted; None likewise."""
    calibration: UsedCalibration | None = None
    reason: str | None = None
    """What a solver said of a robot that diverged."""
    contact: ContactReport | None = None
    """How well the floor's contacts were solved; of finite elements."""
    steps: StepReport | None = None
    """How many time steps were made and halved; of finite elements."""
    leg: PartsSummary | None = None
    """The reduced leg; None for finite elements."""
    range_ratio: float | None = None
    """How far any leg went relative to the furthest snapshot it was reduced from; None where that
    is not known, and for finite elements."""
    notes: tuple[str, ...] = ()
    """Whether the robot left that range, toppled, or was beyond the edges of its ground."""
    replay: str | None = None
    """Page that replays the walk; None of a leg without a skin."""
    film: str | None = None
    live_page_read: bool | None = None
    """Whether a browser has seen the walk to its end; None where it was not shown live."""
    physics: Physics | None = None
    """What the robots were simulated in; None in files of earlier versions."""
    mass: RobotMass | None = None
    """What they weigh; None in files of earlier versions."""
    goal: Goal = FORWARD
    """Of the run that the gait is from; forward where none says."""
    achieved: float | None = None
    """How much of it [its unit]; None of a robot that did not come to the end of its walk."""


def simulate(
    settings: WalkSettings,
    robot: RobotSpec,
    folder: RunFolder,
    watch: Callable[[Trajectory], None] | None = None,
) -> SimulatedWalk:
    """Simulate one robot and save its trajectory.

    Args:
        settings: Design, gait and model.
        robot: What walks.
        folder: Receives ``trajectory.npz``, and of finite elements a checkpoint: the same call goes
            on where it was stopped.
        watch: Told what is recorded as it is simulated.

    Raises:
        FileNotFoundError: The gait's file is missing.
        ValueError: It is no gait, the design has no legs, or regulators that the gait does
            not command.
    """
    start = time.monotonic()
    source = find_gait(settings.gait, settings.design, settings.expert)
    source.check_robot(robot.physics.regulator_count)
    if (note := source.other_design_note) is not None:
        folder.progress.say(note)
    count = source.design.leg_count
    if count == 0:
        raise ValueError(f"design {source.design} has no legs, expected at least one")
    if count < MINIMUM_LEGS:
        folder.progress.say(
            f"design {source.design} has {count} legs, fewer than the {MINIMUM_LEGS} that stand by "
            "themselves: it may lie on the floor"
        )
    if settings.model == "reduced":
        gait = source.gait
        commands = commands_of(gait, robot.physics.time_step_s, gait.regulator_count)
        say_unseen_pressure(robot, float(commands.max(initial=0.0)), folder.progress.say)
    folder.progress.stage(f"simulating {source.design} with the {settings.model} model")
    simulation_start, checkpoint = time.monotonic(), folder / "checkpoint.npz"
    resumed_s: list[float] = []
    trajectory = recorded_walk(
        robot.walking_alone(),
        source.design,
        source.gait,
        settings.model,
        checkpoint,
        record_every=settings.record_every,
        settling_steps=source.settling_steps,
        progress=folder.progress,
        watch=watch,
        keep_checkpoint=True,
        resumed=resumed_s.append,
    )
    earlier_s = sum(resumed_s)
    simulated_s = earlier_s + time.monotonic() - simulation_start
    path = trajectory.with_skin_only().save(folder / TRAJECTORY_FILE)
    checkpoint.unlink(missing_ok=True)
    told, ended = trajectory.metadata, trajectory.status == "completed"
    notes = walk_notes("The robot", told.get("range_ratio"), float(trajectory.lean_deg.max()))
    ground, tracked = robot.physics.ground, trajectory.tracked_point_mm
    if (left := ground.left_note("The robot", trajectory.time_s, tracked)) is not None:
        notes = (*notes, left)
    return SimulatedWalk(
        status=trajectory.status,
        design=str(source.design),
        model=settings.model,
        distance_cm=trajectory.distance_cm,
        goal=source.goal,
        achieved=source.goal.achieved(trajectory),
        left_cm=float(trajectory.left_cm[-1]) if ended else None,
        turned_deg=float(trajectory.turned_deg[-1]) if ended else None,
        simulated_s=float(trajectory.time_s[-1]),
        mean_contact_count=float(trajectory.contact_count.mean()),
        trajectory=str(path),
        **robot.describe(settings.model == "reduced", source.design),
        contact=_read(ContactReport, told.get("contact")),
        steps=_read(StepReport, told.get("steps")),
        reason=told.get("reason"),
        range_ratio=told.get("range_ratio"),
        notes=notes,
        simulation_wall_s=simulated_s,
        wall_s=earlier_s + time.monotonic() - start,
    )


def _read(kind: type[Report], told: dict[str, Any] | None) -> Report | None:
    """What metadata say, where they say it: reduced robots say other things."""
    return None if told is None else result_from_dict(kind, told)
