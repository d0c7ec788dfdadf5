"""Put a run on one self-contained page: film, figures, settings, and how to repeat it.

The page opens from disk without a network and prints well. Everything on it is drawn from the files
of the run folder; no display is needed.

Writes page.html, film.mp4 and still.png into RUN/report, or into --out.

Example: pneumorph report runs/quick
"""

from __future__ import annotations

import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import tyro

from pneumorph.command.run_folder import RunFolder, read_settings, read_summary
from pneumorph.command.verb import Verb
from pneumorph.report.film import FilmSettings
from pneumorph.report.run_page import Run, write_run_page


@dataclass(frozen=True)
class ReportOptions:
    """Which run, and how its film looks."""

    run: tyro.conf.Positional[Path] = tyro.MISSING
    """Folder of a finished run of any verb."""
    film: FilmSettings = field(default_factory=FilmSettings)


def report(options: ReportOptions, folder: RunFolder) -> dict[str, Any]:
    """Write the page and return its path."""
    start = time.monotonic()
    run = Run(options.run, read_summary(options.run), read_settings(options.run))
    folder.progress.stage("drawing the page")
    path = write_run_page(run, folder / "page.html", options.film, folder.progress)
    return {
        "page": str(path),
        "page_bytes": path.stat().st_size,
        "run": str(options.run),
        "run_verb": run.summary["verb"],
        "wall_s": time.monotonic() - start,
    }


VERB = Verb(ReportOptions, report, folder=lambda options: options.run / "report")
