"""Put a run on one self-contained page: replays, figures, settings, and how to repeat it.

The page opens from disk without a network and prints well. Everything on it is drawn from the files
of the run folder; no display is needed. It takes a run of any verb.

Writes page.html, and each figure as PDF and PNG in figures/, into RUN/report or --out.

Example: pneumorph report runs/quick
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import tyro

from pneumorph.base.run_folder import RunFolder
from pneumorph.command.verb import Verb
from pneumorph.report.replay.replay_data import ReplaySettings
from pneumorph.report.run_page import RunPage, write_run_page
from pneumorph.report.sheet import PAGE_REPLAY
from pneumorph.report.style import FIGURE_FILES, FigureFormat
from pneumorph.study.finished_run import FinishedRun


@dataclass(frozen=True)
class ReportOptions:
    """Which run, and how exact its replays are."""

    run: tyro.conf.Positional[Path] = tyro.MISSING
    """Folder of a finished run of any verb."""
    figure_files: tuple[FigureFormat, ...] = FIGURE_FILES
    """Formats in which each figure is saved beside the page; none to save only the page."""
    replay: ReplaySettings = PAGE_REPLAY


def run(options: ReportOptions, folder: RunFolder) -> RunPage:
    """Write the page."""
    finished = FinishedRun.read(options.run)
    folder.progress.stage("drawing the page")
    page = folder / "page.html"
    return write_run_page(finished, page, options.replay, options.figure_files)


VERB = Verb(ReportOptions, run, folder=lambda options: options.run / "report")
