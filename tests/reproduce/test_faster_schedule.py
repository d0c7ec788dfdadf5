"""The faster schedule that experiments train by."""

from __future__ import annotations

import math

from helpers.experiment_scripts import script

from pneumorph.learn.settings import paper_settings


def test_it_takes_at_most_a_quarter_of_the_papers_timesteps() -> None:
    fast, paper = script("fast_schedule").SCHEDULE, paper_settings()
    finetuning = fast.finetuning.finalist_count * fast.finetuning.round_count(1920) * 1920
    assert fast.timesteps_per_round == 1920
    assert fast.round_count * 1920 + finetuning <= paper.total_timesteps / 4
    assert fast.space == paper.space
    # What its description and its pages say: the entropy falls to that of seven designs.
    assert round(math.exp(fast.schedule.final_entropy)) == 7


def test_the_other_experiment_trains_by_it() -> None:
    assert script("damping_gap").SCHEDULE == script("fast_schedule").SCHEDULE
