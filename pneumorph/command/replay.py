"""Look at trajectories in 3D: one page that opens in any browser, from disk and without a network.

Takes trajectory files (trajectory.npz of simulate, best_trajectory.npz of coopt ...) and folders of
measured trials (log.csv and track.csv of deploy), each as LABEL=PATH or PATH; robots stand side by
side. Of a real robot only the path of its marker is known: it is shown as a path and a triad.

The page has a time line to drag, with pressures and distances, speed, pause, single steps and
cameras. Legs are coloured by regulator or by pressure. With --mp4 and --gif a film is made as well.

Writes replay.html and, where asked for, film.mp4 and film.gif.

Example: pneumorph replay learned=RUN/best_trajectory.npz expert=RUN/baseline_trajectory.npz
"""

from __future__ import annotations

import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import tyro

from pneumorph.command.run_folder import RunFolder
from pneumorph.command.verb import Verb
from pneumorph.hardware.marker_track import VideoSettings
from pneumorph.hardware.trial import read_trial
from pneumorph.report.film import FilmSettings, side_by_side, write_film
from pneumorph.report.marker_actor import MarkerActor
from pneumorph.report.replay.page import page_of, player_of, write_page_file
from pneumorph.report.replay.replay_data import ReplaySettings, replay_data
from pneumorph.report.scene import Actor
from pneumorph.trajectory import Trajectory


@dataclass(frozen=True)
class ReplayOptions:
    """What to show, and how."""

    motions: tyro.conf.Positional[tuple[str, ...]] = tyro.MISSING
    """Trajectory files and folders of trials, as LABEL=PATH or PATH."""
    spacing_mm: float = 340.0
    """Distance between the robots' lanes [mm]; 0 lays them over each other."""
    mp4: bool = False
    """Make film.mp4 as well."""
    gif: bool = False
    """Make film.gif as well."""
    replay: ReplaySettings = field(default_factory=ReplaySettings)
    film: FilmSettings = field(default_factory=FilmSettings)
    video: VideoSettings = field(default_factory=VideoSettings)

    def __post_init__(self) -> None:
        if not self.motions:
            raise ValueError("motions is empty, expected at least one trajectory file or trial")
        if not self.spacing_mm >= 0.0:
            raise ValueError(f"spacing_mm is {self.spacing_mm}, expected 0 or more")


def replay(options: ReplayOptions, folder: RunFolder) -> dict[str, Any]:
    """Write the page and the films; return what they show."""
    start = time.monotonic()
    actors = side_by_side(
        [_actor(text, options.video) for text in options.motions], options.spacing_mm
    )
    folder.progress.stage("writing the replay")
    data = replay_data(actors, options.replay)
    title = " and ".join(actor.label for actor in actors)
    path = write_page_file(folder / "replay.html", page_of(title, player_of(data)))
    errors = [each["largest_error_mm"] for each in data["robots"] if "largest_error_mm" in each]
    films = {}
    for suffix in ("mp4", "gif"):
        if getattr(options, suffix):
            folder.progress.stage(f"filming {suffix}")
            film = write_film(folder / f"film.{suffix}", actors, options.film, folder.progress)
            films[suffix] = str(film)
    return {
        "page": str(path),
        "page_bytes": path.stat().st_size,
        "robots": [each["label"] for each in data["robots"]],
        "frames": [each["frames"] for each in data["robots"]],
        "mode_counts": [each["mode_count"] for each in data["bases"]],
        "largest_error_mm": max(errors, default=None),
        **films,
        "wall_s": time.monotonic() - start,
    }


def _actor(text: str, video: VideoSettings) -> Actor | MarkerActor:
    """Return the robot that LABEL=PATH or PATH names."""
    label, _, name = text.rpartition("=")
    path = Path(name)
    if path.is_dir():
        return MarkerActor.of(read_trial(path, video), label or f"{path.name} (measured)")
    return Actor.of(Trajectory.load(path), label or path.stem)


VERB = Verb(ReplayOptions, replay)
