"""What the floor does to the contact points of a robot's legs, as a trajectory holds it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from pneumorph.geometry.robot_shape import stacked
from pneumorph.physics.floor import Floor, PlaneFloor


class LegContacts(NamedTuple):
    """Contacts of each leg after a step, in the world; zero beyond the points of a leg with fewer
    of them than others."""

    force_mN: Float[np.ndarray, "leg point 3"]
    """Force of the floor on each point in the step [mN]."""
    velocity_mm_per_s: Float[np.ndarray, "leg point 3"]
    """Velocities of the points that carry a force, as the law of contact speaks of them, zero of
    others [mm/s]."""
    normal: Float[np.ndarray, "leg point 3"] | None
    """Which way the floor faces below each point; None of a level plane, where it is up."""

    @classmethod
    def of(
        cls,
        floor: Floor,
        positions: Sequence[np.ndarray],
        velocities: Sequence[np.ndarray],
        impulses: np.ndarray,
        time_step_s: float,
    ) -> LegContacts:
        """The contacts of a step.

        Args:
            floor: What the robot stands on.
            positions: Of each leg's points after the step [mm], (point, 3) each.
            velocities: Of these in the step [mm/s], (point, 3) each.
            impulses: Along the floor's normal and tangents at all points, leg by leg [mN s],
                (point, 3).
            time_step_s: Length of the step [s].
        """
        ends = np.cumsum([len(each) for each in positions])[:-1]
        frames = floor.frames(np.concatenate(positions))
        force = np.einsum("pra,pr->pa", frames, impulses) / time_step_s
        moving = np.where(impulses[:, :1] > 0.0, np.concatenate(velocities), 0.0)
        level = isinstance(floor, PlaneFloor)

        def of_legs(values: np.ndarray) -> np.ndarray:
            return stacked(np.split(values, ends), fill_last=False)

        return cls(of_legs(force), of_legs(moving), None if level else of_legs(frames[:, 0]))

    def recorded(self) -> dict[str, np.ndarray]:
        """Arrays of a trajectory's frame by name, in single precision."""
        found = {
            "contact_force_mN": self.force_mN,
            "contact_velocity_mm_per_s": self.velocity_mm_per_s,
            "contact_normal": self.normal,
        }
        return {
            name: values.astype(np.float32) for name, values in found.items() if values is not None
        }
