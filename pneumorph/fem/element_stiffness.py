"""Stiffness matrices of elements: rotated linear, objective, and the tangent of the law.

Symmetric matrices are returned as their upper triangles, (pair, element), pairs in the order of
``numpy.triu_indices(3 k)``; an element's unknowns are ordered node by node, x y z.
"""

from __future__ import annotations

import numpy as np

from pneumorph.fem.corotational import Corotational
from pneumorph.fem.element_group import ElementGroup
from pneumorph.fem.rotation import dot, element_rotation
from pneumorph.physics.physics import Rotation


def stiffness_entries(group: ElementGroup, x: np.ndarray, rotation: Rotation) -> np.ndarray:
    """Upper triangles of a group's share of `PartModel.stiffness` [mN/mm], (pair, element)."""
    if isinstance(group.law, Corotational):
        return rotated_stiffness_entries(group, x, rotation)
    return tangent_entries(group, x, definite=True)


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
                value += dot(mu_g[a], g[b]) * plane[i][j]
            elif i == j:
                value += dot(mu_g[a], g[b])
            pair += 1
    return entries


def objective_stiffness_entries(group: ElementGroup, x: np.ndarray) -> np.ndarray:
    """measure B^T C B with B the exact derivative of a strain and C Hooke's: blind to rigid motion.

    The strain is the law's `damped_strain`. For Green's strain B dF = sym(F^T dF). For U - I with
    F = R U (polar)

        dU = A - [w] U,   A = R^T dF,   (tr(U) I - U) w = axial(A - A^T).

    Either way dF = [r] F, a rigid rotation, gives exactly zero, in stressed elements as well. beta
    times this matrix is a viscosity of deformation only, where beta times the rotated linear
    stiffness, or times a tangent, also resists the turning of a stressed element.

    Args:
        group: The elements.
        x: Node positions [mm], (node, 3).

    Returns:
        Upper triangles [mN/mm], (pair, element).
    """
    gradient = group.deformation_gradients(x)
    d = group.dimension
    if group.law.damped_strain == "green":
        rates = _green_rates(gradient, group.gradients_by_corner)
    else:
        rates = _stretch_rates(gradient, group.gradients_by_corner)
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


def tangent_entries(
    group: ElementGroup, x: np.ndarray, rotation: Rotation = "edge", definite: bool = False
) -> np.ndarray:
    """-d(force)/dx of every element, geometric term included.

    Edge-based rotations give a matrix without symmetry; its symmetric part is returned.

    Args:
        group: The elements.
        x: Node positions [mm], (node, 3).
        rotation: Where a corotational law takes its rotation from.
        definite: Replace negative eigenvalues of dP/dF by zero, point by point: the nearest
            positive semi-definite matrix (Teran et al., Robust Quasistatic Finite Elements, 2005).

    Returns:
        Upper triangles [mN/mm], (pair, element).
    """
    tangent = group.law_with(rotation).tangent(group.deformation_gradients(x))
    return contracted_entries(group, tangent, definite)


def contracted_entries(group: ElementGroup, tangent: np.ndarray, definite: bool) -> np.ndarray:
    """-d(force)/dx of every element from dP/dF at its points.

    Args:
        group: The elements.
        tangent: dP/dF [kPa], (3, d, 3, d, element).
        definite: Replace its negative eigenvalues by zero.

    Returns:
        Upper triangles [mN/mm], (pair, element).
    """
    d, count = group.dimension, group.element_count
    flat = tangent.reshape(3 * d, 3 * d, count)
    flat = 0.5 * (flat + np.swapaxes(flat, 0, 1)) * group.measure
    if definite:
        flat = positive_part(flat)
    tangent = flat.reshape(3, d, 3, d, count)
    gradients = group.gradients_by_corner
    corner_count = len(gradients)
    # Contract F's component first: (3, d, 3, corner, point).
    half = np.empty((3, d, 3, corner_count, count))
    for corner, gradient in enumerate(gradients):
        half[:, :, :, corner] = tangent[:, :, :, 0] * gradient[0]
        for column in range(1, d):
            half[:, :, :, corner] += tangent[:, :, :, column] * gradient[column]
    entries = np.empty((3 * corner_count * (3 * corner_count + 1) // 2, count))
    pair = 0
    for p in range(3 * corner_count):
        a, i = divmod(p, 3)
        for q in range(p, 3 * corner_count):
            b, j = divmod(q, 3)
            value = entries[pair]
            np.multiply(gradients[a, 0], half[i, 0, j, b], out=value)
            for column in range(1, d):
                value += gradients[a, column] * half[i, column, j, b]
            pair += 1
    return entries


def tangent_matrices(group: ElementGroup, x: np.ndarray, rotation: Rotation) -> np.ndarray:
    """-d(force)/dx of every element, (element, 3k, 3k), not symmetric for edge-based rotations.

    Args:
        group: The elements.
        x: Node positions [mm], (node, 3).
        rotation: Where a corotational law takes its rotation from.
    """
    tangent = group.law_with(rotation).tangent(group.deformation_gradients(x)) * group.measure
    gradients = group.gradients_by_corner
    half = np.einsum("iajce,mce->eiajm", tangent, gradients, optimize=True)
    matrices = np.einsum("nae,eiajm->enimj", gradients, half, optimize=True)
    size = 3 * len(gradients)
    return np.ascontiguousarray(matrices).reshape(-1, size, size)


def full_matrices(entries: np.ndarray) -> np.ndarray:
    """Symmetric matrices (element, n, n) from their upper triangles (pair, element)."""
    size = round(np.sqrt(2.0 * len(entries) + 0.25) - 0.5)
    rows, columns = np.triu_indices(size)
    matrices = np.empty((entries.shape[1], size, size))
    matrices[:, rows, columns] = entries.T
    matrices[:, columns, rows] = entries.T
    return matrices


def positive_part(matrices: np.ndarray) -> np.ndarray:
    """Symmetric matrices (n, n, point) with their negative eigenvalues set to zero."""
    values, vectors = np.linalg.eigh(np.moveaxis(matrices, 2, 0))
    wrong = values[:, 0] < 0.0
    repaired = matrices.copy()
    raised = vectors[wrong] * np.maximum(values[wrong], 0.0)[:, None]
    repaired[:, :, wrong] = np.moveaxis(raised @ np.swapaxes(vectors[wrong], 1, 2), 0, 2)
    return repaired


def _green_rates(
    gradient: np.ndarray, gradients: np.ndarray
) -> list[dict[tuple[int, int], np.ndarray]]:
    """sym(F^T dF) for a unit velocity of each unknown of an element, by component a <= b."""
    d = gradient.shape[1]
    return [
        {
            (a, b): 0.5 * (gradient[axis, a] * corner[b] + gradient[axis, b] * corner[a])
            for a in range(d)
            for b in range(a, d)
        }
        for corner in gradients
        for axis in range(3)
    ]


def _stretch_rates(
    gradient: np.ndarray, gradients: np.ndarray
) -> list[dict[tuple[int, int], np.ndarray]]:
    """dU for a unit velocity of each unknown of an element, by component (a, b), a <= b."""
    turn = element_rotation(gradient, "polar")
    d = gradient.shape[1]
    stretch = [[dot(turn[:, a], gradient[:, b]) for b in range(d)] for a in range(d)]
    if d == 3:
        inverse = _inverse_symmetric(stretch)
    else:
        inverse_trace = 1.0 / (stretch[0][0] + stretch[1][1])
    rates = []
    for corner in gradients:
        for axis in range(3):
            a_matrix = [[turn[axis, a] * corner[b] for b in range(d)] for a in range(d)]
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
