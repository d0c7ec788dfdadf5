"""Simulate any design with any gait, reduced or full.

The robot is the paper's, or that of --robot (docs/own_robot.md), with measured material properties;
--physics published is the paper's simulation. The gait is a CSV file, as coopt writes them, a coopt
run (its best pair), a policy (RUN/training/policy.npz with --design), or by default the expert's at
--expert.phase-deg. The design is --design, or the gait file's, or the expert's.

--model full takes half an hour to an hour for 20 s (published physics: ten minutes), and the same
command resumes it. Presets: paper, its robot in either physics; hyperelastic, a full one of the
silicone's own stiffness. --live shows it in the browser. Writes trajectory.npz and replay.html.

Example: pneumorph simulate --gait runs/quick/training/gaits/L1.csv --film --out runs/replay
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Annotated, Any

from pneumorph.base.idle_settings import only_with
from pneumorph.base.layers import layered
from pneumorph.base.run_folder import RunFolder
from pneumorph.catalogue.robot_options import RobotOptions
from pneumorph.catalogue.unseen_pressure import say_lowered_pressure
from pneumorph.command.verb import Verb, flat
from pneumorph.report.film import FilmSettings
from pneumorph.report.replay.live_replay import LiveSettings
from pneumorph.report.shown_walk import simulate_and_show
from pneumorph.study.brought_gait import brought_gait
from pneumorph.study.gait_source import robot_of_source
from pneumorph.study.simulated_walk import SimulatedWalk, WalkSettings


@dataclass(frozen=True)
class SimulateOptions:
    """The robot, its gait, and what to show of it."""

    walk: Annotated[WalkSettings, flat] = field(default_factory=WalkSettings)
    film: bool = False
    """Also make a film."""
    live: bool = False
    """Show the robot in the browser while it is simulated; the address is printed."""
    robot: Annotated[RobotOptions, flat] = field(default_factory=RobotOptions)
    film_settings: FilmSettings = field(default_factory=FilmSettings)
    live_settings: LiveSettings = field(default_factory=LiveSettings)
    idle_settings = only_with(film_settings="film", live_settings="live")

    @classmethod
    def implied(cls, content: Mapping[str, Any], below: Mapping[str, Any]) -> dict[str, Any]:
        """The design, the regulators and the pressures that the robot brings with it."""
        gait, walk = content.get("walk", {}).get("gait"), below["walk"]
        return {"walk": brought_gait(content, below, gait, walk["gait"], walk["expert"])}


def run(options: SimulateOptions, folder: RunFolder) -> SimulatedWalk:
    """Simulate one robot and show it."""
    spec, asked = options.robot.spec(), options.walk
    if asked.model == "reduced":
        options.robot.refuse_full_options()
    elif asked.gait is None:
        say_lowered_pressure(spec, 2.0 * asked.expert.amplitude_kPa, folder.progress.say)
    for note in (notes := options.robot.notes(None if asked.gait else asked.design, spec)):
        folder.progress.say(note)
    film = options.film_settings if options.film else None
    live = options.live_settings if options.live else None
    found = simulate_and_show(asked, spec, folder, film=film, live=live)
    notes += options.robot.forbidden_notes(found.design) if asked.gait else ()
    return replace(found, notes=(*found.notes, *notes))


_LEG = {"leg": "hyperelastic", "physics": {"damping": "objective"}}
_HYPERELASTIC = {"walk": {"model": "full"}, "robot": _LEG}

VERB = Verb(
    SimulateOptions, run,
    {"paper": SimulateOptions, "hyperelastic": lambda: layered(SimulateOptions(), [_HYPERELASTIC])},
    taken_over=lambda options: robot_of_source(options.walk.gait),
)  # fmt: skip
