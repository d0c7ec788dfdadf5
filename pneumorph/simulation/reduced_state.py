"""The state of one reduced robot."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float


@dataclass(frozen=True, eq=False)
class ReducedState:
    """State of one reduced robot."""

    position: Float[np.ndarray, " 3"]
    """Hub origin in the world [mm]."""
    rotation: Float[np.ndarray, "3 3"]
    """Hub frame to world."""
    velocity: Float[np.ndarray, " 3"]
    """Of the hub origin [mm/s]."""
    angular_velocity: Float[np.ndarray, " 3"]
    """Of the hub, world axes [rad/s]."""
    modes: Float[np.ndarray, "mount mode"]
    """Modal coordinates of each mount, padded with zeros."""
    mode_rates: Float[np.ndarray, "mount mode"]
    """Their rates."""
    regulated: Float[np.ndarray, " regulator"]
    """Pressure of each regulator [real kPa]."""
    impulses: Float[np.ndarray, "contact_point 3"]
    """Contact impulses of the last step along z, x, y, or the normal and tangents of the ground
    below a point, the hub's points first [mN s]; warm start of the next."""
    springs: Float[np.ndarray, "mount branch point 6"]
    """Q of (36): strain that the springs of parts that relax have at each sampled tetrahedron's
    point, components 00, 11, 22, 01, 02, 12, padded with zeros; empty where no part relaxes."""
    memory: bytes = b""
    """The legs' stiffness of the last step, as `BatchedSimulator.memory` has it; without it the
    next step finds it afresh."""
