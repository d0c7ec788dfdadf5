"""Snapshots that end below the pressure that was asked for."""

from __future__ import annotations

from pneumorph.reduction.collect import SnapshotSettings, short_bend_note
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
