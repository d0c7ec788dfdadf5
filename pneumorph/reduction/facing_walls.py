"""Walls of one part that face each other across a gap and may not pass through each other.

Neighbouring teeth of a PneuNet bulge towards each other under pressure and meet where nothing bends
them apart. With d_p = y_p - x_p from a point of one wall to the one across, and the gap's direction
n = D / |D|, D from the middle of one side to that of the other, a pair that overlaps costs

    U = 1/2 sum_p k_p min(g_p, 0)^2,    g_p = n . d_p.                                          (45)

d and D are affine in the modes, so the force -dU is exact, n's turning included, and a part that
turns as a whole feels nothing. The stiffness is k dg (x) dg of the pairs that overlap, which is
positive semi-definite. There is no friction between the walls.

No snapshot comes from it: the modes of a leg whose snapshots passed through each other are what its
walls are pushed apart in.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np
from jaxtyping import Float, Int

from pneumorph.geometry.mesh import Mesh
from pneumorph.geometry.wall_gap import WallGap
from pneumorph.reduction.reduced_arrays import ReducedArrays

STIFFNESS_KPA_PER_MM = 1000.0
"""Walls pressed together by 100 kPa overlap by a tenth of a millimetre."""

Part = TypeVar("Part", bound=ReducedArrays)


@dataclass(frozen=True, eq=False)
class FacingWalls:
    """Pairs of points of facing walls in a part's modes."""

    axis: Float[np.ndarray, "gap 3"]
    """D of each gap at rest [mm], (gap, 3)."""
    axis_modes: Float[np.ndarray, "gap 3 mode"]
    pair_gap: Int[np.ndarray, " pair"]
    """Which gap each pair is of, (pair,), rising."""
    pair: Float[np.ndarray, "pair 3"]
    """d of each pair at rest [mm], (pair, 3)."""
    pair_modes: Float[np.ndarray, "pair 3 mode"]
    pair_stiffness: Float[np.ndarray, " pair"]
    """k [mN/mm], (pair,)."""

    def gaps(self, alpha: np.ndarray) -> np.ndarray:
        """g of every pair [mm], (..., pair), at modal coordinates (..., mode)."""
        return self._measured(alpha)[0]

    def force(self, alpha: np.ndarray) -> np.ndarray:
        """Generalised force on modal coordinates (..., mode), same shape."""
        gaps, gradients = self._measured(alpha)
        push = -self.pair_stiffness * np.minimum(gaps, 0.0)
        return np.einsum("...p,...pm->...m", push, gradients)

    def stiffness(self, alpha: np.ndarray) -> np.ndarray:
        """k dg (x) dg of the pairs that overlap, (mode, mode), at alpha (mode,)."""
        gaps, gradients = self._measured(alpha)
        rows = gradients[gaps < 0.0]
        return (rows.T * self.pair_stiffness[gaps < 0.0]) @ rows

    def _measured(self, alpha: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """g of every pair, (..., pair), and dg = n . dd + (d - g n) / |D| . dD,
        (..., pair, mode)."""
        axis = self.axis + np.einsum("gim,...m->...gi", self.axis_modes, alpha)
        length = np.linalg.norm(axis, axis=-1, keepdims=True)
        normals = (axis / length)[..., self.pair_gap, :]
        apart = self.pair + np.einsum("pim,...m->...pi", self.pair_modes, alpha)
        gaps = np.einsum("...pi,...pi->...p", normals, apart)
        across = (apart - gaps[..., None] * normals) / length[..., self.pair_gap, :]
        moved = np.einsum("...pi,pim->...pm", normals, self.pair_modes)
        turned = np.einsum("...pi,pim->...pm", across, self.axis_modes[self.pair_gap])
        return gaps, moved + turned


def with_facing_walls(
    part: Part,
    mesh: Mesh,
    gaps: Sequence[WallGap],
    stiffness_kPa_per_mm: float = STIFFNESS_KPA_PER_MM,
) -> Part:
    """The part with walls that may not pass through each other.

    Args:
        part: A reduced part.
        mesh: The mesh that it was made from.
        gaps: Between which walls.
        stiffness_kPa_per_mm: Pressure between walls that overlap by a millimetre.

    Raises:
        ValueError: The stiffness is not positive, the mesh has another number of nodes, or a wall
            has no triangle of its skin.
    """
    if not 0.0 < stiffness_kPa_per_mm < np.inf:
        raise ValueError(
            f"stiffness_kPa_per_mm is {stiffness_kPa_per_mm}, expected a positive number"
        )
    if len(mesh.nodes) != len(part.rest_nodes):
        raise ValueError(
            f"the mesh has {len(mesh.nodes)} nodes, expected the {len(part.rest_nodes)} of the "
            "mesh that the part was made from"
        )
    rest, modes = part.rest_nodes, part.modes
    axis = np.empty((len(gaps), 3))
    axis_modes = np.empty((len(gaps), 3, modes.shape[2]))
    pairs, pair_gap, areas = [], [], []
    for number, gap in enumerate(gaps):
        for to, values in ((axis, rest), (axis_modes, modes)):
            to[number] = values[gap.second_side].mean(axis=0) - values[gap.first_side].mean(axis=0)
        area = gap.areas(mesh)
        if not area.any():
            raise ValueError(
                f"the first wall of gap {number} has no triangle of the mesh's skin, expected "
                "nodes between which triangles lie"
            )
        stands = area > 0.0  # of quadratic faces the corners stand for nothing
        pairs += list(zip(gap.first[stands], gap.facing[stands], strict=True))
        pair_gap += [number] * int(stands.sum())
        areas.append(area[stands])
    first, facing = np.array(pairs, dtype=int).reshape(-1, 2).T
    return replace(
        part,
        wall_axis=axis,
        wall_axis_modes=axis_modes,
        wall_pair_gap=np.array(pair_gap, dtype=int),
        wall_pair=rest[facing] - rest[first],
        wall_pair_modes=modes[facing] - modes[first],
        wall_pair_stiffness=stiffness_kPa_per_mm * np.concatenate([*areas, np.zeros(0)]),
    )
