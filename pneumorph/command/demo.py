"""Learn a robot in one command: the expert's gait at every phase, design and gait learned together,
and a page that shows both.

This is `pneumorph coopt --preset quick`, with the reduced leg of measured silicone that ships with
the package. The page begins with how far the best robot goes in worlds that training never saw,
beside the expert's. It takes about five minutes on two idle cores, and needs no display. No finite
elements are simulated; use `pneumorph certify --full` for that.

Example: pneumorph demo --seed 1 --out runs/demo
"""

from __future__ import annotations

from pneumorph.base.run_folder import RunFolder
from pneumorph.command.coopt import VERB as COOPT
from pneumorph.command.verb import Verb
from pneumorph.study.training_options import TrainingOptions
from pneumorph.study.training_result import TrainingResult


def demo(options: TrainingOptions, folder: RunFolder) -> TrainingResult:
    """Learn, draw the page, and say what was learned."""
    found = COOPT.run(options, folder)
    folder.progress.say(f"\n{_said(found)}\n")
    return found


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
