"""Simulate any design with any gait, reduced or full.

The gait is a CSV file, as coopt writes them and a spreadsheet can, or else the expert's gait at
--expert.phase-deg. The design is --design, or the one that the file names, or the expert's.

A full robot takes ten minutes for 20 s. Its way is saved every minute: the same command with the
same --out goes on where it was stopped. Presets: paper, and hyperelastic, quadratic finite elements
of the silicone's own stiffness with a pressure map of their own, which take an hour or two.

Writes trajectory.npz and, with --film, film.mp4.

Example: pneumorph simulate --gait runs/quick/training/gaits/L1.csv --film --out runs/replay
"""

from __future__ import annotations

import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any

import tyro

from pneumorph.command.robots import FullOptions, Model, RobotOptions, Workshop
from pneumorph.command.run_folder import RunFolder
from pneumorph.command.verb import Verb
from pneumorph.gait.expert_gait import BASELINE_DESIGN, ExpertGait
from pneumorph.gait.gait_file import read_gait
from pneumorph.gait.open_loop_gait import OpenLoopGait
from pneumorph.presets import HYPERELASTIC_PRESSURE_MAP
from pneumorph.report.film import FilmSettings, write_film
from pneumorph.report.scene import Actor
from pneumorph.report.skin import with_skin_only
from pneumorph.robot.design import MINIMUM_LEGS, Design
from pneumorph.simulation.simulation_settings import SimulationSettings
from pneumorph.trajectory import Trajectory

flat = tyro.conf.arg(name="")


@dataclass(frozen=True)
class SimulateOptions:
    """The robot, its gait, and what to record."""

    design: str | None = None
    """Regulator of each location, 0 for no leg, such as 1.0.0.2.2.0.0.1."""
    gait: Path | None = None
    """Gait file (CSV); by default the expert's gait."""
    model: Model = "reduced"
    """The reduced robot, or finite elements (ten minutes instead of a second)."""
    record_every: int = 10
    """Time steps between recorded frames."""
    film: bool = False
    """Make a film as well."""
    expert: ExpertGait = field(default_factory=ExpertGait)
    robot: Annotated[RobotOptions, flat] = field(default_factory=RobotOptions)
    film_settings: FilmSettings = field(default_factory=FilmSettings)


def simulate(options: SimulateOptions, folder: RunFolder) -> dict[str, Any]:
    """Simulate one robot, save its trajectory, and return how it went."""
    start = time.monotonic()
    least = MINIMUM_LEGS if options.model == "reduced" else 1
    gait, design = gait_and_design(options.gait, options.design, options.expert, least)
    folder.progress.stage(f"simulating {design} with the {options.model} model")
    workshop = Workshop(options.robot)
    simulation_start = time.monotonic()
    if options.model == "full":
        trajectory = workshop.recorded_full(
            design,
            gait,
            folder / "checkpoint.npz",
            options.record_every,
            progress=folder.progress,
        )
    else:
        workshop.refuse_full_options()
        trajectory = workshop.recorded(design, gait, options.record_every)
    simulated_s = time.monotonic() - simulation_start
    path = with_skin_only(trajectory).save(folder / "trajectory.npz")
    summary: dict[str, Any] = {
        "design": str(design),
        "model": options.model,
        "distance_cm": trajectory.forward_distance_cm,
        "status": trajectory.status,
        "simulated_s": float(trajectory.time_s[-1]),
        "mean_contact_count": float(trajectory.contact_count.mean()),
        **{
            name: trajectory.metadata[name]
            for name in ("contact", "steps", "reason")
            if name in trajectory.metadata
        },
        "trajectory": str(path),
        "damping": options.robot.simulation.damping,
        "calibration": workshop.calibration_description,
        **workshop.leg_used(options.model),
        "simulation_wall_s": simulated_s,
    }
    if options.film:
        folder.progress.stage("filming")
        summary["film"] = str(_filmed(trajectory, options, folder))
    return summary | {"wall_s": time.monotonic() - start}


def gait_and_design(
    file: Path | None, named: str | None, expert: ExpertGait, minimum_legs: int = MINIMUM_LEGS
) -> tuple[OpenLoopGait, Design]:
    """Return the gait to walk and the design to walk it with.

    Args:
        file: Gait file; None for the expert's gait.
        named: The design; None for the file's, or else the expert's.
        expert: The expert's gait.
        minimum_legs: Fewest legs.

    Raises:
        ValueError: The design has too few legs, or uses a regulator the gait does not command.
    """
    if file is None:
        gait: OpenLoopGait = expert
        design = Design.parse(named or BASELINE_DESIGN)
    else:
        gait, comments = read_gait(file)
        design = Design.parse(named or comments.get("design", BASELINE_DESIGN))
    if design.leg_count < minimum_legs:
        raise ValueError(
            f"design {design} has {design.leg_count} legs, expected at least {minimum_legs}: it "
            "would lie on the floor"
        )
    design.check_regulators(gait.regulator_count)
    return gait, design


def _filmed(trajectory: Trajectory, options: SimulateOptions, folder: RunFolder) -> Path:
    actor = Actor.of(trajectory, trajectory.metadata["design"])
    return write_film(folder / "film.mp4", [actor], options.film_settings, folder.progress)


def hyperelastic() -> SimulateOptions:
    """Finite elements of the silicone's own stiffness and the pressure map that fits them."""
    physics = SimulationSettings(damping="objective", pressure_map=HYPERELASTIC_PRESSURE_MAP)
    full = FullOptions(leg="hyperelastic")
    return SimulateOptions(model="full", robot=RobotOptions(full=full, simulation=physics))


VERB = Verb(SimulateOptions, simulate, {"paper": SimulateOptions, "hyperelastic": hyperelastic})
