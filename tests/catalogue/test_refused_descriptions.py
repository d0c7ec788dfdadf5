"""Robots' files that are none are refused with file, field and cause, before anything walks."""

from __future__ import annotations

import json
import tomllib
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from pneumorph.base.artefact import ArtefactError
from pneumorph.catalogue.robot_description import RobotDescription

USUAL = 'usual = "b1.0.2.2.0.b1"\n'
PLATE = Path(__file__).parent.parent.parent / "examples" / "plate.toml"
Edited = Callable[[str, str], Path]


@pytest.mark.parametrize(
    ("old", "new", "why"),
    [
        ('leg = "measured"\n\n', 'leg = "none"\n\n', "modules.long.leg"),
        ("bottom_mm = 31", "bottom_mm = 31\nradius_mm = 3", "radius_mm is given"),
        ("density_g_per_ml = 0.6", "", "either density_g_per_ml or mass_kg, got neither"),
        ("density_g_per_ml = 0.6", "density_g_per_ml = 0.6\nwall_mm = 6", "wall_mm is 6"),
        ("density_g_per_ml = 0.6", "density_g_per_ml = 600", "25.*got 600.*in g/ml"),
        ("density_g_per_ml = 0.6", "density_g_per_ml = 0.6\npayload_g = 4e4", "got 40000.*in g;"),
        (
            "density_g_per_ml = 0.6",
            "density_g_per_ml = 0.6\npayload_g = 40\npayload_mm = [0, 15, 50]",
            "payload_mm is 15 mm to the left .* mirror = false",
        ),
        (
            "density_g_per_ml = 0.6",
            "density_g_per_ml = 0.6\ntracked_point_mm = [0, -30, 42]",
            "tracked_point_mm is -30 mm to the left",
        ),
        (
            "density_g_per_ml = 0.6",
            "density_g_per_ml = 0.6\npayload_mm = [0, 0, 50]",
            "payload_mm is given, expected payload_g",
        ),
        (
            "height_mm = 10",
            "height_mm = 0.01\nwall_mm = 2",
            "wall_mm is 2, .* of which the least is 0.01: all are in mm",
        ),
        ("yaw_deg = -90", "yaw_deg = -900", "yaw_deg must be .*-360.*got -900"),
        ("regulator_count = 4", "regulator_count = 4\nfrictoin = 1", "frictoin"),
        ("regulator_count = 4", "regulator_count = 1", "design .* to regulator 2"),
        (
            'modules = ["long"]',
            'modules = ["tall"]',
            r": sites\[1\].modules names 'tall'",
        ),
        ("[modules.short]", "[modules.spare]\n[modules.short]", None),
        ("minimum_legs = 4", "minimum_legs = 7", "legs from 7 to 6"),
        ("minimum_legs = 4", 'exclusions = ["0 1 2 3 4 5"]', "designs: the design space is empty"),
        (f"{USUAL}minimum", 'exclusions = ["0 1 2 3 4 5"]\nminimum', "designs: the .* is empty"),
        (
            f"{USUAL}minimum",
            "minimum_regulators = 5\nminimum",
            "regulators is 5, .* most 4",
        ),
        (
            f"{USUAL}minimum_legs = 4",
            "maximum_legs = 3",
            "no design uses regulator 4, exp",
        ),
        (
            f"{USUAL}minimum_legs = 4",
            'exclusions = ["0 1 2", "3 4"]',
            "regulator_count is 4 and .*regulator 4,",
        ),
        (
            f"{USUAL}minimum_legs = 4",
            f"options = {['0 *'] * 5 + ['0']}".replace("'", '"'),
            r"designs.options\[5\] is '0', expected a module besides",
        ),
        (
            "minimum_legs = 4",
            "maximum_regulators = 5",
            "designs.maximum_regulators is 5, .* most 4",
        ),
        (
            "position_mm = [0, -46, 36]\nyaw_deg = -90",
            "position_mm = [0, -46, 36]\nyaw_deg = -75",
            "nearest site is 4, which is turned by 15 degrees",
        ),
        (
            "minimum_legs = 4",
            "maximum_regulators = 2",
            "regulator_count is 4 and no design uses regulator 3, 4,",
        ),
        (
            'modules = ["long"]',
            "modules = []",
            r"sites\[1\].modules is empty, .*long",
        ),
        (
            'modules = ["long"]',
            'modules = ["long", "short", "long"]',
            r"sites\[1\].modules is \['long', 'short', 'long'\] and names 'long' 2 times, expected",
        ),
        (
            "minimum_legs = 4",
            'exclusions = ["0 1 0"]',
            r"designs.exclusions\[0\] is '0 1 0' and names site 0 2 times, expected each site once",
        ),
        (
            f"{USUAL}minimum",
            'exclusions = ["0 5", "2 3", "5 0"]\nminimum',
            r"exclusions\[0\] is '0 5' and designs.exclusions\[2\] is '5 0', which say the same",
        ),
        (
            "minimum_legs = 4",
            'same = ["180", "mirror", "-180"]',
            r"designs.same\[0\] is '180' and designs.same\[2\] is '-180', which say the same",
        ),
        ("minimum_legs = 4", 'same = ["90"]', "turn of site 0 lies on no site"),
        ("minimum_legs = 4", 'same = ["half"]', "designs.same has 'half'"),
        ("minimum_legs = 4", 'options = ["0 *"]', "designs.options has 1 entries"),
        (
            "position_mm = [0, -46, 36]",
            "position_mm = [5, -46, 36]",
            r"site 1 lies on no site \(it is at 0, -46, 36 mm, the nearest site is 4, 5 mm away\)",
        ),
        ('usual = "b1.0.2.2.0.b1"', 'usual = "b1.b3.2.2.0.b1"', "at location 1, expected"),
        (
            "pitch_deg",
            "pich_deg",
            r"setting sites\[0\].pich_deg: did you mean pitch_deg\?$",
        ),
        (
            "size_factor",
            "size_fator",
            r"modules.short.size_fator: did you mean size_factor\?$",
        ),
        ("[76, 24, 36]", "[76, 24]", r"sites\[0\].position_mm is \[76, 24\], .* of 3 entries$"),
        ("[76, 24, 36]", '"76 24 36"', r"position_mm is '76 24 36', expected a list of 3 entries$"),
        ('name = "', 'names = "', "unknown setting names: did you mean name"),
        (
            'name = "plate"',
            "",
            "name is missing",
        ),
        (
            '"front right"',
            '"front left"',
            r"sites\[0\] and sites\[5\] are both called 'front left'",
        ),
        (
            "position_mm = [76, -24, 36]",
            "position_mm = [76, 24, 36]",
            r"sites\[0\] \(front left\) and sites\[5\] \(front right\) are both at \[76",
        ),
        (
            "minimum_legs = 4",
            f"options = {['0 1'] * 3 + ['0 2'] * 3}".replace("'", '"'),
            "regulator 3 of 4 drives nothing",
        ),
        ("yaw_deg = 90", 'yaw_deg = "90"', r": sites\[1\]\.yaw_deg: expected a number, got '90'"),
    ],
)
def test_a_file_that_is_none_is_refused(
    edited: Edited, old: str, new: str, why: str | None
) -> None:
    """Named with the file, the field and the cause, before anything is simulated."""
    path = edited(old, new)
    if why is None:  # modules that every site allows are no mistake
        assert len(RobotDescription.read(path).modules) == 3
        return
    with pytest.raises(ArtefactError, match=why) as error:
        RobotDescription.read(path)
    assert str(path) in str(error.value)


@pytest.mark.parametrize(
    ("old", "new", "why"),
    [
        ("position_mm = [76, 24, 36]", "position_mm = [89, 24, 36]", "14.0 mm away from the hub"),
        (
            "width_mm = 90",
            "width_mm = 60",
            r"sites\[[01]\].* mm away from the hub.*; misplaced too: .*sites\[4\]",
        ),
        (
            "length_mm = 150\nwidth_mm = 90\nheight_mm = 10\nbottom_mm = 31",
            "length_mm = 0.15\nwidth_mm = 0.09\nheight_mm = 0.01\nbottom_mm = 0.031",
            "the hub is 0.15 mm across, .*: lengths are in mm, not in metres",
        ),
        ("position_mm = [76, 24, 36]", "position_mm = [60, 24, 36]", "height is from 31 to 41 mm"),
        (
            "yaw_deg = 0\npitch_deg = 15",
            "yaw_deg = 180\npitch_deg = 15",
            "does the site's x axis point away",
        ),
        (
            "yaw_deg = 0\npitch_deg = 15",
            "yaw_deg = 30\npitch_deg = 20",  # off the front face by both
            "x axis point away .* 35.5 degrees off the normal of the nearest face",
        ),
        (
            'pitch_deg = 15\n\n[[sites]]\nname = "left',
            'pitch_deg = 45\n\n[[sites]]\nname = "left',
            "mm behind its attachment face",
        ),
        ("density_g_per_ml = 0.6", "mass_kg = 50", "mass_kg of .hub. weighs 5e.04 g .* 42 g are"),
        ('leg = "measured"\n\n', 'leg = "measured"\nmass_g = 9\n\n', None),
        ('leg = "measured"\n\n', 'leg = "hyperelastic"\n\n', "pressure map of slope 1.247"),
    ],
)
def test_a_module_that_is_not_where_its_site_is_is_refused(
    edited: Edited, old: str, new: str, why: str | None
) -> None:
    path = edited(old, new)
    text = path.read_text().replace("mirror = true", "") + "mirror = false\n"
    path.write_text(text)
    described = RobotDescription.read(path)
    if why is None:  # a mass that was weighed is taken as it is
        assert described.spec().modules[0].reduced.mass == pytest.approx(0.009, rel=1e-12)
        return
    with pytest.raises(ArtefactError, match=why) as error:
        described.spec()
    assert str(path) in str(error.value)


def test_a_module_that_no_design_has_may_be_anywhere(edited: Edited) -> None:
    """A site that excludes another, which always has a leg, is empty in all designs."""
    path = edited("position_mm = [76, 24, 36]", "position_mm = [89, 24, 36]")
    text = path.read_text().replace("mirror = true", "").replace(USUAL, "") + "mirror = false\n"
    path.write_text(text)
    with pytest.raises(ArtefactError, match=r"14\.0 mm away from the hub"):
        RobotDescription.read(path).spec()
    options = ["0 *", "*", *["0 *"] * 4]
    path.write_text(f'{text}options = {json.dumps(options)}\nexclusions = ["0 1"]\n')
    assert len(RobotDescription.read(path).spec().sites) == 6


def test_modules_that_reach_into_each_other_are_refused_where_a_design_has_both(
    edited: Edited,
) -> None:
    """Legs of 20 mm at 10 mm from each other; not so where exclusions allow only one of them."""
    path = edited("position_mm = [76, -24, 36]", "position_mm = [76, 14, 36]")
    text = path.read_text().replace("mirror = true", "") + "mirror = false\n"
    path.write_text(text)
    why = r"sites\[0\] \(front left\) and .* at sites\[5\] \(front right\) are up to .* each other"
    with pytest.raises(ArtefactError, match=why):
        RobotDescription.read(path).spec()
    path.write_text(text.replace(USUAL, 'exclusions = ["0 5"]\n'))
    assert len(RobotDescription.read(path).spec().sites) == 6


def test_a_payload_of_kilograms_is_refused(edited: Edited) -> None:
    path = edited("density_g_per_ml = 0.6", "density_g_per_ml = 0.6\npayload_g = 0.03")
    with pytest.raises(ArtefactError, match=r"payload_g is 0\.03, .* 0\.1: it is in grams"):
        RobotDescription.read(path)


@pytest.mark.parametrize("point", ["payload_g = 40\npayload_mm", "tracked_point_mm"])
def test_a_point_beside_the_middle_is_refused_where_the_robot_is_said_to_be_its_half_turn(
    edited: Edited, point: str
) -> None:
    """The plate's sites have one; a payload ahead of the middle lies behind it, turned."""
    turned = 'minimum_legs = 4\nsame = ["180"]'
    for x_mm, same, refused in ((0, turned, False), (12, turned, True), (12, "", False)):
        path = edited(
            "density_g_per_ml = 0.6", f"density_g_per_ml = 0.6\n{point} = [{x_mm}, 0, 50]"
        )
        path.write_text(path.read_text().replace("minimum_legs = 4", same or "minimum_legs = 4"))
        if not refused:
            assert RobotDescription.read(path).space.first is not None
            continue
        with pytest.raises(
            ArtefactError, match=r'_mm is at \(12, 0\) mm, .* "180", expected \(0, 0'
        ):
            RobotDescription.read(path)


def test_a_ground_that_is_none_is_refused_with_file_and_field(
    edited: Edited, tmp_path: Path
) -> None:
    """When the robot's file is read: before anything walks."""
    np.save(tmp_path / "line.npy", np.arange(5.0))
    for name, kind, why in (
        ("none.npy", FileNotFoundError, "does not exist"),
        ("edited.toml", ArtefactError, "not an image"),
        ("line.npy", ArtefactError, r"two axes, \(row, column\), .* got the shape \(5,\)"),
    ):
        path = edited("[hub] #", f'[physics.ground.map]\npath = "{name}"\n\n[hub] #')
        where = rf"{path}: physics.ground.map.path: height map .*{name}.*{why}"
        with pytest.raises(kind, match=where):
            RobotDescription.read(path)


@pytest.mark.parametrize("table", ["physics", "hub", "modules", "sites", "designs", "ring", "name"])
@pytest.mark.parametrize("value", [3, "x", [1], {"a": 1}, None])
def test_a_table_of_another_kind_is_refused_by_the_file(
    tmp_path: Path, table: str, value: object
) -> None:
    if (table, value) == ("name", "x"):
        return
    content = tomllib.loads(PLATE.read_text()) | {table: value}
    path = tmp_path / "odd.json"
    path.write_text(json.dumps(content))
    if table == "ring" and value is None:  # as where it is left out
        assert RobotDescription.read(path).ring is None
        return
    with pytest.raises(ArtefactError, match=str(path)):
        RobotDescription.read(path)
