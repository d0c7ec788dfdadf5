"""Flags and settings of earlier versions mean what they meant."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from helpers.run_folders import write_run

from pneumorph.base.settings import settings_from_dict, settings_to_dict
from pneumorph.catalogue.leg_kinds import HYPERELASTIC_PRESSURE_MAP
from pneumorph.catalogue.older_names import current_arguments
from pneumorph.catalogue.robot_options import RobotOptions
from pneumorph.cli import run
from pneumorph.fem.material import LegMaterials, Material
from pneumorph.physics.physics import Physics
from pneumorph.physics.pressure import PressureMap
from pneumorph.study.training_options import TrainingOptions

Ask = Callable[[str], Any]


def test_older_flags_mean_what_they_are_called_now(asked: Ask) -> None:
    for older, now in {
        "--simulation.damping": "--physics.damping",
        "--simulation.pressure-map.slope=2": "--physics.pressure-map.slope=2",
        "--simulation.contact-sweeps": "--stepper.contact-sweeps",
        "--simulation.element_precision=double": "--stepper.element_precision=double",
        "--materials.paper.poisson-ratio": "--materials.sheet.poisson-ratio",
        "--materials.paper-thickness-mm=2": "--materials.sheet-thickness-mm=2",
        "--leg paper --film": "--leg published --film",
        "--leg=paper": "--leg=published",
    }.items():
        assert current_arguments(older.split()) == now.split()
    kept = ["--physics.damping", "simulation.damping", "--film", "objective", "--preset", "paper"]
    assert current_arguments(kept) == kept
    robot = asked("simulate --simulation.damping objective --simulation.contact-sweeps=7").robot
    assert (robot.physics.damping, robot.stepper.contact_sweeps) == ("objective", 7)


def test_older_settings_are_read(tmp_path: Path, asked: Ask) -> None:
    file = tmp_path / "older.toml"
    file.write_text('[robot.simulation]\ndamping = "objective"\ncontact_sweeps = 7\n')
    robot = asked(f"simulate --settings {file}").robot
    assert (robot.physics.damping, robot.stepper.contact_sweeps) == ("objective", 7)
    assert asked(f"simulate --settings {file} --physics.damping published").robot.physics == (
        Physics()
    )
    file.write_text('[robot]\nleg = "paper"\n')
    assert asked(f"simulate --preset hyperelastic --settings {file}").robot.leg == "published"
    file.write_text(
        'leg = "paper"\nsnapshots.static.loaded_surface = "paper"\n'
        "[materials]\npaper_thickness_mm = 2.0\npaper.young_modulus_kPa = 9.0\n"
        "paper.poisson_ratio = 0.4\n"
    )
    options = asked(f"reduce --settings {file}")
    assert (options.leg, options.snapshots.static.loaded_surface) == ("published", "sheet")
    assert options.materials == LegMaterials(sheet=Material(9.0, 0.4), sheet_thickness_mm=2.0)
    file.write_text("[robot.simulation]\ncontact_sweps = 7\n")
    assert run(["simulate", "--settings", str(file), "--out", str(tmp_path / "s")]) == 1


@pytest.mark.parametrize(
    ("leg", "own"), [("published", PressureMap()), ("hyperelastic", HYPERELASTIC_PRESSURE_MAP)]
)
def test_an_older_run_walks_the_map_it_walked(leg: str, own: PressureMap, tmp_path: Path) -> None:
    """Runs of the hyperelastic leg saved the published map and walked their own."""
    now = settings_to_dict(RobotOptions.of("published"))
    physics, stepper = now.pop("physics"), now.pop("stepper")
    older = {**now, "leg": leg, "simulation": {**physics, **stepper}}
    assert settings_from_dict(RobotOptions, older).physics == Physics(pressure_map=own)
    other = PressureMap(5.0, -1.0)  # no leg's own
    older["simulation"]["pressure_map"] = settings_to_dict(other)
    assert settings_from_dict(RobotOptions, older).physics.pressure_map == other


def test_settings_of_a_group_may_stand_beside_it_as_its_flags_do(
    tmp_path: Path, asked: Ask
) -> None:
    """Verbs of earlier versions had no such groups in their settings."""
    file = tmp_path / "older.json"
    file.write_text('{"pair_count": 2, "cycle_s": 2.0, "robot": {"threads": 3}}')
    folder = write_run(
        tmp_path / "run", "coopt", TrainingOptions(robot=RobotOptions.of("published"))
    )
    options = asked(f"analyse {folder} --afresh --settings {file}")
    assert (options.analysis.pair_count, options.analysis.cycle_s) == (2, 2.0)
    assert options.robot.threads == 3
    file.write_text('{"pear_count": 2}')
    assert run(["analyse", str(folder), "--settings", str(file)]) == 1
