"""What the beginnings of a training saw and found, for the last of them to learn from.

Networks that learn anything early hardly leave it (Nikishin et al., *The Primacy Bias in Deep
Reinforcement Learning*, 2022, who draw new weights now and then and keep the replay buffer). So
does a training: what it finds is a matter of the gaits that it comes upon first. One that begins
with new weights and with what several others saw comes upon the gaits of them all, and finds the
designs that these are of, which are few among many, by what they scored.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from pneumorph.learn.design_distribution import DesignDistribution
from pneumorph.learn.design_gait_pair import DesignGaitPair
from pneumorph.learn.factored_distribution import FactoredDistribution
from pneumorph.learn.mirror import MirrorImage


class Pool:
    """Transitions of the beginnings that have ended, and scores of the designs they evaluated.

    Attributes:
        transitions: What the buffer of each held, see `ReplayBuffer.arrays`.
        scores_cm: Highest score of each design [cm], by its index; of one and the mirror image that
            it counts for, the lower index.
    """

    def __init__(self, twins: MirrorImage | None) -> None:
        """Hold nothing.

        Args:
            twins: Images of designs that count for them; None for none.
        """
        self._twins = twins
        self.transitions: list[dict[str, np.ndarray]] = []
        self.scores_cm: dict[int, float] = {}

    def add(self, transitions: Mapping[str, np.ndarray]) -> None:
        """Take up a copy of what a buffer holds at the end of its beginning."""
        self.transitions.append({name: np.array(values) for name, values in transitions.items()})

    def note(self, evaluated: Sequence[DesignGaitPair]) -> None:
        """Take up the scores of an evaluation's pairs, good and poor ones."""
        for pair in evaluated:
            design = pair.design
            if self._twins is not None:
                design = int(self._twins.once(np.array([design]))[0])
            self.scores_cm[design] = max(pair.score_cm, self.scores_cm.get(design, -np.inf))

    def best(self) -> list[int]:
        """Indices of the designs that were evaluated, the best first."""
        return sorted(self.scores_cm, key=lambda design: -self.scores_cm[design])

    def tell(self, distribution: DesignDistribution | FactoredDistribution) -> None:
        """Let a distribution over designs begin with the scores."""
        if self.scores_cm:
            designs = np.array([*self.scores_cm])
            images = None if self._twins is None else self._twins.designs(designs)
            distribution.know(designs, np.array([*self.scores_cm.values()]), images)
