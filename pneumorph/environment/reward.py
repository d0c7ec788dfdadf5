"""The reward of an action, as a sum of named terms.

All terms are in cm: those of other quantities by a weight that says how many cm a unit is worth.
Mirrored about the forward axis a robot goes as far forward, and as far to the other side.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from pneumorph.base.checked import Checked, NotNegative, Positive
from pneumorph.environment.goal import Goal, GoalName, said_heading

MILLIMETRES_PER_CENTIMETRE = 10.0

GOAL_TERMS: dict[GoalName, str] = {
    "forward": "forward_travel_cm",
    "heading": "heading_travel_cm",
    "turn_left": "turn_cm",
    "turn_right": "turn_cm",
}
"""The term of each goal."""

COSTS = ("backsliding_cm", "hub_load_cm", "pressure_change_cm", "tilt_cm")
"""The terms of what is taken off."""

SAMPLE_STEPS = 10
"""Time steps between looks at a robot within an action, where a term asks for them."""


@dataclass(frozen=True)
class RewardWeights(Checked):
    """The reward: the goal's travel, minus penalties. By default forward travel alone, as in the
    paper; in the measured physics trainings and searches set `tilt` as well, environments made in
    Python do not."""

    backsliding: NotNegative = 0.0
    """Penalty for the furthest slide back within an action [cm per cm], away from the goal: of
    turning, what the degrees that are turned back were worth."""
    hub_load: NotNegative = 0.0
    """Penalty for the share of the weight that the floor bears through the hub, averaged over an
    action [cm for all of the weight]: against robots that drag their hub like a sled."""
    pressure_change: NotNegative = 0.0
    """Penalty for the change of commands from one action to the next, summed over the regulators
    [cm for one regulator over its whole range]: against gaits that use much air."""
    tilt: NotNegative = 0.0
    """Penalty for how far the hub leans beyond `free_tilt_deg`, averaged over an action [cm per
    degree]: against robots that fall over, which gains much distance once."""
    free_tilt_deg: NotNegative = 30.0
    """Lean that is not penalised [degrees]; a robot on its side leans by 50 and more, the paper's
    expert by 10 at most."""
    goal: GoalName = "forward"
    """What is rewarded; directions are those of the floor, along whose forward axis a robot faces
    at the start unless `--physics.start` turns it. `forward`: travel along that axis. `heading`:
    travel in the direction `heading_deg`. `turn_left`, `turn_right`: turning."""
    heading_deg: float = 0.0
    """Direction of the goal `heading`, counted from forward to the left [degrees]: 90 is to the
    left, 180 back."""
    turn_cm_per_degree: Positive = 0.1
    """Reward for a degree of turning [cm per degree]: by default a full circle is worth 36 cm."""

    @classmethod
    def implied(cls, content: Mapping[str, Any], below: Mapping[str, Any]) -> dict[str, Any]:
        """No direction with another goal than `heading`; one that is asked for alone is refused.

        Raises:
            ValueError: There is a direction and the goal has none.
        """
        goal = content.get("goal", below.get("goal"))
        if goal == "heading":
            return {}
        if content.get("heading_deg") and "goal" not in content:
            raise ValueError(
                f"heading_deg is {content['heading_deg']} and goal is {goal}, expected goal "
                "heading with it: no other has a direction"
            )
        return {"heading_deg": 0.0} if "goal" in content else {}

    @property
    def needs_samples(self) -> bool:
        """Whether robots must be looked at within an action."""
        return self.backsliding > 0.0 or self.hub_load > 0.0 or self.tilt > 0.0

    @property
    def takes_off(self) -> bool:
        """Whether something is taken off what of the goal is achieved."""
        return any(getattr(self, name.removesuffix("_cm")) for name in COSTS)

    @property
    def counted(self) -> Goal:
        """The goal as what counts of a walk."""
        turns = self.goal in ("turn_left", "turn_right")
        heading_deg = self.heading_deg if self.goal == "heading" else 0.0
        return Goal(self.goal, heading_deg, self.turn_cm_per_degree if turns else 1.0)

    @property
    def direction(self) -> tuple[float, float, float]:
        """What a cm forward, a cm to the left and a degree turned to the left are worth [cm]."""
        goal = self.counted
        forward, left, turn = goal.direction
        return forward, left, turn * goal.cm_per_unit

    @property
    def is_symmetric(self) -> bool:
        """Whether a robot and its mirror image, doing the same, are rewarded alike."""
        _, left, turn = self.direction
        return abs(left) < 1e-9 and turn == 0.0

    @property
    def said(self) -> str:
        """What is rewarded and what is taken off, for a person; empty for the distance alone."""
        goals = {
            "forward": "distance",
            "heading": f"travel {said_heading(self.heading_deg, ' degrees')}",
            "turn_left": f"{self.turn_cm_per_degree:g} cm for each degree turned left",
            "turn_right": f"{self.turn_cm_per_degree:g} cm for each degree turned right",
        }
        weights = {
            "backsliding": self.backsliding,
            "share of weight on the hub": self.hub_load,
            "change of pressure": self.pressure_change,
            f"degrees of tilt beyond {self.free_tilt_deg:g}": self.tilt,
        }
        less = " and ".join(f"{weight:g} x {name}" for name, weight in weights.items() if weight)
        if less:
            return f"{goals[self.goal]} less {less}"
        return "" if self.goal == "forward" else goals[self.goal]


def reward_terms(
    travel_mm: np.ndarray,
    failed: np.ndarray,
    weights: RewardWeights | None = None,
    slide_mm: np.ndarray | None = None,
    hub_load_share: np.ndarray | None = None,
    pressure_change: np.ndarray | None = None,
    left_mm: np.ndarray | None = None,
    turn_deg: np.ndarray | None = None,
    tilt_deg: np.ndarray | None = None,
) -> dict[str, np.ndarray]:
    """Terms whose sum is the reward of one action.

    ``forward_travel_cm`` is the paper's reward: the distance travelled forward in cm. In its place
    come ``heading_travel_cm`` and ``turn_cm`` where these are the goal. The travel
    of a robot whose simulation failed during the action means nothing and counts as zero, so a
    numerical blow-up never pays. Nor does it cost here; a training learns from another reward of
    it, see `pneumorph.learn.failed_walks.failing_reward_cm`, and any other learner gets this one
    and the termination. ``backsliding_cm``, ``hub_load_cm``,
    ``pressure_change_cm`` and ``tilt_cm`` are there where they have a weight, and not positive.

    Args:
        travel_mm: Forward travel over the action [mm], shape (robot,).
        failed: Robots whose simulation failed during the action, shape (robot,) bool.
        weights: What is taken off; None for nothing.
        slide_mm: Furthest slide back from the goal within the action [mm], shape (robot,), where
            it counts.
        hub_load_share: Mean share of the weight on the hub, shape (robot,), where it counts.
        pressure_change: Change of commands over the range of pressure, summed over regulators,
            shape (robot,), where it counts.
        left_mm: Travel to the left [mm], shape (robot,), where it counts.
        turn_deg: Turn to the left [degrees], shape (robot,), where it counts.
        tilt_deg: Mean over the action of the hub's tilt beyond what is free [degrees], shape
            (robot,), where it counts.

    Returns:
        Each term, shape (robot,); always finite.
    """
    believed = ~failed & np.isfinite(travel_mm)
    travel_mm = np.where(believed, travel_mm, 0.0)
    terms = {"forward_travel_cm": travel_mm / MILLIMETRES_PER_CENTIMETRE}
    if weights is None:
        return terms
    if weights.goal != "forward" and left_mm is not None and turn_deg is not None:
        believed &= np.isfinite(left_mm) & np.isfinite(turn_deg)
        forward, left, turn = weights.direction
        travel = (forward * travel_mm + left * left_mm) / MILLIMETRES_PER_CENTIMETRE
        value = travel if weights.goal == "heading" else turn * turn_deg
        terms = {GOAL_TERMS[weights.goal]: np.where(believed, value, 0.0)}
    costs = {
        "backsliding_cm": (weights.backsliding / MILLIMETRES_PER_CENTIMETRE, slide_mm),
        "hub_load_cm": (weights.hub_load, hub_load_share),
        "pressure_change_cm": (weights.pressure_change, pressure_change),
        "tilt_cm": (weights.tilt, tilt_deg),
    }
    for name, (weight, amount) in costs.items():
        if weight > 0.0 and amount is not None:
            terms[name] = np.where(believed, -weight * amount, 0.0)
    return terms
