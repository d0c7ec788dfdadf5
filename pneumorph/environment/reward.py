"""The reward of an action, as a sum of named terms."""

from __future__ import annotations

import numpy as np

MILLIMETRES_PER_CENTIMETRE = 10.0


def reward_terms(travel_mm: np.ndarray, failed: np.ndarray) -> dict[str, np.ndarray]:
    """Terms whose sum is the reward of one action.

    ``forward_travel_cm`` is the paper's reward: the distance travelled forward in cm. The travel
    of a robot whose simulation failed during the action means nothing and counts as zero, so a
    numerical blow-up never pays.

    Args:
        travel_mm: Forward travel over the action [mm], shape (robot,).
        failed: Robots whose simulation failed during the action, shape (robot,) bool.

    Returns:
        Each term, shape (robot,); always finite.
    """
    believed = ~failed & np.isfinite(travel_mm)
    travel_mm = np.where(believed, travel_mm, 0.0)
    return {"forward_travel_cm": travel_mm / MILLIMETRES_PER_CENTIMETRE}
