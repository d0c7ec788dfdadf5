"""A table of materials in a robot's file says what it says, and the module's part the rest."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from helpers.synthetic_part import synthetic_mesh, vibration_modes

from pneumorph.base.artefact import ArtefactError
from pneumorph.base.settings import settings_to_dict
from pneumorph.catalogue.leg_kinds import MEASURED_MATERIALS
from pneumorph.catalogue.module import Module
from pneumorph.catalogue.module_description import ModuleDescription
from pneumorph.catalogue.robot_description import RobotDescription
from pneumorph.fem.leg_model import leg_model
from pneumorph.fem.material import LegMaterials, Material
from pneumorph.fem.part_ingredients import ingredients
from pneumorph.fem.silicones import BEAM_RELAXATION
from pneumorph.reduction.assemble import assemble_reduced_part

OWN = LegMaterials(
    Material(330.0, 0.45, "stable_neo_hookean"),
    Material(4e5, 0.3, "st_venant_kirchhoff"),
    sheet_thickness_mm=0.2,
    mass_kg=0.02,
    mass_lumping="volume",
    relaxation=BEAM_RELAXATION,
)
ROBOT = """
name = "plate"
[physics]
regulator_count = 1
[hub]
shape = "box"
length_mm = 60
width_mm = 40
height_mm = 10
bottom_mm = 30
density_g_per_ml = 1.2
[[sites]]
position_mm = [30, 0, 35]
[designs]
minimum_legs = 1
mirror = false
[modules.finger]
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A part that says what it was made of, the same part that does not, and their mesh."""
    folder = tmp_path_factory.mktemp("finger")
    mesh = synthetic_mesh((4, 4, 4))
    full = leg_model(mesh, OWN)
    part = assemble_reduced_part(full, vibration_modes(full, 4))
    silent = {name: each for name, each in part.metadata.items() if name != "materials"}
    replace(part, metadata=silent).save(folder / "silent.npz")
    replace(part, metadata={**silent, "materials": settings_to_dict(OWN)}).save(folder / "leg.npz")
    mesh.save(folder / "mesh.npz")
    return folder


def read(folder: Path, table: str, part: str = 'part = "leg.npz"\nmesh = "mesh.npz"\n') -> Module:
    robot = folder / "robot.toml"
    robot.write_text(f"{ROBOT}{part}{table}")
    found = RobotDescription.read(robot)
    again = RobotDescription.read(found.write(folder / "again.toml"))
    assert again.modules == found.modules
    return found.modules["finger"].module("finger", folder, folder, "measured")


@pytest.mark.parametrize(
    "table",
    [
        "sheet_thickness_mm = 0.2",
        "paper_thickness_mm = 0.2",
        "mass_kg = 0.02",
        "silicone.young_modulus_kPa = 330",
        "silicone = {young_modulus_kPa = 330, poisson_ratio = 0.45}",
        'sheet = {law = "st_venant_kirchhoff"}\nmass_lumping = "volume"',
    ],
)
def test_a_table_that_repeats_the_parts_own_changes_nothing(table: str, folder: Path) -> None:
    """What it does not say is the part's, and not the published leg's."""
    plain, repeated = (read(folder, each) for each in ("", f"[modules.finger.materials]\n{table}"))
    assert ingredients(repeated.full) == ingredients(plain.full)
    assert repeated.full.mass_kg == pytest.approx(OWN.mass_kg)
    np.testing.assert_array_equal(repeated.full.node_mass, plain.full.node_mass)
    repeated.check_reduction()


@pytest.mark.parametrize(
    ("table", "told"),
    [
        ("sheet_thickness_mm = 0.3", r"sheet_thickness_mm is 0\.3, expected 0\.2"),
        ("mass_kg = 0.105", r"mass_kg is 0\.105, expected 0\.02"),
        ('mass_lumping = "even"', "mass_lumping is even, expected volume"),
        ("silicone.young_modulus_kPa = 600", r"silicone is Material\(.*600.*expected.*330"),
        ('silicone.law = "corotational"', r"silicone is Material\(.*corotational"),
        ("relaxation = {weights = [0.1], times_s = [0.5]}", "relaxation is .*expected"),
    ],
)
def test_a_table_that_says_otherwise_than_the_part_is_refused(
    table: str, told: str, folder: Path
) -> None:
    with pytest.raises(ArtefactError, match=rf"modules\.finger\.materials\.{told}"):
        read(folder, f"[modules.finger.materials]\n{table}")
    kept = RobotDescription.of_text((folder / "robot.toml").read_text(), folder / "robot.toml")
    assert kept.modules["finger"].materials is not None  # of a run that had it


def test_a_weighed_part_may_say_its_mass_beside_it(folder: Path) -> None:
    module = read(folder, "mass_g = 20.5\n[modules.finger.materials]\nmass_kg = 0.0205")
    assert module.full.mass_kg == pytest.approx(0.0205)


def test_a_part_that_says_nothing_is_held_to_what_it_is(folder: Path) -> None:
    part = 'part = "silent.npz"\nmesh = "mesh.npz"\n'
    whole = (
        "silicone = {young_modulus_kPa = 330, poisson_ratio = 0.45, law = 'stable_neo_hookean'}\n"
        "sheet = {young_modulus_kPa = 4e5, poisson_ratio = 0.3, law = 'st_venant_kirchhoff'}\n"
        "sheet_thickness_mm = 0.2\nmass_kg = 0.02\n"
    )
    module = read(folder, f"[modules.finger.materials]\n{whole}", part)
    assert ingredients(module.full) == ingredients(leg_model(synthetic_mesh((4, 4, 4)), OWN))
    with pytest.raises(ArtefactError, match=r"modules\.finger\.materials\.mass_kg is 0\.04"):
        read(folder, f"[modules.finger.materials]\n{whole.replace('0.02', '0.04')}", part)


def test_a_leg_that_ships_has_the_rest_of_its_own(folder: Path) -> None:
    robot = folder / "ships.toml"
    table = "[modules.finger.materials]\nsheet_thickness_mm = 0.1\n"
    robot.write_text(f'{ROBOT}leg = "measured"\n{table}')
    assert RobotDescription.read(robot).modules["finger"].materials == MEASURED_MATERIALS


@pytest.mark.parametrize(
    ("module", "told"),
    [
        ('part = "leg.npz"\n[modules.finger.materials]\nsheet_thicknes_mm = 1', "sheet_thicknes"),
        ('part = "leg.npz"\n[modules.finger.materials]\nsilicone = 5', "materials.silicone"),
        ("part = 5\n[modules.finger.materials]\nmass_kg = 0.02", "modules.finger.part"),
        ('catalogue = "short"\n[modules.finger.materials]\nmass_kg = 0.02', "beside catalogue"),
    ],
)
def test_what_is_no_table_of_materials_is_refused_by_its_place(
    module: str, told: str, folder: Path
) -> None:
    (folder / "wrong.toml").write_text(f"{ROBOT}{module}\n")
    with pytest.raises(ArtefactError, match=told):
        RobotDescription.read(folder / "wrong.toml")


def test_materials_of_a_description_in_python_are_refused_too(folder: Path) -> None:
    described = ModuleDescription(part=Path("leg.npz"), materials=replace(OWN, mass_kg=0.03))
    with pytest.raises(ValueError, match=r"modules\.f\.materials\.mass_kg is 0\.03"):
        described.refuse_other_materials("f", described.own_part(folder, folder))
