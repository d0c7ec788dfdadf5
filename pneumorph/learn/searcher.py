"""What a search over designs and gaits does: propose candidates, and be told how far they got."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np


@dataclass(frozen=True, eq=False)
class Candidates:
    """Designs with an open-loop gait each.

    Attributes:
        design: Index of each design in the space, shape (candidate,).
        action: Actions in [-1, 1], shape (candidate, action, regulator).
    """

    design: np.ndarray
    action: np.ndarray

    def __len__(self) -> int:
        return len(self.design)


class Searcher(Protocol):
    """Asked and told in turn; the same seed and the same distances give the same candidates."""

    def ask(self) -> Candidates:
        """Propose the next candidates."""

    def tell(self, distance_cm: np.ndarray) -> None:
        """Take the distances of the candidates asked for last [cm], shape (candidate,)."""

    def begin_in_other_worlds(self) -> None:
        """Distances told so far were of other worlds than those to come, and are no measure for
        them."""
