"""A socket of a printed hub, in the frame of the leg that it carries: walls around the leg's end
tooth, a wall behind it that it is glued to, and holes for its tubes.
"""

from __future__ import annotations

from typing import Any

from pneumorph.fabrication.hub_settings import HubSettings
from pneumorph.fabrication.solid import FabricationError
from pneumorph.geometry.netgen_mesher import box, open_cascade, union
from pneumorph.geometry.pneunet import PneuNetShape

BEYOND_MM = 5.0
"""How far what is cut away reaches beyond a solid [mm]."""
PAD_MM = 12.0
"""How far a socket reaches inwards behind the leg: a round flank lies that much further inwards at
the socket's corners [mm]."""


def collar(leg: PneuNetShape, settings: HubSettings) -> Any:
    """Walls beside and above the end tooth, and the pad behind it that fills up to the hub."""
    length, width, _ = leg.tooth_base_mm
    outer = width / 2.0 + settings.clearance_mm + settings.wall_mm
    bottom = leg.base_plate_mm[2] + settings.clearance_mm
    top = leg.height_mm + settings.clearance_mm + settings.wall_mm
    return box(
        (-length / 2.0 - PAD_MM, -outer, bottom),
        (PAD_MM + settings.socket_depth_mm, 2.0 * outer, top - bottom),
    )


def behind_the_socket(leg: PneuNetShape, settings: HubSettings) -> Any:
    """What is hollow of the pad: all but a wall behind the tooth's face and the collar's walls."""
    length, width, _ = leg.tooth_base_mm
    half = width / 2.0 + settings.clearance_mm
    back = -length / 2.0 - settings.wall_mm
    top = leg.height_mm + settings.clearance_mm
    return box((back - PAD_MM, -half, -BEYOND_MM), (PAD_MM, 2.0 * half, top + BEYOND_MM))


def within_the_pad(leg: PneuNetShape, settings: HubSettings, end_wall: bool) -> Any:
    """What is hollow of the pad, with a wall below as well, and one at its end or not."""
    length, width, _ = leg.tooth_base_mm
    half = width / 2.0 + settings.clearance_mm
    bottom = leg.base_plate_mm[2] + settings.clearance_mm + settings.wall_mm
    deep = PAD_MM - settings.wall_mm * (2.0 if end_wall else 1.0)
    return box(
        (-length / 2.0 - settings.wall_mm - deep, -half, bottom),
        (deep, 2.0 * half, leg.height_mm + settings.clearance_mm - bottom),
    )


def leg_space(leg: PneuNetShape, settings: HubSettings, around_mm: float = 0.0) -> Any:
    """What the leg takes, with clearance: its end tooth, open downwards, and its base plate.

    Args:
        leg: The leg.
        settings: The clearance.
        around_mm: So much more on every side but below, and behind the tooth [mm].
    """
    gap = settings.clearance_mm + around_mm
    length, width, _ = leg.tooth_base_mm
    plate_length, plate_width, plate_height = leg.base_plate_mm
    tooth = box(
        (-length / 2.0 - around_mm, -width / 2.0 - gap, -1.0),
        (length + 2.0 * around_mm, width + 2.0 * gap, leg.height_mm + gap + 1.0),
    )
    plate = box(
        (-plate_length / 2.0 - gap, -plate_width / 2.0 - gap, -10.0),
        (plate_length, plate_width + 2.0 * gap, plate_height + gap + 10.0),
    )
    return tooth + plate


def tube_places_mm(leg: PneuNetShape) -> list[float]:
    """Where the tubes of a leg's chambers enter its end tooth, across the leg [mm]; left first."""
    if leg.middle_wall_mm == 0.0:
        return [0.0]
    middle = 0.25 * (leg.chamber_mm[1] + leg.middle_wall_mm)
    return [middle, -middle]


def channel_height_mm(leg: PneuNetShape, settings: HubSettings) -> float:
    """Height of a leg's tube holes above its underside [mm].

    Raises:
        FabricationError: They do not lead into its chamber.
    """
    floor, radius = leg.base_plate_mm[2], settings.channel_radius_mm
    height = 2.0 * floor if settings.channel_height_mm is None else settings.channel_height_mm
    top = floor + leg.chamber_mm[2]
    if not floor <= height - radius < height + radius <= top:
        raise FabricationError(
            f"tube holes of {2.0 * radius:g} mm at {height:g} mm above the leg's underside are not "
            f"within its chamber, from {floor:g} to {top:g} mm: say --hub.channel-height-mm, or "
            "thinner tubes by --hub.channel-radius-mm"
        )
    return height


def channels(leg: PneuNetShape, inwards_mm: float, settings: HubSettings) -> Any:
    """The ways of a leg's tubes from the socket's face inwards along the leg's axis.

    Args:
        leg: The leg.
        inwards_mm: How far [mm].
        settings: Radius and height of the tubes.
    """
    occ = open_cascade()
    face = -leg.tooth_base_mm[0] / 2.0
    return union(
        occ.Cylinder(
            occ.Pnt(face + 1.0, y, channel_height_mm(leg, settings)),
            occ.Dir(-1.0, 0.0, 0.0),
            settings.channel_radius_mm,
            inwards_mm + 1.0,
        )
        for y in tube_places_mm(leg)
    )
