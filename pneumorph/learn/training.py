"""Joint optimisation of design and control (paper, algorithm 1)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import jax
import numpy as np

from pneumorph.base.artefact import reading
from pneumorph.base.progress import ProgressReport
from pneumorph.base.stage_clock import StageClock
from pneumorph.environment.training_environment import EnvironmentFactory, ToldStep
from pneumorph.learn.checkpoint import KIND, Checkpoint
from pneumorph.learn.demonstrations import FirstRound, check_room, first_round
from pneumorph.learn.design_gait_pair import BestPairs, DesignGaitPair
from pneumorph.learn.environments import (
    check_judged,
    check_observation,
    check_shape,
    state_size,
)
from pneumorph.learn.failed_walks import failing_reward_cm
from pneumorph.learn.learned import Learned, below
from pneumorph.learn.mirror import MirrorImage
from pneumorph.learn.pool import Pool
from pneumorph.learn.ranking import Ranking
from pneumorph.learn.round_scores import ScoredRound
from pneumorph.learn.sac import Sac
from pneumorph.learn.settings import CooptSettings
from pneumorph.learn.transitions import Transitions, check_mirrored, last_observation

STAGES = ("simulate", "learn", "log", "evaluate")
"""Where a training's time goes: the robots, drawing actions and updating the networks, metrics and
checkpoints, deterministic evaluations."""


class Training:
    """The state of co-optimisation, advanced by rounds of one episode per robot.

    Between rounds every robot stands at the start of an episode, so what `arrays` and `metadata`
    give is all there is: no simulator state needs saving for a run to go on to the same bits.
    """

    def __init__(
        self,
        make_environment: EnvironmentFactory,
        settings: CooptSettings,
        make_judged: EnvironmentFactory | None = None,
        demonstrations: Sequence[DesignGaitPair] = (),
    ) -> None:
        """Initialise policy, values and a uniform design distribution (algorithm 1, line 1).

        Args:
            make_environment: Makes the environment that the designs live in, such as `crawling`.
            settings: Everything else.
            make_judged: Makes the environment that evaluations walk in, if designs are ranked by
                these alone (`Objective.is_robust`); None for one that is made as that of learning.
            demonstrations: Gaits that are known, see `known_pair`: half of the designs of each
                beginning's first round walk them.

        Raises:
            ValueError: An environment has other robots, actions or designs than the settings, more
                gaits are shown than the first round has room for, or
                mirror images of its states are not known; that of the evaluations has other states
                than that of learning, or gaits count as they are seen while it is another.
        """
        self.settings = settings
        self.space = settings.space
        self.demonstrations = tuple(demonstrations)
        check_room(self.demonstrations, settings)
        some = self.space.some(settings.environment_count)
        self.environment = make_environment(some)
        self._state_size = state_size(self.environment, settings)
        self.judged = self.environment
        """Where designs are walked to be ranked."""
        if make_judged is not None or len(some) > settings.judged_robot_count:
            self.judged = (make_judged or make_environment)(some[: settings.judged_robot_count])
            check_judged(self.judged, self.environment, settings)
        self.learner = Sac(
            self._state_size + self.space.feature_count,
            settings.task.regulator_count,
            settings.sac,
        )
        symmetric = self.environment.is_symmetric
        self.best = BestPairs(self.space, settings.kept_pair_count, symmetric)
        self._mirror = MirrorImage(self.space) if settings.mirror_transitions else None
        # What a design gets is what its image gets: not so where it turns to a side.
        self._twins = self._mirror if settings.mirrored_scores else None
        self.restart = 0
        self.timestep = 0
        self.pool = Pool(self._twins)
        self.learned = self._nothing()
        self.restart_scores_cm: list[float | None] = []
        """Score of the best pair at the end of each beginning; None where none came to its end."""
        self.update_count = 0
        self.failure_count = 0
        self.clock = StageClock()
        self.ranking = Ranking(settings, self.environment, self.judged, self.best, self.clock)
        self._reset = self.clock.timed("simulate", self.environment.reset)
        self._step = self.clock.timed("simulate", self.environment.step)
        # Drawing actions waits for the updates before it: both are learning.
        self._act = self.clock.timed("learn", self._actions)
        self._learn = self.clock.timed("learn", self._updates)

    def _nothing(self) -> Learned:
        """What is known where the present beginning begins."""
        seed = restart_seed(self.settings.seed, self.restart)
        # What follows the training, fine-tuning, learns from what its own beginning saw.
        earlier = self.pool.transitions if self._is_pooled and not self.is_finished else ()
        return Learned(self.settings, self.learner, self._state_size, self._twins, seed, earlier)

    @property
    def _is_pooled(self) -> bool:
        """Whether the present beginning learns from what those before it saw."""
        return self.restart >= max(self.settings.restarts - self.settings.pooled_restarts, 1)

    @property
    def pooling_follows(self) -> bool:
        """Whether a beginning after the present one learns from what this one sees."""
        return self.restart < self.settings.restarts - 1 and self.settings.pooled_restarts > 0

    @property
    def _worlds_number(self) -> int:
        """What the physics of the next round are drawn by, where they are drawn: a resumed run sees
        those that it would have seen. Each beginning has its time in the nominal world."""
        objective = self.settings.objective
        if objective.is_robust and objective.worlds_at(self.learned_timesteps) == 1:
            return self.learned_timesteps
        return self.timestep

    def begin_again(self) -> None:
        """Forget what was learned, but not the best pairs. What was seen is kept if a later
        beginning learns from it; one that does learns from it before its robots walk."""
        if self.pooling_follows:
            self.pool.add(self.learned.buffer.arrays())
        self.restart += 1
        self.learned = self._nothing()
        if self.learned.buffer.earlier_count:
            for _ in range(self.settings.first_learning_steps):
                self._learn(self.settings.updates_per_vector_step)
            self.pool.tell(self.learned.distribution)

    def go_on_as(self, checkpoint: Checkpoint) -> None:
        """Take over what was learned by the end of another beginning; all else stays.

        Raises:
            ArtefactError: The checkpoint is damaged, or of a training with other settings.
        """
        self.pool.transitions.clear()
        self.learned = self._nothing()
        with reading(checkpoint.path, KIND):
            self.learned.restore(checkpoint.arrays, checkpoint.metadata)

    @property
    def is_finished(self) -> bool:
        """Whether the last round has been made."""
        return self.timestep >= self.settings.training_timesteps

    @property
    def learned_timesteps(self) -> int:
        """Timesteps since learning last began from nothing."""
        return self.timestep - self.restart * self.settings.restart_timesteps

    @property
    def is_restart_over(self) -> bool:
        """Whether the last round from this beginning has been made."""
        return self.learned_timesteps >= self.settings.restart_timesteps

    def run_round(self) -> dict[str, Any]:
        """Draw designs, let each walk one episode, learn meanwhile, and update the distribution.

        Returns:
            Metrics of the round.
        """
        # Algorithm 1, line 3.
        worlds = self.settings.objective.worlds_at(self.learned_timesteps)
        learned, count = self.learned, self.settings.environment_count // worlds
        designs, first = learned.distribution.sample(count, learned.rng), None
        # A beginning that learns from those before knows what they were shown, and what has become
        # of it.
        shows = self.learned_timesteps == 0 and not learned.buffer.earlier_count
        if self.demonstrations and shows:
            # A stream of its own: what is not shown does as it does without.
            rng = np.random.default_rng([self.settings.seed, self.timestep, 1])
            first = first_round(self.demonstrations, designs, worlds, self.settings.task, rng)
            designs = first.designs
        # Robot i walks in world i modulo their number, so each design in all of them.
        returns, failed, losses = self.walk_and_learn(
            np.repeat(designs, worlds), self.settings.updates_per_vector_step, first
        )
        # How hard the round was, designs that were drawn say.
        apart = {pair.design for pair in self.demonstrations} if first else ()
        found = learned.scores.of(designs, returns, failed, apart)
        self._update_distribution(found)
        self.failure_count += int(failed.sum())
        return self._metrics(returns, failed, losses) | found.metrics

    def walk_and_learn(
        self, designs: np.ndarray, update_count: int, first: FirstRound | None = None
    ) -> tuple[np.ndarray, np.ndarray, list[dict[str, jax.Array]]]:
        """Let each robot walk an episode with a design's index, and learn after each action.

        Args:
            designs: Index of each robot's design, shape (robot,).
            update_count: Updates of the learner after each action of all robots together.
            first: What the last robots do instead of what the policy says, where gaits are shown.

        Returns:
            Return of each robot [cm] (robot,), whether its simulation failed (robot,), and the
            learner's metrics after each action.

        Raises:
            ValueError: The environment tells arrays of other shapes or numbers that are not finite,
                or learning diverged.
        """
        observation, _ = self._reset(
            seed=self._worlds_number,
            options={"designs": [self.space[int(index)] for index in designs]},
        )
        observed = (len(designs), self._state_size + self.space.feature_count)
        check_observation(self.environment, "observation of reset", observation, observed)
        returns, distances, achieved = np.zeros((3, len(designs)))
        ended, failed = np.zeros((2, len(designs)), dtype=bool)
        commands, losses = [], []
        for number in range(self.settings.task.action_count):
            # Line 4: control the designs, and add the transitions to the replay buffer.
            action = self._act(observation)
            if first is not None:
                others = action[: -len(first.exact)]
                action = np.concatenate([others, first.action[number]], dtype=np.float32)
            next_observation, reward, terminated, truncated, info = self._step(action)
            check_observation(self.environment, "observation", next_observation, observed)
            check_shape(self.environment, "reward", reward, observed[:1])
            told = ToldStep.of(info, action, reward, self.settings.task)
            seen = last_observation(self.environment, next_observation, info)
            check_observation(self.environment, 'info["final_obs"]', seen, observed)
            state, next_state = (each[:, : self._state_size] for each in (observation, seen))
            self._store(
                Transitions(state, designs, action, reward, next_state, terminated), info, told
            )
            returns += np.where(ended, 0.0, reward)
            distances += np.where(ended, 0.0, told.distance_cm)
            achieved += np.where(ended, 0.0, told.achieved)
            failed |= ~ended & told.failed
            ended |= terminated | truncated
            commands.append(told.command_kPa)
            observation = next_observation
            self.timestep += len(designs)
            # Line 5.
            loss = self._learn(update_count)
            if loss:
                losses.append(loss)
        found = ~failed
        if first is not None:  # what is shown is not found: it is walked with the others at the end
            found[-len(first.exact) :] &= ~first.exact
        self._note_pairs(designs, distances, achieved, returns, found, np.array(commands))
        return returns, failed, losses

    def _actions(self, observation: np.ndarray) -> np.ndarray:
        """Actions from the policy, or uniform ones until learning starts."""
        if self._is_warming_up:
            shape = (len(observation), self.settings.task.regulator_count)
            return self.learned.rng.uniform(-1.0, 1.0, shape).astype(np.float32)
        self.learned.state, action = self.learner.sample_actions(self.learned.state, observation)
        self._check_learning({"the policy's action": action})
        return action

    def _store(self, seen: Transitions, info: Mapping[str, Any], told: ToldStep) -> None:
        learned, stored = self.learned, [seen]
        if self._mirror is not None:
            check_mirrored(self.environment, info, told)
            stored.append(seen.image(self._mirror, told.mirrored_reward_cm))
        if told.failed.any():
            rewards = [each.reward[~told.failed] for each in stored]
            reward_cm = failing_reward_cm(
                np.concatenate([learned.buffer.rewards_of_going_on, *rewards]),
                self.settings.sac.discount,
                self.settings.task.action_count,
            )
            stored = [each.failing(told.failed, reward_cm) for each in stored]
        for each in stored:
            learned.buffer.add(**vars(each))

    @property
    def _is_warming_up(self) -> bool:
        """Whether the policy knows too little to be followed, or to learn from."""
        early = self.learned_timesteps < self.settings.learning_start_timestep
        return early and not self.learned.buffer.earlier_count

    def _updates(self, count: int) -> dict[str, jax.Array]:
        if count == 0 or self._is_warming_up:
            return {}
        learned = self.learned
        batches = learned.buffer.sample(count, self.settings.sac.batch_size, learned.rng)
        learned.state, metrics = self.learner.update(learned.state, batches)
        self._check_learning(metrics)
        self.update_count += count
        return metrics

    def _check_learning(self, told: Mapping[str, Any]) -> None:
        """Refuse to go on where a number of the learner is not finite.

        Raises:
            ValueError: One is not.
        """
        for name, values in told.items():
            wrong = np.asarray(values)[~np.isfinite(values)]
            if wrong.size:
                sac = self.settings.sac
                raise ValueError(
                    f"learning diverged at timestep {self.timestep}: {name} is {wrong[0]}, "
                    "expected finite numbers; begin anew with lower learning rates "
                    f"(sac.critic_learning_rate is {sac.critic_learning_rate:g}, "
                    f"sac.policy_learning_rate {sac.policy_learning_rate:g}), or with rewards of "
                    "some centimetres an action where the reward is your own"
                )

    def _note_pairs(
        self,
        designs: np.ndarray,
        distances: np.ndarray,
        achieved: np.ndarray,
        returns: np.ndarray,
        found: np.ndarray,
        commands: np.ndarray,
    ) -> None:
        if self.settings.objective.is_robust:
            return  # each went in one world: nothing to rank by
        self.best.offer(
            DesignGaitPair(
                int(designs[robot]),
                commands[:, robot],
                float(distances[robot]),
                float(returns[robot]),
                "exploration",
                self.timestep,
                float(achieved[robot]),
            )
            for robot in np.flatnonzero(found)
            if self.best.is_worth_keeping(float(returns[robot]))
        )

    def _update_distribution(self, found: ScoredRound) -> None:
        """Lines 6 to 9 of algorithm 1, with the scores of a round's designs."""
        designs, scores_cm = found.designs, found.scores_cm
        images = None if self._twins is None else self._twins.designs(designs)
        self.learned.distribution.take_round(
            designs, scores_cm, found.failing, images, found.in_worlds
        )
        if (
            self.settings.expected_scores
            and self.learned_timesteps >= self.settings.schedule.decay_start_timestep
        ):
            # What a failure counts for is no measure of what the critic expects.
            sound = ~found.failing
            self.learned.distribution.expect(
                lambda among: self.expected_returns(designs[sound], scores_cm[sound], among),
                self.learned.rng,
            )
        self.learned.distribution.follow_schedule(self.learned_timesteps)

    def expected_returns(
        self, designs: np.ndarray, returns: np.ndarray, among: np.ndarray | None = None
    ) -> np.ndarray:
        """Return what the critic expects of designs [cm], shape (design,).

        Its values are discounted and count entropy as well: they are scaled so that those of the
        designs that just walked, without a failure, add up to their returns.

        Args:
            designs: Index of each design that walked, shape (n,).
            returns: Their returns [cm], shape (n,).
            among: Indices of the designs that are asked for; None for every design.
        """
        if among is None:
            values = self._values(np.arange(len(self.space)))
            walked = values[designs].sum()
        else:
            values = self._values(np.concatenate([among, designs]))
            values, walked = values[: len(among)], values[len(among) :].sum()
        travelled = returns.sum()
        if walked <= 0.0 or travelled <= 0.0:
            return np.full(len(values), -np.inf)
        return values * (travelled / walked)

    def _values(self, designs: np.ndarray) -> np.ndarray:
        """What the critic expects of designs at the start of an episode, (n,), in its measure."""
        features = self.space.features(designs)
        # Every episode begins with no action to remember.
        start = np.zeros((len(features), self._state_size), np.float32)
        observation = np.concatenate([start, features.astype(np.float32)], axis=1)
        return self.learner.values(self.learned.state, observation).astype(float)

    def _metrics(
        self, returns: np.ndarray, failed: np.ndarray, losses: list[dict[str, jax.Array]]
    ) -> dict[str, Any]:
        distribution = self.learned.distribution
        learning = {
            name: float(np.mean([loss[name] for loss in losses]))
            for name in (losses[0] if losses else ())
        }
        return {
            "timestep": self.timestep,
            "restart": self.restart,
            "return_mean_cm": float(returns.mean()),
            "return_maximum_cm": float(returns.max()),
            "best_distance_cm": self.best.best_distance_cm,
            "best_achieved": self.best.best_achieved,
            "failed_count": int(failed.sum()),
            "design_entropy": distribution.entropy,
            "design_entropy_target": distribution.target_entropy(self.learned_timesteps),
            "inverse_temperature": distribution.inverse_temperature,
            "update_count": self.update_count,
            **learning,
            **{f"{stage}_s": self.clock.seconds[stage] for stage in STAGES},
            **distribution.said(),
        }

    def evaluate(self, progress: ProgressReport | None = None) -> list[DesignGaitPair]:
        """Walk the designs that may be the best with the deterministic policy and keep good pairs:
        those of the highest scores, those that the critic expects most of, and those that were the
        best of earlier beginnings where one learns from them, until the end of it was evaluated.

        Returns:
            The pairs walked, the highest score first.
        """
        # Not by what its buffer holds: one that goes on after its last round has forgotten that.
        knows_earlier = self._is_pooled and len(self.restart_scores_cm) <= self.restart
        designs = self.learned.distribution.candidates(
            self.settings.evaluated_design_count,
            self._values if self.update_count else None,
            # A stream of its own: a round draws the same whether it was evaluated before.
            np.random.default_rng([self.settings.seed, self.timestep]),
            self.pool.best() if knows_earlier else (),
        )
        return self.ranking.of_policy(
            self.learner, self.learned.state.policy, designs, self.timestep, progress
        )

    def evaluate_shown(self) -> list[DesignGaitPair]:
        """Walk the gaits that were shown where designs are ranked, and keep good pairs.

        Returns:
            The best of each design, the highest score first.
        """
        return self.ranking.of_gaits(self.demonstrations)

    def arrays(self) -> dict[str, np.ndarray]:
        """All arrays of the state, for a checkpoint."""
        return {
            **self.learned.arrays(),
            **{f"best/{name}": value for name, value in self.best.arrays().items()},
        }

    def metadata(self) -> dict[str, Any]:
        """All numbers of the state that are not arrays, for a checkpoint."""
        return {
            "timestep": self.timestep,
            "restart": self.restart,
            "restart_scores_cm": list(self.restart_scores_cm),
            "found": [*self.pool.scores_cm.items()],
            "update_count": self.update_count,
            "failure_count": self.failure_count,
            "evaluation_timesteps": self.ranking.timesteps,
            "seconds": dict(self.clock.seconds),
            **self.learned.metadata(),
        }

    def take_over(self, checkpoint: Checkpoint) -> None:
        """Go on from a checkpoint.

        Raises:
            ArtefactError: It is damaged, or of a training with other settings.
        """
        with reading(checkpoint.path, KIND):
            self.restore(checkpoint.arrays, checkpoint.metadata)

    def restore(self, arrays: Mapping[str, np.ndarray], metadata: Mapping[str, Any]) -> None:
        """Take over what `arrays` and `metadata` gave.

        Raises:
            ArtefactError: The networks of the checkpoint have other shapes.
            KeyError, TypeError, ValueError: Something is missing or of another type.
        """
        self.timestep = int(metadata["timestep"])
        # Not in checkpoints of an earlier version, as the scores.
        self.restart = int(metadata.get("restart", 0))
        del self.pool.transitions[self.restart :]
        self.pool.scores_cm = {int(design): score for design, score in metadata.get("found", [])}
        self.learned = self._nothing()
        self.learned.restore(arrays, metadata)
        self.best.restore(below(arrays, "best/"))
        self.restart_scores_cm = list(metadata.get("restart_scores_cm", []))
        self.update_count = int(metadata["update_count"])
        self.failure_count = int(metadata["failure_count"])
        self.ranking.timesteps = metadata.get("evaluation_timesteps")
        self.clock.clear()
        self.clock.seconds.update(metadata["seconds"])


def restart_seed(seed: int, restart: int) -> int:
    """Seed of a training's beginning: the training's own of the first."""
    drawn = np.random.SeedSequence([seed, restart]).generate_state(1)[0]
    return int(drawn >> 1) if restart else seed  # settings may have such seeds
