"""Learn a design and its gait together, and compare them with the expert's.

First the expert's gait walks at every phase. Then one design-conditioned policy and a distribution
over designs are trained together, as in the paper. The best pairs are open-loop gaits that anyone
can replay. A stopped run goes on from its last checkpoint with --resume and the same --out.

Presets: quick (minutes on two cores: three or four legs, many updates an action, mirror images),
paper (one million timesteps, all designs, then fine-tuning of the eight best) and fast (all
designs in a quarter of that). All use the published damping; see --simulation.damping. With
--randomize every round is walked in worlds drawn from --randomisation, so that a pair's distance is
that of the world it was seen in; `pneumorph evaluate RUN --randomize` ranks pairs over many worlds.

Writes best_trajectory.npz, baseline_trajectory.npz, phase_sweep.npz and, in training/,
metrics.jsonl, TensorBoard logs, checkpoints, policy.npz, a policy for each fine-tuned design, and
gaits/L1.csv, L2.csv ...

Example: pneumorph coopt --preset quick --seed 1 --out runs/quick-1
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Annotated, Any

import tyro

from pneumorph.command.baseline import sweep_summary, swept
from pneumorph.command.robots import RobotOptions, Workshop
from pneumorph.command.run_folder import RunFolder
from pneumorph.command.verb import Verb
from pneumorph.coopt.checkpoint import has_checkpoint
from pneumorph.coopt.cooptimise import cooptimise
from pneumorph.coopt.settings import (
    CooptSettings,
    fast_settings,
    paper_settings,
    quick_settings,
)
from pneumorph.coopt.training import STAGES
from pneumorph.environment.crawling_simulator import CrawlingSimulator, SimulatorFactory
from pneumorph.environment.crawling_task import CrawlingTask
from pneumorph.gait.gait_file import read_gait
from pneumorph.gait.phase_sweep import PhaseSweepSettings
from pneumorph.report.skin import with_skin_only
from pneumorph.robot.design import Design
from pneumorph.settings import settings_to_dict
from pneumorph.simulation.randomisation import Randomisation

flat = tyro.conf.arg(name="")

TRAINING_FOLDER = "training"
_TIMES = (
    *(f"{stage}_s" for stage in STAGES),
    "other_s",
    "learn_and_log_share",
    "finetuning_wall_s",
)
BEST_TRAJECTORY_FILE = "best_trajectory.npz"


@dataclass(frozen=True)
class CooptOptions:
    """The learner, the robots, and the baseline to compare with."""

    resume: bool = False
    """Go on from the newest checkpoint in the run folder."""
    randomize: bool = False
    """Train in worlds drawn anew every round, instead of one; see --randomisation."""
    wandb_project: str | None = None
    """Project of Weights & Biases to log to besides TensorBoard; offline, into the run folder,
    unless WANDB_API_KEY is set."""
    world_count: int = 8
    """Worlds side by side in a round of --randomize."""
    randomisation: Randomisation = field(default_factory=Randomisation)
    coopt: Annotated[CooptSettings, flat] = field(default_factory=quick_settings)
    robot: Annotated[RobotOptions, flat] = field(default_factory=RobotOptions)
    baseline: PhaseSweepSettings = field(default_factory=PhaseSweepSettings)


def coopt(options: CooptOptions, folder: RunFolder) -> dict[str, Any]:
    """Sweep the baseline, train, replay the best pair, and return what was found."""
    start = time.monotonic()
    if options.coopt.task.regulator_count != options.robot.simulation.regulator_count:
        raise ValueError(
            f"the task has {options.coopt.task.regulator_count} regulators and the simulation "
            f"{options.robot.simulation.regulator_count}, expected the same number"
        )
    if has_checkpoint(folder.path / TRAINING_FOLDER) and not options.resume:
        raise ValueError(
            f"{folder.path} holds a training run already; go on with --resume, or choose another "
            "--out"
        )
    workshop = Workshop(options.robot)
    sweep = swept(workshop, options.baseline, folder)
    folder.progress.stage("learning design and gait together")
    swept_s = time.monotonic() - start
    learned = cooptimise(
        workshop.robot,
        _simulator_factory(workshop, options),
        options.coopt,
        folder.path / TRAINING_FOLDER,
        time_step_s=options.robot.simulation.time_step_s,
        provenance={
            "simulation": settings_to_dict(workshop.simulation),
            "leg": workshop.leg.digest(),
            **_randomised(options),
        },
        resume=options.resume,
        wandb_project=options.wandb_project,
        progress=folder.progress,
        say=folder.progress.say,
    )
    start = time.monotonic()
    replayed = _replay_best(workshop, learned, options.coopt.task, folder)
    # Learning counts what earlier processes spent on it before this one went on.
    learned_s = learned["wall_s"] + learned.get("finetuning_wall_s", 0.0)
    return {
        "best_design": learned["best_design"],
        "best_distance_cm": learned["best_distance_cm"],
        "best_gait": _under_training(learned["best_gait"]),
        "replayed_distance_cm": replayed,
        **sweep_summary(sweep, options.baseline),
        "timesteps": learned["timesteps"],
        "wall_s": swept_s + learned_s + time.monotonic() - start,
        "training_wall_s": learned["wall_s"],
        **{name: learned[name] for name in _TIMES if name in learned},
        "finetuning_timesteps": learned["finetuning_timesteps"],
        "update_count": learned["update_count"],
        "failed_episode_count": learned["failed_episode_count"],
        "seed": options.coopt.seed,
        "damping": options.robot.simulation.damping,
        "calibration": workshop.calibration_description,
        **_randomised(options),
        "seen_pairs": learned["seen_pairs"],
        "pairs": [{**each, "gait": _under_training(each["gait"])} for each in learned["pairs"]],
        "notes": learned["remarks"],
        "leg": workshop.leg_description,
    }


def _simulator_factory(workshop: Workshop, options: CooptOptions) -> SimulatorFactory:
    if not options.randomize:
        return workshop.simulator

    def make(robots: Sequence[Any]) -> CrawlingSimulator:
        return workshop.randomised_simulator(
            robots, options.randomisation, options.coopt.seed, options.world_count
        )

    return make


def _randomised(options: CooptOptions) -> dict[str, Any]:
    """What a summary and a checkpoint say of the worlds of a randomised training."""
    if not options.randomize:
        return {}
    drawn = {**settings_to_dict(options.randomisation), "world_count": options.world_count}
    return {"randomisation": drawn}


def _replay_best(
    workshop: Workshop, learned: dict[str, Any], task: CrawlingTask, folder: RunFolder
) -> float | None:
    """Walk the best pair's gait file once more, record it, and return its distance in cm."""
    if learned["best_gait"] is None:
        return None
    folder.progress.stage("recording the best pair")
    gait, _ = read_gait(
        folder.path / TRAINING_FOLDER / learned["best_gait"],
        task.minimum_pressure_kPa,
        task.maximum_pressure_kPa,
    )
    trajectory = workshop.recorded(
        Design.parse(learned["best_design"]),
        gait,
        settling_steps=task.settling_step_count,
        description={"gait": learned["best_gait"]},
    )
    with_skin_only(trajectory).save(folder / BEST_TRAJECTORY_FILE)
    return trajectory.forward_distance_cm


def _under_training(path: str | None) -> str | None:
    return None if path is None else f"{TRAINING_FOLDER}/{path}"


VERB = Verb(
    CooptOptions,
    coopt,
    {
        "quick": lambda: CooptOptions(coopt=quick_settings()),
        "fast": lambda: CooptOptions(coopt=fast_settings()),
        "paper": lambda: CooptOptions(coopt=paper_settings()),
    },
)
