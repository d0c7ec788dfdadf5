"""The same part with fewer modes: cheaper, and made in an instant, without finite elements.

Of a part's modes those combinations are kept along which its snapshots went furthest, the principal
axes of `snapshot_range.py`: a proper orthogonal decomposition of what was decomposed already. With
alpha = T beta, T's columns orthonormal as the modes are in mass, every polynomial of the modes and
every gradient is contracted with T, so forces are exactly those of the whole part that moves along
T alone, T^T f(T beta) (Galerkin). Sampled points and their weights stay. So does the residual
flexibility of contact points: what the modes left out give way belongs to how a whole leg bends,
and added there it makes robots walk worse, not better (`reproduce/learning_modes`).
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from pneumorph.reduction.reduced_arrays import AXES
from pneumorph.reduction.reduced_part import ReducedPart

MODE_LIMIT = "mode_limit"
"""Name in a part's metadata of how many modes it was left with."""


def with_fewer_modes(part: ReducedPart, count: int) -> ReducedPart:
    """A part on the directions that its snapshots went furthest along.

    Args:
        part: The reduced part.
        count: How many modes to keep.

    Returns:
        The part itself where it has no more modes, or does not know its snapshots' range.

    Raises:
        ValueError: The count is not positive.
    """
    if count < 1:
        raise ValueError(f"count is {count}, expected at least one mode to keep")
    if part.mode_count <= count or not part.knows_range:
        return part
    inverse_lengths = np.linalg.norm(part.snapshot_range, axis=1)
    furthest = np.sort(np.argsort(inverse_lengths, kind="stable")[:count])
    fewer = along(part, (part.snapshot_range[furthest] / inverse_lengths[furthest, None]).T)
    return replace(fewer, metadata={**part.metadata, MODE_LIMIT: count})


def along(part: ReducedPart, directions: np.ndarray) -> ReducedPart:
    """A part that moves along some directions of its modes alone.

    Args:
        part: The reduced part.
        directions: T, orthonormal columns, (mode, direction). Rows of the range are its principal
            axes afterwards where they were so and the directions are some of them.
    """
    arrays: dict[str, Any] = {
        name: _contracted(getattr(part, name), axes, directions)
        for name, axes in AXES.items()
        if "mode" in axes and name != "snapshot_range"
    }
    if part.knows_range:  # |W T beta| by a square matrix
        arrays["snapshot_range"] = np.linalg.qr(part.snapshot_range @ directions, mode="r")
    return replace(part, **arrays)


def _contracted(array: np.ndarray, axes: tuple[str, ...], directions: np.ndarray) -> np.ndarray:
    """An array whose axes of modes are contracted with the directions."""
    for place, axis in enumerate(axes):
        if axis == "mode":
            array = np.moveaxis(np.tensordot(array, directions, axes=(place, 0)), -1, place)
    return np.ascontiguousarray(array)
