"""Mass, weight and products of velocities of the reference are sums over the nodes."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.crawlers import PART
from helpers.one_leg import HUB, POSE, motion_of

from pneumorph.robot.robot import Mount
from pneumorph.simulation.reference_mass import (
    cross_matrix,
    hub_moments,
    mass_matrix,
    mount_moments,
    velocity_products,
    weight,
)

GRAVITY = np.array([300.0, -200.0, -9800.0])


@pytest.fixture
def leg():
    """Moments of a bent leg; of its nodes the masses, places and velocities by the unknowns."""
    alpha, rates, velocity = motion_of(PART, 0.3)
    nodes = POSE.apply(PART.positions(alpha))
    jacobian = np.zeros((len(nodes), 3, 6 + PART.mode_count))
    jacobian[:, :, :3] = np.eye(3)
    for axis in range(3):
        jacobian[:, :, 3 + axis] = np.cross(np.eye(3)[axis], nodes)
    jacobian[:, :, 6:] = np.einsum("ij,nja->nia", POSE.rotation, PART.modes)
    body = mount_moments(Mount(PART, POSE, (0,)), alpha)
    return body, PART.mass / len(nodes), nodes, jacobian, rates, velocity[3:]


def test_the_mass_matrix_is_a_sum_over_nodes(leg):
    body, mass, _, jacobian, _, _ = leg
    flat = jacobian.reshape(-1, jacobian.shape[2])
    # Modes kept in single precision are orthonormal to some 1e-8.
    np.testing.assert_allclose(mass_matrix(body), mass * flat.T @ flat, atol=1e-7)


def test_the_weight_is_a_sum_over_nodes(leg):
    body, mass, _, jacobian, _, _ = leg
    expected = mass * np.einsum("nia,i->a", jacobian, GRAVITY)
    np.testing.assert_allclose(weight(body, GRAVITY), expected, atol=1e-7 * np.abs(expected).max())


def test_products_of_velocities_are_a_sum_over_nodes(leg):
    body, mass, nodes, jacobian, rates, turning = leg
    swing = jacobian[:, :, 6:] @ rates
    acceleration = np.cross(turning, np.cross(turning, nodes)) + 2.0 * np.cross(turning, swing)
    expected = -mass * np.einsum("nia,ni->a", jacobian, acceleration)
    got = velocity_products(body, turning, rates)
    np.testing.assert_allclose(got, expected, atol=1e-7 * np.abs(expected).max())


def test_a_hub_is_a_rigid_body():
    """Euler's equations about the frame's origin, which is not the centre of mass."""
    body, turning = hub_moments(HUB), np.array([0.4, -0.3, 0.9])
    inertia = np.trace(HUB.second_moment) * np.eye(3) - HUB.second_moment
    matrix = mass_matrix(body)
    assert matrix.shape == (6, 6)
    np.testing.assert_allclose(matrix[:3, :3], HUB.mass * np.eye(3))
    np.testing.assert_allclose(matrix[3:, 3:], inertia)
    np.testing.assert_allclose(matrix[3:, :3], cross_matrix(HUB.first_moment))
    np.testing.assert_allclose(matrix, matrix.T)
    got = velocity_products(body, turning, np.zeros(0))
    centripetal = np.cross(turning, np.cross(turning, HUB.first_moment))
    np.testing.assert_allclose(got[:3], -centripetal, atol=1e-15)
    # w x I w, to the rounding of numbers of the size of I w^2, 40 kg mm^2 / s^2.
    np.testing.assert_allclose(got[3:], -np.cross(turning, inertia @ turning), atol=1e-13)
