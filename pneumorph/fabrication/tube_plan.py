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
    """Which chamber of the leg, from 1, in the order of its mesh's cavities."""
    chambers: int = 1
    """How many chambers the leg has."""
    leg: str = ""
    """The kind of leg; empty where there is one and no need of a name."""
    site: str = ""
    """What the site is called; empty for its number."""
    side: str = ""
    """Which of several chambers, for a person; empty of the only one."""


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
            len(seat.regulators),
            "" if seat.leg is None else seat.leg.name,
            seat.name,
            "" if seat.leg is None else seat.leg.chamber_names[chamber - 1],
        )
        for seat in seats
        for chamber, regulator in enumerate(seat.regulators, start=1)
    ]


def tubes_csv(tubes: Sequence[TubeRun]) -> str:
    """The tube plan as CSV; with chambers, kinds of legs and names of sites where there are."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    further = [
        name
        for name, told in (
            ("chamber", any(run.chambers > 1 for run in tubes)),
            ("side", any(run.side for run in tubes)),
            ("leg", any(run.leg for run in tubes)),
            ("site", any(run.site for run in tubes)),
        )
        if told
    ]
    writer.writerow(["location", "direction_deg", "regulator", "length_mm", *further])
    for run in tubes:
        row = [run.location, f"{run.direction_deg:g}", run.regulator, run.length_mm]
        writer.writerow([*row, *(getattr(run, name) for name in further)])
    return text.getvalue()
