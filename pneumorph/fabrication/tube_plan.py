"""The tubes of a robot: which chamber is joined to which regulator, and how long to cut each."""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence
from dataclasses import dataclass

from pneumorph.fabrication.robot_to_make import Seat
from pneumorph.fabrication.workshop_settings import WorkshopSettings


@dataclass(frozen=True)
class TubeRun:
    """One leg's tube."""

    location: int
    """Location around the hub, from 0."""
    direction_deg: float
    """Counter-clockwise from forward [degrees]."""
    regulator: int
    """Regulator, from 1."""
    length_mm: float
    """Cut length [mm]."""
    chamber: int = 1
    """Which chamber of the leg, from 1, the left one first."""


def tube_plan(seats: Sequence[Seat], workshop: WorkshopSettings) -> list[TubeRun]:
    """The tube of every chamber of every leg: through the hub to its middle, with slack.

    Args:
        seats: Where legs sit.
        workshop: Slack.
    """
    return [
        TubeRun(
            seat.location,
            seat.direction_deg,
            regulator,
            round(seat.tube_mm + workshop.tube_slack_mm, 1),
            chamber,
        )
        for seat in seats
        for chamber, regulator in enumerate(seat.regulators, start=1)
    ]


def tubes_csv(tubes: Sequence[TubeRun]) -> str:
    """The tube plan as CSV; with chambers where a leg has several."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    chambers = any(run.chamber > 1 for run in tubes)
    writer.writerow(
        ["location", "direction_deg", "regulator", "length_mm", *(["chamber"] if chambers else [])]
    )
    for run in tubes:
        row = [run.location, f"{run.direction_deg:g}", run.regulator, run.length_mm]
        writer.writerow([*row, *([run.chamber] if chambers else [])])
    return text.getvalue()
