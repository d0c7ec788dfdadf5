"""The error indicator against true errors, on parts small enough to solve."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import spearmanr
from small_robot import small_leg, small_robot
from synthetic_part import synthetic_part, vibration_modes

from pneumorph.fem.full_order_settings import FullOrderSettings
from pneumorph.fem.static import static_equilibrium
from pneumorph.reduction import static_equilibrium as reduced_statics
from pneumorph.reduction.assemble import assemble_reduced_part
from pneumorph.reduction.error_indicator import ErrorIndicator, Imbalance, relative_imbalance

CELLS = (6, 4, 4)
MODEL = synthetic_part(CELLS)
HELD = MODEL.mesh.node_set("attachment")


def tip_force(size_mN: float, seed: int) -> np.ndarray:
    """A force of random direction on the outer end face [mN], (node, 3)."""
    direction = np.random.default_rng(seed).normal(size=3)
    force = np.zeros((MODEL.node_count, 3))
    tip = MODEL.mesh.node_set("outer_end_face")
    force[tip] = size_mN * direction / np.linalg.norm(direction) / len(tip)
    return force


def true_and_indicated(mode_count: int, pressure: float, force: np.ndarray) -> tuple[float, float]:
    """Energy norm of the reduced equilibrium's error at the true state, and the indicator's."""
    reduced = assemble_reduced_part(MODEL, vibration_modes(synthetic_part(CELLS), mode_count))
    full = static_equilibrium(MODEL, pressure, HELD, external_force=force)
    external = reduced.modes.reshape(-1, mode_count).T @ force.ravel()
    found = reduced_statics.static_equilibrium(reduced, pressure, external=external)
    assert full.converged
    assert found.converged
    x = reduced.positions(found.alpha)
    imbalance = ErrorIndicator(MODEL).at_rest(x - MODEL.rest_nodes, pressure, force)
    error = (x - full.positions).ravel()
    stiffness = MODEL.stiffness(full.positions)
    return float(error @ (stiffness @ error)) ** 0.5, imbalance.residual**0.5


def test_indicator_is_the_energy_error_of_a_small_displacement() -> None:
    for seed in range(3):
        true, indicated = true_and_indicated(6, 0.0, tip_force(1.0, seed))
        # Galerkin: r = K (u - u_r) in a linear part. 1 mN moves the tip by 0.02 mm, which turns
        # elements by 2e-4; edge-based rotations make the tangent differ from K in that order.
        assert indicated == pytest.approx(true, rel=2e-3)


def test_indicator_ranks_true_errors_of_large_displacements() -> None:
    true, indicated = zip(
        *(
            true_and_indicated(mode_count, pressure, tip_force(size, seed))
            for seed, (mode_count, pressure, size) in enumerate(
                (mode_count, pressure, size)
                for mode_count in (4, 8, 14)
                for pressure in (0.0, 40.0)
                for size in (20.0, 200.0)
            )
        ),
        strict=True,
    )
    assert max(true) > 5.0 * min(true)
    assert spearmanr(true, indicated).statistic > 0.9
    # Turned elements are as stiff as before: the estimate stays within a factor.
    ratio = np.array(indicated) / np.array(true)
    assert ratio.min() > 0.5
    assert ratio.max() < 2.0


def test_a_step_of_the_full_model_leaves_nothing_unbalanced() -> None:
    leg = small_leg()
    robot = small_robot(
        FullOrderSettings(floor_height_mm=0.0, regulator_count=2, contact_tolerance_mm_per_s=1e-10),
        leg=leg,
    )
    state = robot.settled_state(5)
    for _ in range(10):
        state = robot.step(state, np.array([5.0, 10.0]))
    following = robot.step(state, np.array([5.0, 10.0]))
    assert following.active_contacts > 0
    indicator = ErrorIndicator(leg)
    first = 0
    for number, mounted in enumerate(robot.legs):
        # Impulses are along normal, x, y of the level floor.
        impulse = following.impulses[first : first + mounted.contact_count][:, [1, 2, 0]]
        first += mounted.contact_count
        imbalance = indicator.of_step(
            state.positions[number],
            state.velocities[number],
            following.velocities[number],
            float(robot.settings.pressure_map.simulated(following.regulated_kPa)[number]),
            mounted.contact_weights.T @ impulse,
            mounted.pose.rotation,
            robot.settings,
        )
        # Squares: the linear solve balances forces to 1e-9 of the elastic ones or better.
        assert imbalance.residual < 1e-18 * imbalance.elastic
        without = indicator.of_step(
            state.positions[number],
            state.velocities[number],
            following.velocities[number],
            0.0,
            np.zeros_like(state.positions[number]),
            mounted.pose.rotation,
            robot.settings,
        )
        assert without.residual > 1e-3 * without.elastic


def test_relative_imbalance_is_a_ratio_of_sums() -> None:
    assert relative_imbalance([Imbalance(1.0, 50.0), Imbalance(3.0, 50.0)]) == pytest.approx(0.2)
    assert relative_imbalance([Imbalance(0.0, 0.0)]) == 0.0
    assert relative_imbalance([Imbalance(1.0, 0.0)]) == float("inf")
    with pytest.raises(ValueError, match="at least one state"):
        relative_imbalance([])
