"""Scaled material against exact scaling laws of the same part."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from synthetic_part import synthetic_reduced_part

from pneumorph.presets import paper_robot_builder
from pneumorph.reduction.static_equilibrium import static_equilibrium
from pneumorph.robot.design import Design
from pneumorph.robot.scaled_part import scaled_part, scaled_robot
from pneumorph.simulation.reduced_robot import ReducedRobot
from pneumorph.simulation.rollout import rollout
from pneumorph.simulation.simulation_settings import SimulationSettings


def test_stiffer_part_bends_alike_under_more_pressure() -> None:
    """Statics without weight depend on pressure over modulus alone."""
    part = synthetic_reduced_part(mode_count=4, cells=(4, 4, 4))
    soft = static_equilibrium(part, 30.0).alpha
    stiff = static_equilibrium(scaled_part(part, modulus_factor=1.7), 1.7 * 30.0).alpha
    # Both to the search's relative residual of 1e-9.
    np.testing.assert_allclose(stiff, soft, rtol=1e-6, atol=1e-9 * np.abs(soft).max())


def test_heavier_part_is_the_same_shape() -> None:
    part = synthetic_reduced_part(mode_count=4, cells=(4, 4, 4))
    heavy = scaled_part(part, mass_factor=3.0)
    alpha = np.array([0.3, -0.2, 0.1, 0.05])
    np.testing.assert_allclose(
        heavy.positions(np.sqrt(3.0) * alpha), part.positions(alpha), rtol=1e-14
    )
    assert heavy.cavity().volume(np.sqrt(3.0) * alpha) == pytest.approx(
        part.cavity().volume(alpha), rel=1e-13
    )
    # Modes stay orthonormal in mass: what the stepper takes for granted.
    trace = np.einsum("iiab->ab", heavy.second_moment_mode_pairs)
    np.testing.assert_allclose(trace, np.eye(4), atol=1e-6)


def test_robot_of_all_masses_moduli_and_pressures_doubled_walks_the_same_path() -> None:
    """Newton's law is linear in mass, modulus and pressure together (gravity scales with mass)."""
    robot = paper_robot_builder()(Design.parse("1.0.0.2.2.0.0.1"))
    commands = np.zeros((60, 3))
    commands[:, 0] = 60.0
    # Double arithmetic: single's rounding of element forces would be magnified by contact.
    settings = SimulationSettings(element_precision="double")
    doubled = replace(
        settings,
        pressure_map=replace(
            settings.pressure_map,
            slope=2.0 * settings.pressure_map.slope,
            intercept_kPa=2.0 * settings.pressure_map.intercept_kPa,
        ),
    )
    _, once = rollout(ReducedRobot(robot, settings), commands)
    _, twice = rollout(ReducedRobot(scaled_robot(robot, 2.0, 2.0), doubled), commands)
    moved = np.abs(once.tracked_point_mm[-1] - once.tracked_point_mm[0]).max()
    assert moved > 0.5
    # Equal but for rounding and the friction solver's 0.01 mm/s over 0.75 s.
    np.testing.assert_allclose(twice.tracked_point_mm, once.tracked_point_mm, atol=1e-2)
    _, heavy = rollout(ReducedRobot(scaled_robot(robot, 1.0, 2.0), settings), commands)
    assert np.abs(heavy.tracked_point_mm - once.tracked_point_mm).max() > 0.1


def test_factor_of_zero_is_refused() -> None:
    part = synthetic_reduced_part(mode_count=4, cells=(4, 4, 4))
    with pytest.raises(ValueError, match="modulus_factor must be positive and finite, got 0"):
        scaled_part(part, modulus_factor=0.0)
