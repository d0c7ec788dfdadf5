"""Options of finite elements reach the numerics that they are options of."""

from __future__ import annotations

from dataclasses import MISSING, fields

from pneumorph.catalogue.full_options import FullOptions
from pneumorph.catalogue.robot_options import RobotOptions
from pneumorph.fem.full_order_settings import FullOrderSettings

NO_NUMERICS = {"hub", "mesh"}
OTHERS = {
    "integrator": "implicit_euler",
    "newton_matrix": "kept",
    "displacement_tolerance_mm": 0.25,
    "thread_count": 3,
    "friction_solver": "gauss_seidel",
    "contact_sweeps": 250,
}


def test_each_option_is_one_of_the_numerics_with_the_same_default() -> None:
    numerics = {each.name: each for each in fields(FullOrderSettings)}
    options = {each.name: each for each in fields(FullOptions) if each.name not in NO_NUMERICS}
    assert options.keys() <= numerics.keys()
    for name, option in options.items():
        assert option.default == numerics[name].default is not MISSING
        assert option.type == numerics[name].type


def test_each_option_reaches_the_robot() -> None:
    assert OTHERS.keys() == {each.name for each in fields(FullOptions)} - NO_NUMERICS
    asked = FullOptions(**OTHERS)  # type: ignore[arg-type]
    assert asked.numerics() == FullOrderSettings(**OTHERS)  # type: ignore[arg-type]
    robot = RobotOptions.of("measured", full=asked).spec()
    assert robot.full_order == asked.numerics()
