"""The volume of a pressurised cavity as an exact cubic polynomial of the modal coordinates.

V(x) = sum over terms of w x_a . (x_b x x_c) is trilinear in the node positions, for linear and
quadratic triangles (`pneumorph.fem.cavity`), and x = Y + Phi alpha, so V(alpha) = V0 + V1.alpha
+ 1/2 alpha.V2 alpha + 1/6 V3 alpha alpha alpha without any error. Its gradient is the generalised
force of unit pressure, its Hessian the pressure stiffness.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pneumorph.fem.cavity import Cavity


@dataclass(frozen=True)
class CavityPolynomial:
    """Coefficients of one cavity's volume [mm^3]; V2 and V3 are symmetric in all indices."""

    constant: float
    linear: np.ndarray
    """(mode,)"""
    quadratic: np.ndarray
    """(mode, mode)"""
    cubic: np.ndarray
    """(mode, mode, mode)"""

    def volume(self, alpha: np.ndarray) -> float:
        """Volume [mm^3] at modal coordinates (mode,)."""
        cubic = self.cubic @ alpha @ alpha @ alpha / 6.0
        return float(
            self.constant + self.linear @ alpha + 0.5 * alpha @ self.quadratic @ alpha + cubic
        )

    def gradient(self, alpha: np.ndarray) -> np.ndarray:
        """Generalised force of a pressure of 1 kPa, (mode,)."""
        return self.linear + self.quadratic @ alpha + 0.5 * (self.cubic @ alpha @ alpha)

    def hessian(self, alpha: np.ndarray) -> np.ndarray:
        """Derivative of `gradient`, (mode, mode), symmetric."""
        return self.quadratic + self.cubic @ alpha


def cavity_polynomial(nodes: np.ndarray, cavity: Cavity, modes: np.ndarray) -> CavityPolynomial:
    """Expand the volume of a closed cavity in the modal coordinates.

    Args:
        nodes: Rest positions [mm], (node, 3).
        cavity: The closed surface, normals out of the cavity.
        modes: Mode shapes, (node, 3, mode).

    Raises:
        ValueError: The surface is not closed, or its normals point into the cavity.
    """
    triangles, weights = cavity.triangles, cavity.weights
    area = cavity.gradient(nodes)  # of the surface, node by node; in all zero if it is closed
    if np.linalg.norm(area.sum(axis=0)) > 1e-6 * np.abs(area).sum():
        raise ValueError(
            "the cavity surface must be closed, but its area vectors sum to "
            f"{area.sum(axis=0)} mm^2 instead of zero; a triangle is missing or turned"
        )
    rest = nodes[triangles]
    fields = modes[triangles]
    a, b, c = (rest[:, corner] for corner in range(3))
    mode_a, mode_b, mode_c = (fields[:, corner] for corner in range(3))

    constant = cavity.volume(nodes)
    if constant <= 0.0:
        raise ValueError(
            f"the cavity volume must be positive, got {constant} mm^3; "
            "the triangles' normals must point out of the cavity, into the solid"
        )
    linear = np.einsum("ni,nik->k", area, modes)

    def mixed(position: np.ndarray, second: np.ndarray, third: np.ndarray) -> np.ndarray:
        # sum over terms of w position . (second_j x third_k)
        turned = np.cross(weights[:, None, None] * position[:, :, None], second, axis=1)
        return np.tensordot(turned, third, axes=([0, 1], [0, 1]))

    product = mixed(a, mode_b, mode_c) + mixed(b, mode_c, mode_a) + mixed(c, mode_a, mode_b)
    quadratic = product + product.T

    mode_count = modes.shape[2]
    triple = np.empty((mode_count,) * 3)
    for mode in range(mode_count):
        triple[mode] = mixed(mode_a[:, :, mode], mode_b, mode_c)
    orders = [(0, 1, 2), (1, 2, 0), (2, 0, 1), (0, 2, 1), (2, 1, 0), (1, 0, 2)]
    cubic = np.sum([np.transpose(triple, order) for order in orders], axis=0)
    return CavityPolynomial(constant, linear, quadratic, cubic)
