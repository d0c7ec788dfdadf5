"""Scaled material against exact scaling laws of the same part."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from helpers.synthetic_part import synthetic_reduced_part

from pneumorph.catalogue.paper_robot import paper_robot
from pneumorph.physics.physics import Physics
from pneumorph.reduction.modal_equilibrium import modal_equilibrium
from pneumorph.robot.robot import Robot
from pneumorph.robot.scaled_part import scaled_part, scaled_robot
from pneumorph.simulation.reduced_robot import ReducedRobot
from pneumorph.simulation.rollout import rollout
from pneumorph.simulation.stepper_settings import StepperSettings


def test_stiffer_part_bends_alike_under_more_pressure() -> None:
    """Statics without weight depend on pressure over modulus alone."""
    part = synthetic_reduced_part(mode_count=4, cells=(4, 4, 4))
    soft = modal_equilibrium(part, 30.0).alpha
    stiff = modal_equilibrium(scaled_part(part, modulus_factor=1.7), 1.7 * 30.0).alpha
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


def test_a_stiffer_leg_stands_on_the_same_mount() -> None:
    """Held at a shape, it resists with its elements' force times the factor, and the same mount."""
    part = synthetic_reduced_part(mode_count=4, cells=(4, 4, 4))
    mount = np.diag([5.0, 2.0, 1.0, 3.0])
    held = replace(part, linear_stiffness=mount)
    alpha = np.array([0.3, -0.2, 0.1, 0.05])
    stiff = scaled_part(held, modulus_factor=2.5, mass_factor=4.0)
    elastic = 2.5 * part.internal_force(alpha)
    # Modes of four times the mass are half as large: forces along them too, coordinates twice.
    np.testing.assert_allclose(
        stiff.internal_force(2.0 * alpha), (elastic - mount @ alpha) / 2.0, rtol=1e-12
    )


def test_robot_of_all_masses_moduli_and_pressures_doubled_walks_the_same_path() -> None:
    """Newton's law is linear in mass, modulus and pressure together (gravity scales with mass)."""
    robot = paper_robot("published").assembly("1.0.0.2.2.0.0.1")
    commands = np.zeros((60, 3))
    commands[:, 0] = 60.0
    # Double arithmetic: single's rounding of element forces would be magnified by contact.
    physics, stepper = Physics(), StepperSettings(element_precision="double")
    doubled = replace(
        physics,
        pressure_map=replace(
            physics.pressure_map,
            slope=2.0 * physics.pressure_map.slope,
            intercept_kPa=2.0 * physics.pressure_map.intercept_kPa,
        ),
    )
    _, once = rollout(ReducedRobot(robot, physics, stepper), commands)
    _, twice = rollout(ReducedRobot(_on_stiffer_mounts(robot), doubled, stepper), commands)
    moved = np.abs(once.tracked_point_mm[-1] - once.tracked_point_mm[0]).max()
    assert moved > 0.5
    # Equal but for rounding and the friction solver's 0.01 mm/s over 0.75 s.
    np.testing.assert_allclose(twice.tracked_point_mm, once.tracked_point_mm, atol=1e-2)
    _, heavy = rollout(ReducedRobot(scaled_robot(robot, 1.0, 2.0), physics, stepper), commands)
    assert np.abs(heavy.tracked_point_mm - once.tracked_point_mm).max() > 0.1


def _on_stiffer_mounts(robot: Robot) -> Robot:
    """All moduli and masses of a robot doubled, and the hub's own stiffness with them."""
    heavy = scaled_robot(robot, 2.0, 2.0)
    part = heavy.mounts[0].part
    part = replace(part, linear_stiffness=2.0 * part.linear_stiffness)
    return replace(heavy, mounts=tuple(replace(mount, part=part) for mount in heavy.mounts))


def test_factor_of_zero_is_refused() -> None:
    part = synthetic_reduced_part(mode_count=4, cells=(4, 4, 4))
    with pytest.raises(ValueError, match="modulus_factor must be positive and finite, got 0"):
        scaled_part(part, modulus_factor=0.0)
