"""The report page of a run of any verb: what was asked, what came out, and how to repeat it."""

from __future__ import annotations

import errno
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Protocol, runtime_checkable

from pneumorph.base.artefact import ArtefactError
from pneumorph.base.progress import Progress
from pneumorph.base.run_folder import SETTINGS, SUMMARY
from pneumorph.catalogue.robot_mass import RobotMass
from pneumorph.environment.goal import Goal
from pneumorph.report import page
from pneumorph.report.expert_words import (
    Durations,
    durations_apart,
    expert_elsewhere,
    unasked_of_expert,
)
from pneumorph.report.learning_figures import said_score
from pneumorph.report.page import Section
from pneumorph.report.physics_words import MEAN_OVER_WORLDS, physics_of
from pneumorph.report.repeat_section import repeat_section
from pneumorph.report.replay.replay_data import ReplaySettings
from pneumorph.report.sheet import Sheet
from pneumorph.report.style import FIGURE_FILES, FigureFormat
from pneumorph.report.verb_pages import (
    EXPERT,
    PAGES,
    TRAINED_DISTANCE,
    TRAINING,
    HeadlineNumber,
    VerbPage,
    experts_numbers,
)
from pneumorph.report.walk_sections import walk_sections
from pneumorph.study.baseline import BestPhase
from pneumorph.study.finished_run import FinishedRun
from pneumorph.study.simulated_walk import SimulatedWalk
from pneumorph.study.training_result import TrainingResult

_SHOWN_ELSEWHERE = (
    "air_fit", "bend", "calibration", "drawing", "node_error", "path_fit", "tolerances",
    "transfer_gaits", "transfer_rewards",
)  # fmt: skip
"""How the names of pictures end that other sections show."""

RUN_PAGE = "report/page.html"
"""Where a training's own page is, from its folder."""


@runtime_checkable
class Noted(Protocol):
    """A result that remarks something."""

    @property
    def notes(self) -> tuple[str, ...]: ...


@dataclass(frozen=True)
class RunPage:
    """A run's page and the figures beside it."""

    page: str
    page_bytes: int
    figures: tuple[str, ...]
    run: str
    run_verb: str
    wall_s: float


def write_run_page(
    run: FinishedRun,
    path: Path,
    replay: ReplaySettings | None = None,
    figure_files: tuple[FigureFormat, ...] = FIGURE_FILES,
) -> RunPage:
    """Write the page of a run.

    Args:
        run: The run.
        path: The HTML file; files of its figures are written beside it.
        replay: How exact replays are.
        figure_files: What each figure is saved as.

    Raises:
        ArtefactError: Its summary is damaged, or of another version.
    """
    start = time.monotonic()
    sheet = Sheet(path.parent, replay, figure_files)
    usual = PAGES.get(run.verb, VerbPage(f"pneumorph {run.verb}", ""))
    shown = PAGES.get(f"{run.verb} {run.settings.get('subject')}", usual)
    found = None if shown.result is None else run.result(shown.result)
    if isinstance(found, SimulatedWalk) and found.status != "completed":
        found = replace(found, distance_cm=None)  # which earlier versions wrote
    goal = run.goal
    with _told_of(run):
        sections = [
            *walk_sections(run.folder, sheet, goal),
            *(section for make in shown.sections for section in make(found, run, sheet)),
            *_picture_sections(run),
            _results_section(found, run),
            repeat_section(run),
        ]
        physics = physics_of(found)
        headline = _headline(found, run, shown, goal)
    where = f"Run folder {run.folder}" + (f", {physics}." if physics else ".")
    title, lead = shown.title, shown.lead
    if shown is TRAINING and run.own_task is not None:
        title = f"A robot learned the task {run.own_task}"
        lead += (
            f" Pairs are ranked by the reward of {run.own_task}, which only its training knows; "
            f"what is told of worlds is {goal.label}, whether the task asks for it or not."
        )
    elif shown is TRAINING and not goal.is_forward:
        title = f"A robot learned to {goal.label}"
    page.write_page(path, title, f"{lead} {where}", headline, sections, sheet.head)
    return RunPage(
        page=str(path),
        page_bytes=path.stat().st_size,
        figures=tuple(str(each) for each in sheet.files),
        run=str(run.folder),
        run_verb=run.verb,
        wall_s=time.monotonic() - start,
    )


def page_of_finished(run: FinishedRun, progress: Progress) -> str | None:
    """Write the page of a run that has just ended, or say why there is none: what was found is
    there all the same.

    Args:
        run: The run.
        progress: Is told why there is no page.

    Returns:
        The page's file, in the run's folder; None where it cannot be written or drawn.
    """
    try:
        return write_run_page(run, run.folder / RUN_PAGE).page
    except (OSError, ValueError) as error:  # such as a full disk, or a value that nothing draws
        progress.say(f"no page of {run.folder}: {error}; `pneumorph report {run.folder}` draws it")
        return None


_OF_THE_DISK = (errno.ENOSPC, errno.EDQUOT, errno.EROFS, errno.EACCES, errno.EIO)


@contextmanager
def _told_of(run: FinishedRun) -> Iterator[None]:
    """Whatever a figure or a table cannot be made of is told with the run's files.

    Raises:
        ArtefactError: A value is of the type that its place has, and nothing can be drawn of it.
    """
    try:
        yield
    except (ValueError, LookupError, TypeError, AttributeError, ArithmeticError, OSError) as error:
        if isinstance(error, ValueError | OSError) and str(run.folder) in str(error):
            raise
        if isinstance(error, OSError) and error.errno in _OF_THE_DISK:
            raise OSError(
                error.errno, f"the page of {run.folder} cannot be written: {error.strerror}"
            ) from error
        raise ArtefactError(
            f"the page of {run.folder} cannot be drawn ({error}): a value of its {SUMMARY} or "
            f"{SETTINGS} is missing or out of range, or pneumorph is at fault; --debug says where"
        ) from error


def _headline(found: Any, run: FinishedRun, shown: VerbPage, goal: Goal) -> str:
    first = [(number, found) for number in shown.headline]
    if run.source is not None and run.source.verb in ("coopt", "demo"):
        elsewhere = expert_elsewhere(run)
        numbers = experts_numbers(elsewhere) if elsewhere else EXPERT
        first += [(number, run.source.result(BestPhase)) for number in numbers]
    compared = any(number.walker == "expert" for number, _ in first)
    scored: dict[str, str] = {}
    if (own_task := unasked_of_expert(run)) is not None:
        scored = _scored(found, own_task)
        first = [(_of_distance(number, goal), of) for number, of in first if not number.of_expert]
    # An expert that is not among the numbers is in the sections below them.
    apart = durations_apart(run) if compared else None
    written = [_named(number, run, apart).said(result, goal) for number, result in first]
    return page.numbers(scored | dict(each for each in written if each is not None))


def _scored(found: Any, own_task: str) -> dict[str, str]:
    """What the best pair of a training was rewarded for a task of one's own, with its label."""
    pairs = found.pairs if isinstance(found, TrainingResult) else ()
    if not pairs or pairs[0].score_cm is None:
        return {}
    return {f"score of the best pair, reward of {own_task}": said_score(pairs[0].score_cm)}


def _of_distance(number: HeadlineNumber, goal: Goal) -> HeadlineNumber:
    """A number that says what it is of, where that was not asked for."""
    return replace(number, label=f"{goal.label} {number.of_goal}") if number.of_goal else number


def _named(number: HeadlineNumber, run: FinishedRun, apart: Durations | None) -> HeadlineNumber:
    """A number with what it must be told with beside others: that it is a mean, and how long the
    walks were where they are not equally long."""
    mean = run.has_drawn_worlds and run.objective is not None and run.objective.is_robust
    if number is TRAINED_DISTANCE and mean:
        number = number.behind(MEAN_OVER_WORLDS)
    if apart is None or not number.walker:
        return number
    return number.behind(apart.of_pairs if number.walker == "pair" else apart.of_expert)


def _picture_sections(run: FinishedRun) -> list[Section]:
    """Return the figures that the verb itself saved and no other section shows."""
    pictures = [
        page.picture(path, path.stem.replace("_", " "))
        for path in sorted(run.folder.glob("*.png"))
        if not path.stem.endswith(_SHOWN_ELSEWHERE)
    ]
    return [Section("Figures", page.side_by_side(*pictures))] if pictures else []


def _results_section(found: Any, run: FinishedRun) -> Section:
    """Return every plain value of the summary, the verb's own and what stands beside them."""
    failed = isinstance(found, SimulatedWalk) and found.distance_cm is None
    plain = [
        (name.replace("_", " "), value)
        for name, value in run.summary.items()
        if isinstance(value, str | int | float) and not isinstance(value, bool)
        if not (name == "distance_cm" and failed)
    ]
    mass: RobotMass | None = getattr(found, "mass", None)
    if mass is not None:
        plain.append(("mass", mass.words))
    notes = found.notes if isinstance(found, Noted) else ()
    said = "".join(page.paragraph(note, "note") for note in notes)
    return Section("Results", page.table(["what", "value"], plain) + said)
