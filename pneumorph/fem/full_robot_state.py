"""The state of a full-order robot."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Generic

import numpy as np

from pneumorph.fem.hub_body import HubState
from pneumorph.fem.maxwell_group import ViscousState


@dataclass(frozen=True, eq=False)
class FullRobotState(Generic[HubState]):
    """State of a full-order robot."""

    hub: HubState
    """Of the hub."""
    positions: tuple[np.ndarray, ...]
    """World positions of each leg's nodes [mm], each (node, 3)."""
    velocities: tuple[np.ndarray, ...]
    """Their velocities [mm/s], each (node, 3)."""
    regulated_kPa: np.ndarray
    """Pressure of each regulator [real kPa], (regulator,)."""
    impulses: np.ndarray
    """Contact impulses of the last step: normal, tangent, tangent (on a plane z, x, y) [mN s],
    (contact point, 3); legs' points first, then the hub's."""
    contact_velocities: np.ndarray
    """Velocities of the contact points after the last step, in the same rows [mm/s], (contact
    point, 3): a pressed point sticks where the tangents' are zero. Zero too for points that took no
    part."""
    pressure_work_mJ: np.ndarray
    """Work of the pressure in each leg since the robot was at rest [mJ], (leg,)."""
    memories: tuple[ViscousState | None, ...]
    """What the solid of each leg remembers of its past; None of one that does not relax."""
    active_contacts: int = 0
    """Contact points that took part in the last step."""
    contact_residual: float = 0.0
    """Contact law violated by at most this in the last step [mm/s]."""
    penetration_mm: float = 0.0
    """Depth of the deepest contact point below the floor [mm]."""
    iterations: int = 0
    """Linear solves of the last step, with all its parts where it was halved."""
    substeps: int = 1
    """Parts that the last step was made of: more than 1 where it failed and was halved."""
