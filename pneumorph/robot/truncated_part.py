"""The same part with its first modes alone: for measurements of cost, not for walking."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from pneumorph.reduction.reduced_part import ReducedPart

_MODE_AXES = {
    "modes": 1,
    "tetrahedron_mode_gradient": 1,
    "membrane_mode_gradient": 1,
    "linear_stiffness": 2,
    "cavity_volume_1": 1,
    "cavity_volume_2": 2,
    "cavity_volume_3": 3,
    "first_moment_modes": 1,
    "second_moment_modes": 1,
    "second_moment_mode_pairs": 2,
    "contact_modes": 1,
}
"""How many of an array's last axes are modes."""


def truncated_part(part: ReducedPart, mode_count: int) -> ReducedPart:
    """Keep a part's first modes.

    The modes that are left still span equilibria of less pressure, but the sampled elements were
    chosen for all modes, and a basis cut short is too stiff.

    Args:
        part: The reduced part.
        mode_count: How many of its modes to keep.

    Raises:
        ValueError: The part has fewer modes, or none are kept.
    """
    if not 1 <= mode_count <= part.mode_count:
        raise ValueError(
            f"mode_count is {mode_count}, expected 1 to {part.mode_count}, the modes of the part"
        )
    changes: dict[str, Any] = {
        name: getattr(part, name)[(..., *[slice(mode_count)] * axes)]
        for name, axes in _MODE_AXES.items()
    }
    return replace(part, **changes)
