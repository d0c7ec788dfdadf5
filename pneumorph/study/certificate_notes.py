"""What a certificate says besides its numbers."""

from __future__ import annotations

from collections.abc import Collection, Sequence

import numpy as np

from pneumorph.environment.goal import Goal
from pneumorph.simulation.randomisation import Randomisation
from pneumorph.study.certified_pairs import Band, CertifiedPair
from pneumorph.study.certified_walks import FullOrderWalk
from pneumorph.study.toppled_note import toppled_in_worlds_note


def measured_notes(drawn: Randomisation, idle: Collection[str] = ()) -> list[str]:
    """What to say where worlds agree with tests of the robot, which the nominal world does not.

    Args:
        drawn: What the worlds are drawn from.
        idle: Numbers that change nothing of the robot (`idle_numbers`): of their tests
            `idle_notes` says so.
    """
    names = ", ".join(name for name, _, _ in drawn.measured if name not in idle)
    if not names:
        return []
    return [
        f"bands agree with the tests of {names}; what is said of the world as it stands (nominal "
        "distances, friction margins, finite elements) is of the robot before any test"
    ]


def expert_notes(
    band: Band, of_run_s: float, duration_s: float, toppled_share: float | None
) -> list[str]:
    """What to say of the expert's robot.

    Args:
        band: What it achieves.
        of_run_s: How long its gait lasts in the run [s].
        duration_s: How long it walked here, as the pairs did [s].
        toppled_share: In which share of the worlds it fell over; None where not known.
    """
    notes = []
    if not np.isclose(of_run_s, duration_s):
        notes.append(
            f"the expert's gait lasts {of_run_s:g} s in the run, and {duration_s:g} s here as "
            "those of the pairs do"
        )
    if band.failed_count:
        notes.append(f"the expert's robot diverged in {band.failed_count} worlds, counted as 0")
    if (note := toppled_in_worlds_note("the expert's robot", toppled_share)) is not None:
        notes.append(note)
    return notes


def pair_notes(pairs: Sequence[CertifiedPair], goal: Goal) -> list[str]:
    """What to say of pairs that failed, left their snapshots or differ from finite elements."""
    notes = []
    for pair in pairs:
        if pair.band.failed_count:
            notes.append(f"{pair.label} diverged in {pair.band.failed_count} worlds, counted as 0")
        if (note := toppled_in_worlds_note(pair.label, pair.toppled_share)) is not None:
            notes.append(note)
        if pair.left_range_share:
            notes.append(
                f"{pair.label} left the range of its legs' snapshots in "
                f"{100.0 * pair.left_range_share:.0f} % of the worlds"
            )
        for each in pair.full_order:
            if not each.agrees:
                where = "as it stands" if each.world is None else f"number {each.world}"
                full, reduced = (
                    "no end" if far is None else goal.said(far) for far in (each.full, each.reduced)
                )
                why = "" if each.reason is None else f" ({each.reason})"
                notes.append(
                    f"{pair.label} as finite elements in the world {where} comes to {full}{why}, "
                    f"the reduced robot to {reduced}{_chaos(each, goal)}"
                )
    if not any(pair.full_order for pair in pairs):
        notes.append("no pair walked as finite elements; `pneumorph certify RUN --full` makes them")
    return notes


def _chaos(walk: FullOrderWalk, goal: Goal) -> str:
    """What to add of a walk that does not repeat itself."""
    if walk.repeats or walk.near_low is None or walk.near_high is None:
        return ""
    return (
        f" (and in worlds that differ by a thousandth to {goal.said(walk.near_low)} ... "
        f"{goal.said(walk.near_high)}: the walk is chaotic there)"
    )
