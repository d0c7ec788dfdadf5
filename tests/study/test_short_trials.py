"""Trials that ended early, beside whole ones."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np

from pneumorph.study.transfer import whole_trials


def trial(name: str, end_s: float) -> Any:
    return SimpleNamespace(name=name, track=SimpleNamespace(time_s=np.array([0.0, end_s])))


def test_a_trial_that_ended_early_does_not_cut_the_others_short() -> None:
    """Of a gait of 20 s; up to a step of 1 s may be missing."""
    whole, late, short = trial("trial_1", 20.0), trial("trial_2", 19.2), trial("trial_3", 1.1)
    assert whole_trials("L", [whole, late], 20.0, 1.0) == ((whole, late), [])
    kept, told = whole_trials("L", [whole, short, late], 20.0, 1.0)
    assert kept == (whole, late)
    assert told == [
        "L: of a gait of 20 s tracks tell of a part: trial_3 from 0.00 to 1.10 s; left out"
    ]
    kept, told = whole_trials("L", [short], 20.0, 1.0)
    assert kept == (short,)
    assert told[0].endswith("from 0.00 to 1.10 s; what all have in common is compared")


def test_a_trial_whose_track_begins_late_is_left_out() -> None:
    """The marker was not seen at first: how far it went until then nobody knows."""
    whole, unseen = trial("trial_1", 20.0), trial("trial_2", 20.0)
    unseen.track.time_s = np.array([4.0, 20.0])
    kept, told = whole_trials("L", [whole, unseen], 20.0, 1.0)
    assert kept == (whole,)
    assert told[0].endswith("trial_2 from 4.00 to 20.00 s; left out")
