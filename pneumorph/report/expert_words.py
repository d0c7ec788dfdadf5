"""Whether the expert of a training walked as the robots of a run that looks at it do, and for as
long."""

from __future__ import annotations

from dataclasses import dataclass

from pneumorph.report.physics_words import Simulated
from pneumorph.study.finished_run import FinishedRun

_TASKS = {"coopt", "search", "task"}
"""Groups of settings that say how long pairs walk."""


@dataclass(frozen=True)
class Durations:
    """How long the pairs of a run walk and how long the expert beside them, where that differs.

    Attributes:
        pairs_s: Length of an episode [s].
        expert_s: Length of the expert's gait [s].
    """

    pairs_s: float
    expert_s: float

    @property
    def of_pairs(self) -> str:
        """That of the pairs, to stand behind a number."""
        return f"in {self.pairs_s:.3g} s"

    @property
    def of_expert(self) -> str:
        """That of the expert."""
        return f"in {self.expert_s:.3g} s"


def durations_apart(run: FinishedRun) -> Durations | None:
    """How long the pairs and the expert walk that stand beside each other on a run's page; None
    where that is equally long, or where its settings and those of the run that it looks at do not
    tell."""
    learned = run if _TASKS & run.settings.keys() else run.source
    swept = run if "baseline" in run.settings else run.source
    if learned is None or swept is None:
        return None
    if not _TASKS & learned.settings.keys() or "baseline" not in swept.settings:
        return None
    task, step_s = learned.task, learned.robot.physics.time_step_s
    pairs_s = task.walk_s(step_s)
    expert_s = swept.baseline.gait.duration_s
    return None if abs(pairs_s - expert_s) < step_s else Durations(pairs_s, expert_s)


def unasked_of_expert(run: FinishedRun) -> str | None:
    """The task of one's own that the pairs of a run, or of the run that it looks at, learned: the
    expert was not asked for it, and is not to be compared by anything else. None of other runs."""
    return run.own_task if run.source is None else run.own_task or run.source.own_task


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
