"""The rotation of an element, from its deformation gradient in its material frame.

Arrays are laid out component first, element last, so that every operation runs along elements.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import cast

import numpy as np

from pneumorph.physics.physics import Rotation

_POLAR_ITERATIONS = 60
_POLAR_TOLERANCE = 1e-14


def element_rotation(gradient: np.ndarray, rotation: Rotation) -> np.ndarray:
    """Rotation of every element.

    Args:
        gradient: Deformation gradient F, (3, d, element), d = 3 for solids, 2 for membranes.
        rotation: Where to take it from.

    Returns:
        R with orthonormal columns, (3, d, element).

    Raises:
        ValueError: No such choice.
    """
    if rotation == "edge":
        return edge_rotation(gradient)
    if rotation == "polar":
        return polar_rotation(gradient)
    raise ValueError(f'rotation must be "edge" or "polar", got {rotation!r}')


def edge_rotation(gradient: np.ndarray) -> np.ndarray:
    """Gram-Schmidt of the first two columns of F.

    The material frame has its first axis along the first edge and its second in the first face, so
    this is the frame of the deformed first edge and first face, as SOFA's "large" method has it.

    Args:
        gradient: F, (3, d, element).
    """
    first = gradient[:, 0] / _length(gradient[:, 0])
    normal = cross(gradient[:, 0], gradient[:, 1])
    normal /= _length(normal)
    columns = [first, cross(normal, first), normal][: gradient.shape[1]]
    return np.stack(columns, axis=1)


def polar_rotation(gradient: np.ndarray) -> np.ndarray:
    """R of the polar decomposition F = R U; for a membrane in its deformed plane.

    Solids: Higham's iteration R <- (R + R^-T) / 2, SIAM J. Sci. Stat. Comput. 7 (1986) 1160; an
    inverted element gets the nearest proper rotation by singular values. Membranes: R = F U^-1
    with the closed root of the 2 x 2 matrix F^T F.

    Args:
        gradient: F, (3, d, element).
    """
    if gradient.shape[1] == 2:
        return cast(np.ndarray, _plane_polar(gradient))
    rotation = gradient.copy()
    wrong = ~(np.einsum("ie,ie->e", gradient[:, 0], cofactor(gradient)[:, 0]) > 0.0)
    rotation[:, :, wrong] = np.eye(3)[:, :, None]  # must not end the others' iteration
    for _ in range(_POLAR_ITERATIONS):
        cof = cofactor(rotation)
        determinant = np.einsum("ie,ie->e", rotation[:, 0], cof[:, 0])
        # Far from a rotation, balancing the two terms by size first halves the iterations.
        updated = 0.5 * (rotation + cof / determinant)
        change = float(np.abs(updated - rotation).max()) if updated.size else 0.0
        rotation = updated
        if change < _POLAR_TOLERANCE or not np.isfinite(change):
            break
        if change < 1e-7:  # quadratic convergence: the next change would be rounding
            break
    if wrong.any() and np.all(np.isfinite(gradient)):
        left, _, right = np.linalg.svd(np.moveaxis(gradient[:, :, wrong], 2, 0))
        left[:, :, 2] *= np.sign(np.linalg.det(left @ right))[:, None]
        rotation[:, :, wrong] = np.moveaxis(left @ right, 0, 2)
    return rotation


def cross(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """Cross product of vectors laid out (3, element)."""
    return np.stack(
        [
            first[1] * second[2] - first[2] * second[1],
            first[2] * second[0] - first[0] * second[2],
            first[0] * second[1] - first[1] * second[0],
        ]
    )


def dot(
    first: Sequence[np.ndarray] | np.ndarray, second: Sequence[np.ndarray] | np.ndarray
) -> np.ndarray:
    """Dot product of vectors laid out (3, element), term after term: (element,)."""
    product: np.ndarray = first[0] * second[0] + first[1] * second[1] + first[2] * second[2]
    return product


def cofactor(matrix: np.ndarray) -> np.ndarray:
    """det(A) A^-T of matrices (3, 3, element)."""
    first, second, third = matrix[:, 0], matrix[:, 1], matrix[:, 2]
    return np.stack([cross(second, third), cross(third, first), cross(first, second)], axis=1)


def polar_rotation_rate(turn: np.ndarray, gradient: np.ndarray) -> np.ndarray:
    """dR / dF of the polar decomposition F = R U, (3, d, 3, d, element): R's component first.

    dR = R [w] + n (n . dF) U^-1 with (tr(U) I - U) w = axial(R^T dF - dF^T R); n, the normal of a
    sheet, exists for d = 2 only.

    Args:
        turn: R, (3, d, element).
        gradient: F, (3, d, element).
    """
    d = gradient.shape[1]
    stretch = np.einsum("iae,ibe->abe", turn, gradient)
    rate = np.zeros((3, d, 3, d, gradient.shape[2]))
    if d == 3:
        trace = stretch[0, 0] + stretch[1, 1] + stretch[2, 2]
        matrix = trace * np.eye(3)[:, :, None] - stretch
        cof = cofactor(matrix)
        inverse = cof / np.sum(matrix[:, 0] * cof[:, 0], axis=0)
        for i in range(3):
            for c in range(3):
                # R^T dF = R_i. (x) e_c, and its axial vector is e_c x R_i.
                axial = cross(np.eye(3)[c][:, None] * np.ones_like(turn[i]), turn[i])
                w = np.einsum("abe,be->ae", inverse, axial)
                for row in range(3):
                    rate[row, :, i, c] = cross(turn[row], w)
        return rate
    inverse_trace = 1.0 / (stretch[0, 0] + stretch[1, 1])
    root = stretch[0, 0] * stretch[1, 1] - stretch[0, 1] * stretch[1, 0]
    inverse = np.stack(
        [np.stack([stretch[1, 1], -stretch[0, 1]]), np.stack([-stretch[1, 0], stretch[0, 0]])]
    )
    inverse /= root
    normal = cross(turn[:, 0], turn[:, 1])
    for i in range(3):
        for c in range(2):
            # w = (A_10 - A_01) / tr U with A = R^T dF; R [w] = (w R_1, -w R_0).
            w = (turn[i, 1] if c == 0 else -turn[i, 0]) * inverse_trace
            rate[:, 0, i, c], rate[:, 1, i, c] = w * turn[:, 1], -w * turn[:, 0]
            rate[:, :, i, c] += normal[:, None] * (normal[i] * inverse[c])[None]
    return rate


def _length(vectors: np.ndarray) -> np.ndarray:
    return np.sqrt(vectors[0] ** 2 + vectors[1] ** 2 + vectors[2] ** 2)


def _plane_polar(gradient: np.ndarray) -> np.ndarray:
    first, second = gradient[:, 0], gradient[:, 1]
    a, b = np.sum(first * first, axis=0), np.sum(first * second, axis=0)
    c = np.sum(second * second, axis=0)
    root = np.sqrt(a * c - b * b)
    # U = (C + sqrt(det C) I) / sqrt(tr C + 2 sqrt(det C)); det U = sqrt(det C).
    scale = 1.0 / np.sqrt(a + c + 2.0 * root)
    u, v, w = (a + root) * scale, b * scale, (c + root) * scale
    return np.stack([(first * w - second * v) / root, (second * u - first * v) / root], axis=1)
