"""A description that Python has made, or read, is written to a file that describes it again."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers.box_mesh import box_mesh

from pneumorph.base.settings import settings_to_dict
from pneumorph.catalogue.acting_description import ActingDescription
from pneumorph.catalogue.design_rules import DesignRules
from pneumorph.catalogue.hub_description import HubDescription
from pneumorph.catalogue.module_description import ModuleDescription
from pneumorph.catalogue.robot_description import RobotDescription
from pneumorph.catalogue.shipped_data import data_file
from pneumorph.catalogue.site_description import SiteDescription
from pneumorph.fem.material import LegMaterials
from pneumorph.geometry.mounting import RadialMounting
from pneumorph.physics.ground import Ground, Steps

EXAMPLES = Path(__file__).parent.parent.parent / "examples"
ROBOTS = [
    data_file("paper_robot.toml"),
    *(each for each in sorted(EXAMPLES.rglob("*.toml")) if "[hub]" in each.read_text()),
]
HUB = HubDescription("box", 150.0, 90.0, height_mm=10.0, bottom_mm=31.0, density_g_per_ml=0.6)


def _the_same(one: RobotDescription, other: RobotDescription) -> bool:
    """From which folder its files are named is not what a description says."""
    return _from_the_root(one) == _from_the_root(other)


def _from_the_root(robot: RobotDescription) -> RobotDescription:
    def named(path: Path | None) -> Path | None:
        return None if path is None else (robot.folder / path).resolve()

    changes = dict(robot.physics.changes)
    if "map" in changes.get("ground", {}):
        placed = {"path": str(named(Path(changes["ground"]["map"]["path"])))}
        changes["ground"] = {**changes["ground"], "map": placed}
    return replace(
        robot,
        hub=replace(robot.hub, mesh=named(robot.hub.mesh)),
        modules={
            name: replace(each, part=named(each.part), mesh=named(each.mesh))
            for name, each in robot.modules.items()
        },
        physics=replace(robot.physics, changes=changes),
        catalogue_folder=named(robot.catalogue_folder),
        folder=Path(),
        file=None,
    )


@pytest.mark.parametrize("file", ROBOTS, ids=lambda file: file.stem)
def test_every_robot_that_ships_is_written_and_read_again(file: Path, tmp_path: Path) -> None:
    read = RobotDescription.read(file)
    written = read.write(tmp_path / "robots" / "again.toml")
    assert _the_same(RobotDescription.read(written), read)
    assert written.read_text() != file.read_text()


def test_every_field_is_written(tmp_path: Path) -> None:
    (tmp_path / "here/maps").mkdir(parents=True)
    np.save(tmp_path / "here/maps/hills.npy", np.full((6, 6), 3.0))
    box_mesh((80.0, 60.0, 10.0)).save(tmp_path / "here/hub.npz")
    robot = RobotDescription(
        'the "long" one',
        HubDescription(
            "mesh", mesh=Path("hub.npz"), mass_kg=0.05, payload_g=20.0, payload_mm=(0.0, 0.0, 8.0),
            contact="spread", contact_spacing_mm=12.0, surface="felt",
        ),
        {
            "long leg": ModuleDescription(),
            "own": ModuleDescription(
                None, "measured", Path("leg.npz"), tmp_path / "mesh.npz",
                LegMaterials(sheet_thickness_mm=0.5), 0.75, 20.0,
            ),
        },
        (
            SiteDescription((40.0, 0.0, 5.0), name="front", modules=("own",)),
            SiteDescription((-40.0, 0.0, 5.0), 180.0, 15.0, 5.0),
        ),
        physics=ActingDescription(
            "measured",
            {"friction": 0.8, "friction_by_surface": [["felt", 0.5]],
             "ground": {"map": {"path": "maps/hills.npy"}, "rough": {"seed": 3}}},
        ),
        randomisation={"mass_factor": "U(0.95, 1.05)", "friction_by_surface": [["felt", "0.5"]]},
        designs=DesignRules("1.2", 1, 2, 1, 3, ("0 *", "0 1 2 b*"), canonical=False, mirror=False),
        mounting_tolerance_mm=4.5,
        catalogue_folder=Path("../catalogue"),
        folder=tmp_path / "here",
    )  # fmt: skip
    beside = robot.write(tmp_path / "here/robot.toml")
    assert _the_same(RobotDescription.of_text(beside.read_text(), beside), robot)
    elsewhere = robot.write(tmp_path / "there/deep/robot.toml")
    back = RobotDescription.of_text(elsewhere.read_text(), elsewhere)
    assert _the_same(back, robot)
    assert back.hub.mesh == Path("../../here/hub.npz")
    assert back.modules["own"].mesh == tmp_path / "mesh.npz"  # named from the root
    assert back.acting.ground.grid().height(0.0, 0.0) == pytest.approx(3.0)
    assert back.hub.spec(back.folder).mesh.digest() == robot.hub.spec(robot.folder).mesh.digest()


def test_a_ring_is_written(tmp_path: Path) -> None:
    robot = RobotDescription("ring", HUB, {"leg": ModuleDescription()}, ring=RadialMounting())
    assert _the_same(RobotDescription.read(robot.write(tmp_path / "ring.toml")), robot)


def test_a_file_of_another_kind_is_refused(tmp_path: Path) -> None:
    robot = RobotDescription("ring", HUB, {"leg": ModuleDescription()}, ring=RadialMounting())
    with pytest.raises(ValueError, match=r"path is .*robot\.json, expected .* ends in \.toml"):
        robot.write(tmp_path / "robot.json")
    assert not list(tmp_path.iterdir())


def test_what_python_has_at_hand_is_written_as_its_numbers(tmp_path: Path) -> None:
    ground = Ground(steps=Steps(rise_mm=5.0))
    robot = RobotDescription(
        "numpy",
        replace(HUB, payload_g=np.float32(20.0), payload_mm=np.array([0, 0, 8])),
        {"leg": ModuleDescription(size_factor=np.float64(0.75))},
        (
            SiteDescription(tuple(np.array([40, 0, 5]))),
            SiteDescription(np.array([-40, 0, 5]), np.int64(180)),
        ),
        physics=ActingDescription(
            "measured",
            {
                "regulator_count": np.int64(2),
                "air": {"filling_mm3_per_s_kPa": np.array([70.0, 80.0])},
                "ground": settings_to_dict(ground),  # has no map, which is None
            },
        ),
        randomisation={"mass_factor": np.str_("U(0.95, 1.05)")},
        designs=DesignRules(minimum_legs=np.int64(1), mirror=np.bool_(False)),
    )
    back = RobotDescription.read(robot.write(tmp_path / "robot.toml"))
    assert [each.position_mm for each in back.sites] == [(40.0, 0.0, 5.0), (-40.0, 0.0, 5.0)]
    assert (back.sites[1].yaw_deg, back.hub.payload_mm) == (180.0, (0.0, 0.0, 8.0))
    assert (back.hub.payload_g, back.modules["leg"].size_factor) == (20.0, 0.75)
    assert (back.designs.minimum_legs, back.designs.mirror) == (1, False)
    assert back.acting == robot.acting
    assert (back.acting.regulator_count, back.acting.ground) == (2, ground)
    assert back.acting.air.filling_mm3_per_s_kPa == (70.0, 80.0)
    assert back.worlds == robot.worlds


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        ({"physics": ActingDescription("measured", {"friction": {0.5}})},
         r"\[physics\]: friction is \{0\.5\}, expected a number, a text"),
        ({"physics": ActingDescription("measured", {"ground": {"map": {"path": b"hills"}}})},
         r"\[physics\]: ground\.map\.path is b'hills', expected"),
        ({"physics": ActingDescription("measured", {"friction": None})}, r"\[physics\]: friction"),
        ({"randomisation": {"mass_factor": 1j}}, r"randomisation\.mass_factor is 1j, expected"),
        ({"randomisation": {"mass_factor": None}}, "mass_factor"),
        ({"randomisation": {1: 2.0}}, "randomisation has the name 1, expected a text"),
        ({"sites": (SiteDescription(np.array([40.0, None, 5.0])),), "ring": None},
         r"sites\[0\]\.position_mm is \[40\.0, None, 5\.0\], expected"),
        ({"sites": (SiteDescription((40.0, 0.0, 5.0), modules={"leg"}),), "ring": None},
         r"sites\[0\]\.modules is \{'leg'\}, expected"),
        ({"modules": {"leg": ModuleDescription(materials=object())}},
         r"modules\.leg\.materials is <object"),
    ],
)  # fmt: skip
def test_a_value_that_no_file_can_hold_is_refused(
    changed: dict[str, Any], said: str, tmp_path: Path
) -> None:
    robot = RobotDescription("ring", HUB, {"leg": ModuleDescription()}, ring=RadialMounting())
    with pytest.raises(ValueError, match=said):
        replace(robot, **changed).write(tmp_path / "robot.toml")
    assert not list(tmp_path.iterdir())
