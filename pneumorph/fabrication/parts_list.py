"""What a design is made of: legs, silicone, tubes, connectors, prints."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Sequence
from dataclasses import dataclass

from pneumorph.base.checked import Checked, NotNegative, Positive
from pneumorph.catalogue.masses import PRINT_DENSITY_G_PER_ML, CastDensities
from pneumorph.geometry.mounting import RadialMounting
from pneumorph.geometry.pneunet import PneuNetShape
from pneumorph.robot.design import Design

MM3_PER_ML = 1000.0


@dataclass(frozen=True)
class WorkshopSettings(Checked):
    """Materials and supplies, for the parts list."""

    silicone: str = "Dragon Skin 30"
    """Name of the silicone."""
    silicone_density_g_per_ml: Positive = CastDensities().silicone_g_per_ml
    """Density of the silicone [g/ml]."""
    sheet_g_per_m2: NotNegative = CastDensities().sheet_g_per_m2
    """Mass per area of the sheet under the leg [g/m^2]."""
    silicone_waste: NotNegative = 0.2
    """Additional silicone that stays in cups, holes and syringes, relative to what is cast."""
    print_density_g_per_ml: Positive = PRINT_DENSITY_G_PER_ML
    """Density of the printed moulds [g/ml]; the default is PLA's."""
    tube: str = "silicone tube 2 x 3 mm"
    """Name of the tube."""
    supply_tube_mm: Positive = 800.0
    """Length of tube from the middle of the hub to a regulator [mm]."""
    tube_slack_mm: NotNegative = 40.0
    """Length added to each leg's tube [mm], for its end in the leg and slack at the hub."""


@dataclass(frozen=True)
class Printed:
    """A printed part."""

    detail: str
    """What it is printed of, and how."""
    volume_ml: float
    """Its volume [ml]."""
    mass_g: float
    """Its mass [g]."""


@dataclass(frozen=True)
class Part:
    """One line of the parts list."""

    number: int
    name: str
    count: int
    detail: str
    volume_ml: float | None = None
    mass_g: float | None = None


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


def tube_plan(
    design: Design, mounting: RadialMounting, channel_length_mm: float, workshop: WorkshopSettings
) -> list[TubeRun]:
    """The tube of every leg: through its channel to the hub's middle, with slack.

    Args:
        design: The design.
        mounting: Where legs sit.
        channel_length_mm: From a socket's face to the well [mm].
        workshop: Slack.
    """
    length = channel_length_mm + workshop.tube_slack_mm
    return [
        TubeRun(
            location,
            360.0 / mounting.location_count * (location + 0.5),
            regulator,
            round(length, 1),
        )
        for location, regulator in design.legs
    ]


def parts_list(
    design: Design,
    leg: PneuNetShape,
    leg_volume_mm3: float,
    hub: Printed,
    mould_volumes_mm3: dict[str, float],
    tubes: list[TubeRun],
    workshop: WorkshopSettings,
) -> list[Part]:
    """Everything to buy, print, cut and cast for one robot.

    Args:
        design: The design.
        leg: The leg's sizes.
        leg_volume_mm3: Silicone of one leg [mm^3].
        hub: The hub as it is printed.
        mould_volumes_mm3: Printed volume of each part of the mould by name [mm^3].
        tubes: The tube plan.
        workshop: Materials.
    """
    count = design.leg_count
    leg_ml = leg_volume_mm3 / MM3_PER_ML
    mixed_ml = count * leg_ml * (1.0 + workshop.silicone_waste)
    regulators = sorted({run.regulator for run in tubes})
    # A regulator with n legs needs n - 1 tees.
    tees = sum(sum(run.regulator == r for run in tubes) - 1 for r in regulators)
    plate_length, plate_width, _ = leg.base_plate_mm
    tube_mm = sum(run.length_mm for run in tubes) + len(regulators) * workshop.supply_tube_mm
    rows = [
        (
            "PneuNet leg, cast",
            count,
            f"{workshop.silicone}, each",
            leg_ml,
            leg_ml * workshop.silicone_density_g_per_ml,
        ),
        (
            "silicone to mix",
            1,
            f"{workshop.silicone}, {100 * workshop.silicone_waste:.0f} % waste included",
            mixed_ml,
            mixed_ml * workshop.silicone_density_g_per_ml,
        ),
        (
            "paper layer",
            count,
            f"{plate_length:g} x {plate_width:g} mm, under the leg, each",
            None,
            1e-6 * plate_length * plate_width * workshop.sheet_g_per_m2,
        ),
        ("hub, printed", 1, hub.detail, hub.volume_ml, hub.mass_g),
        ("tube", 1, f"{workshop.tube}, {math.ceil(tube_mm / 10) / 100:g} m in all", None, None),
        ("T piece", tees, "joins legs of one regulator", None, None),
        ("tube to a regulator", len(regulators), f"{workshop.supply_tube_mm:g} mm", None, None),
        *(
            (
                f"mould, {name}",
                1,
                "printed once",
                volume / MM3_PER_ML,
                volume / MM3_PER_ML * workshop.print_density_g_per_ml,
            )
            for name, volume in mould_volumes_mm3.items()
        ),
    ]
    return [Part(number, *row) for number, row in enumerate(rows, start=1)]


def parts_csv(parts: Sequence[Part]) -> str:
    """The list as CSV."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(["number", "name", "count", "detail", "volume_ml", "mass_g"])
    for part in parts:
        numbers = ["" if v is None else f"{v:.2f}" for v in (part.volume_ml, part.mass_g)]
        writer.writerow([part.number, part.name, part.count, part.detail, *numbers])
    return text.getvalue()


def tubes_csv(tubes: Sequence[TubeRun]) -> str:
    """The tube plan as CSV."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(["location", "direction_deg", "regulator", "length_mm"])
    for run in tubes:
        writer.writerow([run.location, f"{run.direction_deg:g}", run.regulator, run.length_mm])
    return text.getvalue()
