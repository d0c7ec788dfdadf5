import numpy as np
import pytest
from helpers.small_robot import small_robot

from pneumorph.base.stage_clock import StageClock
from pneumorph.study.full_benchmark import FullBenchmark, bench_full


def test_stages_add_up_to_the_step_they_were_measured_in():
    settings = FullBenchmark(settling_steps=20, walking_steps=3, timed_steps=5, repetitions=3)
    seen = []
    figures = bench_full(
        settings,
        small_robot(soft=True),
        np.full((8, 2), 15.0),
        lambda done, total: seen.append((done, total)),
    )
    stages = [
        getattr(figures, f"{name}_seconds") for name in ("assembly", "factorisation", "contact")
    ]
    assert min(stages) > 0.0
    # What is left is what happens between the stages: real time, and not most of the step's twice.
    assert 0.0 < figures.other_seconds < figures.seconds_per_step
    assert sum(stages) + figures.other_seconds == pytest.approx(figures.seconds_per_step)
    assert figures.elimination_seconds + figures.friction_seconds == pytest.approx(
        figures.contact_seconds
    )
    assert figures.slowest_step_seconds >= figures.seconds_per_step
    assert figures.factorisations_per_step == pytest.approx(
        figures.seconds_per_step / figures.leg_factorisation_seconds
    )
    # Two clocks of microseconds' resolution; one thread cannot use more than the wall time.
    assert 0.0 < figures.cpu_seconds_per_step < figures.seconds_per_step + 1e-4
    assert figures.contact_count > 0
    assert figures.threads == 1
    assert figures.timed_steps == 5
    assert seen == [(number, 8) for number in range(1, 9)]


def test_bad_settings_are_refused():
    with pytest.raises(ValueError, match="timed_steps must be at least 1, got 0"):
        FullBenchmark(timed_steps=0)
    with pytest.raises(ValueError, match="walking_steps must be at least 0, got -1"):
        FullBenchmark(walking_steps=-1)
    with pytest.raises(ValueError, match="has 4 steps, expected 91 or more"):
        bench_full(FullBenchmark(), small_robot(), np.zeros((4, 2)), lambda done, total: None)


def test_clock_counts_calls_that_fail():
    clock = StageClock()
    assert clock.timed("division", divmod)(7, 2) == (3, 1)
    first = clock.seconds["division"]
    with pytest.raises(ZeroDivisionError):
        clock.timed("division", divmod)(1, 0)
    assert clock.seconds["division"] > first > 0.0
    clock.clear()
    assert not clock.seconds
