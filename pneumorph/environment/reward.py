"""The reward of an action, as a sum of named terms."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pneumorph.base.checked import Checked, NotNegative

MILLIMETRES_PER_CENTIMETRE = 10.0

SAMPLE_STEPS = 10
"""Time steps between looks at a robot within an action, where a term asks for them."""


@dataclass(frozen=True)
class RewardWeights(Checked):
    """What is taken off the distance; by default nothing, as published."""

    backsliding: NotNegative = 0.0
    """Of the furthest slide back within an action [cm per cm]."""
    hub_load: NotNegative = 0.0
    """Of the share of the weight that the floor bears through the hub, in the mean over an action
    [cm for all of it]: against robots that drag their hub like a sled."""
    pressure_change: NotNegative = 0.0
    """Of how much commands change from one action to the next, summed over the regulators [cm for
    one of them over its whole range]: against gaits that need much air."""

    @property
    def needs_samples(self) -> bool:
        """Whether robots must be looked at within an action."""
        return self.backsliding > 0.0 or self.hub_load > 0.0

    @property
    def said(self) -> str:
        """What is taken off, for a person; empty where nothing is."""
        weights = {
            "backsliding": self.backsliding,
            "share of weight on the hub": self.hub_load,
            "change of pressure": self.pressure_change,
        }
        return " and ".join(f"{weight:g} x {name}" for name, weight in weights.items() if weight)


def reward_terms(
    travel_mm: np.ndarray,
    failed: np.ndarray,
    weights: RewardWeights | None = None,
    slide_mm: np.ndarray | None = None,
    hub_load_share: np.ndarray | None = None,
    pressure_change: np.ndarray | None = None,
) -> dict[str, np.ndarray]:
    """Terms whose sum is the reward of one action.

    ``forward_travel_cm`` is the paper's reward: the distance travelled forward in cm. The travel
    of a robot whose simulation failed during the action means nothing and counts as zero, so a
    numerical blow-up never pays; nor does it cost. ``backsliding_cm``, ``hub_load_cm`` and
    ``pressure_change_cm`` are there where they have a weight, and not positive.

    Args:
        travel_mm: Forward travel over the action [mm], shape (robot,).
        failed: Robots whose simulation failed during the action, shape (robot,) bool.
        weights: What is taken off; None for nothing.
        slide_mm: Furthest slide back within the action [mm], shape (robot,), where it counts.
        hub_load_share: Mean share of the weight on the hub, shape (robot,), where it counts.
        pressure_change: Change of commands over the range of pressure, summed over regulators,
            shape (robot,), where it counts.

    Returns:
        Each term, shape (robot,); always finite.
    """
    believed = ~failed & np.isfinite(travel_mm)
    travel_mm = np.where(believed, travel_mm, 0.0)
    terms = {"forward_travel_cm": travel_mm / MILLIMETRES_PER_CENTIMETRE}
    if weights is None:
        return terms
    costs = {
        "backsliding_cm": (weights.backsliding / MILLIMETRES_PER_CENTIMETRE, slide_mm),
        "hub_load_cm": (weights.hub_load, hub_load_share),
        "pressure_change_cm": (weights.pressure_change, pressure_change),
    }
    for name, (weight, amount) in costs.items():
        if weight > 0.0 and amount is not None:
            terms[name] = np.where(believed, -weight * amount, 0.0)
    return terms
