"""What the best pairs of a run do: rewards of each step, tilt, load and friction of each leg."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from pneumorph.base.artefact import write_json
from pneumorph.base.checked import Checked, Count, Positive
from pneumorph.base.result import in_cm, result_to_dict
from pneumorph.base.run_folder import RunFolder
from pneumorph.catalogue.robot_mass import RobotMass
from pneumorph.catalogue.robot_spec import RobotSpec
from pneumorph.environment.goal import FORWARD, Goal
from pneumorph.gait.friction_margin import FrictionMargin, friction_margin, point_contacts
from pneumorph.gait.walk import cycle_slides, step_rewards, walk
from pneumorph.physics.calibration import UsedCalibration
from pneumorph.physics.open_loop_gait import OpenLoopGait
from pneumorph.physics.physics import Physics
from pneumorph.reduction.snapshot_range import range_note
from pneumorph.robot.design import Design
from pneumorph.simulation.distribution import Distribution
from pneumorph.simulation.randomisation import Randomisation
from pneumorph.study.certified_candidates import own_task_notes
from pneumorph.study.finished_run import FinishedRun
from pneumorph.study.furthest import furthest
from pneumorph.study.recorded_trajectories import remove_earlier
from pneumorph.study.recorded_walk import recorded_walk
from pneumorph.trajectory import Trajectory

ANALYSIS_FILE = "analysis.json"


@dataclass(frozen=True)
class AnalysisSettings(Checked):
    """Which pairs, and over which frictions."""

    pair_count: Count = 5
    """Number of best pairs to analyse."""
    cycle_s: Positive = 4.0
    """Length of a gait cycle [s]; slides back are counted and figures drawn per cycle."""
    record_every: Count = 5
    """Simulation steps between recorded frames."""
    lowest_friction: Positive | None = None
    """Lowest friction coefficient that the robots walk with; by default the lowest that the run's
    worlds are drawn with, of a run in one world half that of the physics."""
    highest_friction: Positive | None = None
    """Highest friction coefficient, included; by default the highest likewise, or twice that of the
    physics."""
    friction_step: Positive = 0.1
    """Step between friction coefficients."""

    def __post_init__(self) -> None:
        super().__post_init__()
        low, high = self.lowest_friction, self.highest_friction
        if low is not None and high is not None:
            _check_order(low, high)

    def frictions(self, friction: float, drawn: Distribution | None = None) -> tuple[float, ...]:
        """The coefficients, in rising order.

        Args:
            friction: That of the physics, which lies among those that nobody asked for.
            drawn: What the run's worlds are drawn with; None of a run in one world.

        Raises:
            ValueError: The highest is below the lowest, one of which nobody asked for.
        """
        low, high = 0.5 * friction, 2.0 * friction
        if drawn is not None and not drawn.is_constant:
            low, high = min(drawn.lowest, friction), max(drawn.highest, friction)
        low = low if self.lowest_friction is None else self.lowest_friction
        high = high if self.highest_friction is None else self.highest_friction
        _check_order(low, high)
        count = int((high - low) / self.friction_step + 1e-9) + 1
        steps = [round(low + i * self.friction_step, 9) for i in range(count)]
        return (*steps, *([high] if steps[-1] < high - 1e-9 else []))


def _check_order(lowest: float, highest: float) -> None:
    if lowest > highest:
        raise ValueError(
            f"lowest_friction is {lowest:g}, expected at most highest_friction, {highest:g}"
        )


@dataclass(frozen=True)
class AnalysedLeg:
    """A leg over the walk: means weighted by its load; see `FrictionMargin.of_leg`."""

    location: int
    regulator: int
    """Of its first chamber."""
    angle_deg: float
    """Where it points on the robot, from its front to its left [degrees]."""
    mean_load_mN: float
    """What the floor bears of it [mN]."""
    used_share: float
    """Share of the friction that its load allows that it uses, 0 to 1."""
    slipping_share: float
    """Share of the load on points that slip."""
    at_limit_share: float
    """Share of the load that was carried while the whole leg slid."""
    in_air_share: float
    """Share of the time without load."""
    regulators: tuple[int, ...] = ()
    """One for all of its chambers or one for each; none in files of earlier versions."""


@dataclass(frozen=True)
class AnalysedRobot:
    """What one robot did until the end of its walk, or until it diverged.

    A robot that diverged has no distance, rewards or slides.
    """

    label: str
    """B for the expert's best phase, L1 for the run's best pair, L2 ..."""
    design: str
    status: str
    distance_cm: float | None
    step_rewards: tuple[float, ...] | None = field(metadata=in_cm("step_rewards_cm"))
    """What of the goal is achieved in each action's time [its unit], (action,)."""
    cycle_slides: tuple[float, ...] | None = field(metadata=in_cm("cycle_slides_cm"))
    """Furthest slide back from it within each cycle [the goal's unit], (cycle,)."""
    backsliding: float | None = field(metadata=in_cm("backsliding_cm"))
    """Their mean."""
    roll_range_deg: tuple[float, float]
    """Least and largest roll, left side up [degrees]."""
    pitch_range_deg: tuple[float, float]
    """Least and largest pitch, front down [degrees]."""
    mean_contact_count: float
    """Contact points that took part in the contact solve."""
    legs: tuple[AnalysedLeg, ...]
    hub_load_share: float
    """Share of the robot's weight that the floor bears through its hub, in the mean: what of the
    weight the legs do not bear in the recorded frames. These are a sample, and the robot's momentum
    is another at the end, so a hub that never touches has a few thousandths more or less than 0."""
    over_friction: tuple[float, ...] = field(metadata=in_cm("distances_over_friction_cm"))
    """What of the goal is achieved at each of the `frictions` [its unit], (friction,); NaN where
    the simulation failed."""
    range_ratio: float | None = None
    """How far any leg went relative to the furthest snapshot it was reduced from; None where that
    is not known."""
    achieved: float | None = None
    """What of the goal it achieved; None of one that diverged, and in files of earlier versions."""


@dataclass(frozen=True)
class Analysis:
    """What the expert's robot and a run's best pairs do."""

    run: str
    best_design: str
    """The pair that achieved most of the run's goal here; the run's first where all failed."""
    best_distance_cm: float | None
    damping: str
    friction: float
    """Coefficient that the recorded walks were made with, of surfaces without one of their own."""
    frictions: tuple[float, ...]
    robots: tuple[AnalysedRobot, ...]
    wall_s: float
    calibration: UsedCalibration | None = None
    physics: Physics | None = None
    """What the robots were simulated in; None in files of earlier versions."""
    mass: RobotMass | None = None
    """What they weigh; None in files of earlier versions."""
    notes: tuple[str, ...] = ()
    """That a task of one's own is not known here, and robots that left the range of their legs'
    snapshots."""
    goal: Goal = FORWARD
    best_achieved: float | None = None
    """What of it that pair achieved; None as there."""


@dataclass(frozen=True, eq=False)
class Walker:
    """A robot that is analysed.

    Attributes:
        label: B for the expert's, L1 for the run's best pair, L2 ...
        design: Its design.
        gait: Its gait.
        settling_steps: Time steps at zero pressure before the gait.
    """

    label: str
    design: Design
    gait: OpenLoopGait
    settling_steps: int


def walkers(run: FinishedRun, pair_count: int) -> list[Walker]:
    """The expert's best phase, called B as in the paper, and the pairs L1, L2 ..."""
    sweep = run.baseline
    expert = Walker("B", Design.parse(sweep.design), run.best_expert, sweep.settling_step_count)
    settling = run.task.settling_step_count
    return [expert] + [
        Walker(f"L{rank}", pair.design, pair.gait, settling)
        for rank, pair in enumerate(run.pairs(pair_count), start=1)
    ]


def walk_file(label: str) -> str:
    """Name of the recorded walk of a robot."""
    return f"trajectory_{label}.npz"


def analyse(
    run: FinishedRun | Path | str,
    settings: AnalysisSettings | None = None,
    robot: RobotSpec | None = None,
    folder: RunFolder | None = None,
) -> Analysis:
    """Walk the best pairs and the expert once more, record them, and say what each does.

    Args:
        run: The run or its folder.
        settings: Which pairs, and over which frictions.
        robot: What they walk as; None for the leg and physics of the run.
        folder: Receives the trajectories and ``analysis.json``; None for RUN/analysis. Trajectories
            of an earlier analysis there are removed.

    Raises:
        ArtefactError: The run holds no pairs, or is damaged.
    """
    start = time.monotonic()
    settings = settings or AnalysisSettings()
    run = run if isinstance(run, FinishedRun) else FinishedRun.read(Path(run))
    spec = robot or run.spec()
    drawn = None
    if run.has_drawn_worlds:
        drawn = run.structured("randomisation", Randomisation).distributions["friction"]
    frictions = settings.frictions(spec.physics.friction, drawn)
    folder = folder or RunFolder(run.folder / "analysis", "analyse")
    robots = walkers(run, settings.pair_count)
    step_s = run.task.action_s(spec.physics.time_step_s)
    remove_earlier(folder.path, walk_file("B"), walk_file("L*"))
    folder.progress.stage(f"recording {len(robots)} robots")
    recorded = []
    for number, each in enumerate(robots, start=1):
        trajectory = recorded_walk(
            spec,
            each.design,
            each.gait,
            record_every=settings.record_every,
            settling_steps=each.settling_steps,
        )
        recorded.append(trajectory)
        trajectory.with_skin_only().save(folder / walk_file(each.label))
        folder.progress(number, len(robots), "recording")
    folder.progress.stage("walking over the range of friction")
    goal = run.task.goal
    friction = _over_friction(spec, robots, frictions, folder, goal)
    analysed = tuple(
        analysed_robot(each, trajectory, spec, step_s, settings.cycle_s, goal, friction[each.label])
        for each, trajectory in zip(robots, recorded, strict=True)
    )
    best = furthest(analysed[1:])
    found = Analysis(
        run=str(run.folder),
        best_design=best.design,
        best_distance_cm=best.distance_cm,
        goal=goal,
        best_achieved=best.achieved,
        **spec.describe(reduced=False),
        friction=spec.physics.friction,
        frictions=frictions,
        robots=analysed,
        notes=(
            *spec.calibration_notes,
            *own_task_notes(run.own_task, goal),
            *filter(None, (range_note(each.label, each.range_ratio) for each in analysed)),
        ),
        wall_s=time.monotonic() - start,
    )
    content = result_to_dict(found)
    kept = ("friction", "frictions", "robots", "goal", "unit")
    write_json(folder / ANALYSIS_FILE, {name: content[name] for name in kept})
    return found


def _over_friction(
    spec: RobotSpec,
    robots: Sequence[Walker],
    frictions: Sequence[float],
    folder: RunFolder,
    goal: Goal,
) -> dict[str, list[float]]:
    """What each robot achieves at each friction; NaN where its simulation failed."""
    achieved: dict[str, list[float]] = {each.label: [] for each in robots}
    for number, friction in enumerate(frictions, start=1):
        everywhere = replace(spec.physics, friction=friction, friction_by_surface=())
        slippery = replace(spec, physics=everywhere)
        # The expert's gait may last longer or settle otherwise than the learned ones.
        for together in (robots[:1], robots[1:]):
            walked = walk(
                slippery.simulator([each.design for each in together]),
                [each.gait for each in together],
                duration_s=together[0].gait.duration_s,
                time_step_s=spec.physics.time_step_s,
                settling_step_count=together[0].settling_steps,
                record_step_count=100,
            )
            for each, far in zip(together, walked.achieved(goal), strict=True):
                achieved[each.label].append(float(far))
        folder.progress(number, len(frictions), "walking over friction")
    return achieved


def analysed_robot(
    walker: Walker,
    trajectory: Trajectory,
    spec: RobotSpec,
    step_s: float,
    cycle_s: float,
    goal: Goal = FORWARD,
    over_friction: Sequence[float] = (),
) -> AnalysedRobot:
    """What one robot did.

    Args:
        walker: The robot and its gait.
        trajectory: Its walk, recorded with nodes and forces.
        spec: What it walked as.
        step_s: Length of an action [s].
        cycle_s: Length of a cycle [s].
        goal: What counts of its walk.
        over_friction: What of it is achieved at each friction of an analysis.
    """
    rewards: tuple[float, ...] | None = None
    slides: tuple[float, ...] | None = None
    if trajectory.status == "completed":
        path = trajectory.time_s, goal.along(trajectory)
        rewards = tuple(step_rewards(*path, step_s).tolist())
        slides = tuple(cycle_slides(*path, cycle_s).tolist())
    margin = friction_margin(trajectory, leg_friction(walker.design, trajectory, spec))
    roll, pitch = trajectory.tilt_deg
    assert trajectory.contact_force_mN is not None  # or there were no margin
    borne_mN = trajectory.contact_force_mN[..., 2].astype(float).sum(axis=2)
    load_mN = float(borne_mN.sum(axis=1).mean())
    return AnalysedRobot(
        label=walker.label,
        design=str(walker.design),
        status=trajectory.status,
        distance_cm=trajectory.distance_cm,
        step_rewards=rewards,
        cycle_slides=slides,
        backsliding=None if slides is None else float(np.mean(slides)),
        roll_range_deg=(float(roll.min()), float(roll.max())),
        pitch_range_deg=(float(pitch.min()), float(pitch.max())),
        mean_contact_count=float(trajectory.contact_count.mean()),
        legs=_analysed_legs(walker.design, margin, spec),
        hub_load_share=1.0 - load_mN / spec.weight_mN(walker.design),
        over_friction=tuple(over_friction),
        range_ratio=trajectory.metadata.get("range_ratio"),
        achieved=goal.achieved(trajectory),
    )


def leg_friction(design: Design, trajectory: Trajectory, spec: RobotSpec) -> float | np.ndarray:
    """Coefficient of every point of the legs at its pressure in each frame, (frame, leg, point);
    one number where it is the same for all."""
    physics = spec.physics
    if not physics.friction_by_surface and physics.friction_pressure.exponent == 0.0:
        return physics.friction
    pressing = point_contacts(trajectory).pressing_mN
    robot = spec.assembly(design)
    surfaces, counts = robot.contact_surfaces, [len(m.part.contact_points) for m in robot.mounts]
    # A leg of fewer points than others has none beyond them.
    is_point = np.arange(pressing.shape[2]) < np.array(counts)[:, None]
    impulses = physics.time_step_s * pressing[:, is_point]
    hub_count = len(surfaces.names) - sum(counts)
    of_all = physics.contact_friction(surfaces, np.pad(impulses, ((0, 0), (hub_count, 0))))
    of_legs = np.full(pressing.shape, physics.friction)
    of_legs[:, is_point] = of_all[..., hub_count:]
    return of_legs


def _analysed_legs(
    design: Design, margin: FrictionMargin, spec: RobotSpec
) -> tuple[AnalysedLeg, ...]:
    return tuple(
        AnalysedLeg(
            location=each.location,
            regulator=each.regulators[0],
            regulators=each.regulators,
            angle_deg=spec.sites[each.location].yaw_deg,
            **margin.of_leg(leg),
        )
        for leg, each in enumerate(design.fittings)
    )
