"""Kept gaits go as far as when they were kept: the sum of everything that a step is made of."""

from __future__ import annotations

from pathlib import Path

import pytest

from pneumorph.study.finished_run import FinishedRun
from pneumorph.study.recorded_walk import recorded_walk

REPRODUCE = Path(__file__).parent.parent.parent / "reproduce"

ROUNDING_CM = 0.15
"""Other instruction sets and double precision move these distances by 0.035 cm at most. The least
of the mistakes that this should catch moves one of them by much more: a hub that does not know its
tilt takes 26 cm away from the first."""


@pytest.mark.parametrize("rank", [1, 2])
@pytest.mark.parametrize("kept", ["paper_scale", "damping_gap/objective"])
def test_a_kept_gait_goes_as_far_as_it_did(kept: str, rank: int) -> None:
    run = FinishedRun.read(REPRODUCE / kept)
    pair = run.pairs(rank)[rank - 1]
    assert pair.distance_cm is not None
    assert pair.distance_cm > 7.0
    walked = recorded_walk(
        run.robot.spec(),
        pair.design,
        pair.gait,
        record_every=200,
        settling_steps=run.task.settling_step_count,
    )
    assert walked.distance_cm == pytest.approx(pair.distance_cm, abs=ROUNDING_CM)
