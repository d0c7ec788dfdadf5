"""What a training has learned since it began from nothing."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from pneumorph.base.artefact import ArtefactError
from pneumorph.learn.design_distribution import DesignDistribution
from pneumorph.learn.factored_distribution import FactoredDistribution
from pneumorph.learn.mirror import MirrorImage
from pneumorph.learn.replay_buffer import ReplayBuffer
from pneumorph.learn.round_scores import RoundScores
from pneumorph.learn.sac import Sac
from pneumorph.learn.settings import CooptSettings


class Learned:
    """Networks, transitions to learn from, what is believed of designs, and chance to come.

    Attributes:
        state: Policy, values and their optimisers.
        buffer: The newest transitions, and those of earlier beginnings that are learned from.
        distribution: Of the designs.
        scores: Turn the returns of a round into scores.
        rng: Draws designs, first actions and batches.
    """

    def __init__(
        self,
        settings: CooptSettings,
        learner: Sac,
        state_size: int,
        twins: MirrorImage | None,
        seed: int,
        earlier: Sequence[Mapping[str, np.ndarray]] = (),
    ) -> None:
        """Know nothing but what was seen earlier: first weights, a uniform distribution.

        Args:
            settings: Those of the training.
            learner: Draws the weights.
            state_size: Length of what the policy sees beside the design.
            twins: Images of designs that count for them; None for none.
            seed: Of weights and draws.
            earlier: What the buffers of earlier beginnings held.
        """
        space = settings.space
        self.state = learner.initial_state(seed)
        self.buffer = ReplayBuffer(
            settings.buffer_size,
            state_size,
            settings.task.regulator_count,
            space.features,
            earlier,
        )
        self.distribution: DesignDistribution | FactoredDistribution = (
            FactoredDistribution(
                space, settings.schedule, settings.factored, settings.mirrored_scores
            )
            if settings.is_factored
            else DesignDistribution(
                len(space), settings.schedule, space.twin if settings.mirrored_scores else int
            )
        )
        self.scores = RoundScores(settings.objective, twins)
        self.rng = np.random.default_rng(seed)

    def arrays(self) -> dict[str, np.ndarray]:
        """All arrays, for a checkpoint."""
        return {
            **{f"sac/{name}": value for name, value in self.state.arrays().items()},
            **{f"buffer/{name}": value for name, value in self.buffer.arrays().items()},
            **{f"distribution/{name}": value for name, value in self.distribution.arrays().items()},
        }

    def metadata(self) -> dict[str, Any]:
        """All that are no arrays, for a checkpoint."""
        return {
            "round_level": self.scores.level.state(),
            "random_state": json.dumps(self.rng.bit_generator.state),
        }

    def restore(self, arrays: Mapping[str, np.ndarray], metadata: Mapping[str, Any]) -> None:
        """Take over what `arrays` and `metadata` gave.

        Raises:
            ArtefactError: The networks of the checkpoint have other shapes.
            KeyError, TypeError, ValueError: Something is missing or of another type.
        """
        self.state = self.state.restored(below(arrays, "sac/"))
        self.buffer.restore(below(arrays, "buffer/"))
        self.distribution.restore(below(arrays, "distribution/"))
        if "round_level" in metadata:  # not in checkpoints of an earlier version
            self.scores.level.restore(metadata["round_level"])
        try:
            self.rng.bit_generator.state = json.loads(metadata["random_state"])
        except (ValueError, LookupError, TypeError) as error:
            raise ArtefactError(
                f"random_state of the checkpoint is {metadata['random_state'][:80]!r}, expected "
                f"the state of a {type(self.rng.bit_generator).__name__} generator as JSON"
            ) from error


def below(arrays: Mapping[str, np.ndarray], prefix: str) -> dict[str, np.ndarray]:
    """The arrays whose names begin so, by the rest of their names."""
    return {
        name.removeprefix(prefix): value
        for name, value in arrays.items()
        if name.startswith(prefix)
    }
