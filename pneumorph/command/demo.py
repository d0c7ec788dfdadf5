"""The whole way in one command: the expert's gait at every phase, a design and gait learned
together, and a page that shows both.

This is `pneumorph coopt --preset quick` and then `pneumorph report`, with the reduced leg that
ships with the package. It takes minutes on two cores and needs no display.

Example: pneumorph demo --seed 1 --out runs/demo
"""

from __future__ import annotations

import time
from typing import Any

from pneumorph.command.coopt import VERB as COOPT
from pneumorph.command.coopt import CooptOptions, coopt
from pneumorph.command.run_folder import RunFolder
from pneumorph.command.verb import Verb
from pneumorph.report.run import Run
from pneumorph.report.run_page import write_run_page
from pneumorph.settings import settings_to_dict


def demo(options: CooptOptions, folder: RunFolder) -> dict[str, Any]:
    """Learn, draw the page, and say where it is."""
    start = time.monotonic()
    learned = coopt(options, folder)
    folder.progress.stage("drawing the page")
    summary = {"verb": folder.verb, **folder.provenance, **learned}
    run = Run(folder.path, summary, settings_to_dict(options))
    page = write_run_page(run, folder / "report/page.html").path
    best = learned["best_distance_cm"]
    found = "no gait that a robot survived" if best is None else f"{best:.1f} cm"
    folder.progress.say(
        f"\nlearned: {found}, {learned['best_design']}\n"
        f"expert: {learned['baseline_best_distance_cm']:.1f} cm at its best phase, "
        f"{learned['baseline_best_phase_deg']:.0f} degrees\n"
    )
    return {**learned, "page": str(page), "wall_s": time.monotonic() - start}


VERB = Verb(CooptOptions, demo, COOPT.presets)
