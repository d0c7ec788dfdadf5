"""The hub as it is printed: a thin shell with ribs that carries a leg in each of its sockets.

The outside is the disk with a socket at every place. Inside it is hollow and open below: a plate on
top, the flank, a ring around the well in the middle, and behind every socket ribs along the leg's
axis that carry the leg's moment into the ring. It is printed on its top face, so that all walls
stand.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np

from pneumorph.base.checked import Bounds, Checked, NotNegative, Positive
from pneumorph.catalogue.masses import PRINT_DENSITY_G_PER_ML
from pneumorph.fabrication.solid import mounted, single_solid
from pneumorph.geometry.disk import DiskShape
from pneumorph.geometry.mounting import RadialMounting
from pneumorph.geometry.netgen_mesher import box, open_cascade, union
from pneumorph.geometry.pneunet import PneuNetShape

_BEYOND_MM = 5.0
"""How far what is cut away reaches beyond the solid [mm]."""


@dataclass(frozen=True)
class HubSettings(Checked):
    """The printed hub: a hollow shell with ribs and a socket for each leg."""

    material: str = "PLA"
    """Name of the printed material, for the parts list."""
    density_g_per_ml: Positive = PRINT_DENSITY_G_PER_ML
    """Density of the printed material [g/ml]; walls are printed solid."""
    wall_mm: Positive = 0.9
    """Thickness of top plate, flank and socket walls [mm]. Thicker ones are stiffer and heavier."""
    rib_mm: Positive = 0.9
    """Thickness of the ribs and of the ring around the central well [mm]."""
    ribs_per_site: Annotated[int, Bounds(least=0, most=8)] = 2
    """Number of ribs behind each socket. It is even, because the tube runs in the middle."""
    rib_spread_mm: Positive = 16.0
    """Distance between the outermost ribs of a socket [mm]."""
    socket_depth_mm: Positive = 5.0
    """How far the walls of a socket overlap the leg's end tooth [mm]."""
    clearance_mm: NotNegative = 0.25
    """Gap between leg and socket, for glue [mm]."""
    channel_radius_mm: Positive = 1.6
    """Radius of the holes for the tubes [mm]."""
    channel_height_mm: Positive = 8.0
    """Height of those holes above the leg's underside [mm]; it must lie within the first
    chamber."""
    well_radius_mm: Positive = 25.0
    """Radius of the central well, where the tubes come out [mm]."""
    smallest_wall_mm: Positive = 0.6
    """Thinnest wall that your printer can make [mm]; thinner walls are refused. A 0.4 mm nozzle
    prints up to 0.6 mm in one line."""

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.ribs_per_site % 2:
            raise ValueError(
                f"ribs_per_site must be even, got {self.ribs_per_site}; a rib in the middle would "
                "lie in the tube's way"
            )
        for name in ("wall_mm", "rib_mm"):
            if getattr(self, name) < self.smallest_wall_mm:
                raise ValueError(
                    f"{name} must be at least smallest_wall_mm, {self.smallest_wall_mm:g}, got "
                    f"{getattr(self, name):g}; it cannot be printed"
                )

    def rib_places_mm(self) -> np.ndarray:
        """Where the ribs of a socket stand across the leg's axis [mm], (rib,)."""
        return np.linspace(-0.5, 0.5, self.ribs_per_site) * self.rib_spread_mm


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
        return union(mounted(shape, mounting, k) for k in range(mounting.location_count))

    top = disk.bottom_mm + disk.height_mm
    well = _upright(settings.well_radius_mm, disk.bottom_mm - _BEYOND_MM, top + _BEYOND_MM)
    post = _upright(settings.well_radius_mm + settings.rib_mm, disk.bottom_mm, top)
    void = _inner_cone(disk, settings) + everywhere(_behind_the_socket(leg, settings))
    ribs = post
    for location in range(mounting.location_count):
        for rib in _ribs(disk, mounting, settings):
            ribs = ribs + _turned(rib, mounting, location)
    hub = _cone(disk) + everywhere(_collar(leg, settings))
    void = void * _upright(disk.top_radius_mm, disk.bottom_mm - _BEYOND_MM, top - settings.wall_mm)
    hub = hub - (void - ribs)
    hub = (
        hub - everywhere(_leg_space(leg, settings)) - everywhere(_channel(leg, mounting, settings))
    )
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
    low, height = disk.bottom_mm - _BEYOND_MM, disk.height_mm + 2.0 * _BEYOND_MM
    radius = disk.bottom_radius_mm - inset - slope * _BEYOND_MM
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


def _collar(leg: PneuNetShape, settings: HubSettings) -> Any:
    """Walls beside and above the end tooth, and the pad behind it that fills up to the disk."""
    length, width, _ = leg.tooth_base_mm
    outer = width / 2.0 + settings.clearance_mm + settings.wall_mm
    # The disk's flank is round: at the socket's corners it lies this much further inwards.
    behind = 12.0
    bottom = leg.base_plate_mm[2] + settings.clearance_mm
    top = leg.height_mm + settings.clearance_mm + settings.wall_mm
    return box(
        (-length / 2.0 - behind, -outer, bottom),
        (behind + settings.socket_depth_mm, 2.0 * outer, top - bottom),
    )


def _behind_the_socket(leg: PneuNetShape, settings: HubSettings) -> Any:
    """What is hollow of the pad: all but a wall behind the tooth's face and the collar's walls."""
    length, width, _ = leg.tooth_base_mm
    half = width / 2.0 + settings.clearance_mm
    back = -length / 2.0 - settings.wall_mm
    top = leg.height_mm + settings.clearance_mm
    depth = 12.0
    return box((back - depth, -half, -_BEYOND_MM), (depth, 2.0 * half, top + _BEYOND_MM))


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
