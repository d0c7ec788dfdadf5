"""What unseen worlds say of how a training ranked its pairs."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pneumorph.environment.goal import Goal
from pneumorph.learn.failed_walks import counted_walks

_STANDARD_ERRORS = 3.0
"""By so many a mean difference must be ahead: some ten pairs are looked at, one of which is ahead
by two of them by chance alone."""


def ranking_notes(
    labels: Sequence[str], best: int, achieved: np.ndarray, goal: Goal
) -> tuple[str, ...]:
    """Name the pairs that achieve more than the best one in the same unseen worlds.

    Worlds are paired, so what all pairs have in common does not count as scatter.

    Args:
        labels: Of the pairs.
        best: Place of the pair that the training ranked first.
        achieved: By each pair in each world [the goal's unit], (world, pair); NaN where a
            simulation failed, see `counted_walks`.
        goal: What is achieved.
    """
    far = counted_walks(achieved)
    notes = []
    for place, label in enumerate(labels):
        ahead = far[:, place] - far[:, best]
        if place == best or len(ahead) < 2:
            continue
        mean, error = float(ahead.mean()), float(ahead.std(ddof=1) / np.sqrt(len(ahead)))
        if mean > _STANDARD_ERRORS * error:
            notes.append(
                f"{label} achieves {goal.said(mean)} more than {labels[best]} on average over the "
                f"unseen worlds (standard error {goal.said(error)}) and more in "
                f"{100.0 * float((ahead > 0.0).mean()):.0f} % of them; {labels[best]} is the best "
                "by what the training ranks by, in worlds of the training's"
            )
    return tuple(notes)
