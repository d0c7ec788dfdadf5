"""Stiffness matrices of corotational elements: rotated linear, objective, and true tangent.

Symmetric matrices are returned as their upper triangles, (pair, element), pairs in the order of
``numpy.triu_indices(3 k)``; an element's unknowns are ordered node by node, x y z.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pneumorph.fem.element_group import ElementGroup
from pneumorph.fem.rotation import Rotation, element_rotation


def rotated_stiffness_entries(
    group: ElementGroup, x: np.ndarray, rotation: Rotation = "edge"
) -> np.ndarray:
    """The linear stiffness turned with the element, no geometric term.

    K_ab = measure (lambda g_a g_b^T + mu g_b g_a^T + mu (g_a . g_b) P), g_n = R grad_n; P is the
    identity for solids, and R R^T, the projection onto the element's plane, for membranes.

    Args:
        group: The elements.
        x: Node positions [mm], (node, 3).
        rotation: Where the rotation is taken from.

    Returns:
        Upper triangles [mN/mm], (pair, element).
    """
    turn = element_rotation(group.deformation_gradients(x), rotation)
    weighted_lambda, weighted_mu = group.weighted_constants
    gradients, d = group.gradients_by_corner, group.dimension
    corner_count = len(gradients)
    g = [
        [sum(turn[axis, c] * gradients[corner, c] for c in range(d)) for axis in range(3)]
        for corner in range(corner_count)
    ]
    lambda_g = [[weighted_lambda * component for component in vector] for vector in g]
    mu_g = [[weighted_mu * component for component in vector] for vector in g]
    plane = (
        None
        if d == 3
        else [[sum(turn[i, c] * turn[j, c] for c in range(d)) for j in range(3)] for i in range(3)]
    )
    entries = np.empty((3 * corner_count * (3 * corner_count + 1) // 2, group.element_count))
    pair = 0
    for p in range(3 * corner_count):
        a, i = divmod(p, 3)
        for q in range(p, 3 * corner_count):
            b, j = divmod(q, 3)
            value = entries[pair]
            np.multiply(lambda_g[a][i], g[b][j], out=value)
            value += mu_g[b][i] * g[a][j]
            if plane is not None:
                value += _dot(mu_g[a], g[b]) * plane[i][j]
            elif i == j:
                value += _dot(mu_g[a], g[b])
            pair += 1
    return entries


def objective_stiffness_entries(group: ElementGroup, x: np.ndarray) -> np.ndarray:
    """measure B^T C B with B the exact derivative of the corotated strain: blind to rigid motion.

    With F = R U (polar) the strain is U - I, and a velocity gradient dF changes it by

        dU = A - [w] U,   A = R^T dF,   (tr(U) I - U) w = axial(A - A^T),

    so that dF = [r] F, a rigid rotation, gives dU = 0 exactly, in stressed elements as well.
    beta times this matrix is a viscosity of deformation only, where beta times the rotated linear
    stiffness also resists the turning of a stressed element.

    Args:
        group: The elements.
        x: Node positions [mm], (node, 3).

    Returns:
        Upper triangles [mN/mm], (pair, element).
    """
    gradient = group.deformation_gradients(x)
    turn = element_rotation(gradient, "polar")
    d = group.dimension
    stretch = [[_dot(list(turn[:, a]), list(gradient[:, b])) for b in range(d)] for a in range(d)]
    rates = _stretch_rates(turn, stretch, group.gradients_by_corner)
    weighted_lambda, weighted_mu = group.weighted_constants
    diagonal = [(a, a) for a in range(d)]
    off_diagonal = [(a, b) for a in range(d) for b in range(a + 1, d)]
    trace = [sum(rate[key] for key in diagonal) for rate in rates]
    lambda_trace = [weighted_lambda * value for value in trace]
    scaled = [
        {key: (2.0 if key in diagonal else 4.0) * weighted_mu * rate[key] for key in rate}
        for rate in rates
    ]
    size = len(rates)
    entries = np.empty((size * (size + 1) // 2, group.element_count))
    pair = 0
    for p in range(size):
        for q in range(p, size):
            value = entries[pair]
            np.multiply(lambda_trace[p], trace[q], out=value)
            for key in diagonal + off_diagonal:
                value += scaled[p][key] * rates[q][key]
            pair += 1
    return entries


def tangent_matrices(group: ElementGroup, x: np.ndarray, rotation: Rotation = "edge") -> np.ndarray:
    """-d(force)/dx of every element including the change of its rotation, (element, 3k, 3k).

    The derivative of measure R sigma by F is taken by central differences of step 1e-6, exact to
    about 1e-9 relative. Not symmetric for ``edge``, whose force has no potential.

    Args:
        group: The elements.
        x: Node positions [mm], (node, 3).
        rotation: Where the rotation is taken from.
    """
    gradient = group.deformation_gradients(x)
    d, step = group.dimension, 1e-6
    corners = len(group.gradients_by_corner)
    derivative = np.empty((group.element_count, 3, d, 3, d))
    for axis in range(3):
        for column in range(d):
            ahead, behind = gradient.copy(), gradient.copy()
            ahead[axis, column] += step
            behind[axis, column] -= step
            change = group.rotated_stress(ahead, rotation) - group.rotated_stress(behind, rotation)
            derivative[:, :, :, axis, column] = np.moveaxis(change / (2.0 * step), 2, 0)
    grads = group.material_gradients
    left = np.einsum("enc,eicjd->enijd", grads, derivative, optimize=True)
    tangent = np.einsum("enijd,emd->enimj", left, grads, optimize=True)
    return np.ascontiguousarray(tangent).reshape(-1, 3 * corners, 3 * corners)


def _stretch_rates(
    turn: np.ndarray, stretch: list[list[np.ndarray]], gradients: np.ndarray
) -> list[dict[tuple[int, int], np.ndarray]]:
    """dU for a unit velocity of each unknown of an element, by component (a, b), a <= b."""
    d = len(stretch)
    if d == 3:
        inverse = _inverse_symmetric(stretch)
    else:
        inverse_trace = 1.0 / (stretch[0][0] + stretch[1][1])
    rates = []
    for gradient in gradients:
        for axis in range(3):
            a_matrix = [[turn[axis, a] * gradient[b] for b in range(d)] for a in range(d)]
            if d == 3:
                axial = [
                    a_matrix[2][1] - a_matrix[1][2],
                    a_matrix[0][2] - a_matrix[2][0],
                    a_matrix[1][0] - a_matrix[0][1],
                ]
                w = [sum(inverse[i][j] * axial[j] for j in range(3)) for i in range(3)]
                spin = [[0.0, -w[2], w[1]], [w[2], 0.0, -w[0]], [-w[1], w[0], 0.0]]
            else:
                turning = (a_matrix[1][0] - a_matrix[0][1]) * inverse_trace
                spin = [[0.0, -turning], [turning, 0.0]]
            rates.append(
                {
                    (a, b): a_matrix[a][b] - sum(spin[a][c] * stretch[c][b] for c in range(d))
                    for a in range(d)
                    for b in range(a, d)
                }
            )
    return rates


def _inverse_symmetric(stretch: list[list[np.ndarray]]) -> list[list[np.ndarray]]:
    """(tr(U) I - U)^-1 for symmetric 3 x 3 U."""
    trace = stretch[0][0] + stretch[1][1] + stretch[2][2]
    m = [[(trace if a == b else 0.0) - stretch[a][b] for b in range(3)] for a in range(3)]
    c00 = m[1][1] * m[2][2] - m[1][2] * m[2][1]
    c01 = m[1][2] * m[2][0] - m[1][0] * m[2][2]
    c02 = m[1][0] * m[2][1] - m[1][1] * m[2][0]
    scale = 1.0 / (m[0][0] * c00 + m[0][1] * c01 + m[0][2] * c02)
    c11 = m[0][0] * m[2][2] - m[0][2] * m[2][0]
    c12 = m[0][1] * m[2][0] - m[0][0] * m[2][1]
    c22 = m[0][0] * m[1][1] - m[0][1] * m[1][0]
    upper = [[c00, c01, c02], [c01, c11, c12], [c02, c12, c22]]
    return [[value * scale for value in row] for row in upper]


def _dot(first: Sequence[np.ndarray], second: Sequence[np.ndarray]) -> np.ndarray:
    product: np.ndarray = first[0] * second[0] + first[1] * second[1] + first[2] * second[2]
    return product
