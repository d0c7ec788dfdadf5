"""The same part with fewer sampled points: cheaper, and made in seconds, without finite elements.

A part's points were chosen for all of its modes and for snapshots of finite elements (`ecsw.py`).
Left with fewer modes (`fewer_modes.py`) it needs fewer: with forces f_p(beta) of its points on the
modes that it has, the same search chooses non-negative factors c_p, most of them zero, with

    sum_p c_p f_p(beta_s) = sum_p f_p(beta_s)

at states beta_s that it goes through, and with the stiffness at some of them. Its points stand for
the mesh, and a few of them for its points: a hyperreduction of what was hyperreduced. Volumes of
whole elements, sheets seen by fields of stress, chambers and masses are polynomials of the modes,
and stay as they are.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sparse
from threadpoolctl import threadpool_limits

from pneumorph.reduction.ecsw import EcswSettings, TrainingRows, fitted_columns
from pneumorph.reduction.reduced_part import ReducedPart


@dataclass(frozen=True, eq=False)
class FewerPoints:
    """Which sampled points of a part stand for all of them."""

    tetrahedron_factor: np.ndarray
    """New weight of each point over the old, zero of most, (element,)."""
    membrane_factor: np.ndarray
    """The same of a sheet's points, (triangle,)."""
    relative_residual: float
    """Of scaled forces and stiffnesses, as `EcswResult` has it."""

    @property
    def count(self) -> int:
        """Points that are left."""
        return int((self.tetrahedron_factor > 0.0).sum() + (self.membrane_factor > 0.0).sum())

    def of(self, part: ReducedPart) -> ReducedPart:
        """The part with these points alone; whatever its scale.

        Raises:
            ValueError: It has another number of points than these were chosen of.
        """
        ours = len(self.tetrahedron_factor), len(self.membrane_factor)
        if (theirs := (len(part.tetrahedron_index), len(part.membrane_index))) != ours:
            raise ValueError(
                f"points were chosen of {ours} tetrahedra's and membrane's, expected a part with "
                f"as many, got {theirs}: another reduction, or one with fewer points already"
            )
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
        return replace(part, **arrays)


def fewer_points(part: ReducedPart, states: np.ndarray, tolerance: float) -> FewerPoints | None:
    """Choose points that stand for all.

    Args:
        part: The reduced part.
        states: What it goes through, modal coordinates (state, mode).
        tolerance: Relative residual of scaled forces and stiffnesses, as of
            `EcswSettings.hyperreduction_tolerance`.

    Returns:
        None where no fewer are within the tolerance, and of a part that was not sampled by
        `ecsw`, whose weights do not tell which points are each other's mirror image.

    Raises:
        ValueError: No state, or the tolerance is not above 0 and below 1.
    """
    if len(states) == 0:
        raise ValueError("states must hold at least one state that the part goes through, got none")
    groups = part.tetrahedra, part.membrane
    weights = part.tetrahedron_weight, part.membrane_weight
    columns = _columns(weights)
    if columns is None:
        return None
    training = TrainingRows(
        groups,
        columns,
        "polar" if part.is_polar else "edge",
        part.linear_stiffness,
        (part.dilatation, part.sheet),
        part.relaxation is not None,
    )
    settings = EcswSettings(hyperreduction_tolerance=tolerance)
    # Matrices of so few modes are faster without threads, and sums of one order.
    with threadpool_limits(1, user_api="blas"):
        solution = fitted_columns(training, states, settings)
    if not solution.converged or np.all(solution.weight > 0.0):
        return None
    factors = training.columns @ solution.weight
    solid, sheet = np.split(factors, [len(weights[0])])
    return FewerPoints(solid, sheet, solution.relative_residual)


def _columns(weights: tuple[np.ndarray, ...]) -> sparse.csr_matrix | None:
    """Adds up what points contribute that are to share a factor, (point, column): two points of the
    same weight are each other's mirror image, which ECSW gave it to. None where more than two have
    the same."""
    owners, column_count = [], 0
    for each in weights:
        different, owner, shared = np.unique(each, return_inverse=True, return_counts=True)
        if shared.max(initial=0) > 2:
            return None
        owners.append(column_count + owner)
        column_count += len(different)
    column = np.concatenate(owners)
    return sparse.csr_matrix(
        (np.ones(len(column)), (np.arange(len(column)), column)), shape=(len(column), column_count)
    )
