"""Hubs of robots' files: their volume in closed form, and sockets that clear their legs."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

occ = pytest.importorskip("netgen.occ")

from pneumorph.catalogue.hub_description import HubDescription  # noqa: E402
from pneumorph.fabrication.described_hub import make_described_hub  # noqa: E402
from pneumorph.fabrication.hub_settings import HubSettings  # noqa: E402
from pneumorph.fabrication.leg_socket import PAD_MM, tube_places_mm  # noqa: E402
from pneumorph.fabrication.solid import FabricationError, posed, surface_of  # noqa: E402
from pneumorph.fabrication.wall_thickness import wall_thickness_mm  # noqa: E402
from pneumorph.geometry.netgen_mesher import box  # noqa: E402
from pneumorph.geometry.pneunet import PneuNetShape  # noqa: E402
from pneumorph.geometry.pose import Pose, rotation_about  # noqa: E402

PLATE = HubDescription(
    "box", length_mm=150, width_mm=90, height_mm=10, bottom_mm=31, density_g_per_ml=0.6
)
TWIN = PneuNetShape(connector_mm=(81.0, 8.0, 2.0), middle_wall_mm=2.0)


def seat(yaw_deg: float, position: tuple[float, float, float]) -> Pose:
    """Where a leg's frame is if the middle of its end tooth's face is at a position."""
    turn = rotation_about("z", yaw_deg) @ rotation_about("y", 15.0)
    face = np.array([-52.0, 0.0, 12.0])
    return Pose(turn, np.array(position) - turn @ face)


LEGS = [(PneuNetShape(), seat(0.0, (76, 24, 36))), (TWIN, seat(90.0, (0, 46, 36)))]


def volume(shape: Any) -> float:
    return float(sum(solid.mass for solid in shape.solids))


@pytest.mark.parametrize(
    ("hub", "expected_mm3"),
    [
        (PLATE, 150 * 90 * 10),
        (replace(PLATE, wall_mm=2.0), 150 * 90 * 10 - 146 * 86 * 6),
        (
            HubDescription("disk", radius_mm=50, height_mm=18, bottom_mm=20, density_g_per_ml=1),
            np.pi * 50**2 * 18,
        ),
        (
            HubDescription(
                "disk", radius_mm=40, top_radius_mm=50, height_mm=18, bottom_mm=0, mass_kg=0.1
            ),
            np.pi * 18 / 3 * (40**2 + 40 * 50 + 50**2),
        ),
    ],
)
def test_without_legs_it_is_the_body(hub: HubDescription, expected_mm3: float) -> None:
    assert volume(make_described_hub(hub, [])) == pytest.approx(expected_mm3, rel=1e-9)


@pytest.mark.parametrize("wall_mm", [None, 2.0])
def test_sockets_clear_their_legs_and_open_to_the_top(wall_mm: float | None) -> None:
    hub = make_described_hub(replace(PLATE, wall_mm=wall_mm), LEGS)
    assert wall_thickness_mm(surface_of(hub), 5.0).min() > HubSettings().smallest_wall_mm
    for leg, pose in LEGS:
        for low, size in leg.solid_boxes():
            assert volume(posed(box(low, size), pose) * hub) == 0.0
        # A wall stands behind the tooth's face, but for the tubes.
        low, high = leg.base_plate_mm[2] + 2.0, leg.height_mm - 1.0
        wall = box((-52.5, -9.0, low), (0.2, 18.0, high - low))
        tubes = len(tube_places_mm(leg)) * np.pi * 1.6**2
        behind = volume(posed(wall, pose) * hub)
        assert behind == pytest.approx(0.2 * (18.0 * (high - low) - tubes), rel=1e-6)
        for y in tube_places_mm(leg):
            # A thinner tube passes from the leg's face to above the hub.
            along = occ.Cylinder(occ.Pnt(-51.5, y, 8.0), occ.Dir(-1, 0, 0), 1.5, PAD_MM + 1.0)
            assert volume(posed(along, pose) * hub) == 0.0
            x0, y0, z0 = pose.apply(np.array([-52.0 - PAD_MM - 3.2, y, 8.0]))
            up = occ.Cylinder(occ.Pnt(x0, y0, z0), occ.Z, 1.5, 20.0)
            assert volume(up * hub) == 0.0


DISK = HubDescription(
    "disk",
    radius_mm=50,
    top_radius_mm=54.5,
    height_mm=18,
    bottom_mm=26.9,
    density_g_per_ml=1.24,
    wall_mm=0.9,
)


def test_a_flank_is_as_thick_as_the_other_walls() -> None:
    """Facets of e are e^2 / (8 r) off a curved wall: those of 5 mm 0.06 off this one."""
    hub = make_described_hub(DISK, [])
    thickness = wall_thickness_mm(surface_of(hub, 4.0), 5.0)
    assert thickness[np.isfinite(thickness)] == pytest.approx(0.9, abs=0.06)
    low, high, wall = np.pi / 3 * 18, np.pi / 3 * 16.2, 0.9 * np.hypot(1.0, 0.25)
    bottom, top = 50 + 0.225 - wall, 54.5 - 0.225 - wall
    outside = low * (50**2 + 50 * 54.5 + 54.5**2)
    inside = high * (bottom**2 + bottom * top + top**2)
    assert volume(hub) == pytest.approx(outside - inside, rel=1e-9)


@pytest.mark.parametrize("roll_deg", [0.0, 45.0, -45.0])
def test_sockets_of_rolled_legs_in_a_thin_shell_can_be_printed(roll_deg: float) -> None:
    """Where a leg's base plate grazes the flank, the flank has a wall of its own behind it."""
    legs = []
    for yaw in (45.0, 225.0):
        turn = rotation_about("z", yaw) @ rotation_about("y", 15.0) @ rotation_about("x", roll_deg)
        radians = np.radians(yaw)
        place = np.array([55.0 * np.cos(radians), 55.0 * np.sin(radians), 36.0])
        face = np.array([-52.0, 0.0, 12.0])
        legs.append((TWIN, Pose(turn, place - turn @ face)))
    hub = make_described_hub(DISK, legs)
    assert wall_thickness_mm(surface_of(hub, 8.0), 5.0).min() > HubSettings().smallest_wall_mm
    added_g = 1.24e-3 * (volume(hub) - volume(make_described_hub(DISK, [])))
    assert 0.5 < added_g / len(legs) < 3.0  # a solid pad would add 8 g
    for leg, pose in legs:
        for low, size in leg.solid_boxes():
            assert volume(posed(box(low, size), pose) * hub) == 0.0


def test_two_chambers_have_two_tubes_within_their_chambers() -> None:
    left, right = tube_places_mm(TWIN)
    assert left == -right
    # A chamber reaches from the wall's side, 1 mm, to 7 mm.
    assert 1.0 + 1.6 < left < 7.0 - 1.6


def test_a_socket_that_does_not_meet_the_hub_is_refused() -> None:
    with pytest.raises(FabricationError, match="the hub with its sockets consists of 2 solids"):
        make_described_hub(PLATE, [(PneuNetShape(), seat(0.0, (120, 0, 36)))])
    mesh = HubDescription("mesh", mesh="hub.npz", mass_kg=0.1)  # type: ignore[arg-type]
    with pytest.raises(FabricationError, match="the hub is a mesh, expected a box or a disk"):
        make_described_hub(mesh, [])
