"""Errors are zero for equal robots, and tell a shift of the path from a change of shape."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from helpers.synthetic_part import synthetic_reduced_part

from pneumorph.catalogue.leg_module import module_of_leg
from pneumorph.catalogue.paper_robot import paper_robot
from pneumorph.simulation.rollout import rollout
from pneumorph.study.animations import animations
from pneumorph.study.robot_error import node_error, robot_error
from pneumorph.trajectory import Trajectory


@pytest.fixture(scope="module")
def trajectory() -> Trajectory:
    (animation,) = animations(["two_leg"], 0.3)
    part = synthetic_reduced_part(mode_count=4, cells=(4, 4, 4))
    model = paper_robot(module_of_leg("published", part=part)).reduced(animation.design)
    return rollout(model, np.full((30, 3), 45.0))[1]


def shifted(trajectory: Trajectory, way: list[float]) -> Trajectory:
    nodes = trajectory.node_positions_mm
    assert nodes is not None
    return replace(
        trajectory,
        node_positions_mm=nodes + np.float32(way),
        hub_position_mm=trajectory.hub_position_mm + way,
        tracked_point_mm=trajectory.tracked_point_mm + way,
    )


def test_a_robot_has_no_error_against_itself(trajectory: Trajectory) -> None:
    error = robot_error(trajectory, trajectory)
    assert error.mean_node_error_mm == error.path_error_mm == error.distance_error_cm == 0.0
    assert error.leg_force_error_percent == 0.0
    assert error.slip_agreement_percent == 100.0
    assert error.mean_displacement_mm > 0.0


def test_a_shifted_robot_has_the_error_of_the_shift_and_none_of_shape(
    trajectory: Trajectory,
) -> None:
    error = robot_error(trajectory, shifted(trajectory, [3.0, 0.0, 4.0]))
    # Positions are stored in single precision: 2^-23 of 200 mm is 2e-5 mm.
    assert error.mean_node_error_mm == pytest.approx(5.0, abs=1e-4)
    assert error.largest_node_error_mm == pytest.approx(5.0, abs=1e-4)
    assert error.path_error_mm == pytest.approx(5.0, abs=1e-9)
    assert error.mean_node_error_in_hub_mm == pytest.approx(0.0, abs=1e-4)
    assert error.distance_error_cm == pytest.approx(0.0, abs=1e-12)  # both ends are shifted


def test_forces_and_slipping_points_are_compared(trajectory: Trajectory) -> None:
    force, velocity = trajectory.contact_force_mN, trajectory.contact_velocity_mm_per_s
    assert force is not None
    assert velocity is not None
    stronger = robot_error(trajectory, replace(trajectory, contact_force_mN=1.1 * force))
    assert stronger.leg_force_error_percent == pytest.approx(10.0, abs=1e-4)
    still = replace(trajectory, contact_velocity_mm_per_s=0.0 * velocity)
    sliding = replace(still, contact_velocity_mm_per_s=np.full_like(velocity, 5.0))
    error = robot_error(still, sliding)
    assert error.slip_agreement_percent == 0.0
    assert error.slipping_points_overlap_percent == 0.0
    assert robot_error(sliding, sliding).slipping_points_overlap_percent == 100.0
    nothing = robot_error(*(replace(trajectory, contact_force_mN=0.0 * force) for _ in range(2)))
    assert np.isnan(nothing.leg_force_error_percent)


def test_trajectories_that_do_not_match_are_refused(trajectory: Trajectory) -> None:
    nodes = trajectory.node_positions_mm
    assert nodes is not None
    fewer = replace(trajectory, node_positions_mm=nodes[:, :, 1:], skin_triangles=None, shape=None)
    with pytest.raises(ValueError, match="expected the same; the models come from different"):
        node_error(trajectory, fewer)
    with pytest.raises(ValueError, match="without node positions"):
        node_error(trajectory, replace(trajectory, node_positions_mm=None))
    with pytest.raises(ValueError, match="without contact forces"):
        robot_error(trajectory, replace(trajectory, contact_force_mN=None))
    with pytest.raises(ValueError, match="ended as diverged"):
        robot_error(trajectory, replace(trajectory, status="diverged"))
