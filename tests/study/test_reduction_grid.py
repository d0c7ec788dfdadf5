"""Several reductions of one leg beside its finite elements."""

from __future__ import annotations

from dataclasses import replace

import pytest

from pneumorph.base.layers import layered
from pneumorph.catalogue.robot_options import RobotOptions
from pneumorph.catalogue.robot_spec import RobotSpec
from pneumorph.catalogue.shipped_data import data_file
from pneumorph.physics.calibration import Calibration
from pneumorph.study import reduction_grid


def test_reductions_of_a_grid_weigh_what_the_robots_leg_does(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The file's own leg is 2.2 times as heavy as the one that is cast and compared."""
    walked: list[RobotSpec] = []

    def noted(_file, _walks, robot: RobotSpec, _record_every) -> None:
        walked.append(robot)

    monkeypatch.setattr(reduction_grid, "_point", noted)
    robot = layered(RobotOptions(), [{"leg": "hyperelastic"}]).spec()
    robot = replace(robot.calibrated(Calibration(robot.physics.pressure_map, 1.1)), thread_count=2)
    file = data_file("leg_hyperelastic.npz")
    reduction_grid.reduction_grid([file], [], robot, 2, lambda *_: None)
    (found,) = walked
    assert found.module.reduced.digest() == robot.module.reduced.digest()
    assert found.module.reduced.mass == pytest.approx(found.module.full.mass_kg, rel=1e-9)
    assert found.thread_count == 1
