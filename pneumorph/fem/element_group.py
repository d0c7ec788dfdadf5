"""Corotational elements of one kind: linear tetrahedra, or membrane triangles.

With F the deformation gradient in an element's material frame and R its rotation:

    strain eps = sym(R^T F) - I,  stress sigma = lambda tr(eps) I + 2 mu eps,
    force on node n  f_n = - measure R sigma grad_n.

Mueller and Gross, Interactive Virtual Materials, Graphics Interface 2004; Nesme et al. 2005.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from pneumorph.fem.rotation import Rotation, element_rotation


@dataclass(frozen=True, eq=False)
class ElementGroup:
    """Elements with k nodes and d material dimensions (4 and 3: solid; 3 and 2: membrane).

    The material frame of an element: first axis along the edge from its node 0 to its node 1,
    second in the face of nodes 0, 1, 2 on the side of node 2, third their cross product.
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
    """Volume, or area times thickness [mm^3], (element,)."""
    lame_lambda: np.ndarray
    """lambda, that of plane stress for membranes [kPa], (element,)."""
    lame_mu: np.ndarray
    """mu [kPa], (element,)."""

    @property
    def element_count(self) -> int:
        """Number of elements."""
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

    def deformation_gradients(self, x: np.ndarray) -> np.ndarray:
        """F = sum_n x_n (outer) grad_n, (3, d, element).

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

    def rotated_stress(self, gradient: np.ndarray, rotation: Rotation) -> np.ndarray:
        """measure R sigma, the force per material gradient [mN mm], (3, d, element).

        Args:
            gradient: F, (3, d, element).
            rotation: Where the rotation is taken from.
        """
        turn = element_rotation(gradient, rotation)
        weighted_lambda, weighted_mu = self.weighted_constants
        d = self.dimension
        stretch = [[_dot(turn[:, a], gradient[:, b]) for b in range(d)] for a in range(d)]
        trace = sum(stretch[a][a] for a in range(d)) - d
        stress = np.empty_like(gradient)
        for b in range(d):
            for axis in range(3):
                total = 0.0
                for a in range(d):
                    if a == b:
                        sigma = weighted_lambda * trace + 2.0 * weighted_mu * (stretch[a][a] - 1.0)
                    else:
                        sigma = weighted_mu * (stretch[a][b] + stretch[b][a])
                    total = total + turn[axis, a] * sigma
                stress[axis, b] = total
        return stress

    def forces_by_corner(self, x: np.ndarray, rotation: Rotation = "edge") -> np.ndarray:
        """Force of every element on its nodes [mN], (3, k, element)."""
        stress = self.rotated_stress(self.deformation_gradients(x), rotation)
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
            rotation: Where the rotation is taken from.
        """
        return np.transpose(self.forces_by_corner(x, rotation), (2, 1, 0))

    def stiffness(self, x: np.ndarray, rotation: Rotation = "edge") -> np.ndarray:
        """Rotated linear stiffness of every element [mN/mm], (element, 3k, 3k).

        Symmetric, without the geometric term: the force changes by -K dx while R is held.
        """
        from pneumorph.fem.element_stiffness import rotated_stiffness_entries

        return self.full_matrices(rotated_stiffness_entries(self, x, rotation))

    def full_matrices(self, entries: np.ndarray) -> np.ndarray:
        """Symmetric matrices (element, 3k, 3k) from their upper triangles (pair, element)."""
        size = 3 * len(self.nodes_by_corner)
        rows, columns = np.triu_indices(size)
        matrices = np.empty((self.element_count, size, size))
        matrices[:, rows, columns] = entries.T
        matrices[:, columns, rows] = entries.T
        return matrices


def _dot(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    product: np.ndarray = first[0] * second[0] + first[1] * second[1] + first[2] * second[2]
    return product
