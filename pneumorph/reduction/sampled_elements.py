"""Integration points of a reduced part, evaluated in modal coordinates, whatever their law.

The deformation gradient of a point is affine in the modal coordinates,

    F(alpha) = rest + mode_gradient alpha,

in the material frame of its element (see `pneumorph.fem.element_group`). The law of
`pneumorph.fem` gives the stress P(F), and with the measure, the sampling weight in it,

    force = - sum_points measure P : D,   stiffness = sum_points measure D^T C D,   D = dF/dalpha,

C being dP/dF or what a time step takes in its place.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from pneumorph.fem.corotational import Corotational, law_with_rotation
from pneumorph.fem.element_stiffness import positive_part
from pneumorph.fem.law import Law
from pneumorph.fem.law_registry import make_law
from pneumorph.fem.material import Material
from pneumorph.fem.rotation import element_rotation
from pneumorph.physics.physics import Rotation


@dataclass(frozen=True, eq=False)
class SampledElements:
    """The points of one kind of element a reduced part sums over.

    Axes are (point, world, material, mode); a material has d dimensions, 3 in a solid and 2 in a
    membrane. A linear element is one point.
    """

    rest: np.ndarray
    """Deformation gradient at rest [-], (point, 3, d)."""
    mode_gradient: np.ndarray
    """Derivative of the gradient by the modal coordinates, (point, 3, d, mode)."""
    measure: np.ndarray
    """Weight times the volume that a point stands for [mm^3], (point,)."""
    material: Material
    """What the elements are made of."""

    @property
    def mode_count(self) -> int:
        """Number of modes."""
        return int(self.mode_gradient.shape[3])

    @property
    def dimension(self) -> int:
        """Material dimensions d."""
        return int(self.rest.shape[2])

    @cached_property
    def law(self) -> Law:
        """Stress and tangent."""
        return make_law(self.material, self.dimension)

    @property
    def weighted_lame_constants(self) -> tuple[np.ndarray, np.ndarray]:
        """lambda (of plane stress in membranes) and mu times the measure [mN mm], each (point,)."""
        lame_lambda, lame_mu = self.material.lame_constants(self.dimension)
        return lame_lambda * self.measure, lame_mu * self.measure

    def gradients(self, alpha: np.ndarray) -> np.ndarray:
        """Deformation gradients at modal coordinates (..., mode): shape (..., point, 3, d)."""
        point_count, _, dimension, mode_count = self.mode_gradient.shape
        change = alpha @ self.mode_gradient.reshape(-1, mode_count).T
        return self.rest + change.reshape(*alpha.shape[:-1], point_count, 3, dimension)

    def stress(self, gradient: np.ndarray, rotation: Rotation = "edge") -> np.ndarray:
        """P times the measure [mN mm] at deformation gradients (..., point, 3, d), same shape.

        Args:
            gradient: Deformation gradients.
            rotation: Where a corotational law takes its rotation from.
        """
        by_point = gradient.reshape(-1, 3, self.dimension)
        stress = law_with_rotation(self.law, rotation).stress(_component_first(by_point))
        weighted: np.ndarray = (
            np.moveaxis(stress, 2, 0).reshape(gradient.shape) * self.measure[:, None, None]
        )
        return weighted

    def force(self, alpha: np.ndarray, rotation: Rotation = "edge") -> np.ndarray:
        """Generalised internal force [mN mm per unit of alpha] at (..., mode), same shape."""
        stress = self.stress(self.gradients(alpha), rotation)
        mode_count = self.mode_count
        return -stress.reshape(*alpha.shape[:-1], -1) @ self.mode_gradient.reshape(-1, mode_count)

    def published_tangent(self, gradient: np.ndarray, rotation: Rotation = "edge") -> np.ndarray:
        """C times the measure of the published step, as `PartModel.stiffness` has it.

        Hooke's law in the frame of the rotation for the corotational law; dP/dF with negative
        eigenvalues set to zero for others.

        Args:
            gradient: Deformation gradients, (point, 3, d).
            rotation: Where a corotational law takes its rotation from.

        Returns:
            Symmetric positive semi-definite [mN mm], (point, 3 d, 3 d).
        """
        by_component = _component_first(gradient)
        if isinstance(self.law, Corotational):
            return self._hooke(element_rotation(by_component, rotation))
        size = 3 * self.dimension
        tangent = self.law.tangent(by_component).reshape(size, size, -1)
        tangent = positive_part(0.5 * (tangent + np.swapaxes(tangent, 0, 1)))
        return np.moveaxis(tangent, 2, 0) * self.measure[:, None, None]

    def objective_tangent(self, gradient: np.ndarray) -> np.ndarray:
        """C times the measure that objective damping acts on: B^T (Hooke) B, B dF a strain's rate.

        Green's strain has B dF = sym(F^T dF), Hooke's law in the "frame" F, and is blind to rigid
        turns. The corotational law has sym(R^T dF) with polar R, which is the rate of stretch but
        for terms of the order of the strain.

        Args:
            gradient: Deformation gradients, (point, 3, d).

        Returns:
            Symmetric positive semi-definite [mN mm], (point, 3 d, 3 d).
        """
        by_component = _component_first(gradient)
        if self.law.damped_strain == "stretch":
            by_component = element_rotation(by_component, "polar")
        return self._hooke(by_component)

    def stiffness(self, alpha: np.ndarray, rotation: Rotation = "edge") -> np.ndarray:
        """D^T C D of the published step (mode, mode) at alpha (mode,), positive semi-definite."""
        return self._projected(self.published_tangent(self.gradients(alpha), rotation))

    def objective_stiffness(self, alpha: np.ndarray) -> np.ndarray:
        """D^T C D of objective damping (mode, mode) at alpha (mode,), positive semi-definite."""
        return self._projected(self.objective_tangent(self.gradients(alpha)))

    def _projected(self, tangent: np.ndarray) -> np.ndarray:
        directions = self.mode_gradient.reshape(
            len(self.measure), 3 * self.dimension, self.mode_count
        )
        flat = directions.reshape(-1, self.mode_count)
        return flat.T @ (tangent @ directions).reshape(flat.shape)

    def _hooke(self, frame: np.ndarray) -> np.ndarray:
        """lambda A_ia A_jc + mu A_ic A_ja + mu (A A^T)_ij delta_ac of a frame A, (3, d, point)."""
        weighted_lambda, weighted_mu = self.weighted_lame_constants
        turned = np.einsum("icp,jap->iajcp", frame, frame)
        tangent = weighted_mu * turned
        tangent += weighted_lambda * (frame[:, :, None, None] * frame[None, None])
        across = weighted_mu * np.einsum("iap,jap->ijp", frame, frame)
        for column in range(self.dimension):
            tangent[:, column, :, column] += across
        size = 3 * self.dimension
        return np.moveaxis(tangent.reshape(size, size, -1), 2, 0)


def _component_first(gradient: np.ndarray) -> np.ndarray:
    # (point, 3, d) as the laws have it, (3, d, point).
    return np.ascontiguousarray(np.moveaxis(gradient, 0, 2))
