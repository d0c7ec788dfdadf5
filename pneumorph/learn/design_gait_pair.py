"""A design with a gait and how far it travels: what co-optimisation finds."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from pneumorph.environment.crawling_task import CrawlingTask
from pneumorph.gait.gait_file import write_gait
from pneumorph.gait.held_gait import HeldGait
from pneumorph.robot.design import Design
from pneumorph.robot.design_space import DesignSpace

SOURCES = ("policy", "exploration", "search", "before", "demonstration")


@dataclass(frozen=True, eq=False)
class DesignGaitPair:
    """A design, the pressures it is driven with, and the distance it was seen to travel.

    Attributes:
        design: Index in the design space.
        held_kPa: Real pressures, each held for one action [kPa], shape (action, regulator).
        distance_cm: Forward travel in one episode [cm]; where designs walk in several worlds, the
            mean over those of an evaluation, in which a failed simulation counts as zero, or less.
        score_cm: What it is ranked by [cm]: the return, which is the distance less what the reward
            takes off; where designs walk in several worlds, the objective over those of an
            evaluation.
        source: ``policy`` for the deterministic policy's gait, ``exploration`` for an episode of
            training, whose actions were drawn from the policy, ``search`` for a search without
            one, ``before`` for a gait of before a fine-tuning that did not better it,
            ``demonstration`` for one that learning was shown. Always a plain open-loop gait.
        timestep: Timestep of training, or of the search, at which it was seen.
        achieved: As `distance_cm` what of the task's goal it achieved [its unit].
    """

    design: int
    held_kPa: np.ndarray
    distance_cm: float
    score_cm: float
    source: str
    timestep: int
    achieved: float

    def gait(self, action_s: float, task: CrawlingTask | None = None) -> HeldGait:
        """The gait, with each action held for ``action_s`` [s], in a task's range of pressures."""
        return HeldGait.evenly(self.held_kPa, action_s, task)

    def write(self, path: Path, design: Design, action_s: float, task: CrawlingTask) -> None:
        """Write the gait with its design.

        Args:
            path: Where to write.
            design: What walks.
            action_s: How long an action is held [s].
            task: Whose range of pressures is accepted.
        """
        comments = {
            "design": str(design),
            "distance_cm": f"{self.distance_cm:.3f}",
            "source": self.source,
        }
        write_gait(path, self.gait(action_s, task), comments)


class BestPairs:
    """The pairs of highest score, one for each design, or for each up to mirror images."""

    def __init__(self, space: DesignSpace, count: int, mirrored: bool = True) -> None:
        """Keep at most ``count`` pairs.

        Args:
            space: The designs.
            count: How many.
            mirrored: Whether a design and its mirror image count as one.
        """
        self.count = count
        self._twin = space.twin if mirrored else int
        self.pairs: list[DesignGaitPair] = []

    @property
    def best_achieved(self) -> float | None:
        """What of the goal the best pair achieved [its unit]; None before the first."""
        return self.pairs[0].achieved if self.pairs else None

    @property
    def best_distance_cm(self) -> float | None:
        """Distance of the best pair [cm]; None before the first."""
        return self.pairs[0].distance_cm if self.pairs else None

    def is_worth_keeping(self, score_cm: float) -> bool:
        """Whether a pair of this score might enter the list."""
        return len(self.pairs) < self.count or score_cm > self.pairs[-1].score_cm

    def offer(self, pairs: Iterable[DesignGaitPair]) -> None:
        """Keep those among the pairs that belong among the best."""
        best: dict[int, DesignGaitPair] = {}
        for pair in [*self.pairs, *pairs]:
            twin = self._twin(pair.design)
            if twin not in best or pair.score_cm > best[twin].score_cm:
                best[twin] = pair
        ranked = sorted(best.values(), key=lambda pair: pair.score_cm, reverse=True)
        self.pairs = ranked[: self.count]

    def arrays(self) -> dict[str, np.ndarray]:
        """The pairs as arrays, for a checkpoint."""
        return {
            "design": np.array([pair.design for pair in self.pairs], dtype=np.int64),
            "held_kPa": np.array([pair.held_kPa for pair in self.pairs], dtype=np.float64),
            "distance_cm": np.array([pair.distance_cm for pair in self.pairs], dtype=np.float64),
            "score_cm": np.array([pair.score_cm for pair in self.pairs], dtype=np.float64),
            "source": np.array([SOURCES.index(pair.source) for pair in self.pairs], np.int64),
            "timestep": np.array([pair.timestep for pair in self.pairs], dtype=np.int64),
            "achieved": np.array([pair.achieved for pair in self.pairs], dtype=np.float64),
        }

    def restore(self, arrays: Mapping[str, np.ndarray]) -> None:
        """Take over what `arrays` gave."""
        # Neither is in those of earlier versions.
        scores = arrays.get("score_cm", arrays["distance_cm"])
        achieved = arrays.get("achieved", arrays["distance_cm"])
        self.pairs = [
            DesignGaitPair(
                int(arrays["design"][place]),
                arrays["held_kPa"][place],
                float(arrays["distance_cm"][place]),
                float(scores[place]),
                SOURCES[int(arrays["source"][place])],
                int(arrays["timestep"][place]),
                float(achieved[place]),
            )
            for place in range(len(arrays["design"]))
        ]
