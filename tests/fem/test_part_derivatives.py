"""Of parts of every law and either element: energy, force and tangent, and rigid motion."""

import numpy as np
import pytest
from helpers.element_cases import ORDERS, box_part, wobbled
from helpers.law_cases import SOLIDS

from pneumorph.fem.part_model import PartModel
from pneumorph.geometry.pose import rotation_about


@pytest.fixture(scope="module", params=[(law, order) for law in SOLIDS for order in ORDERS])
def part(request) -> PartModel:
    return box_part(*request.param, hollow=True)


@pytest.fixture(scope="module")
def x(part) -> np.ndarray:
    return wobbled(part, 0.08)


def test_force_is_the_derivative_of_the_energy(part, x):
    direction, step = np.random.default_rng(2).normal(size=x.shape), 1e-5
    change = part.elastic_energy(x + step * direction) - part.elastic_energy(x - step * direction)
    expected = -np.sum(part.internal_force(x, "polar") * direction)
    # step^2 and rounding of 1e-15 over the step: some 1e-9 of the force's norm.
    tolerance = 1e-7 * np.linalg.norm(part.internal_force(x, "polar"))
    assert change / (2.0 * step) == pytest.approx(expected, abs=tolerance)


def test_tangent_is_the_derivative_of_all_forces(part, x):
    pressure, step = 30.0, 1e-6

    def force(positions):
        return part.internal_force(positions, "polar") + part.pressure_force(positions, pressure)

    direction = np.random.default_rng(3).normal(size=x.shape)
    change = (force(x + step * direction) - force(x - step * direction)) / (2.0 * step)
    expected = -part.tangent(x, pressure, "polar") @ direction.ravel()
    # Rounding of 1e-16 over the step of 1e-6, of forces of 100 mN.
    np.testing.assert_allclose(change.ravel(), expected, atol=1e-6 * np.abs(expected).max())


def test_rigid_motion_gives_no_force_and_no_energy(part):
    turn = rotation_about("x", 70.0) @ rotation_about("z", 200.0)
    moved = part.rest_nodes @ turn.T + [5.0, -3.0, 20.0]
    # Rounding of coordinates of 20 mm, 4e-15, through a stiffness of E h = 100 to 1000 mN/mm.
    assert np.abs(part.internal_force(moved, "polar")).max() < 1e-10
    assert abs(part.elastic_energy(moved)) < 1e-10


def test_forces_turn_with_the_body_and_have_no_resultant(part, x):
    turn = rotation_about("y", 110.0) @ rotation_about("x", -35.0)
    force = part.internal_force(x, "polar")
    size = np.abs(force).max()
    assert size > 10.0
    np.testing.assert_allclose(
        part.internal_force(x @ turn.T, "polar"), force @ turn.T, atol=1e-12 * size
    )
    assert np.abs(force.sum(axis=0)).max() < 1e-12 * size
    assert np.abs(np.cross(x, force).sum(axis=0)).max() < 1e-11 * size


def test_objective_stiffness_is_blind_to_rigid_motion_of_a_stressed_body(part, x):
    spin = np.cross(np.array([0.3, -1.0, 2.0]), x) + np.array([1.0, 2.0, 3.0])
    published = np.abs(part.stiffness(x, "polar") @ spin.ravel()).max()
    assert published > 10.0  # what the published damping resists
    assert np.abs(part.objective_stiffness(x) @ spin.ravel()).max() < 1e-12 * published


def test_stiffnesses_are_semidefinite_and_agree_at_rest(part, x):
    for matrix in (part.stiffness(x, "polar"), part.objective_stiffness(x)):
        values = np.linalg.eigvalsh(matrix.toarray())
        assert values.min() > -1e-12 * values.max()
    rest = part.rest_nodes
    tangent = part.tangent(rest, rotation="polar")
    for matrix in (part.stiffness(rest, "polar"), part.objective_stiffness(rest)):
        # Rounding; the own law's tangent comes by differences, exact to 1e-8.
        assert np.abs(matrix - tangent).max() < 1e-7 * np.abs(tangent).max()
    values = np.linalg.eigvalsh(tangent.toarray())
    # Six rigid motions and nothing else costs no energy.
    assert np.sum(values < 1e-6 * values.max()) == 6
