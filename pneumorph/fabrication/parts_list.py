"""What a design is made of: legs, silicone, tubes, connectors, prints."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from pneumorph.fabrication.robot_to_make import Payload
from pneumorph.fabrication.tube_plan import TubeRun
from pneumorph.fabrication.workshop_settings import WorkshopSettings

MM3_PER_ML = 1000.0


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
class LegMaterial:
    """What a kind of leg takes."""

    name: str
    """What the kind is called; empty where there is one."""
    count: int
    """How many of it."""
    silicone_mm3: float
    """Silicone of each [mm^3]."""
    sheet_mm2: float
    """Sheet of each [mm^2]; 0 for none."""
    sheet_size: str
    """Its size, such as ``115 x 32 mm``."""
    silicone: str
    """Name of its silicone."""
    density_g_per_ml: float
    """Density of its silicone [g/ml]."""

    @property
    def silicone_ml(self) -> float:
        """Silicone of each [ml]."""
        return self.silicone_mm3 / MM3_PER_ML

    def mass_g(self, workshop: WorkshopSettings) -> float:
        """Mass of one, silicone and sheet [g]."""
        silicone = self.silicone_ml * self.density_g_per_ml
        return silicone + 1e-6 * self.sheet_mm2 * workshop.sheet_g_per_m2


def parts_list(
    legs: Sequence[LegMaterial],
    hub: Printed,
    mould_volumes_mm3: Mapping[str, float],
    tubes: Sequence[TubeRun],
    workshop: WorkshopSettings,
    payload: Payload | None = None,
) -> list[Part]:
    """Everything to buy, print, cut and cast for one robot.

    Args:
        legs: The kinds of legs.
        hub: The hub as it is printed.
        mould_volumes_mm3: Printed volume of each part of the moulds by name [mm^3].
        tubes: The tube plan.
        workshop: Materials.
        payload: What the hub carries; None for nothing.
    """
    mixed_ml: dict[tuple[str, float], float] = {}
    for each in legs:
        kind = each.silicone, each.density_g_per_ml
        cast_ml = each.count * each.silicone_ml * (1.0 + workshop.silicone_waste)
        mixed_ml[kind] = mixed_ml.get(kind, 0.0) + cast_ml
    regulators = sorted({run.regulator for run in tubes})
    # A regulator with n tubes needs n - 1 tees.
    tees = sum(sum(run.regulator == r for run in tubes) - 1 for r in regulators)
    tube_mm = sum(run.length_mm for run in tubes) + len(regulators) * workshop.supply_tube_mm
    rows: list[tuple[str, int, str, float | None, float | None]] = [
        (
            f"PneuNet leg{_called(each)}, cast",
            each.count,
            f"{each.silicone}, each",
            each.silicone_ml,
            each.silicone_ml * each.density_g_per_ml,
        )
        for each in legs
    ]
    rows += [
        (
            "silicone to mix",
            1,
            f"{silicone}, {100 * workshop.silicone_waste:.0f} % waste included",
            volume_ml,
            volume_ml * density,
        )
        for (silicone, density), volume_ml in mixed_ml.items()
    ]
    rows += [
        (
            f"paper layer{_called(each)}",
            each.count,
            f"{each.sheet_size}, under the leg, each",
            None,
            1e-6 * each.sheet_mm2 * workshop.sheet_g_per_m2,
        )
        for each in legs
        if each.sheet_mm2 > 0.0
    ]
    rows += [
        ("hub, printed", 1, hub.detail, hub.volume_ml, hub.mass_g),
        ("tube", 1, f"{workshop.tube}, {math.ceil(tube_mm / 10) / 100:g} m in all", None, None),
        ("T piece", tees, "joins tubes of one regulator", None, None),
        ("tube to a regulator", len(regulators), f"{workshop.supply_tube_mm:g} mm", None, None),
    ]
    if payload is not None:
        rows.append(("payload", 1, f"on the hub, {payload.told}", None, payload.mass_g))
    rows += [
        (
            f"mould, {name}",
            1,
            "printed once",
            volume / MM3_PER_ML,
            volume / MM3_PER_ML * workshop.print_density_g_per_ml,
        )
        for name, volume in mould_volumes_mm3.items()
    ]
    return [Part(number, *row) for number, row in enumerate(rows, start=1)]


def _called(leg: LegMaterial) -> str:
    return f" {leg.name}" if leg.name else ""


def parts_csv(parts: Sequence[Part]) -> str:
    """The list as CSV."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(["number", "name", "count", "detail", "volume_ml", "mass_g"])
    for part in parts:
        numbers = ["" if v is None else f"{v:.2f}" for v in (part.volume_ml, part.mass_g)]
        writer.writerow([part.number, part.name, part.count, part.detail, *numbers])
    return text.getvalue()
