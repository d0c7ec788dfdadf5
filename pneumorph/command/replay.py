"""Look at trajectories in 3D: one page that opens in any browser, from disk and without a network.

Takes trajectory files (trajectory.npz of simulate, best_trajectory.npz of coopt ...), folders of
such runs, and folders of measured trials (log.csv and track.csv of deploy), each as LABEL=PATH or
PATH; robots are shown side by side. For a real robot only the marker's path is known, so it is
shown as a path and a triad.

The page has a draggable time line with pressures and distances, speed, pause, single steps and
cameras. Legs are coloured by regulator or by pressure. --mp4 and --gif also make a film.

Writes replay.html and, where asked for, film.mp4 and film.gif.

Example: pneumorph replay learned=RUN/best_trajectory.npz expert=RUN/baseline_trajectory.npz
"""

from __future__ import annotations

from dataclasses import dataclass, field

import tyro

from pneumorph.base.checked import Checked, NotNegative
from pneumorph.base.run_folder import RunFolder
from pneumorph.command.verb import Verb
from pneumorph.hardware.marker_track import VideoSettings
from pneumorph.report.film import FilmSettings
from pneumorph.report.replay.replay_data import ReplaySettings
from pneumorph.report.replay.replayed_motions import ReplayedMotions, motion, replay_motions


@dataclass(frozen=True)
class ReplayOptions(Checked):
    """What to show, and how."""

    motions: tyro.conf.Positional[tuple[str, ...]] = tyro.MISSING
    """Trajectory files, runs that recorded one, and folders of trials, as LABEL=PATH or PATH."""
    spacing_mm: NotNegative = 340.0
    """Distance between the robots' lanes [mm]; 0 overlays them."""
    mp4: bool = False
    """Also make film.mp4."""
    gif: bool = False
    """Also make film.gif."""
    replay: ReplaySettings = field(default_factory=ReplaySettings)
    film: FilmSettings = field(default_factory=FilmSettings)
    video: VideoSettings = field(default_factory=VideoSettings)

    def __post_init__(self) -> None:
        super().__post_init__()
        if not self.motions:
            raise ValueError("motions is empty, expected at least one trajectory file or trial")

    def idle_settings(self) -> dict[str, str]:
        """Those of a film that nobody asked for."""
        return {} if self.mp4 or self.gif else {"film": "without --mp4 or --gif"}


def run(options: ReplayOptions, folder: RunFolder) -> ReplayedMotions:
    """Write the page and the films."""
    return replay_motions(
        [motion(text, options.video) for text in options.motions],
        folder,
        options.replay,
        spacing_mm=options.spacing_mm,
        films=[kind for kind in ("mp4", "gif") if getattr(options, kind)],
        film=options.film,
    )


VERB = Verb(ReplayOptions, run)
