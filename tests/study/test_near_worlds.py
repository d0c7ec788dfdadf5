"""Worlds that nobody could tell apart, and walks that are chaotic there."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from pneumorph.environment.goal import FORWARD
from pneumorph.physics.physics import Physics
from pneumorph.simulation.randomisation import World
from pneumorph.study.certificate_notes import _chaos
from pneumorph.study.certified_walks import FullOrderWalk, KeptWalk
from pneumorph.study.near_worlds import NEAR_SHARE, near_worlds

PHYSICS = Physics(friction_by_surface=(("skin", 0.9), ("hub", 0.3)))
WORLD = World(0.7, 1.1, 0.9, 0.05, 1.0, friction_by_surface=(("skin", 0.5),), reduction="leg.npz")


def test_they_differ_by_a_thousandth_and_in_nothing_else() -> None:
    count = 400
    worlds = near_worlds(WORLD, PHYSICS, count)
    assert worlds == near_worlds(WORLD, PHYSICS, count)
    rows = np.array(
        [
            [w.friction, w.modulus_factor, w.mass_factor, *(v for _, v in w.friction_by_surface)]
            for w in worlds
        ]
    )
    surfaces = {name for w in worlds for name, _ in w.friction_by_surface}
    assert surfaces == {"skin", "hub"}  # the hub's is the physics' own
    changes = rows / np.array([0.7, 1.1, 0.9, 0.5, 0.3]) - 1.0
    # A mean of 400 strays from 0 by 0.05 deviations, a deviation from its own by 0.035; six times.
    assert np.abs(changes.mean(axis=0)).max() < 0.3 * NEAR_SHARE
    assert np.abs(changes.std(axis=0) / NEAR_SHARE - 1.0).max() < 0.21
    assert np.abs(np.corrcoef(changes.T) - np.eye(5)).max() < 0.3
    same = {
        "friction": 0.7, "modulus_factor": 1.1, "mass_factor": 0.9,
        "friction_by_surface": WORLD.friction_by_surface,
    }  # fmt: skip
    assert {replace(w, **same) for w in worlds} == {WORLD}


@pytest.mark.parametrize(
    ("near", "repeats"),
    [([10.0, 10.29], True), ([9.69, 10.0], False), ([10.0, np.nan], False), ([-9.0, 9.9], False)],
)
def test_a_walk_that_a_thousandth_changes_is_chaotic(near: list[float], repeats: bool) -> None:
    """Nothing is to be learned of the reduction from such a walk; how it agrees stands."""
    kept = KeptWalk(20.0, "completed", 1.0)
    walk = FullOrderWalk.of(3, kept, 10.0, near=np.array(near))
    assert (walk.agrees, walk.repeats, walk.parts) == (False, repeats, repeats)
    assert (walk.near_low, walk.near_high) == (
        np.nan_to_num(near).min(),
        np.nan_to_num(near).max(),
    )
    assert ("chaotic" in _chaos(walk, FORWARD)) is not repeats
    assert FullOrderWalk.of(3, kept, 10.0).parts
