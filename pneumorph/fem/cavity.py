"""The volume of a cavity and its derivatives; pressure does work on it."""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from functools import cache
from typing import TypeAlias

import numpy as np

from pneumorph.fem.quadrature import shape_gradients, shape_values

Pressure: TypeAlias = float | np.ndarray
"""One for all of a part's cavities [kPa], or one for each, (cavity,)."""


@dataclass(frozen=True, eq=False)
class Cavity:
    """A closed surface; V = sum_t w_t x_0 . (x_1 x x_2).

    A pressure p loads the nodes with p dV/dx, the follower load on the deformed surface. A linear
    triangle is one term with w = 1/6; a quadratic one is a sum of terms over triples of its nodes.
    """

    triangles: np.ndarray
    """Node indices of each term; linear triangles with normals out of the cavity, (term, 3)."""
    weights: np.ndarray
    """w, (term,)."""

    @classmethod
    def of_surface(cls, triangles: np.ndarray) -> Cavity:
        """The cavity within a closed surface.

        Args:
            triangles: Node indices, normals out of the cavity, (triangle, 3 or 6).
        """
        triples, weights = volume_terms(triangles.shape[1])
        return cls(triangles[:, triples].reshape(-1, 3), np.tile(weights, len(triangles)))

    def volume(self, x: np.ndarray) -> float:
        """V [mm^3] at node positions x [mm], (node, 3)."""
        first, second, third = (x[self.triangles[:, corner]] for corner in range(3))
        return float(self.weights @ np.einsum("ti,ti->t", first, np.cross(second, third)))

    def gradient(self, x: np.ndarray) -> np.ndarray:
        """dV/dx [mm^2], (node, 3): w x_1 x x_2 for corner 0, and so on round."""
        corners = [np.ascontiguousarray(x[self.triangles[:, corner]]) for corner in range(3)]
        gradient = np.empty((3, len(x)))
        contributions = [
            np.cross(corners[(corner + 1) % 3], corners[(corner + 2) % 3]) * self.weights[:, None]
            for corner in range(3)
        ]
        values = np.concatenate(contributions)
        indices = self.triangles.T.ravel()
        for axis in range(3):
            gradient[axis] = np.bincount(indices, values[:, axis], minlength=len(x))
        return gradient.T

    def hessian_blocks(self, x: np.ndarray) -> np.ndarray:
        """d2V/dx2 of every term [mm], (term, 9, 9); the diagonal blocks vanish."""
        blocks = np.zeros((len(self.triangles), 3, 3, 3, 3))
        for first in range(3):
            second, third = (first + 1) % 3, (first + 2) % 3
            # dV/dx_a = w x_b x x_c, so d2V/dx_a dx_b = -w [x_c].
            block = -_skew(x[self.triangles[:, third]]) * self.weights[:, None, None]
            blocks[:, first, :, second, :] = block
            blocks[:, second, :, first, :] = np.swapaxes(block, 1, 2)
        return blocks.reshape(-1, 9, 9)


@cache
def volume_terms(node_count: int) -> tuple[np.ndarray, np.ndarray]:
    """Triples i < j < k of a triangle's nodes and their weights in the volume beneath it.

    With x = sum N_i x_i over parameters u, v, V = 1/3 int x . (x_u x x_v) du dv is a sum of
    x_i . (x_j x x_k) times 1/3 int N_i (N_j,u N_k,v - N_j,v N_k,u). Its antisymmetric part differs
    from it by terms of the triangle's edges alone, which cancel between neighbours.
    """
    # Degree 4 for quadratic triangles: a Gauss rule of 3 x 3 points on the collapsed square.
    abscissae, factors = np.polynomial.legendre.leggauss(3)
    u, v = (np.ravel(each) for each in np.meshgrid(0.5 + 0.5 * abscissae, 0.5 + 0.5 * abscissae))
    weight = np.outer(factors, factors).ravel() / 4.0 * (1.0 - u)
    points = np.column_stack([(1.0 - u) * (1.0 - v), u, v * (1.0 - u)])
    values = shape_values(points, node_count)
    slopes = shape_gradients(points, node_count)
    triples, weights = [], []
    for triple in itertools.combinations(range(node_count), 3):
        total = 0.0
        for order in itertools.permutations(range(3)):
            sign = round(np.linalg.det(np.eye(3)[list(order)]))
            i, j, k = (triple[place] for place in order)
            area = slopes[:, j, 0] * slopes[:, k, 1] - slopes[:, j, 1] * slopes[:, k, 0]
            total += sign * float(weight @ (values[:, i] * area)) / 6.0
        if abs(total) > 1e-12:
            triples.append(triple)
            weights.append(total)
    return np.array(triples), np.array(weights)


def _skew(vectors: np.ndarray) -> np.ndarray:
    """[v] with [v] w = v x w, (n, 3, 3)."""
    skew = np.zeros((len(vectors), 3, 3))
    skew[:, 0, 1], skew[:, 0, 2], skew[:, 1, 2] = -vectors[:, 2], vectors[:, 1], -vectors[:, 0]
    skew[:, 1, 0], skew[:, 2, 0], skew[:, 2, 1] = vectors[:, 2], -vectors[:, 1], vectors[:, 0]
    return skew
