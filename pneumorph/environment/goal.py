"""What of a robot's motion counts, and in which unit.

Travel forward or along a heading is in cm, turning in degrees. Both are told from where the robot
stood at the start, travel along the axes of the floor, the turn summed over its way, so that it
does not end at half a circle.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal, Protocol

import numpy as np

from pneumorph.trajectory import Trajectory

GoalName = Literal["forward", "heading", "turn_left", "turn_right"]


class Told(Protocol):
    """What results tell of a design with its gait."""

    @property
    def distance_cm(self) -> float | None: ...

    @property
    def achieved(self) -> float | None: ...


_USUAL_HEADINGS = {0.0: "forward", 90.0: "to the left", -90.0: "to the right", 180.0: "backward"}


def said_heading(heading_deg: float, degrees: str) -> str:
    """A heading for a person.

    Args:
        heading_deg: From forward to the left [degrees].
        degrees: What follows their number.
    """
    turned = heading_deg % 360.0
    signed = turned if turned <= 180.0 else turned - 360.0
    side = "right" if signed < 0.0 else "left"
    return _USUAL_HEADINGS.get(signed, f"{abs(signed):g}{degrees} {side} of forward")


@dataclass(frozen=True)
class Goal:
    """What is achieved, and how it is told.

    Attributes:
        name: Travel along the forward axis or along a heading, or turning to a side.
        heading_deg: Where ``heading`` goes, from forward to the left [degrees].
        cm_per_unit: What a unit of it is worth in the reward [cm]: 1 of what is in cm.
    """

    name: GoalName = "forward"
    heading_deg: float = 0.0
    cm_per_unit: float = 1.0

    @property
    def is_forward(self) -> bool:
        """Whether it is the distance."""
        return self.name == "forward"

    @property
    def turns(self) -> bool:
        """Whether it is turning."""
        return self.name in ("turn_left", "turn_right")

    @property
    def unit(self) -> str:
        """What it is counted in, ``cm`` or ``degrees``."""
        return "degrees" if self.turns else "cm"

    @property
    def symbol(self) -> str:
        """Its unit beside a number, with the space that it asks for."""
        return "°" if self.turns else " cm"

    @property
    def digits(self) -> int:
        """Behind the decimal point, where it is told a person."""
        return 0 if self.turns else 1

    @property
    def label(self) -> str:
        """What is achieved, in a word or some."""
        return {
            "forward": "distance",
            "heading": f"travel {said_heading(self.heading_deg, '°')}",
            "turn_left": "turn to the left",
            "turn_right": "turn to the right",
        }[self.name]

    @property
    def title(self) -> str:
        """The same as the begin of a sentence."""
        return self.label.capitalize()

    @property
    def verb(self) -> str:
        """What a robot did that achieved it."""
        return "turned" if self.turns else "walked"

    @property
    def axis(self) -> str:
        """The same for an axis or a column, with the unit."""
        return self.in_unit("forward distance" if self.is_forward else self.label)

    def in_unit(self, name: str) -> str:
        """A name with the unit behind it, for an axis or a column."""
        return f"{name} ({self.symbol.strip()})"

    @property
    def direction(self) -> tuple[float, float, float]:
        """How much of it a cm forward, a cm to the left and a degree turned to the left are."""
        if self.name == "forward":
            return 1.0, 0.0, 0.0
        if self.name == "heading":
            angle = math.radians(self.heading_deg)
            return math.cos(angle), math.sin(angle), 0.0
        return 0.0, 0.0, 1.0 if self.name == "turn_left" else -1.0

    def of(
        self,
        forward_cm: np.ndarray,
        left_cm: np.ndarray | None = None,
        turned_deg: np.ndarray | None = None,
    ) -> np.ndarray:
        """How much was achieved [`unit`], of the shape of the arguments.

        Args:
            forward_cm: Travel forward [cm].
            left_cm: Travel to the left [cm]; None where that is not known.
            turned_deg: Turn to the left, whole circles counted [degrees]; None likewise.

        Raises:
            ValueError: It takes what is not known.
        """
        if self.is_forward:
            return forward_cm
        if left_cm is None or turned_deg is None:
            raise ValueError(
                f"the goal is {self.name!r}, expected 'forward' of robots whose simulator does not "
                "know where they turn"
            )
        forward, left, turn = self.direction
        return turn * turned_deg if self.turns else forward * forward_cm + left * left_cm

    def along(self, trajectory: Trajectory) -> np.ndarray:
        """How much a recorded robot has achieved at each frame [`unit`], (frame,)."""
        return self.of(trajectory.forward_cm, trajectory.left_cm, trajectory.turned_deg)

    def achieved(self, trajectory: Trajectory) -> float | None:
        """How much a recorded robot achieved [`unit`]; None of one whose walk did not end."""
        if self.is_forward:
            return trajectory.distance_cm
        return float(self.along(trajectory)[-1]) if trajectory.status == "completed" else None

    def of_pair(self, pair: Told) -> float | None:
        """What a design with its gait achieved, as a result of any version tells it [`unit`]."""
        return pair.distance_cm if self.is_forward else pair.achieved

    def said(self, achieved: float) -> str:
        """What was achieved, for a person, such as ``12.3 cm`` or ``123°``."""
        return f"{achieved:.{self.digits}f}{self.symbol}"

    def of_reward(self, reward_cm: float) -> float:
        """A reward [cm] as what it would take to earn it [`unit`]."""
        return reward_cm / self.cm_per_unit


FORWARD = Goal()
"""The distance: what is counted where nobody asks for another goal."""


def turn_between(before_deg: np.ndarray, after_deg: np.ndarray) -> np.ndarray:
    """Turn to the left from one heading to the next, of two the one that is less than half a circle
    [degrees], of the shape of the arguments [degrees]."""
    turn: np.ndarray = (after_deg - before_deg + 180.0) % 360.0 - 180.0
    return turn
