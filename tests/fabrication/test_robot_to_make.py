"""What is built is what was simulated: its legs, their chambers, the tubes to each."""

from __future__ import annotations

from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers.two_chambers import two_chamber_mesh

from pneumorph.catalogue.hub_description import HubDescription
from pneumorph.catalogue.paper_robot import paper_robot, ring_of_sites
from pneumorph.catalogue.robot_description import RobotDescription
from pneumorph.fabrication.fabrication_settings import FabricationSettings
from pneumorph.fabrication.hub_settings import HubSettings
from pneumorph.fabrication.leg_socket import channel_height_mm
from pneumorph.fabrication.robot_to_make import (
    LegToMake,
    RobotToMake,
    _check_chambers,
    _ignored_of_hub,
    described_robot_to_make,
    paper_robot_to_make,
)
from pneumorph.fabrication.solid import FabricationError
from pneumorph.geometry.attachment import mount_pose
from pneumorph.geometry.mesh import Mesh
from pneumorph.geometry.mounting import RadialMounting
from pneumorph.geometry.pneunet import PneuNetShape
from pneumorph.geometry.pose import Pose

PLATE = Path(__file__).parent.parent.parent / "examples" / "plate.toml"
CHAMBERS = Path(__file__).parent.parent.parent / "examples" / "two_chambers.toml"


def _made(design: str, path: Path = PLATE) -> RobotToMake:
    robot = RobotDescription.read(path)
    return described_robot_to_make(design, robot, robot.spec(), FabricationSettings())


@pytest.mark.parametrize(
    ("design", "why"),
    [
        ("c1.0.2.2.0.1", r"leg of kind 3 at site 0 \(front left\), expected one of long, short"),
        ("9.0.2.2.0.1", "connects location 0 to regulator 9, expected 1 to 4"),
        ("1+2.0.2.2.0.1", r"gives 2 regulators to long at site 0 \(front left\), expected one for"),
    ],
)
def test_what_cannot_be_simulated_is_not_built(design: str, why: str) -> None:
    with pytest.raises(ValueError, match=why):
        _made(design)


def test_sizes_beside_a_robots_file_are_refused() -> None:
    """They were ignored; walls and the printer's are the workshop's, whatever the robot."""
    robot = RobotDescription.read(PLATE)
    longer = FabricationSettings(leg=PneuNetShape().scaled(2.0))
    with pytest.raises(ValueError, match="leg is given beside a robot's file"):
        described_robot_to_make("1.0.2.2.0.1", robot, robot.spec(), longer)
    walls = FabricationSettings(hub=HubSettings(wall_mm=3.0))
    described_robot_to_make("1.0.2.2.0.1", robot, robot.spec(), walls)


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("material", "PETG"),
        ("rib_mm", 2.0),
        ("ribs_per_site", 4),
        ("rib_spread_mm", 10.0),
        ("well_radius_mm", 10.0),
        ("density_g_per_ml", 1.5),
    ],
)
def test_what_says_nothing_of_a_files_hub_is_refused_beside_it(name: str, value: Any) -> None:
    """Ribs and the well are the paper's hub's, and the plate's file has a density."""
    robot = RobotDescription.read(PLATE)
    settings = FabricationSettings(hub=replace(HubSettings(), **{name: value}))
    with pytest.raises(ValueError, match=rf"hub\.{name} is given beside a robot's file, .*ignored"):
        described_robot_to_make("1.0.2.2.0.1", robot, robot.spec(), settings)


def test_settings_of_a_files_hub_that_have_a_meaning_are_taken(tmp_path: Path) -> None:
    """The density where the file has the mass alone, and ribs that another limit forces."""
    weighed = tmp_path / "weighed.toml"
    weighed.write_text(PLATE.read_text().replace("density_g_per_ml", "mass_kg", 1))
    robot = RobotDescription.read(weighed)
    assert robot.hub.density_g_per_ml is None
    heavy = FabricationSettings(hub=HubSettings(density_g_per_ml=1.5))
    made = described_robot_to_make("1.0.2.2.0.1", robot, robot.spec(), heavy)
    assert made.hub.density_g_per_ml == 1.5
    coarse = FabricationSettings(hub=HubSettings(wall_mm=1.2, rib_mm=1.2, smallest_wall_mm=1.2))
    described_robot_to_make("1.0.2.2.0.1", robot, robot.spec(), coarse)


def test_nothing_of_sockets_says_anything_of_a_hub_that_is_a_mesh() -> None:
    """Its density does where the file has the mass alone."""
    hub = HubDescription(shape="mesh", mesh=Path("hub.npz"), mass_kg=0.1)
    ignored = set(_ignored_of_hub(hub, HubSettings()))
    assert ignored == {each.name for each in fields(HubSettings)} - {"density_g_per_ml"}


def test_one_regulator_of_a_leg_of_two_chambers_has_a_tube_to_each() -> None:
    legs = [seat for seat in _made("0.1.0.2.0.1.0.2", CHAMBERS).seats if seat.leg is not None]
    assert [seat.regulators for seat in legs][:2] == [(1, 1), (2, 2)]


def test_chambers_are_called_by_where_they_lie() -> None:
    """Whatever their regions are called, and in whichever order; ones behind each other by name."""
    mesh = two_chamber_mesh()
    left, right = (mesh.surfaces[f"cavity_{side}"] for side in ("left", "right"))
    others = {n: each for n, each in mesh.surfaces.items() if not n.startswith("cavity")}

    def names(shape: Mesh) -> tuple[str, ...]:
        return LegToMake("twin", None, shape, 40.0, 2).chamber_names

    assert names(mesh) == ("left", "right")
    swapped = replace(mesh, surfaces={**others, "cavity_a": right, "cavity_b": left})
    assert names(swapped) == ("right", "left")
    turned = replace(swapped, nodes=mesh.nodes[:, [1, 0, 2]] * [1.0, -1.0, 1.0])
    assert names(replace(turned, nodes=turned.nodes + np.array([0.0, 100.0, 0.0]))) == (
        "cavity_a",
        "cavity_b",
    )
    alone = replace(mesh, surfaces={**others, "cavity": left})
    assert names(alone) == ("",)


def test_tubes_reach_the_top_of_a_tall_hub(tmp_path: Path) -> None:
    tall = tmp_path / "tall.toml"
    tall.write_text(PLATE.read_text().replace("height_mm = 10", "height_mm = 100"))
    low, high = (_made("1.0.2.2.0.1", path).seats[0].tube_mm for path in (PLATE, tall))
    assert high == pytest.approx(low + 90.0)


def test_a_mould_of_another_number_of_chambers_is_refused() -> None:
    """Its silicone is within a thousandth of the other's."""
    _check_chambers(PneuNetShape(middle_wall_mm=2.0, connector_mm=(81.0, 8.0, 2.0)),
                    two_chamber_mesh())  # fmt: skip
    with pytest.raises(ValueError, match="has 1 chamber and the simulated mesh 2"):
        _check_chambers(PneuNetShape(), two_chamber_mesh())


def test_tube_holes_lead_into_chambers_of_legs_of_all_sizes() -> None:
    usual, hub = PneuNetShape(), HubSettings()
    assert channel_height_mm(usual, hub) == 8.0
    assert channel_height_mm(usual.scaled(2.0), hub) == 16.0
    with pytest.raises(FabricationError, match="not within its chamber, from 8 to 34 mm"):
        channel_height_mm(usual.scaled(2.0), HubSettings(channel_height_mm=8.0))


OF_TEETH = [
    PneuNetShape((34.0 + 9.0 * n, 32.0, 4.0), (23.0 + 9.0 * n, 20.0, 9.0),
                 inner_tooth_count=n, connector_mm=(9.0 * n, 2.0, 2.0))
    for n in (6, 10)
]  # fmt: skip
"""Legs of 77 and of 113 mm of teeth."""


@pytest.mark.parametrize("leg", [*OF_TEETH, PneuNetShape().scaled(0.9)])
def test_legs_of_other_sizes_are_built_where_they_are_simulated(leg: PneuNetShape) -> None:
    """On the paper's robot the face of the end tooth stays where it is."""
    robot, design = paper_robot("published"), "1.0.0.2.2.0.0.1"
    seats = paper_robot_to_make(design, FabricationSettings(leg=leg), robot).seats
    usual = paper_robot_to_make(design, FabricationSettings(), robot).seats
    face = Pose(np.eye(3), np.array([-0.5 * leg.tooth_base_mm[0], 0.0,
                                     0.5 * (leg.base_plate_mm[2] + leg.height_mm)]))  # fmt: skip
    for seat, paper, site in zip(seats, usual, ring_of_sites(RadialMounting(), robot.modules),
                                 strict=True):  # fmt: skip
        np.testing.assert_allclose(seat.face_mm, paper.face_mm, atol=1e-9)
        np.testing.assert_array_equal(paper.pose.translation, site.pose.translation)
        assert site.face is not None
        simulated = mount_pose(site.pose.compose(site.face), face)
        np.testing.assert_allclose(seat.pose.translation, simulated.translation, atol=1e-9)
        np.testing.assert_allclose(seat.pose.rotation, simulated.rotation, atol=1e-12)


@pytest.mark.parametrize("count", [6, 12])
def test_a_ring_of_another_number_of_places_is_refused(count: int) -> None:
    """Design and tubes would be of one robot, and the hub of another."""
    settings = FabricationSettings(mounting=RadialMounting(location_count=count))
    design = ".".join("1" * count)
    with pytest.raises(ValueError, match=rf"location_count is {count}, expected 8 .* \(--robot\)"):
        paper_robot_to_make(design, settings, paper_robot("published"))
    with pytest.raises(ValueError, match=rf"has {count} locations, expected 8 as the hub"):
        paper_robot_to_make(design, FabricationSettings(), paper_robot("published"))
