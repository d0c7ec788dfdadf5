"""Elements of one kind at their integration points: tetrahedra of a solid, or triangles of a sheet.

    F = sum_n x_n (outer) grad_n,   f_n = - sum_points measure P(F) grad_n,   P from the law.

A linear element has one integration point; one of higher order has several, which carry the same
nodes and are treated as if each were an element.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from pneumorph.fem.corotational import law_with_rotation
from pneumorph.fem.law import Law
from pneumorph.fem.material import Material
from pneumorph.fem.rotation import element_rotation
from pneumorph.physics.physics import Rotation


@dataclass(frozen=True, eq=False)
class ElementGroup:
    """Integration points with k nodes and d material dimensions (3: solid, 2: sheet).

    The material frame of a point: for a solid, first axis along its element's edge from corner 0 to
    corner 1, second in the face of corners 0, 1, 2 on the side of corner 2, third their cross
    product; for a sheet the same in its tangent plane. ``element`` in shapes means such a point.
    """

    kind: str
    """``tetrahedron`` or ``membrane``."""
    connectivity: np.ndarray
    """Node indices, (element, k)."""
    material_gradients: np.ndarray
    """Gradients of the shape functions in the material frame [1/mm], (element, k, d)."""
    rest_frame: np.ndarray
    """Deformation gradient at rest: the axes of the material frame, (element, 3, d)."""
    measure: np.ndarray
    """Volume, or area times thickness, that a point stands for [mm^3], (element,)."""
    lame_lambda: np.ndarray
    """lambda, that of plane stress for sheets [kPa], (element,)."""
    lame_mu: np.ndarray
    """mu [kPa], (element,)."""
    material: Material
    """What the elements are made of."""
    law: Law
    """Its energy, stress and tangent."""
    points_per_element: int = 1
    """Integration points of one element; they follow each other."""

    @property
    def element_count(self) -> int:
        """Number of integration points."""
        return len(self.connectivity)

    @property
    def dimension(self) -> int:
        """Material dimensions d."""
        return int(self.material_gradients.shape[2])

    @cached_property
    def nodes_by_corner(self) -> np.ndarray:
        """Node indices, (k, element)."""
        return np.ascontiguousarray(self.connectivity.T)

    @cached_property
    def gradients_by_corner(self) -> np.ndarray:
        """Gradients of the shape functions, (k, d, element)."""
        return np.ascontiguousarray(np.moveaxis(self.material_gradients, 0, 2))

    @cached_property
    def weighted_constants(self) -> tuple[np.ndarray, np.ndarray]:
        """lambda and mu times the measure [mN mm], two of (element,)."""
        return self.lame_lambda * self.measure, self.lame_mu * self.measure

    def law_with(self, rotation: Rotation) -> Law:
        """The law; a corotational one with its element rotation taken from `rotation`."""
        return law_with_rotation(self.law, rotation)

    def deformation_gradients(self, x: np.ndarray) -> np.ndarray:
        """F, (3, d, element).

        Args:
            x: Node positions [mm], (node, 3).
        """
        corners = np.ascontiguousarray(x.T)[:, self.nodes_by_corner]  # (3, k, element)
        result = np.empty((3, self.dimension, self.element_count))
        for axis in range(3):
            for column in range(self.dimension):
                total = corners[axis, 0] * self.gradients_by_corner[0, column]
                for corner in range(1, len(self.nodes_by_corner)):
                    total += corners[axis, corner] * self.gradients_by_corner[corner, column]
                result[axis, column] = total
        return result

    def rotations(self, x: np.ndarray, rotation: Rotation = "edge") -> np.ndarray:
        """Rotation of every element, (element, 3, d)."""
        return np.moveaxis(element_rotation(self.deformation_gradients(x), rotation), 2, 0)

    def energy(self, x: np.ndarray) -> float:
        """Stored energy [mN mm]; of a corotational law with polar rotations."""
        density = self.law_with("polar").energy(self.deformation_gradients(x))
        return float(density @ self.measure)

    def forces_by_corner(self, x: np.ndarray, rotation: Rotation = "edge") -> np.ndarray:
        """Force of every element on its nodes [mN], (3, k, element)."""
        stress = self.law_with(rotation).stress(self.deformation_gradients(x)) * self.measure
        forces = np.empty((3, len(self.nodes_by_corner), self.element_count))
        for axis in range(3):
            for corner, gradient in enumerate(self.gradients_by_corner):
                total = stress[axis, 0] * gradient[0]
                for column in range(1, self.dimension):
                    total += stress[axis, column] * gradient[column]
                forces[axis, corner] = -total
        return forces

    def forces(self, x: np.ndarray, rotation: Rotation = "edge") -> np.ndarray:
        """Force of every element on its nodes [mN], (element, k, 3).

        Args:
            x: Node positions [mm], (node, 3).
            rotation: Where a corotational law takes its rotation from.
        """
        return np.transpose(self.forces_by_corner(x, rotation), (2, 1, 0))
