"""Where a step of a full-order robot may end."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Generic

import numpy as np

from pneumorph.fem.hub_body import HubState


@dataclass(frozen=True, eq=False)
class TrialStep(Generic[HubState]):
    """Where a step may end; axes as in `FullRobotState`."""

    hub: HubState
    """State of the hub; its velocity leads there from the step's start."""
    positions: tuple[np.ndarray, ...]
    """World positions of each leg's nodes [mm], each (node, 3)."""
    velocities: tuple[np.ndarray, ...]
    """Velocities that lead there [mm/s], each (node, 3)."""
    impulses: np.ndarray
    """Contact impulses, rows of the floor's frames [mN s], (contact point, 3)."""
    contact_velocities: np.ndarray
    """Velocities of the contact points in the same rows [mm/s], (contact point, 3)."""
    contact_residual: float = 0.0
    """Contact law violated by at most this [mm/s]."""
