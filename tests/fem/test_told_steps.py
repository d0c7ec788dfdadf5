"""A rollout of finite elements tells how far it is before its first piece ends."""

from __future__ import annotations

import itertools
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from helpers.small_robot import small_robot

import pneumorph.fem.resumable_rollout as resumable
from pneumorph.base.artefact import load_artefact
from pneumorph.trajectory import Trajectory

COMMANDS = np.tile([30.0, 10.0], (8, 1))
Told = list[tuple[int, int, str]]


def rolled(
    folder: Path, monkeypatch: pytest.MonkeyPatch, each_look_s: float
) -> tuple[Told, Trajectory, dict[str, np.ndarray]]:
    """What is told where every look at the clock takes so long, the way, and what is kept of it."""
    looks, told = itertools.count(), Told()
    clock = SimpleNamespace(monotonic=lambda: each_look_s * next(looks))
    monkeypatch.setattr(resumable, "time", clock)
    checkpoint = folder / f"{each_look_s:g}.npz"
    way = resumable.resumable_rollout(
        small_robot(),
        COMMANDS,
        checkpoint,
        settling_steps=3,
        record_every=4,
        checkpoint_every_s=0.0,
        progress=lambda *step: told.append(step),
        keep_checkpoint=True,
    )
    return told, way, load_artefact(checkpoint, "FullRollout", 1)[0]


def test_slow_steps_are_told_one_by_one_and_quick_ones_by_piece(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What is recorded, and kept to go on from, is the same."""
    slow, way, kept = rolled(tmp_path, monkeypatch, 5.0)
    quick, same, kept_too = rolled(tmp_path, monkeypatch, 0.0)
    assert slow == [
        *((step, 3, "settling") for step in (1, 2)),
        *((step, 8, "simulating") for step in range(1, 9)),
    ]
    assert quick == [(4, 8, "simulating"), (8, 8, "simulating")]
    for one, other in ((way.arrays(), same.arrays()), (kept, kept_too)):
        assert one.keys() == other.keys()
        for name, value in one.items():
            np.testing.assert_array_equal(other[name], value, err_msg=name)
