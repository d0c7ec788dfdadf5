"""The hub of a robot's file as it is printed: the box or the disk that the file has, solid or with
walls, and a socket at every site that carries a leg.

A leg's tubes run through its socket along the leg's axis and come out on top behind it.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from pneumorph.catalogue.hub_description import HubDescription
from pneumorph.fabrication.hub_settings import HubSettings
from pneumorph.fabrication.leg_socket import (
    BEYOND_MM,
    PAD_MM,
    channel_height_mm,
    channels,
    collar,
    leg_space,
    tube_places_mm,
    within_the_pad,
)
from pneumorph.fabrication.solid import FabricationError, posed, single_solid
from pneumorph.geometry.netgen_mesher import box, open_cascade, union
from pneumorph.geometry.pneunet import PneuNetShape
from pneumorph.geometry.pose import Pose


def make_described_hub(
    hub: HubDescription,
    legs: Sequence[tuple[PneuNetShape, Pose]],
    settings: HubSettings | None = None,
) -> Any:
    """Make the hub of a robot's file with a socket for every leg, in the robot's frame.

    Args:
        hub: A box or a disk.
        legs: Sizes and pose of each leg.
        settings: Walls of the sockets, clearance and holes; ribs and well are of the paper's hub.

    Raises:
        ModuleNotFoundError: netgen is not installed.
        FabricationError: The hub is a mesh, or the sockets do not meet it.
    """
    if hub.shape == "mesh":
        raise FabricationError(
            "the hub is a mesh, expected a box or a disk: sockets in a mesh are its maker's"
        )
    settings = settings or HubSettings()
    body = _body(hub, 0.0)
    hollow = None if hub.wall_mm is None else _body(hub, hub.wall_mm)
    if hollow is not None:
        around = hollow
        for leg, pose in legs:  # whose space grazes the walls, and has one of its own around it
            around = around - posed(leg_space(leg, settings, settings.wall_mm), pose)
        body = body - around
    assert hub.bottom_mm is not None
    assert hub.height_mm is not None
    top_mm = hub.bottom_mm + hub.height_mm
    for leg, pose in legs:
        body = body + posed(collar(leg, settings), pose)
    for leg, pose in legs:
        if hollow is not None:
            body = body - posed(within_the_pad(leg, settings, end_wall=True), pose)
            # Its end opens into the hollow, and stands where it would thin the hub's own wall.
            body = body - posed(within_the_pad(leg, settings, end_wall=False), pose) * hollow
        body = body - posed(leg_space(leg, settings), pose)
        body = body - _tubes(leg, pose, top_mm, hollow is not None, settings)
    return single_solid("the hub with its sockets", body)


def _body(hub: HubDescription, inset_mm: float) -> Any:
    """The box or the disk without so much of its outside."""
    assert hub.bottom_mm is not None
    assert hub.height_mm is not None
    low, height = hub.bottom_mm + inset_mm, hub.height_mm - 2.0 * inset_mm
    if hub.shape == "box":
        assert hub.length_mm is not None
        assert hub.width_mm is not None
        length, width = hub.length_mm - 2.0 * inset_mm, hub.width_mm - 2.0 * inset_mm
        return box((-length / 2.0, -width / 2.0, low), (length, width, height))
    bottom, top = hub.radii_mm(inset_mm)
    occ = open_cascade()
    if bottom == top:
        return occ.Cylinder(occ.Pnt(0, 0, low), occ.Z, bottom, height)
    return occ.Cone(occ.Axes(occ.Pnt(0, 0, low), occ.Z), bottom, top, height, 2.0 * np.pi)


def _tubes(
    leg: PneuNetShape, pose: Pose, top_mm: float, hollow: bool, settings: HubSettings
) -> Any:
    """Along the leg's axis to behind its socket, and from there straight up. Behind the wall of a
    socket of a hollow hub there is nothing to drill."""
    inwards = PAD_MM + 2.0 * settings.channel_radius_mm
    occ = open_cascade()
    shafts = []
    for y in tube_places_mm(leg):
        end = np.array([-leg.tooth_base_mm[0] / 2.0 - inwards, y, channel_height_mm(leg, settings)])
        x, y_there, z = map(float, pose.apply(end))
        # From the middle of the channel, whose end is flat, to above the hub and its sockets.
        over = max(top_mm, z + leg.height_mm) + BEYOND_MM
        shafts.append(
            occ.Cylinder(occ.Pnt(x, y_there, z), occ.Z, settings.channel_radius_mm, over - z)
        )
    drilled = 2.0 * settings.wall_mm if hollow else inwards
    return posed(channels(leg, drilled, settings), pose) + union(shafts)
