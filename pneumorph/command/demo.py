"""Learn a robot in one command: the expert's gait at every phase, design and gait learned together,
and a page that shows both.

This runs `pneumorph coopt --preset quick` and then `pneumorph report`, with the reduced leg of
measured silicone that ships with the package. The page begins with how far the best robot goes in
worlds that training never saw, beside the expert's. It takes some minutes on two idle cores,
thirteen where they lack AVX-512, and needs no display. No finite elements are simulated; use
`pneumorph certify --full` for that.

Example: pneumorph demo --seed 1 --out runs/demo
"""

from __future__ import annotations

import time
from dataclasses import dataclass

from pneumorph.base.result import result_to_dict
from pneumorph.base.run_folder import RunFolder
from pneumorph.base.settings import settings_to_dict
from pneumorph.command.coopt import VERB as COOPT
from pneumorph.command.verb import Verb
from pneumorph.report.run_page import write_run_page
from pneumorph.study.finished_run import FinishedRun
from pneumorph.study.training_options import TrainingOptions, train_as_asked
from pneumorph.study.training_run import TrainingResult


@dataclass(frozen=True, kw_only=True)
class Demo(TrainingResult):
    """What was learned, and the page that shows it."""

    page: str


def demo(options: TrainingOptions, folder: RunFolder) -> Demo:
    """Learn, draw the page, and say where it is."""
    start = time.monotonic()
    found = train_as_asked(options, folder)
    folder.progress.stage("drawing the page")
    summary = {"verb": folder.verb, **folder.provenance, **result_to_dict(found)}
    run = FinishedRun(folder.path, summary, settings_to_dict(options))
    page = write_run_page(run, folder / "report/page.html").page
    folder.progress.say(f"\n{_said(found)}\n")
    return Demo(**{**vars(found), "wall_s": time.monotonic() - start}, page=page)


def _said(found: TrainingResult) -> str:
    """What the best pair and the expert achieve, for a person."""
    certificate, goal = found.certificate, found.goal
    if certificate is not None:
        expert = certificate.expert.band
        return (
            f"{certificate.best_design} in {certificate.world_count} worlds that training never "
            f"saw: {goal.said(certificate.median)} (median), "
            f"{goal.said(certificate.tenth_percentile)} to "
            f"{goal.said(certificate.ninetieth_percentile)} in 80 % of them\n"
            f"the expert's robot there: {goal.said(expert.median)}, {goal.said(expert.low)} to "
            f"{goal.said(expert.high)}; the learned one goes further in "
            f"{100.0 * certificate.share_beyond_expert:.0f} %"
        )
    best = found.best_distance_cm if goal.is_forward else found.best_achieved
    far = "no gait that a robot survived" if best is None else goal.said(best)
    return (
        f"learned: {far}, {found.best_design}\n"
        f"expert: {goal.said(found.best_achieved_by_expert)} at its best phase, "
        f"{found.baseline_best_phase_deg:.0f} degrees"
    )


VERB = Verb(TrainingOptions, demo, COOPT.presets)
