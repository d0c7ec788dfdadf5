"""How well the steps of a full-order rollout were solved, as its trajectory's metadata say it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class ContactReport:
    """How well the floor's contacts were solved."""

    floor: Any
    """What the floor is; JSON values of the floor's own."""
    worst_residual_mm_per_s: float
    """Of the friction law, in any step."""
    unconverged_share: float
    """Of the steps, in which it stayed above its tolerance."""
    deepest_penetration_mm: float


@dataclass(frozen=True)
class StepReport:
    """How many time steps were made."""

    count: int
    halved: int
    """Of them, how many were made in halves because the whole one found no solution."""
    mean_iterations: float
    """Of Newton's method, per step."""
