"""The same part with fewer sampled points: cheaper, and made in seconds, without finite elements.

A part's points were chosen for all of its modes and for snapshots of finite elements (`ecsw.py`).
Left with fewer modes (`fewer_modes.py`) it needs fewer: with forces f_p(beta) of its points on the
modes that it has, the same search chooses non-negative factors c_p, most of them zero, with

    sum_p c_p f_p(beta_s) = sum_p f_p(beta_s)

at states beta_s that it goes through. Its points stand for the mesh, and a few of them for its
points: a hyperreduction of what was hyperreduced. Volumes of whole elements, sheets seen by fields
of stress, chambers and masses are polynomials of the modes, and stay as they are.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sparse
from threadpoolctl import threadpool_limits

from pneumorph.reduction.ecsw import EcswSettings, TrainingRows, fitted_columns
from pneumorph.reduction.reduced_part import ReducedPart

POINT_SHARE = "point_share"
"""Name in a part's metadata of the share of its sampled points that it was left with."""
# Factors are rounded, since what they are fitted with rounds otherwise on other machines.
_DECIMALS = 6


@dataclass(frozen=True, eq=False)
class FewerPoints:
    """Which sampled points of a part stand for all of them."""

    tetrahedron_factor: np.ndarray
    """New weight of each point over the old, zero of most, (element,)."""
    membrane_factor: np.ndarray
    """The same of a sheet's points, (triangle,)."""
    relative_residual: float
    """Of scaled forces at the states, as `EcswResult` has it."""

    @property
    def share(self) -> float:
        """Points that are left, over all."""
        factors = np.concatenate([self.tetrahedron_factor, self.membrane_factor])
        return float(np.mean(factors > 0.0)) if len(factors) else 1.0

    def of(self, part: ReducedPart) -> ReducedPart:
        """The part with these points alone; whatever its scale."""
        arrays = {}
        for name, factor in (
            ("tetrahedron", self.tetrahedron_factor),
            ("membrane", self.membrane_factor),
        ):
            left = np.flatnonzero(factor)
            for each in ("index", "rest", "mode_gradient"):
                arrays[f"{name}_{each}"] = getattr(part, f"{name}_{each}")[left]
            for each in ("weight", "measure"):
                arrays[f"{name}_{each}"] = getattr(part, f"{name}_{each}")[left] * factor[left]
        return replace(part, **arrays, metadata={**part.metadata, POINT_SHARE: self.share})


def fewer_points(part: ReducedPart, states: np.ndarray, tolerance: float) -> FewerPoints:
    """Choose points that stand for all.

    Args:
        part: The reduced part.
        states: What it goes through, modal coordinates (state, mode).
        tolerance: Relative residual of scaled forces, as of
            `EcswSettings.hyperreduction_tolerance`.

    Raises:
        ValueError: No state, or the tolerance is not positive.
    """
    if len(states) == 0:
        raise ValueError("states must hold at least one state that the part goes through, got none")
    groups = part.tetrahedra, part.membrane
    weights = part.tetrahedron_weight, part.membrane_weight
    training = TrainingRows(
        groups,
        _columns(weights),
        "polar" if part.is_polar else "edge",
        part.linear_stiffness,
        (part.dilatation, part.sheet),
        part.relaxation is not None,
    )
    settings = EcswSettings(hyperreduction_tolerance=tolerance)
    # Matrices of so few modes are faster without threads, and sums of one order.
    with threadpool_limits(1, user_api="blas"):
        solution = fitted_columns(training, states, settings)
    factors = np.round(training.columns @ solution.weight, _DECIMALS)
    solid, sheet = np.split(factors, [len(weights[0])])
    return FewerPoints(solid, sheet, solution.relative_residual)


def _columns(weights: tuple[np.ndarray, ...]) -> sparse.csr_matrix:
    """Adds up what points contribute that are to share a factor, (point, column): two points of the
    same weight are each other's mirror image, which ECSW gave it to."""
    owner: list[np.ndarray] = []
    for each in weights:
        _, column, count = np.unique(each, return_inverse=True, return_counts=True)
        alone = count[column] != 2
        column[alone] = len(count) + np.arange(int(alone.sum()))
        before = 0 if not owner else int(max(other.max(initial=-1) for other in owner)) + 1
        owner.append(before + np.unique(column, return_inverse=True)[1])
    columns = np.concatenate(owner)
    return sparse.csr_matrix(
        (np.ones(len(columns)), (np.arange(len(columns)), columns)),
        shape=(len(columns), int(columns.max(initial=-1)) + 1),
    )
