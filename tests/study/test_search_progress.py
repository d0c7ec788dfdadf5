"""A search tells how far it is in a generation and in its evaluation, and ends at its end."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from pneumorph.learn.objective import Objective
from pneumorph.study.search_progress import SearchProgress


@pytest.mark.parametrize("worlds", [1, 4])
def test_steps_are_counted_to_the_end(worlds: int) -> None:
    """Two generations of 10 candidates, four side by side, and as many finalists in 8 worlds."""
    told: list[tuple[int, int, str]] = []
    objective = Objective(worlds_per_design=worlds, evaluation_worlds=8)
    timesteps = 2 * 10 * 3 * worlds
    progress = SearchProgress(
        lambda *each: told.append(each), timesteps, 3, objective, 6, 4 * worlds
    )
    asked: Any = SimpleNamespace(ask=lambda: np.arange(10), tell=lambda _: None)
    searcher = progress.of(asked)
    for generation in range(2):
        searcher.ask()
        progress(generation * 10 * 3 * worlds, timesteps, "searching")
        for _ in range(3 * 3):
            progress.stepped()
    progress(timesteps, timesteps, "searching")
    evaluated = 0 if worlds == 1 else 2 * 2 * 3
    for _ in range(evaluated):
        progress.stepped()
    steps = [done for done, _, _ in told]
    assert steps == sorted(steps)
    assert steps[-1] == progress.total == 2 * 9 + evaluated
    assert {total for _, total, _ in told} == {progress.total}
