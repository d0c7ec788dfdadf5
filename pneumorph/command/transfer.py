"""Compare trials on a rig with the simulation.

Takes folders of `pneumorph deploy`, each as LABEL=FOLDER or FOLDER, whose trials hold a log and the
marker's track (time_s,x_mm,y_mm, or a table of Tracker, DeepLabCut or SLEAP, see --video). Each
design is simulated with the commands that were given, and set beside its trials: reward per step,
commanded against sensed pressure, backsliding, mean and spread, and the transfer ratio.

Writes the paper's two comparison figures, transfer_rewards and transfer_gaits (PNG and PDF), the
simulations as simulated_LABEL.npz, and comparison.json.

Example: pneumorph transfer B=runs/deploy-B L1=runs/deploy-L1 --calibration calibration.json
"""

from __future__ import annotations

import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import tyro

from pneumorph.artefact import write_json
from pneumorph.command.deploy import SCHEDULE_FILE
from pneumorph.command.robots import Model, RobotOptions, Workshop
from pneumorph.command.run_folder import RunFolder, finite
from pneumorph.command.verb import Verb
from pneumorph.gait.gait_file import read_gait
from pneumorph.hardware.marker_track import VideoSettings
from pneumorph.hardware.trial import Trial, read_trial, trial_folders
from pneumorph.hardware.trial_comparison import Comparison, compare_trials, pressure_tracking
from pneumorph.report.skin import with_skin_only
from pneumorph.report.style import save_figure
from pneumorph.report.transfer_figure import transfer_gaits_figure, transfer_rewards_figure
from pneumorph.robot.design import Design

flat = tyro.conf.arg(name="")


@dataclass(frozen=True)
class TransferOptions:
    """What was deployed, and the simulation beside it."""

    runs: tyro.conf.Positional[tuple[str, ...]] = tyro.MISSING
    """Deployments, as LABEL=FOLDER or FOLDER; the first is what the others are compared with."""
    model: Model = "reduced"
    """The reduced robots, or the finite elements they stand for."""
    step_s: float = 1.0
    """Length of a step, over which a reward is counted [s]."""
    cycle_s: float = 4.0
    """Length of a cycle, over which a slide back is counted [s]."""
    video: VideoSettings = field(default_factory=VideoSettings)
    robot: Annotated[RobotOptions, flat] = field(default_factory=RobotOptions)

    def __post_init__(self) -> None:
        if not self.runs:
            raise ValueError("runs is empty, expected at least one folder of `pneumorph deploy`")
        for name in ("step_s", "cycle_s"):
            if not getattr(self, name) > 0.0:
                raise ValueError(f"{name} must be positive, got {getattr(self, name)}")


def transfer(options: TransferOptions, folder: RunFolder) -> dict[str, Any]:
    """Simulate what was deployed and set it beside the trials."""
    start = time.monotonic()
    workshop = Workshop(options.robot)
    comparisons: list[Comparison] = []
    trials: list[list[Trial]] = []
    for number, text in enumerate(options.runs, start=1):
        label, _, path = text.rpartition("=")
        run = Path(path)
        folder.progress.stage(f"simulating {label or run.name} ({number} of {len(options.runs)})")
        own = [read_trial(each, options.video) for each in trial_folders(run)]
        comparisons.append(_compared(workshop, run, label or run.name, own, options, folder))
        trials.append(own)
    figures = [
        *save_figure(transfer_rewards_figure(comparisons), folder / "transfer_rewards.png"),
        *save_figure(transfer_gaits_figure(comparisons, trials), folder / "transfer_gaits.png"),
    ]
    robots = []
    for comparison, own in zip(comparisons, trials, strict=True):
        tracking = [pressure_tracking(trial) for trial in own]
        robots.append(
            {
                **comparison.summary(),
                "pressure_rms_kPa": _mean([each["rms_kPa"] for each in tracking]),
                "pressure_delay_s": _mean([each["delay_s"] for each in tracking]),
                "distance_over_first": _ratio(comparison, comparisons[0]),
            }
        )
    write_json(folder / "comparison.json", finite({"robots": robots}))
    first = robots[-1]
    return {
        "model": options.model,
        "transfer_ratio": first["transfer_ratio"],
        "mean_distance_cm": first["mean_distance_cm"],
        "spread_cm": first["spread_cm"],
        "simulated_distance_cm": first["simulated_distance_cm"],
        "robots": robots,
        "figures": [str(each) for each in figures],
        "damping": options.robot.simulation.damping,
        "calibration": workshop.calibration_description,
        **workshop.leg_used(options.model),
        "wall_s": time.monotonic() - start,
    }


def _compared(
    workshop: Workshop,
    run: Path,
    label: str,
    trials: list[Trial],
    options: TransferOptions,
    folder: RunFolder,
) -> Comparison:
    gait, comments = read_gait(run / SCHEDULE_FILE, maximum_pressure_kPa=float("inf"))
    if "design" not in comments:
        raise ValueError(f"{run} is a bend test, expected the deployment of a design's gait")
    design = Design.parse(comments["design"])
    if options.model == "full":
        checkpoint = folder / f"checkpoint_{label}.npz"
        trajectory = workshop.recorded_full(
            design, gait, checkpoint, record_every=5, progress=folder.progress
        )
    else:
        workshop.refuse_full_options()
        trajectory = workshop.recorded(design, gait, record_every=5)
    with_skin_only(trajectory).save(folder / f"simulated_{label}.npz")
    x = trajectory.tracked_point_mm[:, 0]
    return compare_trials(
        label,
        comments["design"],
        trajectory.time_s,
        (x - x[0]) / 10.0,
        trials,
        options.step_s,
        options.cycle_s,
    )


def _mean(values: list[float | None]) -> float | None:
    known = [value for value in values if value is not None]
    return float(np.mean(known)) if known else None


def _ratio(comparison: Comparison, first: Comparison) -> dict[str, float | None]:
    """Distance over the first robot's, simulated and measured: the paper's factor of 2.3."""

    def over(ours: float, theirs: float) -> float | None:
        return ours / theirs if theirs > 0.0 else None

    return {
        "simulated": over(comparison.simulated_distance_cm, first.simulated_distance_cm),
        "measured": over(comparison.mean_distance_cm, first.mean_distance_cm),
    }


VERB = Verb(TransferOptions, transfer)
