"""Walks that rank designs and gaits, which nothing is learned from."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from pneumorph.base.progress import ProgressReport
from pneumorph.base.stage_clock import StageClock
from pneumorph.environment.training_environment import TrainingEnvironment
from pneumorph.learn.design_gait_pair import BestPairs, DesignGaitPair
from pneumorph.learn.evaluated_gaits import best_of_each_design
from pneumorph.learn.evaluation import evaluate_policy, evaluation_timesteps
from pneumorph.learn.networks import Policy
from pneumorph.learn.objective import Objective
from pneumorph.learn.sac import Sac
from pneumorph.learn.settings import CooptSettings


class Ranking:
    """Walks candidates by a training's objective, and counts what that takes.

    Attributes:
        timesteps: Actions of all robots so far, which a training's own timesteps do not count; None
            where an earlier version began, which did not count them.
    """

    def __init__(
        self,
        settings: CooptSettings,
        environment: TrainingEnvironment,
        judged: TrainingEnvironment,
        best: BestPairs,
        clock: StageClock,
    ) -> None:
        """Rank nothing yet.

        Args:
            settings: Those of the training.
            environment: Where robots learn; many candidates walk there first.
            judged: Where designs are ranked.
            best: Is offered every pair that was ranked.
            clock: Is told the time, as that of the stage ``evaluate``.
        """
        self.timesteps: int | None = 0
        self._settings, self._best = settings, best
        self._environment, self._judged = environment, judged
        self._evaluate_policy = clock.timed("evaluate", evaluate_policy)
        self._best_of_each_design = clock.timed("evaluate", best_of_each_design)

    def of_policy(
        self,
        learner: Sac,
        policy: Policy,
        designs: np.ndarray,
        timestep: int,
        progress: ProgressReport | None = None,
    ) -> list[DesignGaitPair]:
        """Walk designs with a policy's deterministic actions, and offer the pairs.

        Args:
            learner: Gives the policy's actions.
            policy: The policy.
            designs: Indices of designs, (design,); of more than the settings rank, those that do
                best in few worlds.
            timestep: Of the training, noted in the pairs.
            progress: Told how far the walks are.

        Returns:
            The pairs walked, the highest score first.
        """

        def walked(
            where: TrainingEnvironment, which: np.ndarray, objective: Objective
        ) -> list[DesignGaitPair]:
            self._count(len(which), objective)
            return self._evaluate_policy(
                where,
                self._settings.space,
                policy,
                learner,
                which,
                timestep=timestep,
                progress=progress,
                objective=objective,
            )

        objective = self._settings.objective
        if len(designs) > self._settings.ranked_design_count:
            few = replace(objective, evaluation_worlds=objective.first_worlds)
            designs = self._shortlist(designs, walked(self._environment, designs, few))
        return self._offered(walked(self._judged, designs, objective))

    def of_gaits(self, pairs: Sequence[DesignGaitPair]) -> list[DesignGaitPair]:
        """Walk gaits that are known, and offer the best of each design.

        Args:
            pairs: Designs and gaits; what they say of distances is not used.

        Returns:
            The best of each design, the highest score first.
        """
        settings = self._settings
        self._count(len(pairs), settings.objective)
        walked = self._best_of_each_design(pairs, self._judged, settings.space, settings.objective)
        return self._offered(list(walked.values()))

    def _shortlist(self, designs: np.ndarray, walked: list[DesignGaitPair]) -> np.ndarray:
        """Those of the highest scores, one of a design and its image where these count as one, in
        the order of before."""
        settings = self._settings
        best = BestPairs(
            settings.space, settings.ranked_design_count, self._environment.is_symmetric
        )
        best.offer(walked)
        return designs[np.isin(designs, [pair.design for pair in best.pairs])]

    def _offered(self, pairs: list[DesignGaitPair]) -> list[DesignGaitPair]:
        self._best.offer(pairs)
        return sorted(pairs, key=lambda pair: pair.score_cm, reverse=True)

    def _count(self, count: int, objective: Objective) -> None:
        if self.timesteps is not None:
            self.timesteps += evaluation_timesteps(count, objective, self._settings.task)
