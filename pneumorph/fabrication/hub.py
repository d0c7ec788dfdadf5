"""The hub as it is printed: the disk with a socket, a tube channel and a recess for each leg."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from pneumorph.base.checked import Checked, NotNegative, Positive
from pneumorph.fabrication.solid import mounted, single_solid
from pneumorph.geometry.disk import DiskShape
from pneumorph.geometry.mounting import RadialMounting
from pneumorph.geometry.netgen_mesher import box, open_cascade
from pneumorph.geometry.pneunet import PneuNetShape


@dataclass(frozen=True)
class HubSettings(Checked):
    """Sizes of the sockets and channels [mm]."""

    socket_depth_mm: Positive = 8.0
    """How far a socket's walls reach over the leg's end tooth."""
    socket_wall_mm: Positive = 2.4
    """Thickness of those walls."""
    clearance_mm: NotNegative = 0.25
    """Gap around the leg, for glue."""
    channel_radius_mm: Positive = 1.6
    """Radius of the tube channels."""
    channel_height_mm: Positive = 8.0
    """Height of a channel above the leg's bottom, within the first chamber's."""
    well_radius_mm: Positive = 14.0
    """Radius of the well in the middle, where the tubes come out."""
    well_depth_mm: Positive = 10.0
    """Depth of the well."""
    smallest_wall_mm: Positive = 0.8
    """Thinnest wall that can be printed."""


def make_hub(
    disk: DiskShape | None = None,
    leg: PneuNetShape | None = None,
    mounting: RadialMounting | None = None,
    settings: HubSettings | None = None,
) -> Any:
    """Make the hub with a socket at every location, in the robot's frame.

    Args:
        disk: The disk.
        leg: The leg.
        mounting: Where legs sit.
        settings: Sizes of sockets and channels.

    Raises:
        ModuleNotFoundError: netgen is not installed.
        FabricationError: The sizes do not fit: the hub falls to pieces.
    """
    disk, leg = disk or DiskShape(), leg or PneuNetShape()
    mounting, settings = mounting or RadialMounting(), settings or HubSettings()
    occ = open_cascade()
    axis = occ.Axes(occ.Pnt(0, 0, disk.bottom_mm), occ.Z)
    hub = occ.Cone(axis, disk.bottom_radius_mm, disk.top_radius_mm, disk.height_mm, 2.0 * np.pi)
    well = occ.Cylinder(
        occ.Pnt(0, 0, disk.bottom_mm + disk.height_mm - settings.well_depth_mm),
        occ.Z,
        settings.well_radius_mm,
        settings.well_depth_mm + 1.0,
    )
    places = range(mounting.location_count)
    for location in places:
        hub = hub + mounted(_collar(leg, settings), mounting, location)
    for location in places:
        hub = hub - mounted(_leg_space(leg, settings), mounting, location)
    for location in places:
        hub = hub - mounted(_channel(leg, mounting, settings), mounting, location)
    return single_solid("the hub", hub - well)


def _collar(leg: PneuNetShape, settings: HubSettings) -> Any:
    """Walls beside and above the end tooth, and the pad behind it that fills up to the disk."""
    length, width, _ = leg.tooth_base_mm
    outer = width / 2.0 + settings.clearance_mm + settings.socket_wall_mm
    # The disk's flank is round: at the socket's corners it lies this much further inwards.
    behind = 12.0
    bottom = leg.base_plate_mm[2] + settings.clearance_mm
    top = leg.height_mm + settings.clearance_mm + settings.socket_wall_mm
    return box(
        (-length / 2.0 - behind, -outer, bottom),
        (behind + settings.socket_depth_mm, 2.0 * outer, top - bottom),
    )


def _leg_space(leg: PneuNetShape, settings: HubSettings) -> Any:
    """What the leg takes, with clearance: its end tooth, open downwards, and its base plate."""
    gap = settings.clearance_mm
    length, width, _ = leg.tooth_base_mm
    plate_length, plate_width, plate_height = leg.base_plate_mm
    tooth = box(
        (-length / 2.0, -width / 2.0 - gap, -1.0),
        (length, width + 2.0 * gap, leg.height_mm + gap + 1.0),
    )
    plate = box(
        (-plate_length / 2.0 - gap, -plate_width / 2.0 - gap, -10.0),
        (plate_length, plate_width + 2.0 * gap, plate_height + gap + 10.0),
    )
    return tooth + plate


def _channel(leg: PneuNetShape, mounting: RadialMounting, settings: HubSettings) -> Any:
    """A tube's way from the socket's face along the leg's axis into the well."""
    occ = open_cascade()
    face = -leg.tooth_base_mm[0] / 2.0
    # To the well's middle radius, where every channel has met it.
    across = (mounting.hub_radius_mm - 0.6 * settings.well_radius_mm) / np.cos(
        np.radians(mounting.pitch_deg)
    )
    start = occ.Pnt(face + 1.0, 0.0, settings.channel_height_mm)
    inwards = occ.Dir(-1.0, 0.0, 0.0)
    return occ.Cylinder(start, inwards, settings.channel_radius_mm, float(across) + 1.0)
