"""Node errors are zero for equal models, and tell a shift of the path from a change of shape."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from pneumorph.comparison.animation_error import compare_animation, node_error
from synthetic_part import synthetic_reduced_part

from pneumorph.comparison.animations import animations
from pneumorph.presets import paper_robot_builder
from pneumorph.simulation.reduced_robot import ReducedRobot
from pneumorph.simulation.rollout import rollout
from pneumorph.trajectory import Trajectory


@pytest.fixture(scope="module")
def trajectory() -> Trajectory:
    (animation,) = animations(["two_leg"], 0.3)
    part = synthetic_reduced_part(mode_count=4, cells=(4, 4, 4))
    model = ReducedRobot(paper_robot_builder(part)(animation.design))
    return rollout(model, np.full((30, 3), 45.0))[1]


def test_a_model_has_no_error_against_itself() -> None:
    (animation,) = animations(["two_leg"], 0.3)
    build = paper_robot_builder(synthetic_reduced_part(mode_count=4, cells=(4, 4, 4)))
    models = [ReducedRobot(build(animation.design)) for _ in range(2)]
    error, full, reduced = compare_animation(animation, *models)
    assert error.mean_node_error_mm == 0.0  # the same arithmetic: the same bits
    assert error.mean_node_error_in_hub_mm == 0.0
    assert error.mean_displacement_mm > 0.0
    assert error.time_ratio == error.full_s_per_step / error.reduced_s_per_step
    assert full.time_s[-1] == reduced.time_s[-1] == pytest.approx(0.3)


def test_a_shifted_robot_has_the_error_of_the_shift(trajectory: Trajectory) -> None:
    nodes = trajectory.node_positions_mm
    assert nodes is not None
    shifted = replace(trajectory, node_positions_mm=nodes + np.float32([3.0, 0.0, 4.0]))
    # Positions are stored in single precision: 2^-23 of 200 mm is 2e-5 mm.
    assert node_error(trajectory, shifted) == pytest.approx(5.0, abs=1e-4)


def test_trajectories_that_do_not_match_are_refused(trajectory: Trajectory) -> None:
    nodes = trajectory.node_positions_mm
    assert nodes is not None
    with pytest.raises(ValueError, match="expected the same; the models come from different"):
        node_error(trajectory, replace(trajectory, node_positions_mm=nodes[:, :, 1:]))
    with pytest.raises(ValueError, match="without node positions"):
        node_error(trajectory, replace(trajectory, node_positions_mm=None))
