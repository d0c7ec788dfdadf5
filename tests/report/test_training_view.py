"""What a training's page says in numbers."""

from __future__ import annotations

import numpy as np
import pytest

from pneumorph.environment.goal import FORWARD
from pneumorph.learn.design_gait_pair import DesignGaitPair
from pneumorph.learn.snapshot import TrainingSnapshot
from pneumorph.report.training_view import _headline


@pytest.mark.parametrize(
    ("of_round", "found", "said"),
    [(4.0, [7.0], "4.0 cm"), (None, [7.0], "7.0 cm"), (None, [], "none yet")],
)
def test_the_best_is_that_of_the_round_or_what_was_found(
    of_round: float | None, found: list[float], said: str
) -> None:
    """Robots in drawn worlds have none in their rounds."""
    last = {"best_distance_cm": of_round, "best_achieved": of_round, "return_mean_cm": 1.0,
            "design_entropy": 2.0, "design_entropy_target": 2.0}  # fmt: skip
    pairs = [DesignGaitPair(0, np.zeros((1, 3)), each, each, "policy", 9, each) for each in found]
    headline = _headline(TrainingSnapshot([last], pairs, 9, 9, 0.0), FORWARD)
    assert headline[f"best {FORWARD.label}"] == said
