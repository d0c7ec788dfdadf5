"""The state of one reduced robot."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True, eq=False)
class ReducedState:
    """State of one reduced robot."""

    position: np.ndarray
    """Hub origin in the world [mm], (3,)."""
    rotation: np.ndarray
    """Hub frame to world, (3, 3)."""
    velocity: np.ndarray
    """Of the hub origin [mm/s], (3,)."""
    angular_velocity: np.ndarray
    """Of the hub, world axes [rad/s], (3,)."""
    modes: np.ndarray
    """Modal coordinates of each mount, padded with zeros, (mount, mode)."""
    mode_rates: np.ndarray
    """Their rates, (mount, mode)."""
    regulated: np.ndarray
    """Pressure of each regulator [real kPa], (regulator,)."""
    impulses: np.ndarray
    """Contact impulses of the last step along z, x, y, the hub's points first [mN s], (contact
    point, 3); warm start of the next."""
    memory: bytes = b""
    """The legs' stiffness of the last step, as `BatchedSimulator.memory` has it; without it the
    next step finds it afresh."""
