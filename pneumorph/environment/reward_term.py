"""A term of a reward of one's own: what of a robot's motion counts, in its unit, and its worth.

    turning = RewardTerm("turning", "degrees", -0.1, lambda motion: abs(motion.moved.turn_deg))

A `TaskWrapper` with ``terms`` adds them to the reward.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from pneumorph.environment.place import Move, Place


@dataclass(frozen=True, eq=False)
class ActionMotion:
    """What robots did within an action.

    Attributes:
        before: Where they were when it began.
        after: Where they are at its end.
        failed: Whether their simulation failed within it, (robot,) bool; where they are means
            nothing then.
        simulator: What they are simulated by, at the end of the action: a `CrawlingSimulator`, and
            of the others in ``crawling_simulator`` those whose attributes it has.
    """

    before: Place
    after: Place
    failed: np.ndarray
    simulator: Any

    @property
    def moved(self) -> Move:
        """How they moved, turning by less than half a circle."""
        return self.before.to(self.after)

    def mirrored(self) -> ActionMotion:
        """What their mirror images about the floor's forward axis did."""
        return replace(self, before=self.before.mirrored(), after=self.after.mirrored())


@dataclass(frozen=True)
class RewardTerm:
    """A term of a reward of one's own.

    Attributes:
        name: What it is called; what it was worth stands in a step's info as ``NAME_cm``.
        unit: Of its amount, such as ``degrees``.
        cm_per_unit: What a unit of it is worth [cm]; negative for a penalty.
        amount: Its amount for each robot [unit], (robot,), of an `ActionMotion`.
        depends_on_side: Whether a robot and its mirror image, doing the same, have other amounts:
            a turn to the left does, a turn to either side does not.
    """

    name: str
    unit: str
    cm_per_unit: float
    amount: Callable[[ActionMotion], np.ndarray]
    depends_on_side: bool = False

    def __post_init__(self) -> None:
        if not np.isfinite(self.cm_per_unit):
            raise ValueError(
                f"cm_per_unit of the term {self.name!r} is {self.cm_per_unit}, expected a number "
                f"of cm for each of its {self.unit}"
            )
        if not self.name.isidentifier():
            raise ValueError(
                f"the name of a term is {self.name!r}, expected one word of letters, digits and "
                "underscores"
            )

    @property
    def said(self) -> str:
        """What it is worth, for a person."""
        return f"{self.cm_per_unit:g} cm for each of {self.name} ({self.unit})"

    def worth_cm(self, motion: ActionMotion) -> tuple[np.ndarray, np.ndarray]:
        """What the robots get for it and what their mirror images would [cm], (robot,) each; 0 of
        robots whose simulation failed.

        Raises:
            ValueError: Amounts of another shape or that are not finite, or one that depends on the
                side and says that it does not.
        """
        own, image = (self._amount(each) for each in (motion, motion.mirrored()))
        if not self.depends_on_side and not np.allclose(own, image, rtol=1e-9, atol=1e-9):
            robot = int(np.argmax(np.abs(own - image)))
            raise ValueError(
                f"the term {self.name!r} is {own[robot]:g} {self.unit} of a robot and "
                f"{image[robot]:g} of its mirror image, expected the same of both, or "
                "depends_on_side = True"
            )
        return self.cm_per_unit * own, self.cm_per_unit * image

    def _amount(self, motion: ActionMotion) -> np.ndarray:
        count = len(motion.failed)
        found = np.asarray(self.amount(motion), dtype=np.float64)
        if found.shape != (count,):
            raise ValueError(
                f"the term {self.name!r} has amounts of shape {found.shape}, expected ({count},): "
                "one for each robot"
            )
        found = np.where(motion.failed, 0.0, found)
        if not np.isfinite(found).all():
            robot = int(np.flatnonzero(~np.isfinite(found))[0])
            raise ValueError(
                f"the term {self.name!r} is {found[robot]} {self.unit} of robot {robot}, whose "
                "simulation is sound, expected a finite number"
            )
        return found


def with_terms(
    terms: Sequence[RewardTerm], motion: ActionMotion, reward: np.ndarray, info: dict[str, Any]
) -> np.ndarray:
    """A step's reward with further terms [cm], (robot,); its info tells each of them, and what the
    mirror images get.

    Args:
        terms: What is added.
        motion: What the robots did in the step.
        reward: Without them [cm], (robot,).
        info: Of the step; changed.

    Raises:
        ValueError: As of `RewardTerm.worth_cm`.
    """
    image, told = np.asarray(info.get("mirrored_reward_cm", reward)), {}
    for term in terms:
        own_cm, image_cm = term.worth_cm(motion)
        reward, image = reward + own_cm, image + image_cm
        told[f"{term.name}_cm"] = own_cm
    told |= {"mirrored_reward_cm": image, "mirrored_with_cm": image, "rewarded_cm": reward}
    info |= told
    if "final_info" in info:
        info["final_info"] |= told
    return reward
