"""How near each leg is to slipping while a robot walks, from a recorded trajectory.

A leg that presses on the floor with N and is held by a friction of T uses the share T / (mu N) of
what friction can give; N is along the floor's normal below each point and T is across it. One that
uses nearly all of it slides as a whole; below, it sticks or rolls over with some of its points
sliding.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from pneumorph.trajectory import Trajectory

SLIP_MM_PER_S = 1.0
"""A pressed point that moves faster along the floor slips [mm/s]: a hundred times what the solvers'
tolerance leaves of one that sticks, so that it lies at the limit of its friction."""
LIMIT_SHARE = 0.95
"""A leg that uses more than this share of its friction is at its limit."""
_LEAST_LOAD_MN = 1.0
"""A leg that presses less than this is in the air [mN]; a leg weighs 1000."""


@dataclass(frozen=True, eq=False)
class FrictionMargin:
    """Load, use of friction and slipping of each leg.

    Attributes:
        time_s: Time of each frame [s], shape (frame,).
        load_mN: What the floor presses with along its normal [mN], shape (frame, leg).
        used_share: Friction over the most that the load allows, shape (frame, leg), 0 to 1; NaN
            where a leg is in the air.
        slipping_share: Share of the load on points that slip, shape (frame, leg); NaN likewise.
    """

    time_s: np.ndarray
    load_mN: np.ndarray
    used_share: np.ndarray
    slipping_share: np.ndarray

    def of_leg(self, leg: int) -> dict[str, float]:
        """Means of a leg over the walk, weighted by its load.

        Returns:
            ``mean_load_mN``, ``used_share``, ``slipping_share``, and ``at_limit_share``: of the
            load, what was carried while the leg was at its limit; ``in_air_share`` of the time.
        """
        load = self.load_mN[:, leg]
        pressed = load > _LEAST_LOAD_MN
        weight = load[pressed] / max(load[pressed].sum(), _LEAST_LOAD_MN)
        return {
            "mean_load_mN": float(load.mean()),
            "used_share": float(weight @ self.used_share[pressed, leg]),
            "slipping_share": float(weight @ self.slipping_share[pressed, leg]),
            "at_limit_share": float(weight @ (self.used_share[pressed, leg] > LIMIT_SHARE)),
            "in_air_share": float(1.0 - pressed.mean()),
        }


class PointContacts(NamedTuple):
    """What the floor does to the contact points of a recorded robot's legs, in double precision."""

    pressing_mN: Float[np.ndarray, "frame leg point"]
    """Force along the floor's normal [mN]."""
    friction_mN: Float[np.ndarray, "frame leg point 3"]
    """Force across it [mN], world axes."""
    sliding_mm_per_s: Float[np.ndarray, "frame leg point"]
    """Speed along the floor of points that carry a force [mm/s]."""


def point_contacts(trajectory: Trajectory) -> PointContacts:
    """Forces and speeds of a recorded walk along the floor's normals and across them.

    Raises:
        ValueError: The trajectory was recorded without contact forces.
    """
    force, velocity = trajectory.contact_force_mN, trajectory.contact_velocity_mm_per_s
    if force is None or velocity is None:
        raise ValueError(
            "the trajectory holds no contact forces, expected one that was recorded with its nodes"
        )
    force, velocity = force.astype(float), velocity.astype(float)
    up = trajectory.contact_normal
    normal = np.array([0.0, 0.0, 1.0]) if up is None else up.astype(float)
    pressing, leaving = (np.sum(each * normal, axis=-1) for each in (force, velocity))
    along = velocity - leaving[..., None] * normal
    return PointContacts(
        pressing, force - pressing[..., None] * normal, np.linalg.norm(along, axis=-1)
    )


def friction_margin(trajectory: Trajectory, friction: float | np.ndarray) -> FrictionMargin:
    """Read the margins of a recorded walk.

    Args:
        trajectory: With the forces on the legs' contact points.
        friction: Coulomb coefficient mu that it walked with, one for all points or (frame, leg,
            point).

    Raises:
        ValueError: The trajectory was recorded without contact forces, or mu is not
            positive.
    """
    pressing, held, sliding = point_contacts(trajectory)
    if not np.all(friction > 0.0):
        raise ValueError(f"friction is {np.min(friction)}, expected a positive coefficient")
    load = pressing.sum(axis=2)
    pressed = load > _LEAST_LOAD_MN
    grip = friction * load if np.ndim(friction) == 0 else (friction * pressing).sum(axis=2)
    most = np.where(pressed, grip, np.nan)
    pull = np.linalg.norm(held.sum(axis=2), axis=-1)
    on_slipping = np.where(sliding > SLIP_MM_PER_S, pressing, 0.0).sum(axis=2)
    return FrictionMargin(
        trajectory.time_s,
        load,
        pull / most,
        on_slipping / np.where(pressed, load, np.nan),
    )
