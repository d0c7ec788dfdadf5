"""Snapshot proper orthogonal decomposition: the modes a part may move in.

Snapshots u_s and an inner product H (mass, or energy: a stiffness plus a little mass) give the Gram
matrix C = U^T H U with eigenvalues s_j^2. The singular values s_j measure how much of the snapshots
lies along each H-orthonormal mode. With a mode tolerance t the basis keeps the smallest number m of
modes with

    sqrt( sum_{j > m} s_j^2 / sum_j s_j^2 ) <= t,

the relative root-mean-square projection error of the snapshots in the norm of H. This is the mode
tolerance of the published experiment (0.0032), there in the Euclidean norm of the nodes' positions,
which with equal node masses is the norm of mass. Snapshots that are only known up to a dropped part
of square D (`incremental_pod.py`) add D to both sums; the bound then holds for them all the same.

The span is then mass-orthonormalised, Phi^T M Phi = I, one mode after the other, so that fewer
modes of the same decomposition are a sub-basis.

For a part with a mirror plane the mirror images count as snapshots too. Their decomposition splits
exactly into that of the symmetric and of the antisymmetric halves of the snapshots, because the two
halves are orthogonal in every inner product the mirror leaves unchanged; so each mode is exactly
one or the other, and a part and its mirror image are reduced alike.

Source: Goury and Duriez 2018 for soft robots; Sirovich 1987 for the method of snapshots.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sparse

from pneumorph.reduction.incremental_pod import MIRROR as MIRROR
from pneumorph.reduction.incremental_pod import IncrementalPod, gram_vectors
from pneumorph.reduction.snapshots import BLOCK_SIZE

# Singular values below this, relative to the largest, are rounding of the Gram matrix.
_ROUNDING = 1e-7


@dataclass(frozen=True)
class Pod:
    """Modes and how well they hold the snapshots."""

    modes: np.ndarray
    """Mass-orthonormal modes [kg^-1/2], (node, 3, mode)."""
    singular_values: np.ndarray
    """All singular values in the chosen inner product, descending; before them what the snapshots
    have along each of the fields that were modes before others were chosen. Not in the order of
    the modes."""
    parity: np.ndarray
    """+1 for a symmetric, -1 for an antisymmetric mode, 0 without a mirror plane, (mode,). Those of
    one parity stand together, symmetric ones first."""
    dropped_square: float = 0.0
    """D: square of what the snapshots lost before."""

    @property
    def projection_error(self) -> float:
        """sqrt((D + sum of the dropped s_j^2) / (D + sum of all s_j^2)), at least the true one."""
        error = truncation_error(self.singular_values, self.dropped_square)
        return float(error[self.modes.shape[2]])


def pod(
    displacement: np.ndarray,
    node_mass: np.ndarray,
    *,
    tolerance: float,
    mode_limit: int,
    metric: sparse.spmatrix | None = None,
    mirror_nodes: np.ndarray | None = None,
) -> Pod:
    """Decompose snapshots and keep the modes a tolerance asks for.

    Args:
        displacement: Snapshots [mm], (snapshot, node, 3); scale one to weigh it.
        node_mass: Lumped mass [kg], (node,).
        tolerance: Mode tolerance t of the formula above, between 0 and 1.
        mode_limit: Keep at most so many modes, whatever the tolerance asks for.
        metric: Inner product H, symmetric (3 node, 3 node) and definite on the snapshots; the
            lumped mass if not given.
        mirror_nodes: Node that each node's image under y -> -y is, (node,), or None.

    Raises:
        ValueError: No snapshot, shapes disagree, values not finite or a tolerance out of range.
    """
    _check(displacement, node_mass)
    if metric is None:
        metric = sparse.diags(np.repeat(node_mass, 3)).tocsr()
    gathered = IncrementalPod(metric, _ROUNDING, mirror_nodes)
    for start in range(0, len(displacement), BLOCK_SIZE):
        gathered.add(displacement[start : start + BLOCK_SIZE])
    return joint_pod(
        [(1.0, gathered)], node_mass, metric, tolerance=tolerance, mode_limit=mode_limit
    )


def joint_pod(
    parts: Sequence[tuple[float, IncrementalPod]],
    node_mass: np.ndarray,
    metric: sparse.spmatrix,
    *,
    tolerance: float,
    mode_limit: int,
    first: Mapping[int, np.ndarray] | None = None,
) -> Pod:
    """Decompose several sets of snapshots together, each with its weight.

    Args:
        parts: Factor of the snapshots of each set, and its decomposition in this metric.
        node_mass: Lumped mass [kg], (node,).
        metric: Inner product H, (3 node, 3 node).
        tolerance: Mode tolerance t of the formula above, between 0 and 1; what the sets have
            dropped counts as error.
        mode_limit: Keep at most so many modes, whatever the tolerance asks for.
        first: Orthonormal fields of each parity that are modes whatever follows, (mode, 3 node),
            as `leading_fields` makes them; the others are of what these leave of the snapshots.

    Raises:
        ValueError: A tolerance or limit out of range, or all snapshots are zero.
    """
    if not 0.0 < tolerance < 1.0:
        raise ValueError(f"tolerance must lie between 0 and 1, got {tolerance}")
    if mode_limit < 1:
        raise ValueError(f"mode_limit must be at least 1, got {mode_limit}")
    values, parities, fields = [], [], []
    leading, leading_values, leading_parities = [], [], []
    for parity in parts[0][1].scaled_modes:
        rows = np.concatenate([scale * part.scaled_modes[parity] for scale, part in parts])
        if first is not None:
            along = rows @ (metric @ first[parity].T)
            rows = rows - along @ first[parity]
            leading.append(first[parity])
            leading_values.append(np.linalg.norm(along, axis=0))
            leading_parities.append(np.full(len(first[parity]), parity))
        squares, vectors = gram_vectors(rows, metric)
        kept = min(mode_limit, len(rows))
        values.append(np.sqrt(squares))
        parities.append(np.full(kept, parity))
        fields.append((np.sqrt(squares[:kept]), vectors[:, :kept].T @ rows))
    singular_values = np.concatenate([*leading_values, np.sort(np.concatenate(values))[::-1]])
    if singular_values.max(initial=0.0) == 0.0:
        raise ValueError("displacement must not be zero in every snapshot; nothing moved")
    dropped = sum(scale**2 * part.dropped_square for scale, part in parts)
    reached = truncation_error(singular_values, dropped) <= tolerance
    # Where even all of them leave more than the tolerance, all are wanted.
    wanted = int(np.argmax(reached)) if reached.any() else len(singular_values)
    # Gram eigenvalues below rounding carry no direction.
    meaningful = int((singular_values > _ROUNDING * singular_values.max()).sum())
    given = sum(map(len, leading))
    count = max(1, given, min(wanted, meaningful))
    count = min(count, mode_limit)

    scale_of = np.concatenate([scale for scale, _ in fields])
    chosen = np.argsort(-scale_of, kind="stable")[: max(count - given, 0)]
    rows = np.concatenate([*leading, np.concatenate([field for _, field in fields])[chosen]])
    modes = mass_orthonormalise(rows[:count].T, node_mass)
    sides = np.concatenate([*leading_parities, np.concatenate(parities)[chosen]])[:count]
    order = np.argsort(-sides, kind="stable")
    return Pod(
        modes=modes[:, order].reshape(len(node_mass), 3, count),
        singular_values=singular_values,
        parity=sides[order],
        dropped_square=dropped,
    )


def leading_fields(
    parts: Sequence[IncrementalPod], metric: sparse.spmatrix, tolerance: float
) -> dict[int, np.ndarray]:
    """Fewest orthonormal fields that hold sets of snapshots, each to count alike.

    The symmetric and the antisymmetric fields of a part with a mirror plane are chosen each for
    itself, so what either leaves may be all that is allowed, and both leave up to sqrt(2) times the
    tolerance. Of curves that are nearly symmetric the one part is as good as all.

    Args:
        parts: Decompositions of the sets in this metric.
        metric: Inner product H, (3 node, 3 node).
        tolerance: Relative root-mean-square error of the sets' projection on the fields, of what
            each parity leaves alone.

    Returns:
        Fields by parity, (mode, 3 node).
    """
    scaled = [(part.square**-0.5, part) for part in parts]
    found = {}
    for parity in parts[0].scaled_modes:
        rows = np.concatenate([scale * part.scaled_modes[parity] for scale, part in scaled])
        squares, vectors = gram_vectors(rows, metric)
        left = np.append(np.cumsum(squares[::-1])[::-1], 0.0)
        count = int(np.argmax(left <= tolerance**2 * len(parts)))
        found[parity] = (vectors[:, :count].T @ rows) / np.sqrt(squares[:count])[:, None]
    return found


def truncation_error(singular_values: np.ndarray, dropped_square: float = 0.0) -> np.ndarray:
    """sqrt((D + sum_{j > m} s_j^2) / (D + sum s_j^2)) for m = 0 .. number of values."""
    squares = np.append(np.cumsum(singular_values[::-1] ** 2)[::-1], 0.0) + dropped_square
    return np.sqrt(squares / squares[0])


def mass_orthonormalise(fields: np.ndarray, node_mass: np.ndarray) -> np.ndarray:
    """Gram-Schmidt of columns (3 node, mode) in the lumped mass; largest entry made positive."""
    root = np.sqrt(np.repeat(node_mass, 3))[:, None]
    orthonormal, _ = np.linalg.qr(root * fields)
    modes = orthonormal / root
    largest = np.abs(modes).argmax(axis=0)
    return modes * np.sign(modes[largest, np.arange(modes.shape[1])])


def project(displacement: np.ndarray, modes: np.ndarray, node_mass: np.ndarray) -> np.ndarray:
    """Modal coordinates of displacements (snapshot, node, 3), nearest in mass: (snapshot, mode)."""
    weighted = (node_mass[:, None, None] * modes).reshape(-1, modes.shape[2])
    return displacement.reshape(len(displacement), -1) @ weighted


def _check(displacement: np.ndarray, node_mass: np.ndarray) -> None:
    if displacement.ndim != 3 or displacement.shape[1:] != (len(node_mass), 3):
        raise ValueError(
            f"displacement must have shape (snapshot, {len(node_mass)}, 3), got "
            f"{displacement.shape}; snapshots and masses may belong to different meshes"
        )
    if len(displacement) == 0:
        raise ValueError("displacement must hold at least one snapshot, got none")
    if not np.all(np.isfinite(displacement)):
        raise ValueError("displacement must be finite; the full-order run may have diverged")
