"""Simulate any design with any gait, reduced or full.

The robot is the paper's, or what --robot describes (docs/own_robot.md), as its materials were
measured; --physics published is the paper's simulation. The gait is a CSV file, as coopt writes
them and a spreadsheet can, a coopt run (its best pair), a policy (RUN/training/policy.npz with
--design), or else the expert's gait at --expert.phase-deg. The design is --design, or the one that
the file names, or the expert's.

A full robot (--model full) takes half an hour for 20 s, ten minutes with --physics published, and
an hour or two with the hyperelastic leg. Its way is saved every minute: the same command with the
same --out goes on where it was stopped. Presets: paper, the paper's robot in either physics, and
hyperelastic, legs of the silicone's own stiffness with their pressure map, cast mass and damping.

With --live the robot can be watched in the browser while it is simulated: the address is printed,
and the page keeps what it has seen. Writes trajectory.npz, replay.html and, with --film, film.mp4.

Example: pneumorph simulate --gait runs/quick/training/gaits/L1.csv --film --out runs/replay
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Annotated, Any

from pneumorph.base.layers import layered
from pneumorph.base.run_folder import RunFolder
from pneumorph.catalogue.robot_options import RobotOptions, chosen_robot
from pneumorph.command.verb import Verb, flat
from pneumorph.report.film import FilmSettings
from pneumorph.report.replay.live_replay import LiveSettings
from pneumorph.report.shown_walk import simulate_and_show
from pneumorph.study.gait_source import robot_of_source
from pneumorph.study.simulated_walk import SimulatedWalk, WalkSettings


@dataclass(frozen=True)
class SimulateOptions:
    """The robot, its gait, and what to show of it."""

    walk: Annotated[WalkSettings, flat] = field(default_factory=WalkSettings)
    film: bool = False
    """Make a film as well."""
    live: bool = False
    """Show the robot in the browser meanwhile; the address is printed."""
    robot: Annotated[RobotOptions, flat] = field(default_factory=RobotOptions)
    film_settings: FilmSettings = field(default_factory=FilmSettings)
    live_settings: LiveSettings = field(default_factory=LiveSettings)

    @classmethod
    def implied(cls, content: Mapping[str, Any], _: Mapping[str, Any]) -> dict[str, Any]:
        """The design and the regulators that a robot's file brings with it."""
        robot = chosen_robot(content)
        if robot is None or content.get("walk", {}).get("gait") is not None:
            return {}
        return {"walk": {"design": robot.usual_design, "expert": robot.expert_settings()}}


def run(options: SimulateOptions, folder: RunFolder) -> SimulatedWalk:
    """Simulate one robot and show it."""
    spec = options.robot.spec()
    if options.walk.model == "reduced":
        options.robot.refuse_full_options()
    described = options.robot.description
    notes: list[str] = []
    if described is not None:
        free = options.walk.gait is None and options.walk.design is not None
        of_design = described.design_note(options.walk.design or "") if free else None
        notes = [note for note in (of_design, described.worlds_note) if note is not None]
    for note in notes:
        folder.progress.say(note)
    film = options.film_settings if options.film else None
    live = options.live_settings if options.live else None
    walk = simulate_and_show(options.walk, spec, folder, film=film, live=live)
    return replace(walk, notes=(*walk.notes, *notes))


_HYPERELASTIC = {
    "walk": {"model": "full"},
    "robot": {"leg": "hyperelastic", "physics": {"damping": "objective"}},
}

VERB = Verb(
    SimulateOptions,
    run,
    {"paper": SimulateOptions, "hyperelastic": lambda: layered(SimulateOptions(), [_HYPERELASTIC])},
    taken_over=lambda options: robot_of_source(options.walk.gait),
)
