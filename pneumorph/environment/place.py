"""Where robots are on the floor, and how they moved."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from pneumorph.environment.goal import turn_between
from pneumorph.environment.reward import MILLIMETRES_PER_CENTIMETRE


@dataclass(frozen=True, eq=False)
class Place:
    """Where robots are.

    Attributes:
        forward_mm: Along the floor's forward axis [mm], (robot,).
        left_mm: To the left of it [mm], (robot,).
        heading_deg: Where they face, from forward to the left [degrees], (robot,); NaN where that
            is not known.
    """

    forward_mm: np.ndarray
    left_mm: np.ndarray
    heading_deg: np.ndarray

    def faced(self, later: Place) -> Place:
        """These places with all headings: of robots that have faced nowhere so far, tipped over
        since they started, where they do at a later place, forward if they still do not. Standing
        up is no turn."""
        heading_deg = np.where(np.isnan(self.heading_deg), later.heading_deg, self.heading_deg)
        return replace(self, heading_deg=np.nan_to_num(heading_deg))

    def mirrored(self) -> Place:
        """Where their mirror images about the forward axis are; of places `since` a start, those
        that start in the same place."""
        return replace(self, left_mm=-self.left_mm, heading_deg=-self.heading_deg)

    def since(self, start: Place) -> Place:
        """Where they are from where they started, along the same axes; where they face is told
        from the forward axis of the floor as before."""
        return replace(
            self,
            forward_mm=self.forward_mm - start.forward_mm,
            left_mm=self.left_mm - start.left_mm,
        )

    def unless(self, chosen: np.ndarray, other: Place) -> Place:
        """These places, and another's of the robots marked in ``chosen`` (robot,) bool."""
        return Place(
            np.where(chosen, other.forward_mm, self.forward_mm),
            np.where(chosen, other.left_mm, self.left_mm),
            np.where(chosen, other.heading_deg, self.heading_deg),
        )

    def to(self, later: Place) -> Move:
        """How they moved from here to a later place, turning by less than half a circle."""
        return Move(
            later.forward_mm - self.forward_mm,
            later.left_mm - self.left_mm,
            turn_between(self.heading_deg, later.heading_deg),
        )


@dataclass(frozen=True, eq=False)
class Move:
    """How robots moved.

    Attributes:
        forward_mm: Along the floor's forward axis [mm], (robot,).
        left_mm: To the left [mm], (robot,).
        turn_deg: Turn to the left [degrees], (robot,).
    """

    forward_mm: np.ndarray
    left_mm: np.ndarray
    turn_deg: np.ndarray

    def mirrored(self) -> Move:
        """What their mirror images about the forward axis do."""
        return replace(self, left_mm=-self.left_mm, turn_deg=-self.turn_deg)

    def towards(self, direction: tuple[float, float, float]) -> np.ndarray:
        """How far they came towards a goal [mm], (robot,).

        Args:
            direction: What a cm forward, a cm to the left and a degree to the left are worth [cm],
                as `RewardWeights.direction` has it.
        """
        forward, left, turn = direction
        turned_mm = MILLIMETRES_PER_CENTIMETRE * turn * self.turn_deg
        return forward * self.forward_mm + left * self.left_mm + turned_mm
