"""Integration rules and shape functions of the elements."""

import itertools
import math

import numpy as np
import pytest

from pneumorph.fem.quadrature import quadrature, shape_gradients, shape_values

ELEMENTS = [(3, 4), (3, 10), (2, 3), (2, 6)]


def monomials(dimension: int, degree: int):
    return [
        powers
        for powers in itertools.product(range(degree + 1), repeat=dimension + 1)
        if sum(powers) == degree
    ]


@pytest.mark.parametrize(("dimension", "node_count"), ELEMENTS)
def test_rule_is_exact_for_the_strain_energy_of_a_straight_element(dimension, node_count):
    """Degree 0 for linear elements, 2 for quadratic ones, by a! b! c! d! 3! / (a+b+c+d+3)!."""
    rule = quadrature(dimension, node_count)
    for degree in range(1 if node_count == dimension + 1 else 3):
        for powers in monomials(dimension, degree):
            exact = math.factorial(dimension) * math.prod(map(math.factorial, powers))
            exact /= math.factorial(degree + dimension)
            values = np.prod(rule.barycentric ** np.array(powers), axis=1)
            assert rule.weights @ values == pytest.approx(exact, rel=1e-14)


@pytest.mark.parametrize(("dimension", "node_count"), ELEMENTS)
def test_shape_functions_are_one_at_their_node_and_sum_to_one(dimension, node_count):
    corners = np.eye(dimension + 1)
    edges = ((0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3))[: 3 if dimension == 2 else 6]
    middles = [0.5 * (corners[a] + corners[b]) for a, b in edges]
    nodes = np.array([*corners, *middles])[:node_count]
    np.testing.assert_allclose(shape_values(nodes, node_count), np.eye(node_count), atol=1e-15)
    points = np.random.default_rng(0).dirichlet(np.ones(dimension + 1), 5)
    np.testing.assert_allclose(shape_values(points, node_count).sum(axis=1), 1.0, rtol=1e-14)


@pytest.mark.parametrize(("dimension", "node_count"), ELEMENTS)
def test_gradients_are_the_derivatives_of_the_values(dimension, node_count):
    points = np.random.default_rng(1).dirichlet(np.ones(dimension + 1), 5)
    gradients = shape_gradients(points, node_count)
    for axis in range(dimension):
        change = np.zeros(dimension + 1)
        change[[0, axis + 1]] = -0.5, 0.5
        # Central differences are exact for polynomials of degree two.
        slope = shape_values(points + change, node_count) - shape_values(
            points - change, node_count
        )
        np.testing.assert_allclose(gradients[:, :, axis], slope, atol=1e-14)


def test_an_element_of_other_nodes_is_refused():
    with pytest.raises(ValueError, match="of 3 dimensions must have 4 or 10 nodes, got 8"):
        quadrature(3, 8)
