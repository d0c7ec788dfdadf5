"""What can be looked at of one walk: its replay, a film, and a page while it is simulated."""

from __future__ import annotations

import time
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path

from pneumorph.base.run_folder import RunFolder
from pneumorph.catalogue.robot_spec import RobotSpec
from pneumorph.report.film import FilmSettings, write_film
from pneumorph.report.physics_words import physics_name
from pneumorph.report.replay.live_replay import LiveReplay, LiveSettings
from pneumorph.report.replay.page import write_replay
from pneumorph.report.scene import Actor
from pneumorph.study.gait_source import find_gait
from pneumorph.study.simulated_walk import SimulatedWalk, WalkSettings, simulate
from pneumorph.trajectory import Trajectory


def simulate_and_show(
    settings: WalkSettings,
    robot: RobotSpec,
    folder: RunFolder,
    *,
    film: FilmSettings | None = None,
    live: LiveSettings | None = None,
) -> SimulatedWalk:
    """Simulate one robot, and write what can be looked at of its walk.

    Args:
        settings: Design, gait and model.
        robot: What walks.
        folder: Receives what `simulate` writes, replay.html, and film.mp4 where a film is wanted.
        film: Settings of the film; None for none.
        live: Settings of a page that shows the robot meanwhile; None for none.

    Raises:
        FileNotFoundError: The gait's file is missing.
        ValueError: It is no gait or does not fit the design, or a film is wanted of a leg without a
            skin.
        OSError: The live page's port is taken.
    """
    start = time.monotonic()
    with ExitStack() as stack:
        page = None
        if live is not None:
            source = find_gait(settings.gait, settings.design, settings.expert)
            page = stack.enter_context(LiveReplay(str(source.design), live, source.goal))
            folder.progress.say(f"live at {page.address}")
        walk = show_walk(simulate(settings, robot, folder, page), folder, film)
        if page is not None:
            folder.progress.say(f"the live page can still be opened: {page.address}")
            walk = replace(walk, live_page_read=page.finish())
    return replace(walk, wall_s=time.monotonic() - start)


def show_walk(
    walk: SimulatedWalk, folder: RunFolder, film: FilmSettings | None = None
) -> SimulatedWalk:
    """Write replay.html and, with settings of a film, film.mp4; return the walk with their names.

    Raises:
        ValueError: A film is wanted of a leg without a skin.
    """
    trajectory = Trajectory.load(Path(walk.trajectory))
    if trajectory.skin_triangles is None and film is None:
        return walk  # a leg of another program may have no skin
    made_in = [physics_name(walk.physics)] if walk.physics is not None else []
    actor = Actor.of(trajectory, "\n".join([walk.design, *made_in]), walk.goal)
    page = write_replay(folder / "replay.html", [actor], title=", ".join([walk.design, *made_in]))
    shown = replace(walk, replay=str(page))
    if film is None:
        return shown
    folder.progress.stage("filming")
    return replace(shown, film=str(write_film(folder / "film.mp4", [actor], film, folder.progress)))
