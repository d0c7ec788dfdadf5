"""What to tell of a robot that fell over: it may have come far by that, once."""

from __future__ import annotations

import numpy as np

from pneumorph.reduction.snapshot_range import range_note

TOPPLED_DEG = 60.0
"""A hub that leans further lies on its side or its back, or is about to [degrees]; trainings
penalise more than 30."""


def toppled_note(name: str, lean_deg: float | None) -> str | None:
    """What to tell of a robot whose hub leaned by more than `TOPPLED_DEG`; None of others.

    Args:
        name: What it is called.
        lean_deg: How far it leaned at most [degrees]; None where that is not known.
    """
    if lean_deg is None or lean_deg <= TOPPLED_DEG:
        return None
    return (
        f"{name} toppled: its hub leaned by up to {lean_deg:.0f} degrees, and what it achieved "
        "counts its fall; look at the replay"
    )


def walk_notes(name: str, range_ratio: float | None, lean_deg: float | None) -> tuple[str, ...]:
    """What to tell of a walk: that it left its legs' snapshots, that it toppled.

    Args:
        name: What the robot is called.
        range_ratio: As of `range_note`.
        lean_deg: As of `toppled_note`.
    """
    told = range_note(name, range_ratio), toppled_note(name, lean_deg)
    return tuple(note for note in told if note is not None)


def toppled_share(lean_deg: np.ndarray) -> float | None:
    """Share of walks that toppled; None where that is not known of any.

    Args:
        lean_deg: How far hubs leaned at most [degrees], (walk,); NaN where not known.
    """
    known = lean_deg[~np.isnan(lean_deg)]
    return float(np.mean(known > TOPPLED_DEG)) if known.size else None


def toppled_in_worlds_note(name: str, share: float | None) -> str | None:
    """What to tell of a robot that toppled in some worlds; None of one that did in none.

    Args:
        name: What it is called.
        share: In which share of its walks it toppled; None where that is not known.
    """
    if not share:
        return None
    return (
        f"{name} toppled in {max(100.0 * share, 1.0):.0f} % of the worlds: its hub leaned by more "
        f"than {TOPPLED_DEG:g} degrees, and its fall counts in what it achieved there"
    )
