"""Simulate any design with any gait, reduced or full.

The gait is a CSV file, as coopt writes them and a spreadsheet can, a coopt run (its best pair), a
policy (RUN/training/policy.npz with --design), or else the expert's gait at --expert.phase-deg. The
design is --design, or the one that the file names, or the expert's.

A full robot (--model full) takes ten minutes for 20 s, or an hour or two with the hyperelastic leg.
Its way is saved every minute: the same command with the same --out goes on where it was stopped.
Presets: paper, and hyperelastic, legs of the silicone's own stiffness with a pressure map of their
own and objective damping.

With --live the robot can be watched in the browser while it is simulated: the address is printed,
and the page keeps what it has seen. Writes trajectory.npz, replay.html and, with --film, film.mp4.

Example: pneumorph simulate --gait runs/quick/training/gaits/L1.csv --film --out runs/replay
"""

from __future__ import annotations

import time
from contextlib import ExitStack
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any

import tyro

from pneumorph.command.gait_source import GaitSource, find_gait
from pneumorph.command.robots import Model, RobotOptions, Workshop
from pneumorph.command.run_folder import RunFolder
from pneumorph.command.verb import Verb
from pneumorph.gait.expert_gait import ExpertGait
from pneumorph.report.film import FilmSettings, write_film
from pneumorph.report.replay.live_replay import LiveReplay, LiveSettings
from pneumorph.report.replay.page import write_replay
from pneumorph.report.scene import Actor
from pneumorph.report.skin import with_skin_only
from pneumorph.robot.design import MINIMUM_LEGS
from pneumorph.simulation.simulation_settings import SimulationSettings
from pneumorph.trajectory import Trajectory

flat = tyro.conf.arg(name="")


@dataclass(frozen=True)
class SimulateOptions:
    """The robot, its gait, and what to record."""

    design: str | None = None
    """Regulator of each location, 0 for no leg, such as 1.0.0.2.2.0.0.1."""
    gait: Path | None = None
    """Gait file (CSV or sorotraj YAML), coopt run (its best pair) or policy (npz, with --design);
    by default the expert's gait."""
    model: Model = "reduced"
    """The reduced robot, or finite elements (ten minutes instead of a second)."""
    record_every: int = 10
    """Time steps between recorded frames."""
    film: bool = False
    """Make a film as well."""
    live: bool = False
    """Show the robot in the browser meanwhile; the address is printed."""
    expert: ExpertGait = field(default_factory=ExpertGait)
    robot: Annotated[RobotOptions, flat] = field(default_factory=RobotOptions)
    film_settings: FilmSettings = field(default_factory=FilmSettings)
    live_settings: LiveSettings = field(default_factory=LiveSettings)


def simulate(options: SimulateOptions, folder: RunFolder) -> dict[str, Any]:
    """Simulate one robot, save its trajectory, and return how it went."""
    start = time.monotonic()
    least = MINIMUM_LEGS if options.model == "reduced" else 1
    source = gait_of(options.gait, options.design, options.expert, least)
    design = source.design
    folder.progress.stage(f"simulating {design} with the {options.model} model")
    workshop = Workshop(options.robot)
    with ExitStack() as stack:
        live = None
        if options.live:
            live = stack.enter_context(LiveReplay(str(design), options.live_settings))
            folder.progress.say(f"live at {live.address}")
        simulation_start = time.monotonic()
        trajectory = _walked(workshop, source, options, folder, live)
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
            **_shown(trajectory, options, folder),
        }
        if live is not None:
            summary["live_page_read"] = _until_read(live, folder)
    return summary | {"wall_s": time.monotonic() - start}


def _walked(
    workshop: Workshop,
    source: GaitSource,
    options: SimulateOptions,
    folder: RunFolder,
    live: LiveReplay | None,
) -> Trajectory:
    if options.model == "full":
        return workshop.recorded_full(
            source.design,
            source.gait,
            folder / "checkpoint.npz",
            options.record_every,
            source.settling_steps,
            progress=folder.progress,
            watch=live,
        )
    workshop.refuse_full_options()
    return workshop.recorded(
        source.design, source.gait, options.record_every, source.settling_steps, watch=live
    )


def _shown(trajectory: Trajectory, options: SimulateOptions, folder: RunFolder) -> dict[str, str]:
    """Write what can be looked at; return the files by name."""
    if trajectory.skin_triangles is None and not options.film:
        return {}  # a leg of another program may have no skin
    actor = Actor.of(trajectory, trajectory.metadata["design"])
    shown = {"replay": str(write_replay(folder / "replay.html", [actor], title=actor.label))}
    if options.film:
        folder.progress.stage("filming")
        film = write_film(folder / "film.mp4", [actor], options.film_settings, folder.progress)
        shown["film"] = str(film)
    return shown


def _until_read(live: LiveReplay, folder: RunFolder) -> bool:
    """Leave the live page time to be read to its end; the keyboard may end the wait."""
    folder.progress.say(f"the live page can still be opened: {live.address}")
    try:
        return live.finish()
    except KeyboardInterrupt:
        return False


def gait_of(
    file: Path | None, named: str | None, expert: ExpertGait, minimum_legs: int = MINIMUM_LEGS
) -> GaitSource:
    """Return the gait to walk and the design to walk it with.

    Args:
        file: As of `find_gait`; None for the expert's gait.
        named: The design; None for the file's, or else the expert's.
        expert: The expert's gait.
        minimum_legs: Fewest legs.

    Raises:
        ValueError: The design has too few legs, or uses a regulator the gait does not command.
    """
    found = find_gait(file, named, expert)
    if found.design.leg_count < minimum_legs:
        raise ValueError(
            f"design {found.design} has {found.design.leg_count} legs, expected at least "
            f"{minimum_legs}: it would lie on the floor"
        )
    return found


def hyperelastic() -> SimulateOptions:
    """Legs of the silicone's own stiffness, damped in proportion to deformation alone."""
    physics = SimulationSettings(damping="objective")
    return SimulateOptions(model="full", robot=RobotOptions(leg="hyperelastic", simulation=physics))


VERB = Verb(SimulateOptions, simulate, {"paper": SimulateOptions, "hyperelastic": hyperelastic})
