"""Tetrahedra that resist a change of their volume, as wholes: mean dilatation.

    E = sum_elements lambda / 2 V (v / V - 1)^2,   f = -lambda (v / V - 1) dv/dx,

with v the deformed and V the rest volume of an element. One condition for an element instead of one
for each of its integration points: a quadratic tetrahedron with a constant pressure (P2/P0), which
does not lock as lambda grows. Nagtegaal, Parks and Rice, On numerically accurate finite element
solutions in the fully plastic range, Comput. Meth. Appl. Mech. Eng. 4 (1974) 153; Simo, Taylor and
Pister, Variational and projection methods for the volume constraint, ibid. 51 (1985) 177; Boffi,
Brezzi and Fortin, Mixed Finite Element Methods and Applications, section 8.6.

The volume is exact, for curved elements too: by the divergence theorem, with T antisymmetric,

    v = sum_(n < m < k) T_nmk x_n . (x_m x x_k),   u_nm = sum_k T_nmk x_k,
    dv/dx_n = 1/2 sum_m x_m x u_nm,   d2v / dx_ni dx_mj = eps_ijk u_nmk.

T has numbers for a tetrahedron of 4 or of 10 nodes, whatever its shape.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from functools import cache, cached_property

import numpy as np

from pneumorph.fem.cavity import volume_terms
from pneumorph.fem.determinant import SIGNED_PERMUTATIONS
from pneumorph.fem.material import Material
from pneumorph.fem.rotation import cross
from pneumorph.geometry.mesh import TETRAHEDRON_EDGES, TRIANGLE_EDGES
from pneumorph.geometry.surface import TETRAHEDRON_FACES


@dataclass(frozen=True, eq=False)
class VolumeGroup:
    """The volume part of a solid's energy; its shape part is an `ElementGroup` with lambda = 0."""

    connectivity: np.ndarray
    """Node indices, (element, 4 or 10)."""
    rest_volume: np.ndarray
    """V [mm^3], (element,)."""
    lame_lambda: float
    """lambda [kPa]."""

    @classmethod
    def of_solid(cls, nodes: np.ndarray, tetrahedra: np.ndarray, material: Material) -> VolumeGroup:
        """The volumes of a solid's elements.

        Args:
            nodes: Rest positions [mm], (node, 3).
            tetrahedra: Node indices of positive tetrahedra, (element, 4 or 10).
            material: What the solid is made of.
        """
        empty = cls(tetrahedra, np.ones(len(tetrahedra)), material.lame_lambda)
        return cls(tetrahedra, empty.volumes(nodes), material.lame_lambda)

    @cached_property
    def nodes_by_corner(self) -> np.ndarray:
        """Node indices, (k, element)."""
        return np.ascontiguousarray(self.connectivity.T)

    def volumes(self, x: np.ndarray) -> np.ndarray:
        """v [mm^3], (element,).

        Args:
            x: Node positions [mm], (node, 3).
        """
        corners, _, gradient = self._volume_gradient(x)
        volumes: np.ndarray = np.einsum("nie,nie->e", corners, gradient) / 3.0
        return volumes

    def pressures(self, x: np.ndarray) -> np.ndarray:
        """lambda (1 - v / V) [kPa], (element,)."""
        pressures: np.ndarray = self.lame_lambda * (1.0 - self.volumes(x) / self.rest_volume)
        return pressures

    def energy(self, x: np.ndarray) -> float:
        """Stored energy [mN mm]."""
        swelling = self.volumes(x) / self.rest_volume - 1.0
        return float(0.5 * self.lame_lambda * (self.rest_volume @ swelling**2))

    def forces_by_corner(self, x: np.ndarray) -> np.ndarray:
        """Force of every element on its nodes [mN], (3, k, element)."""
        corners, _, gradient = self._volume_gradient(x)
        volumes = np.einsum("nie,nie->e", corners, gradient) / 3.0
        pressure = self.lame_lambda * (1.0 - volumes / self.rest_volume)
        return pressure * np.swapaxes(gradient, 0, 1)

    def tangent_entries(
        self, x: np.ndarray, definite: bool = False, change: np.ndarray | None = None
    ) -> np.ndarray:
        """-d(force)/dx = lambda / V dv (x) dv + lambda (v / V - 1) d2v of every element.

        Args:
            x: Node positions [mm], (node, 3).
            definite: Leave the second term out; what is left is positive semi-definite, and zero on
                rigid motions.
            change: A Newton step that led here [mm], (node, 3): the second term has the volume that
                its linearisation foresaw (`pneumorph.fem.foreseen_stress`). None for v.

        Returns:
            Upper triangles [mN/mm], (pair, element), as in `pneumorph.fem.element_stiffness`.
        """
        corners, mixed, gradient = self._volume_gradient(x)
        rate = gradient.reshape(-1, len(self.rest_volume))  # unknowns node by node, x y z
        stiff = rate * (self.lame_lambda / self.rest_volume)
        size = len(rate)
        starts = np.cumsum([0, *range(size, 0, -1)])  # of the rows of the upper triangle
        entries = np.empty((starts[-1], len(self.rest_volume)))
        for p in range(size):
            np.multiply(stiff[p], rate[p:], out=entries[starts[p] : starts[p + 1]])
        if definite:
            return entries
        if change is None:
            volumes = np.einsum("nie,nie->e", corners, gradient) / 3.0
        else:
            before, _, slope = self._volume_gradient(x - change)
            moves = np.swapaxes(change.T[:, self.nodes_by_corner], 0, 1)
            volumes = np.einsum("nie,nie->e", before / 3.0 + moves, slope)
        mixed = mixed * (self.lame_lambda * (volumes / self.rest_volume - 1.0))
        for u, (n, m) in zip(mixed, volume_tensor(len(corners))[0], strict=True):
            for i, j, k, sign in SIGNED_PERMUTATIONS:
                p, q = 3 * n + i, 3 * m + j
                entries[starts[p] + q - p] += sign * u[k]
        return entries

    def volume_field(self, x: np.ndarray) -> VolumeField:
        """Positions or displacements of the elements' corners, to be mixed with others.

        Args:
            x: Vectors at the nodes, (node, 3).
        """
        return VolumeField(*self._volume_gradient(x)[:2])

    def _volume_gradient(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Positions from the first node on, (k, 3, element), u, (pair, 3, element), and dv/dx."""
        corners = np.ascontiguousarray(np.swapaxes(x, 0, 1)[:, self.nodes_by_corner])
        # From the first node on, so that nothing is lost where a body is far from the origin.
        corners = np.swapaxes(corners - corners[:, :1], 0, 1)
        pairs, tensor = volume_tensor(len(corners))
        mixed = (tensor @ corners.reshape(len(corners), -1)).reshape(len(pairs), 3, -1)
        gradient = np.zeros_like(corners)
        for u, (n, m) in zip(mixed, pairs, strict=True):
            gradient[n] += 0.5 * cross(corners[m], u)
            gradient[m] -= 0.5 * cross(corners[n], u)
        return corners, mixed, gradient


@dataclass(frozen=True, eq=False)
class VolumeField:
    """Vectors at the corners of every element, as the volumes see them.

    v = D(x, x, x) with a D that is linear and symmetric in its three fields.
    """

    corners: np.ndarray
    """From the element's first node on, (k, 3, element)."""
    sums: np.ndarray
    """u_nm = sum_k T_nmk x_k, (pair, 3, element)."""

    def mixed(self, other: VolumeField) -> np.ndarray:
        """6 D(self, other, .): what a third field does to the volume, (k, 3, element)."""
        pairs, _ = volume_tensor(len(self.corners))
        result = np.zeros_like(self.corners)
        for u, w, (n, m) in zip(self.sums, other.sums, pairs, strict=True):
            result[n] += 0.5 * (cross(self.corners[m], w) + cross(other.corners[m], u))
            result[m] -= 0.5 * (cross(self.corners[n], w) + cross(other.corners[n], u))
        return result


@cache
def volume_tensor(node_count: int) -> tuple[list[tuple[int, int]], np.ndarray]:
    """Pairs n < m of a tetrahedron's nodes, and T_nmk for each, (pair, k).

    Args:
        node_count: 4 or 10.
    """
    on_edge = {frozenset(edge): 4 + place for place, edge in enumerate(TETRAHEDRON_EDGES)}
    triples, weights = volume_terms(3 if node_count == 4 else 6)
    tensor = np.zeros((node_count,) * 3)
    for face in TETRAHEDRON_FACES.tolist():
        middles = [on_edge[frozenset((face[a], face[b]))] for a, b in TRIANGLE_EDGES]
        nodes = np.array(face + middles)
        for triple, weight in zip(nodes[triples], weights, strict=True):
            for order in itertools.permutations(range(3)):
                sign = round(np.linalg.det(np.eye(3)[list(order)]))
                tensor[tuple(triple[list(order)])] += sign * weight
    pairs = [pair for pair in itertools.combinations(range(node_count), 2) if tensor[pair].any()]
    return pairs, np.array([tensor[pair] for pair in pairs])
