"""Corotational elements of a reduced part, evaluated in modal coordinates.

An element's deformation gradient is affine in the modal coordinates,
F'(alpha) = rest + mode_gradient alpha, expressed in the element's material frame (first axis along
its first edge, second in its first face). Corotational linear elasticity with the rotation R' of
F' gives the stress P' = R' (lambda tr(eps) I + 2 mu eps), eps = sym(R'^T F') - I, and the
generalised force -weight * measure * P' : dF'/dalpha. Membranes are the same with two material
axes.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pneumorph.fem.rotation import Rotation
from pneumorph.fem.rotation import element_rotation as component_rotation


@dataclass(frozen=True)
class SampledElements:
    """The elements a reduced part integrates over; axes are (element, world, material, mode)."""

    rest: np.ndarray
    """Rest deformation gradient in the material frame [-], (element, 3, d) with d = 3 or 2."""
    mode_gradient: np.ndarray
    """Derivative of that gradient by the modal coordinates, (element, 3, d, mode)."""
    weighted_lambda: np.ndarray
    """weight * measure * lambda [kPa mm^3], (element,)."""
    weighted_mu: np.ndarray
    """weight * measure * mu [kPa mm^3], (element,)."""

    @property
    def mode_count(self) -> int:
        return int(self.mode_gradient.shape[3])

    def gradients(self, alpha: np.ndarray) -> np.ndarray:
        """Deformation gradients at modal coordinates (..., mode): shape (..., element, 3, d)."""
        element_count, _, dimension, mode_count = self.mode_gradient.shape
        change = alpha @ self.mode_gradient.reshape(-1, mode_count).T
        return self.rest + change.reshape(*alpha.shape[:-1], element_count, 3, dimension)

    def force(self, alpha: np.ndarray, rotation: Rotation = "edge") -> np.ndarray:
        """Generalised internal force [mN mm per unit of alpha] at (..., mode), same shape."""
        gradient = self.gradients(alpha)
        stress = rotated_stress(gradient, self.weighted_lambda, self.weighted_mu, rotation)
        mode_count = self.mode_count
        return -stress.reshape(*alpha.shape[:-1], -1) @ self.mode_gradient.reshape(-1, mode_count)

    def stiffness(self, alpha: np.ndarray, rotation: Rotation = "edge") -> np.ndarray:
        """Rotated linear stiffness (mode, mode) at alpha (mode,), positive semi-definite."""
        strain = strain_factors(
            self.gradients(alpha),
            self.mode_gradient,
            self.weighted_lambda,
            self.weighted_mu,
            rotation,
        )
        flat = strain.reshape(-1, self.mode_count)
        return flat.T @ flat


def element_rotation(gradient: np.ndarray, rotation: Rotation) -> np.ndarray:
    """Rotation R' of deformation gradients in the material frame, (..., 3, d) like them."""
    by_component = np.moveaxis(gradient.reshape(-1, *gradient.shape[-2:]), 0, 2)
    turned = component_rotation(np.ascontiguousarray(by_component), rotation)
    return np.moveaxis(turned, 2, 0).reshape(gradient.shape)


def rotated_stress(
    gradient: np.ndarray, lame_lambda: np.ndarray, lame_mu: np.ndarray, rotation: Rotation
) -> np.ndarray:
    """P' = R' (lambda tr(eps) I + 2 mu eps) of gradients (..., element, 3, d), same shape."""
    frame = element_rotation(gradient, rotation)
    stretch = np.swapaxes(frame, -1, -2) @ gradient
    identity = np.eye(gradient.shape[-1])
    strain = 0.5 * (stretch + np.swapaxes(stretch, -1, -2)) - identity
    trace = np.trace(strain, axis1=-2, axis2=-1)
    stress = (
        2.0 * lame_mu[:, None, None] * strain + (lame_lambda * trace)[..., None, None] * identity
    )
    return frame @ stress


def strain_factors(
    gradient: np.ndarray,
    directions: np.ndarray,
    lame_lambda: np.ndarray,
    lame_mu: np.ndarray,
    rotation: Rotation,
) -> np.ndarray:
    """Factors s whose products s_a . s_b are an element's stiffness between two fields.

    For fields whose deformation gradients are D_a, the rotated linear stiffness is
    lambda tr(R'^T D_a) tr(R'^T D_b) + 2 mu sym(R'^T D_a) : sym(R'^T D_b).

    Args:
        gradient: Deformation gradients that fix the rotations, (element, 3, d).
        directions: Deformation gradients of the fields, (element, 3, d, field).
        lame_lambda: lambda times measure, (element,).
        lame_mu: mu times measure, (element,).
        rotation: As in `element_rotation`.

    Returns:
        Factors, (element, 1 + d * d, field).
    """
    frame = element_rotation(gradient, rotation)
    element_count, _, dimension, field_count = directions.shape
    turned = np.swapaxes(frame, -1, -2) @ directions.reshape(
        element_count, 3, dimension * field_count
    )
    turned = turned.reshape(element_count, dimension, dimension, field_count)
    symmetric = 0.5 * (turned + np.swapaxes(turned, 1, 2))
    trace = np.trace(turned, axis1=1, axis2=2)
    return np.concatenate(
        [
            np.sqrt(lame_lambda)[:, None, None] * trace[:, None, :],
            np.sqrt(2.0 * lame_mu)[:, None, None]
            * symmetric.reshape(element_count, dimension**2, field_count),
        ],
        axis=1,
    )
