"""What can be looked at of one recorded walk: its replay, and a film where that is wanted."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from pneumorph.base.run_folder import RunFolder
from pneumorph.report.film import FilmSettings, write_film
from pneumorph.report.physics_words import physics_name
from pneumorph.report.replay.page import write_replay
from pneumorph.report.scene import Actor
from pneumorph.study.simulated_walk import SimulatedWalk
from pneumorph.trajectory import Trajectory


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
    actor = Actor.of(trajectory, "\n".join([walk.design, *made_in]))
    page = write_replay(folder / "replay.html", [actor], title=", ".join([walk.design, *made_in]))
    shown = replace(walk, replay=str(page))
    if film is None:
        return shown
    folder.progress.stage("filming")
    return replace(shown, film=str(write_film(folder / "film.mp4", [actor], film, folder.progress)))
