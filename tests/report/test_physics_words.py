"""What a physics is called where its numbers are told."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from pneumorph.catalogue.leg_kinds import leg_kind
from pneumorph.catalogue.robot_description import RobotDescription
from pneumorph.report.physics_words import physics_name, physics_words

MEASURED = leg_kind("measured").physics
EXAMPLES = Path(__file__).parents[2] / "examples"


def test_a_robot_of_ones_own_is_in_the_physics_that_it_is_based_on() -> None:
    """With its own number of regulators, and chambers that grow as its legs have it."""
    for file in ("plate.toml", "two_chambers.toml"):
        physics = RobotDescription.read(EXAMPLES / file).spec().physics
        assert physics != MEASURED
        assert physics_name(physics) == "measured physics"
    told = physics_words(RobotDescription.read(EXAMPLES / "two_chambers.toml").spec().physics)
    assert told.endswith("kPa, chamber growth 0.00987 2.87e-05 3.46e-07")
    valves = replace(MEASURED.air, filling_mm3_per_s_kPa=(70.0,) * 4)
    assert physics_name(replace(MEASURED, regulator_count=4, air=valves)) == "objective damping"


def test_other_numbers_are_none_that_has_a_name() -> None:
    assert physics_name(leg_kind("published").physics) == "published physics"
    slippery = physics_words(replace(MEASURED, friction=0.3))
    assert slippery.startswith(
        "measured physics but for friction, objective damping, friction 0.3, of hub 0.22, air"
    )
    hill = replace(MEASURED, friction=0.3, friction_by_surface=(), floor_slope_deg=5.0)
    assert physics_name(hill) == "measured physics but for slope and friction"
    assert physics_name(replace(MEASURED, time_step_s=0.005)) == "objective damping"
