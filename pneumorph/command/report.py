"""Put a run on one self-contained page: replays, figures, settings, and how to repeat it.

The page opens from disk without a network and prints well. Everything on it is drawn from the files
of the run folder; no display is needed. It takes a run of any verb.

Writes page.html, and each figure as PDF and PNG in figures/, into RUN/report or --out.

Example: pneumorph report runs/quick
"""

from __future__ import annotations

import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import tyro

from pneumorph.command.run_folder import RunFolder, read_settings, read_summary
from pneumorph.command.verb import Verb
from pneumorph.report.replay.replay_data import ReplaySettings
from pneumorph.report.run import Run
from pneumorph.report.run_page import write_run_page
from pneumorph.report.sheet import PAGE_REPLAY


@dataclass(frozen=True)
class ReportOptions:
    """Which run, and how exact its replays are."""

    run: tyro.conf.Positional[Path] = tyro.MISSING
    """Folder of a finished run of any verb."""
    replay: ReplaySettings = PAGE_REPLAY


def report(options: ReportOptions, folder: RunFolder) -> dict[str, Any]:
    """Write the page and return its path."""
    start = time.monotonic()
    run = Run(options.run, read_summary(options.run), read_settings(options.run))
    folder.progress.stage("drawing the page")
    written = write_run_page(run, folder / "page.html", options.replay)
    return {
        "page": str(written.path),
        "page_bytes": written.path.stat().st_size,
        "figures": [str(each) for each in written.figures],
        "run": str(options.run),
        "run_verb": run.summary["verb"],
        "wall_s": time.monotonic() - start,
    }


VERB = Verb(ReportOptions, report, folder=lambda options: options.run / "report")
