"""What the best pairs of a coopt run do: rewards of each step, tilt, load and friction of each leg.

The run's best pairs and, for comparison, the expert's best phase walk once more in the reduced
model and are recorded with the floor's forces. The same walks over a range of friction coefficients
tell how far each gait leans on the friction it was found with.

Writes analysis.json, the trajectories, and the figures steps, margin, friction, pairs and a cycle
of each robot.

Example: pneumorph analyse runs/paper --out runs/paper-analysis
"""

from __future__ import annotations

import time
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import tyro

from pneumorph.artefact import write_json
from pneumorph.command.learned_run import LearnedRun, read_learned_run
from pneumorph.command.robots import RobotOptions, Workshop
from pneumorph.command.run_folder import RunFolder, finite, read_settings, read_summary
from pneumorph.command.verb import Verb
from pneumorph.gait.friction_margin import FrictionMargin, friction_margin
from pneumorph.gait.open_loop_gait import OpenLoopGait
from pneumorph.gait.phase_sweep import PhaseSweepSettings
from pneumorph.gait.walk import cycle_slides_cm, step_rewards_cm, walk
from pneumorph.report.cycle_figure import cycle_figure, tilt_deg
from pneumorph.report.friction_figure import friction_figure, margin_figure
from pneumorph.report.pairs_figure import Pair, pairs_figure
from pneumorph.report.skin import with_skin_only
from pneumorph.report.step_figure import path_of, step_figure
from pneumorph.report.style import save_figure
from pneumorph.robot.design import Design
from pneumorph.settings import settings_from_dict
from pneumorph.simulation.batched_simulator import BatchedSimulator
from pneumorph.trajectory import Trajectory

flat = tyro.conf.arg(name="")


@dataclass(frozen=True)
class AnalyseOptions:
    """Which pairs, and over which frictions."""

    run: tyro.conf.Positional[Path] = tyro.MISSING
    """Folder of a coopt run."""
    pair_count: int = 5
    """How many of the best pairs."""
    afresh: bool = False
    """Take leg and physics from the flags alone, not from the run with what the flags change."""
    cycle_s: float = 4.0
    """Length of a cycle, over which a slide back is counted and figures are drawn [s]."""
    record_every: int = 5
    """Simulation steps between recorded frames."""
    lowest_friction: float = 0.6
    """First friction coefficient."""
    highest_friction: float = 1.4
    """Last friction coefficient, included."""
    friction_step: float = 0.1
    """Step from one coefficient to the next."""
    robot: Annotated[RobotOptions, flat] = field(default_factory=RobotOptions)

    def __post_init__(self) -> None:
        if self.pair_count < 1 or self.record_every < 1:
            raise ValueError(
                f"pair_count and record_every are {self.pair_count} and {self.record_every}, "
                "expected at least 1"
            )
        if not self.cycle_s > 0.0:
            raise ValueError(f"cycle_s is {self.cycle_s}, expected a positive time")
        if not (0.0 < self.lowest_friction <= self.highest_friction and self.friction_step > 0.0):
            raise ValueError(
                f"frictions from {self.lowest_friction} to {self.highest_friction} in steps of "
                f"{self.friction_step}, expected a rising range of positive numbers"
            )

    @property
    def frictions(self) -> list[float]:
        """The coefficients, in rising order."""
        count = int((self.highest_friction - self.lowest_friction) / self.friction_step + 1e-9) + 1
        return [round(self.lowest_friction + i * self.friction_step, 9) for i in range(count)]


@dataclass(frozen=True, eq=False)
class _Walker:
    label: str
    design: Design
    gait: OpenLoopGait
    settling_steps: int


def analyse(options: AnalyseOptions, folder: RunFolder) -> dict[str, Any]:
    """Walk, record, and say what each robot did."""
    start = time.monotonic()
    run = read_learned_run(options.run, options.robot, options.pair_count, options.afresh)
    workshop = Workshop(run.robot)
    workshop.refuse_full_options()
    walkers = _walkers(run)
    friction = workshop.simulation.friction
    step_s = run.task.action_step_count * workshop.simulation.time_step_s
    folder.progress.stage(f"recording {len(walkers)} robots")
    trajectories, margins = {}, {}
    for number, walker in enumerate(walkers, start=1):
        trajectory = workshop.recorded(
            walker.design, walker.gait, options.record_every, walker.settling_steps
        )
        trajectories[walker.label] = trajectory
        margins[walker.label] = friction_margin(trajectory, friction)
        with_skin_only(trajectory).save(folder / f"trajectory_{walker.label}.npz")
        folder.progress(number, len(walkers), "recording")
    folder.progress.stage("walking over the range of friction")
    distances = _over_friction(workshop, walkers, options.frictions, folder)
    found = [
        {
            "label": walker.label,
            "design": str(walker.design),
            **_described(walker.design, trajectories[walker.label], margins[walker.label],
                         step_s, options.cycle_s),
            "hub_load_share": 1.0 - margins[walker.label].load_mN.sum(axis=1).mean()
            / _weight_mN(workshop, walker.design),
            "distances_over_friction_cm": distances[walker.label],
        }
        for walker in walkers
    ]  # fmt: skip
    content = {"friction": friction, "frictions": options.frictions, "robots": found}
    write_json(folder / "analysis.json", finite(content))
    _draw(folder, options, workshop, step_s, walkers, trajectories, margins, distances)
    return {
        "run": str(options.run),
        "best_design": found[1]["design"],
        "best_distance_cm": found[1]["distance_cm"],
        "damping": workshop.simulation.damping,
        "calibration": workshop.calibration_description,
        **content,
        "wall_s": time.monotonic() - start,
    }


def _walkers(run: LearnedRun) -> list[_Walker]:
    """The expert's best phase, called B as in the paper, and the pairs L1, L2 ..."""
    sweep = settings_from_dict(PhaseSweepSettings, read_settings(run.folder)["baseline"])
    phase = read_summary(run.folder)["baseline_best_phase_deg"]
    expert = _Walker(
        "B",
        Design.parse(sweep.design),
        replace(sweep.gait, phase_deg=phase),
        sweep.settling_step_count,
    )
    pairs = zip(run.designs, run.gaits, strict=True)
    settling = run.task.settling_step_count
    return [expert] + [
        _Walker(f"L{rank}", design, gait, settling)
        for rank, (design, gait) in enumerate(pairs, start=1)
    ]


def _weight_mN(workshop: Workshop, design: Design) -> float:
    """Weight of a robot [mN]: what of it the legs do not carry over a walk rests on the hub."""
    robot = workshop.robot(design)
    mass = robot.hub.mass + sum(mount.part.mass for mount in robot.mounts)
    return float(mass * workshop.simulation.gravity_mm_per_s2)


def _over_friction(
    workshop: Workshop, walkers: list[_Walker], frictions: list[float], folder: RunFolder
) -> dict[str, list[float]]:
    """Distance of each robot at each friction [cm]; NaN where its simulation failed."""
    distances: dict[str, list[float]] = {walker.label: [] for walker in walkers}
    for number, friction in enumerate(frictions, start=1):
        physics = replace(workshop.simulation, friction=friction)
        # The expert's gait may last longer or settle otherwise than the learned ones.
        for together in (walkers[:1], walkers[1:]):
            simulator = BatchedSimulator(
                [workshop.robot(walker.design) for walker in together],
                physics,
                workshop.options.threads,
            )
            walked = walk(
                simulator,
                [walker.gait for walker in together],
                duration_s=together[0].gait.duration_s,
                time_step_s=physics.time_step_s,
                settling_step_count=together[0].settling_steps,
                record_step_count=100,
            )
            for walker, distance in zip(together, walked.distance_cm, strict=True):
                distances[walker.label].append(float(distance))
        folder.progress(number, len(frictions), "walking over friction")
    return distances


def _described(
    design: Design,
    trajectory: Trajectory,
    margin: FrictionMargin,
    step_s: float,
    cycle_s: float,
) -> dict[str, Any]:
    """Rewards, slides back, tilt, and what each leg does until the end or a divergence."""
    path: dict[str, Any] = dict.fromkeys(
        ("distance_cm", "step_rewards_cm", "cycle_slides_cm", "backsliding_cm")
    )
    if trajectory.status == "completed":
        time_s, forward_cm = path_of(trajectory)
        slides = cycle_slides_cm(time_s, forward_cm, cycle_s)
        path = {
            "distance_cm": trajectory.forward_distance_cm,
            "step_rewards_cm": step_rewards_cm(time_s, forward_cm, step_s).tolist(),
            "cycle_slides_cm": slides.tolist(),
            "backsliding_cm": float(slides.mean()),
        }
    roll, pitch = tilt_deg(trajectory.hub_rotation)
    return {
        "status": trajectory.status,
        **path,
        "roll_range_deg": [float(roll.min()), float(roll.max())],
        "pitch_range_deg": [float(pitch.min()), float(pitch.max())],
        "mean_contact_count": float(trajectory.contact_count.mean()),
        "legs": [
            {
                "location": location,
                "regulator": regulator,
                "angle_deg": float(np.degrees(design.angle_rad(location))),
                **margin.of_leg(leg),
            }
            for leg, (location, regulator) in enumerate(design.legs)
        ],
    }


def _draw(
    folder: RunFolder,
    options: AnalyseOptions,
    workshop: Workshop,
    step_s: float,
    walkers: list[_Walker],
    trajectories: dict[str, Trajectory],
    margins: dict[str, FrictionMargin],
    distances: dict[str, list[float]],
) -> None:
    """Draw the robots that came to the end of their walks."""
    trajectories = {k: each for k, each in trajectories.items() if each.status == "completed"}
    if not trajectories:
        return
    walkers = [walker for walker in walkers if walker.label in trajectories]
    designs = {walker.label: walker.design for walker in walkers}
    paths = {label: path_of(each) for label, each in trajectories.items()}
    rate = workshop.simulation.pressure_rate_kPa_per_s
    pairs = [
        Pair(each.label, each.design, each.gait, trajectories[each.label].forward_distance_cm)
        for each in walkers
    ]
    figures = {
        "steps": step_figure(paths, step_s, options.cycle_s),
        "margin": margin_figure(
            {label: (designs[label], margins[label]) for label in designs}, options.cycle_s
        ),
        "friction": friction_figure(
            options.frictions,
            {label: distances[label] for label in designs},
            workshop.simulation.friction,
        ),
        "pairs": pairs_figure(pairs, rate),
        **{
            f"cycle_{label}": cycle_figure(each, options.cycle_s)
            for label, each in trajectories.items()
        },
    }
    for name, figure in figures.items():
        save_figure(figure, folder / f"{name}.png", ("png",))


VERB = Verb(AnalyseOptions, analyse)
