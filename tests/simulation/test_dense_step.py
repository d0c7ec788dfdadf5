"""A step of the compiled stepper equals dense numpy linear algebra."""

from __future__ import annotations

import numpy as np
import pytest
from crawlers import PART
from dense_step import dense_step, dense_system, falling_robot, state_of, velocities
from synthetic_part import synthetic_reduced_part

from pneumorph.simulation import RobotStatus

LAWS = ("corotational", "st_venant_kirchhoff", "stable_neo_hookean")


def assert_one_step_equals(part, size, damping, instruction_set, precision, tolerance, state=None):
    simulator, settings, (alpha, rates, velocity) = falling_robot(
        part,
        size,
        state,
        damping=damping,
        instruction_set=instruction_set,
        element_precision=precision,
    )
    simulator.advance(np.array([[0.0, 20.0]]), 1)
    assert simulator.status[0] == RobotStatus.RUNNING
    pressure = settings.pressure_map.simulated(20.0)
    system = dense_system(part, alpha, velocity, rates, pressure, settings)
    expected = dense_step(*system, velocity, rates, settings)
    got = velocities(simulator, part.mode_count)
    assert np.abs(got - expected).max() < tolerance * np.abs(expected).max()


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("damping", ["published", "objective"])
@pytest.mark.parametrize("instruction_set", ["best", "avx2", "baseline"])
def test_one_step_equals_dense_linear_algebra(law, damping, instruction_set):
    part = PART if law == "corotational" else synthetic_reduced_part(6, (4, 4, 4), law)
    # Single precision of modes leaves a mass-orthonormality of about 1e-8; all else is double.
    assert_one_step_equals(part, 0.3, damping, instruction_set, "double", 1e-6)


@pytest.mark.parametrize("law", LAWS[1:])
@pytest.mark.parametrize("damping", ["published", "objective"])
def test_quadratic_elements_step_likewise_in_single_precision(law, damping):
    part = synthetic_reduced_part(6, (4, 4, 4), law, quadratic=True)
    # Strains of 1e-2 with 1e-7 of rounding, of which forces nearly balance.
    assert_one_step_equals(part, 0.3, damping, "best", "single", 1e-3)


@pytest.mark.parametrize("mode_count", [8, 14, 20, 30])
@pytest.mark.parametrize("precision", ["single", "double"])
@pytest.mark.parametrize("instruction_set", ["best", "avx2"])
def test_every_mode_count_has_a_kernel_that_is_right(mode_count, precision, instruction_set):
    part = synthetic_reduced_part(mode_count=mode_count, cells=(6, 4, 4))
    # Single: each of a few hundred sums rounds to 6e-8, and the damping of stiff modes is a
    # difference of nearly equal forces; a wrong tile or a lost row would be wrong by tenths.
    tolerance = 1e-6 if precision == "double" else 1e-3
    assert_one_step_equals(part, 0.3, "published", instruction_set, precision, tolerance)


@pytest.mark.parametrize("damping", ["published", "objective"])
def test_crushed_and_inverted_elements_step_as_well(damping):
    part = synthetic_reduced_part(6, (4, 4, 4), "stable_neo_hookean")
    volume = np.linalg.det(part.tetrahedra.gradients(state_of(part, 8.0)[0]))
    assert volume.min() < -0.1  # tangents are indefinite there
    assert volume.max() > 2.0
    assert_one_step_equals(part, 8.0, damping, "best", "double", 1e-6)


@pytest.mark.parametrize("precision", ["single", "double"])
def test_a_crushed_element_still_has_the_polar_rotation(precision):
    """A singular value of 0.003: Newton's iteration without scaling is far from orthogonal then.

    The tangent's constant part relies on the rotation's orthogonality; without it the step's matrix
    was not even positive definite.
    """
    direction = np.array([0.2, 1.0, -0.7, 0.5, -1.0, 0.8])

    def least(scale: float) -> float:
        return float(np.linalg.det(PART.tetrahedra.gradients(scale * direction)).min())

    low, high = 0.0, 1.0
    while least(high) > 0.0:
        high *= 1.1
    for _ in range(60):  # bisect for where the first element is flat
        middle = 0.5 * (low + high)
        low, high = (middle, high) if least(middle) > 0.0 else (low, middle)
    scale = 0.998 * low
    singular = np.linalg.svd(PART.tetrahedra.gradients(scale * direction))[1][:, 2].min()
    assert 0.0005 < singular < 0.005
    # Single: the rotation of a crushed element loses a factor of 1 / 0.003.
    tolerance = 1e-6 if precision == "double" else 1e-3
    _, rates, velocity = state_of(PART, 0.0)
    crushed = (scale * direction, rates, velocity)
    assert_one_step_equals(PART, 0.0, "objective", "best", precision, tolerance, crushed)
