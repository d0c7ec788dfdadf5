"""Which of several walks achieved most."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Protocol, TypeVar


class Walked(Protocol):
    """What walked again, perhaps in another physics."""

    @property
    def achieved(self) -> float | None: ...


WalkedAgain = TypeVar("WalkedAgain", bound=Walked)


def furthest(walked: Sequence[WalkedAgain]) -> WalkedAgain:
    """Return what achieved most of its goal, the first of them where all failed.

    A run's best pair need not be the best in another physics, or as finite elements.

    Args:
        walked: One or more, in the run's order.
    """
    return max(walked, key=lambda each: -math.inf if each.achieved is None else each.achieved)
