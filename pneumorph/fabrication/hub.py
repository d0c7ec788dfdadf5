"""The hub as it is printed: a thin shell with ribs that carries a leg in each of its sockets.

The outside is the disk with a socket at every place. Inside it is hollow and open below: a plate on
top, the flank, a ring around the well in the middle, and behind every socket ribs along the leg's
axis that carry the leg's moment into the ring. It is printed on its top face, so that all walls
stand.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from pneumorph.fabrication.hub_settings import HubSettings
from pneumorph.fabrication.leg_place import leg_pose
from pneumorph.fabrication.leg_socket import (
    BEYOND_MM,
    behind_the_socket,
    channels,
    collar,
    leg_space,
)
from pneumorph.fabrication.solid import posed, single_solid
from pneumorph.geometry.disk import DiskShape
from pneumorph.geometry.mounting import RadialMounting
from pneumorph.geometry.netgen_mesher import box, open_cascade, union
from pneumorph.geometry.pneunet import PneuNetShape


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
        settings: Walls, ribs, sockets and holes.

    Raises:
        ModuleNotFoundError: netgen is not installed.
        FabricationError: The sizes do not fit: the hub falls to pieces.
    """
    disk, leg = disk or DiskShape(), leg or PneuNetShape()
    mounting, settings = mounting or RadialMounting(), settings or HubSettings()

    def everywhere(shape: Any) -> Any:
        places = range(mounting.location_count)
        return union(posed(shape, leg_pose(leg, mounting, k)) for k in places)

    top = disk.bottom_mm + disk.height_mm
    well = _upright(settings.well_radius_mm, disk.bottom_mm - BEYOND_MM, top + BEYOND_MM)
    post = _upright(settings.well_radius_mm + settings.rib_mm, disk.bottom_mm, top)
    void = _inner_cone(disk, settings) + everywhere(behind_the_socket(leg, settings))
    ribs = post
    for location in range(mounting.location_count):
        for rib in _ribs(disk, mounting, settings):
            ribs = ribs + _turned(rib, mounting, location)
    hub = _cone(disk) + everywhere(collar(leg, settings))
    void = void * _upright(disk.top_radius_mm, disk.bottom_mm - BEYOND_MM, top - settings.wall_mm)
    hub = hub - (void - ribs)
    # To the well's middle radius, where every channel has met it.
    inwards = (mounting.hub_radius_mm - 0.6 * settings.well_radius_mm) / np.cos(
        np.radians(mounting.pitch_deg)
    )
    tubes = channels(leg, float(inwards), settings)
    hub = hub - everywhere(leg_space(leg, settings)) - everywhere(tubes)
    return single_solid("the hub", hub - well)


def _cone(disk: DiskShape) -> Any:
    occ = open_cascade()
    axis = occ.Axes(occ.Pnt(0, 0, disk.bottom_mm), occ.Z)
    return occ.Cone(axis, disk.bottom_radius_mm, disk.top_radius_mm, disk.height_mm, 2.0 * np.pi)


def _inner_cone(disk: DiskShape, settings: HubSettings) -> Any:
    """The disk's inside within its flank, continued below its bottom."""
    occ = open_cascade()
    slope = (disk.top_radius_mm - disk.bottom_radius_mm) / disk.height_mm
    inset = settings.wall_mm * np.hypot(1.0, slope)
    low, height = disk.bottom_mm - BEYOND_MM, disk.height_mm + 2.0 * BEYOND_MM
    radius = disk.bottom_radius_mm - inset - slope * BEYOND_MM
    axis = occ.Axes(occ.Pnt(0, 0, low), occ.Z)
    return occ.Cone(axis, radius, radius + slope * height, height, 2.0 * np.pi)


def _upright(radius: float, low: float, high: float) -> Any:
    occ = open_cascade()
    return occ.Cylinder(occ.Pnt(0, 0, low), occ.Z, radius, high - low)


def _ribs(disk: DiskShape, mounting: RadialMounting, settings: HubSettings) -> list[Any]:
    """Ribs of the place that looks along x, from the ring outwards through the flank."""
    half = settings.rib_mm / 2.0
    reach = max(disk.bottom_radius_mm, disk.top_radius_mm)
    return [
        box(
            (0.5 * settings.well_radius_mm, float(y) - half, disk.bottom_mm),
            (reach, settings.rib_mm, disk.height_mm),
        )
        for y in settings.rib_places_mm()
    ]


def _turned(shape: Any, mounting: RadialMounting, location: int) -> Any:
    occ = open_cascade()
    angle = 360.0 / mounting.location_count * (location + 0.5)
    return shape.Rotate(occ.Axis(occ.Pnt(0, 0, 0), occ.Z), angle)
