"""Recorded motions, simulated and measured, on one page in 3D, with films where they are wanted."""

from __future__ import annotations

import time
from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from pneumorph.base.run_folder import SUMMARY, RunFolder
from pneumorph.environment.goal import FORWARD, Goal
from pneumorph.hardware.marker_track import VideoSettings
from pneumorph.hardware.trial import read_trial
from pneumorph.report.film import FilmSettings, refuse_unwritable, side_by_side, write_film
from pneumorph.report.marker_actor import MarkerActor
from pneumorph.report.page import write_html
from pneumorph.report.physics_words import physics_of_walks
from pneumorph.report.replay.page import page_of, player_of
from pneumorph.report.replay.replay_data import ReplaySettings, replay_data
from pneumorph.report.scene import Actor
from pneumorph.study.finished_run import FinishedRun
from pneumorph.trajectory import Trajectory


@dataclass(frozen=True)
class ReplayedMotions:
    """What a replay shows, and where it is; lists have an entry for each robot or mesh of a leg."""

    page: str
    page_bytes: int
    robots: tuple[str, ...]
    """Labels, without designs and physics."""
    frames: tuple[int, ...]
    """Frames that were kept of each robot."""
    mode_counts: tuple[int, ...]
    """Modes that the page tells legs by, of each mesh."""
    largest_error_mm: float | None
    """How far a leg's node is off at most [mm]; None where only markers move."""
    wall_s: float
    mp4: str | None = None
    gif: str | None = None


def replay_motions(
    motions: Sequence[Actor | MarkerActor],
    folder: RunFolder,
    settings: ReplaySettings | None = None,
    *,
    spacing_mm: float = 340.0,
    films: Collection[str] = (),
    film: FilmSettings | None = None,
) -> ReplayedMotions:
    """Write replay.html and the films.

    Args:
        motions: The robots; see `motion`. Their designs and physics are written beside them where
            they differ, and otherwise once.
        folder: Where to write.
        settings: How exact the page is.
        spacing_mm: Distance between the robots' lanes [mm].
        films: Kinds of film to make: mp4, gif.
        film: How films look.

    Raises:
        ValueError: More frames per second than a kind of film has.
    """
    start = time.monotonic()
    for kind in films:
        refuse_unwritable(folder / f"film.{kind}", film or FilmSettings())
    labelled, told = _told_apart(motions)
    actors = side_by_side(labelled, spacing_mm)
    folder.progress.stage("writing the replay")
    data = replay_data(actors, settings)
    title = " and ".join(actor.label.replace("\n", ", ") for actor in actors)
    title += f", {told}" if told else ""
    path = write_html(folder / "replay.html", page_of(title, player_of(data, told)))
    errors = [each["largest_error_mm"] for each in data["robots"] if "largest_error_mm" in each]
    filmed = {}
    for kind in films:
        folder.progress.stage(f"filming {kind}")
        file = folder / f"film.{kind}"
        filmed[kind] = str(write_film(file, actors, film, folder.progress, told))
    return ReplayedMotions(
        page=str(path),
        page_bytes=path.stat().st_size,
        robots=tuple(each["label"].split("\n")[0] for each in data["robots"]),
        frames=tuple(each["frames"] for each in data["robots"]),
        mode_counts=tuple(each["mode_count"] for each in data["bases"]),
        largest_error_mm=max(errors, default=None),
        mp4=filmed.get("mp4"),
        gif=filmed.get("gif"),
        wall_s=time.monotonic() - start,
    )


RECORDED = ("best_trajectory.npz", "trajectory.npz", "baseline_trajectory.npz")
"""What a run's folder is replayed by, the first that is there."""


def motion(text: str, video: VideoSettings) -> Actor | MarkerActor:
    """The robot that LABEL=PATH or PATH names: a trajectory file, a run that recorded its best pair
    or its only robot, or the folder of a trial.

    Args:
        text: The name.
        video: How a trial's track is read.

    Raises:
        FileNotFoundError: No such file.
        ArtefactError: It holds no trajectory, or nothing to draw.
    """
    label, _, name = text.rpartition("=")
    path = Path(name)
    recorded = next((path / each for each in RECORDED if (path / each).is_file()), None)
    if recorded is not None:
        return _simulated(recorded, label or path.name, _goal(path))
    if path.is_dir():
        return MarkerActor.of(read_trial(path, video), label or f"{path.name} (measured)")
    return _simulated(path, label or path.stem, _goal(path.parent))


def _simulated(file: Path, name: str, goal: Goal) -> Actor:
    """A recorded robot by its name."""
    return Actor.of(Trajectory.load(file), name, goal)


def _told_apart(
    motions: Sequence[Actor | MarkerActor],
) -> tuple[list[Actor | MarkerActor], str]:
    """The robots with what tells them apart below their names, and what is said once of all that
    are simulated: design and physics, as far as their trajectories tell."""
    walks = [each.trajectory for each in motions if isinstance(each, Actor)]
    facts = [(walk.metadata.get("design") or "", physics_of_walks([walk])) for walk in walks]
    shared = [len(set(kind)) == 1 for kind in zip(*facts, strict=True)]
    labelled, left = list[Actor | MarkerActor](), iter(facts)
    for each in motions:
        if isinstance(each, Actor):
            own = [fact for fact, same in zip(next(left), shared, strict=True) if fact and not same]
            each = replace(each, label="\n".join([each.label, *own]))
        labelled.append(each)
    said = [fact for fact, same in zip(*facts[:1], shared, strict=False) if fact and same]
    return labelled, ", ".join(said)


def _goal(folder: Path) -> Goal:
    """What counts in a run; travel forward where the folder is none that has ended."""
    return FinishedRun.read(folder).goal if (folder / SUMMARY).is_file() else FORWARD
