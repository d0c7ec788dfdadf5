"""Two-chamber legs turn their robot to one side by left chambers, to the other by right ones."""

from __future__ import annotations

from dataclasses import replace
from itertools import product
from pathlib import Path

import numpy as np
import pytest

from pneumorph.catalogue.robot_description import RobotDescription
from pneumorph.catalogue.robot_spec import RobotSpec
from pneumorph.simulation.rollout import rollout
from pneumorph.study.module_catalogue import read_catalogue, shipped_catalogue

EXAMPLE = Path(__file__).parents[2] / "examples" / "two_chambers.toml"


@pytest.fixture(scope="module")
def robot() -> RobotDescription:
    return RobotDescription.read(EXAMPLE)


def yaw_deg(spec: RobotSpec, design: str, pressures_kPa: list[float]) -> float:
    """How far the hub has turned to the left after 0.3 s at real pressures, floating."""
    floating = replace(spec, physics=replace(spec.physics, gravity_mm_per_s2=0.0))
    commands = np.tile(pressures_kPa, (30, 1))
    _, walked = rollout(floating.reduced(design), commands, record_every=30, settling_steps=0)
    turned = walked.hub_rotation[-1]
    # Four legs alike: the hub neither tilts nor drifts sideways, but for rounding.
    assert abs(turned[2, :2]).max() < 1e-6
    assert abs(walked.hub_position_mm[-1, :2] - walked.hub_position_mm[0, :2]).max() < 1e-4
    return float(np.degrees(np.arctan2(turned[1, 0], turned[0, 0])))


def test_each_side_turns_it_to_its_own(robot: RobotDescription) -> None:
    """The robot is its own mirror image with its chambers exchanged, and so are the turns, to the
    error of its legs' reduction, a percent of the bend."""
    spec, design = robot.spec(), robot.usual_design
    left = yaw_deg(spec, design, [60.0, 0.0, 0.0, 0.0])
    right = yaw_deg(spec, design, [0.0, 60.0, 0.0, 0.0])
    both = yaw_deg(spec, design, [60.0, 60.0, 0.0, 0.0])
    assert abs(left) > 0.05
    assert right == pytest.approx(-left, rel=1e-2)
    assert abs(both) < 1e-2 * abs(left)


def test_its_catalogue_has_its_leg() -> None:
    """By the name, and with the physics, that the robot's file says; nothing has to be built."""
    described = RobotDescription.read(EXAMPLE)
    (module,) = described.modules.values()
    leg = read_catalogue(shipped_catalogue())[str(module.catalogue)]
    assert leg.leg == described.physics.based_on
    assert leg.mesh.leg.middle_wall_mm > 0.0
    assert described.spec().modules[0].reduced.cavity_count == 2


def test_robots_that_are_turned_by_a_quarter_count_once(robot: RobotDescription) -> None:
    """Counted anew: names of regulators for eight chambers, turned by whole legs."""

    def named(chambers: tuple[int, ...]) -> tuple[int, ...]:
        names: dict[int, int] = {}
        return tuple(names.setdefault(each, len(names)) for each in chambers)

    robots = {named(chambers) for chambers in product(range(4), repeat=8)}
    turned = {min(named(each[k:] + each[:k]) for k in (0, 2, 4, 6)) for each in robots}
    assert len(robot.space) == len(turned) == 731
    assert all(len(each.regulators) == 2 for each in robot.space.first.fittings)
