"""Whether the expert of a training walked as the robots of a run that looks at it do."""

from __future__ import annotations

from pneumorph.report.physics_words import Simulated
from pneumorph.study.finished_run import FinishedRun


def expert_elsewhere(run: FinishedRun) -> str:
    """Where the expert of the training that a run looks at walked, such as ``in the training's
    physics``; empty where that is as the run's own robots did, reduced and in the same physics, and
    both may be compared."""
    if run.source is None:
        return ""
    own, its = run.result(Simulated), run.source.result(Simulated)
    if own.physics is not None and its.physics is not None:
        same = own.physics == its.physics
    else:
        same = own.damping is None or its.damping is None or own.damping == its.damping
    if own.model == "full":
        return "in the training's physics, reduced"
    return "" if same else "in the training's physics"
