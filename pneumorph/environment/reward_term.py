"""A term of a reward of one's own: what of a robot's motion counts, in its unit, and its worth.

    turning = RewardTerm("turning", "degrees", -0.1, lambda motion: abs(motion.moved.turn_deg))

A `TaskWrapper` with ``terms`` adds them to the reward.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from numbers import Real
from typing import Any

import numpy as np

from pneumorph.environment.crawling_simulator import CrawlingSimulator, TurningSimulator
from pneumorph.environment.place import Move, Place
from pneumorph.environment.reward import COSTS, GOAL_TERMS

_OF_IMAGES = ("mirrored_reward_cm", "mirrored_with_cm", "rewarded_cm")
"""What a step's info tells of the mirror images, see `TrainingEnvironment`."""

_ENTRIES = {
    "status": "status",
    "distance": "distance_cm",
    "achieved": "achieved",
    "command": "command_kPa",
    "final": "final_obs",
    **{entry.removesuffix("_cm"): entry for entry in (*GOAL_TERMS.values(), *COSTS, *_OF_IMAGES)},
}
"""What a step's info may have besides terms of one's own, by the name that none of these has."""


@dataclass(frozen=True, eq=False)
class ActionMotion:
    """What robots did within an action.

    Attributes:
        failed: Whether their simulation failed within it, (robot,) bool; where they are means
            nothing then.
    """

    _began: Place
    _ended: Place
    failed: np.ndarray
    _start: Place
    _simulator: Any = field(repr=False)

    @classmethod
    def of(
        cls,
        before: Place,
        after: Place,
        failed: np.ndarray,
        start: Place,
        simulator: CrawlingSimulator,
    ) -> ActionMotion:
        """The motion as a simulator knows it; sides and headings are NaN where it does not.

        Args:
            before: Where robots were, as the simulator tells it.
            after: Where they are, likewise.
            failed: Whether their simulation failed, (robot,) bool.
            start: Where they lay when their episode began, likewise.
            simulator: What they are simulated by, at the end of the action.
        """
        if not isinstance(simulator, TurningSimulator):
            unknown = np.full(len(failed), np.nan)
            before, after = (
                replace(each, left_mm=unknown, heading_deg=unknown) for each in (before, after)
            )
        return cls(before, after, failed, start, simulator)

    @property
    def before(self) -> Place:
        """Where they were when it began, as `after` tells it."""
        return self._began.since(self._start)

    @property
    def after(self) -> Place:
        """Where they are at its end: how far forward and to the left of where they lay after they
        were put down and had settled, along the axes of the floor. Where they face is told from its
        forward axis, also of those that are put down facing elsewhere; those that were tipped over
        all along face forward."""
        return self._ended.since(self._start)

    @property
    def moved(self) -> Move:
        """How they moved, turning by less than half a circle."""
        return self._began.to(self._ended)

    @property
    def tilt_deg(self) -> np.ndarray:
        """Angle between each hub's upward axis and the floor's normal at the end [degrees],
        (robot,)."""
        return self._known("tilt_deg")

    @property
    def hub_load_share(self) -> np.ndarray:
        """Share of the floor's normal force that each hub bears at the end, (robot,)."""
        return self._known("hub_load_share")

    @property
    def range_ratio(self) -> np.ndarray:
        """How far a leg has been from rest since the episode began, relative to the furthest state
        it was reduced from, (robot,)."""
        return self._known("range_ratio")

    def mirrored(self) -> ActionMotion:
        """What their mirror images about the forward axis through their start did."""
        return replace(
            self,
            _began=self._began.mirrored(),
            _ended=self._ended.mirrored(),
            _start=self._start.mirrored(),
        )

    def _known(self, name: str) -> np.ndarray:
        if not hasattr(self._simulator, name):
            raise ValueError(
                f"a term asks for {name}, which {type(self._simulator).__name__} does not know of "
                "its robots, expected a simulator that does"
            )
        return np.array(getattr(self._simulator, name), dtype=np.float64)


@dataclass(frozen=True)
class RewardTerm:
    """A term of a reward of one's own.

    Attributes:
        name: What it is called; what it was worth stands in a step's info as ``NAME_cm``. Names
            that the info may have itself, such as ``tilt``, are refused.
        unit: Of its amount, such as ``degrees``.
        cm_per_unit: What a unit of it is worth [cm]; negative for a penalty.
        amount: Its amount for each robot [unit], (robot,), of an `ActionMotion`; called twice for
            each action, for the robots and for their mirror images.
        depends_on_side: Whether a robot and its mirror image, doing the same, have other amounts:
            a turn to the left does, a turn to either side does not.
    """

    name: str
    unit: str
    cm_per_unit: float
    amount: Callable[[ActionMotion], np.ndarray]
    depends_on_side: bool = False

    def __post_init__(self) -> None:
        named = isinstance(self.name, str) and isinstance(self.unit, str)
        if not (named and isinstance(self.cm_per_unit, Real) and callable(self.amount)):
            raise TypeError(
                f"a term is {self!r:.120}, expected name and unit as text, cm_per_unit as a number "
                "and amount as a function of an ActionMotion"
            )
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
        if self.name in _ENTRIES:
            raise ValueError(
                f"a term is called {self.name!r}, and a step's info has {_ENTRIES[self.name]!r} "
                f"already, expected another name than {', '.join(sorted(_ENTRIES))}"
            )

    @property
    def said(self) -> str:
        """What it adds or takes off, for a person."""
        sign = "less" if self.cm_per_unit < 0.0 else "plus"
        return f"{sign} {abs(self.cm_per_unit):g} x {self.name} ({self.unit})"

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
        try:
            found = np.asarray(self.amount(motion), dtype=np.float64)
        except (AttributeError, TypeError) as error:
            raise ValueError(
                f"the amount of the term {self.name!r} fails: {error}; a motion has before and "
                "after (forward_mm, left_mm, heading_deg), moved (forward_mm, left_mm, turn_deg), "
                "failed, tilt_deg, hub_load_share and range_ratio"
            ) from error
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
                "simulation is sound, expected a finite number (sides and headings are NaN where "
                "the simulator does not know them)"
            )
        return found


def with_terms(
    terms: Sequence[RewardTerm],
    motion: ActionMotion,
    reward: np.ndarray,
    info: dict[str, Any],
    symmetric: bool,
) -> np.ndarray:
    """A step's reward with further terms [cm], (robot,); its info tells each of them, and what the
    mirror images get where that is something else, unless nobody knows it without these terms.

    Args:
        terms: What is added.
        motion: What the robots did in the step.
        reward: Without them [cm], (robot,).
        info: Of the step; changed.
        symmetric: Whether that rewards a robot and its mirror image alike.

    Raises:
        ValueError: A term has the name of another entry of the info, or as of
            `RewardTerm.worth_cm`.
    """
    had = "mirrored_reward_cm" in info
    sided = any(term.depends_on_side for term in terms)
    tell = (had or (symmetric and sided)) and not image_is_stale(info, reward)
    image, told = np.asarray(info.get("mirrored_reward_cm", reward)), dict[str, np.ndarray]()
    for term in terms:
        name = f"{term.name}_cm"
        if name in told:
            raise ValueError(f"two terms are called {term.name!r}, expected names of their own")
        if name in (*info, *_OF_IMAGES):
            raise ValueError(
                f"a term is called {term.name!r}, and a step's info has {name!r} already, expected "
                "another name"
            )
        own_cm, image_cm = term.worth_cm(motion)
        reward, image = reward + own_cm, image + image_cm
        told[name] = own_cm
    if tell:
        told |= dict(zip(_OF_IMAGES, (image, image, reward), strict=True))
    told |= {f"_{name}": np.ones(len(reward), dtype=bool) for name in tuple(told)}
    info |= told
    if "final_info" in info:
        ended = info.get("_final_info", np.ones(len(reward), dtype=bool))
        info["final_info"] |= {
            name: ended.copy() if name.startswith("_") else value for name, value in told.items()
        }
    return reward


def image_is_stale(info: Mapping[str, Any], reward: np.ndarray) -> bool:
    """Whether what a step's info tells of the mirror images belongs to another reward: a wrapper
    changed the robots' and not theirs.

    Args:
        info: Of the step.
        reward: What it brought [cm], (robot,).
    """
    rewarded_cm = info.get("rewarded_cm")
    untouched = info.get("mirrored_reward_cm") is info.get("mirrored_with_cm")
    # Single precision of a wrapper is no other reward.
    return rewarded_cm is not None and untouched and not np.allclose(reward, rewarded_cm)
