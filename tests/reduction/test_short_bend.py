"""Snapshots that end below the pressure that was asked for."""

from __future__ import annotations

import numpy as np

from pneumorph.reduction.collect import SnapshotSettings, short_bend_note, short_bend_notes
from pneumorph.reduction.snapshots import Snapshots
from pneumorph.reduction.static_snapshots import StaticSnapshotSettings


def test_free_bends_that_end_early_are_told() -> None:
    """But for the last, at whose pressure there may be no equilibrium."""
    settings = SnapshotSettings(
        static=StaticSnapshotSettings(bend_pressure_kPa=12.0, bend_count=12)
    )
    assert short_bend_note(12.0, settings) is None
    assert short_bend_note(11.0, settings) is None
    note = short_bend_note(8.4, settings)
    assert note is not None
    assert note.startswith("free bends were found up to 8.4 kPa alone, of 12 asked for: the leg ba")


def test_of_several_cavities_each_that_ends_early_is_named() -> None:
    """Also where nothing was found with all of them, and whatever else was collected."""
    settings = SnapshotSettings(
        static=StaticSnapshotSettings(bend_pressure_kPa=12.0, bend_count=12)
    )
    sources = ["bend", "bend of cavity_left", "bend of cavity_right", "load"]
    reached = {1: 12.0, 2: 8.4, 3: 3.0}
    snapshots = Snapshots(
        np.zeros((3, 1, 3), dtype=np.float32),
        np.array(list(reached.values())),
        np.array(list(reached)),
        {"sources": sources},
    )
    every, right = short_bend_notes(snapshots, settings)
    assert every.startswith("free bends were found up to 0 kPa alone, of 12 asked for")
    assert right.startswith(
        "free bends with cavity_right alone inflated were found up to 8.4 kPa alone, of 12 asked"
    )
