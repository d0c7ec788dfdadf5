"""Every option of co-optimisation, with the presets of the paper, a quick and a fast one."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Annotated, Any, Literal

import tyro

from pneumorph.base.checked import Bounds, Checked, Count, CountOrNone
from pneumorph.base.settings import settings_to_dict
from pneumorph.environment.crawling_task import CrawlingTask
from pneumorph.learn.design_distribution import EntropySchedule
from pneumorph.learn.factored_distribution import FactoredSettings
from pneumorph.learn.objective import Objective, check_worlds_fit
from pneumorph.learn.sac import SacSettings
from pneumorph.robot.design_space import DesignSpace


@dataclass(frozen=True)
class FinetuningSettings(Checked):
    """Fine-tuning: after training, the policy is trained further for each of the best designs
    alone. The paper gives no numbers."""

    finalist_count: Count = 8
    """Number of designs that are fine-tuned, each from the policy at the end of training; with
    --restarts at most as many as an evaluation walks."""
    timesteps: CountOrNone = 19_200
    """Actions of all robots together for each of them, rounded up to whole episodes; 0: no
    fine-tuning."""
    updates_per_vector_step: Count = 16
    """Learner updates after each action of all robots together."""

    def round_count(self, timesteps_per_round: int) -> int:
        """Episodes of every robot for each finalist."""
        return math.ceil(self.timesteps / timesteps_per_round)


ROBUST_OBJECTIVE = Objective(
    "mean_minus_deviations", deviations=1.0, worlds_per_design=4, centring_rounds=8
)
"""Of robots in worlds that may be: about what a sixth of the worlds fall short of."""


@dataclass(frozen=True)
class CooptSettings(Checked):
    """Co-optimisation of design and gait; the defaults are the paper's experiment."""

    seed: CountOrNone = 0
    """Seed of every random number."""
    environment_count: Count = 96
    """Robots simulated side by side (paper, appendix A). More use the processors better; a round is
    one episode of each."""
    total_timesteps: Count = 1_000_000
    """Actions of all robots together, rounded up to whole episodes (paper, appendix A); with
    --restarts, those of each beginning."""
    restarts: Count = 1
    """How often learning begins from nothing, one time after another (not in the paper). What a
    training finds depends on the gaits that it comes upon first; of several beginnings the one
    whose policy has the best pair at its end is kept and fine-tuned, and the best pairs of all are
    reported. All other timesteps of these settings count from each beginning."""
    pooled_restarts: CountOrNone = 0
    """How many of these beginnings, the last ones, learn from what all before them saw as well (not
    in the paper; never the first, so that all others do where fewer are left): with new weights,
    but from the transitions of all, which they learn from before their robots walk, too, and
    knowing what their best designs scored. So they come upon the robots of all, and go on from
    there. Of a factored distribution the best designs are only candidates in the evaluation."""
    space: DesignSpace = field(default_factory=DesignSpace)
    """Designs to choose from."""
    task: CrawlingTask = field(default_factory=CrawlingTask)
    """What the robots are asked to do."""
    sac: SacSettings = field(default_factory=SacSettings)
    """Hyperparameters of the learner."""
    schedule: EntropySchedule = field(default_factory=EntropySchedule)
    """How the design distribution narrows."""
    distribution: Literal["by_size", "enumerated", "factored"] = "by_size"
    """How the distribution scores designs. `enumerated`: one score for each design (the paper).
    `factored`: a weight for each option of each location, which needs no list of designs (not in
    the paper). `by_size`: enumerated up to 100 000 designs."""
    factored: FactoredSettings = field(default_factory=FactoredSettings)
    """Weights of the factored distribution; no effect on an enumerated one."""
    finetuning: FinetuningSettings = field(default_factory=FinetuningSettings)
    """Fine-tuning of the best designs after training."""
    objective: Objective = field(default_factory=Objective)
    """How distances in several worlds become one score."""
    buffer_size: Count = 100_000
    """Transitions kept for learning (paper, appendix A); those of earlier beginnings that
    --pooled-restarts learns from come on top."""
    learning_start_timestep: Count = 10_000
    """Timestep of the first update; actions are uniform until then (paper, appendix A)."""
    updates: CountOrNone = 1
    """Number of learner updates each time, see --update-every (paper, appendix A)."""
    update_every: Literal["vector_step", "timestep"] = "vector_step"
    """When the learner updates; the paper's "timesteps per SAC update: 1" can be read in two ways.
    `vector_step`: after each action of all robots together (the authors' experiment). `timestep`:
    once for each action of each robot."""
    mirror_transitions: bool = False
    """Also learn from the mirror image of each transition and return, since a mirrored design walks
    the mirrored path (not in the paper). If the goal lies to one side, the image's transitions get
    the reward that it would earn, and returns count only for the design itself."""
    sided_reward: Annotated[bool, tyro.conf.Fixed, tyro.conf.Suppress] = False
    """Whether a task of one's own rewards a robot and its mirror image differently, so that what a
    design gets does not count for the image; `pneumorph.train` sees it by the terms of a class."""
    expected_scores: bool = False
    """Once the entropy falls, score a design at no less than the critic expects of it (not in the
    paper). The published score is the newest return, which says nothing about designs that never
    walked, and little about those that walked when the policy was worse."""
    learning_modes: CountOrNone = 0
    """Most modes of each leg while robots learn, for each of its cavities; 0 for all that it has
    (the paper). Fewer make a robot's step cheaper and its walks a little different, so no gait
    counts for what it did then: the pairs of an evaluation, finalists and everything after the
    training walk with all modes, and only a shortlist (--shortlist-count) is made with these. No
    effect where designs walk in one world each, whose gaits count as they are seen,
    nor on legs that do not know the range of their snapshots."""
    learning_tolerance: Annotated[float, Bounds(least=0.0, below=1.0)] = 0.0
    """Relative residual of forces at which legs have enough of their sampled points while robots
    learn; they are chosen when learning begins. 0 for all points that they have (the paper). Fewer
    make a step cheaper still; as with --learning-modes, no gait counts for what it did then, and
    there is no effect where designs walk in one world each. Other reductions that worlds may have
    keep their points."""
    checkpoint_interval_timesteps: Count = 50_000
    """Maximum timesteps between checkpoints, which is what a killed run may lose; at least one
    round."""
    evaluation_interval_timesteps: CountOrNone = 0
    """Timesteps between deterministic evaluations; 0 for a single one at the end."""
    evaluated_design_count: Count = 96
    """Number of designs that an evaluation walks with the deterministic policy: by turns those of
    the highest scores, those that the critic expects most of, and, where a beginning learns from
    earlier ones, the best of theirs."""
    shortlist_count: CountOrNone = 0
    """Number of these that walk in all worlds of an evaluation, where designs walk in several:
    first all walk in a quarter of them, at least as many as each design has in a round, as robots
    learn (--learning-modes, --learning-tolerance), and those that do best go on, at least as many
    as are reported or fine-tuned. 0: all go on."""
    kept_pair_count: Count = 5
    """Number of best design-gait pairs to report; a design and its mirror image count as one."""

    @classmethod
    def implied(cls, content: Mapping[str, Any], below: Mapping[str, Any]) -> dict[str, Any]:
        """Of whole settings, as a run keeps them, what an earlier version did not name is as it was
        then, whatever they are laid over: the default."""
        whole = {"seed", "environment_count", "total_timesteps", "buffer_size", "updates"}
        if whole <= content.keys():
            return settings_to_dict(cls())
        return {}

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.space.regulator_count != self.task.regulator_count:
            raise ValueError(
                f"the design space has {self.space.regulator_count} regulators and the task "
                f"{self.task.regulator_count}, expected the same number"
            )
        if self.mirror_transitions and not self.space.has_mirror:
            raise ValueError(
                'mirror_transitions is true and space.mirror is "none", expected it false: a '
                "robot's image is none of this space"
            )
        check_worlds_fit(self.environment_count, self.objective)

    @property
    def is_factored(self) -> bool:
        """Whether the belief over designs is a weight for each option of each location."""
        if self.distribution == "by_size":
            return not self.space.is_listed
        return self.distribution == "factored"

    @property
    def mirrored_scores(self) -> bool:
        """Whether what a design gets counts for its mirror image as well."""
        return self.mirror_transitions and self.is_symmetric

    @property
    def is_symmetric(self) -> bool:
        """Whether a robot and its mirror image, doing the same, are rewarded alike."""
        return self.task.reward.is_symmetric and not self.sided_reward

    @property
    def designs_per_round(self) -> int:
        """Designs that are drawn for a round."""
        return self.environment_count // self.objective.worlds_per_design

    @property
    def ranked_design_count(self) -> int:
        """Designs that walk in all worlds of an evaluation."""
        every = self.evaluated_design_count
        objective = self.objective
        fewer_first = objective.is_robust and objective.first_worlds < objective.evaluation_worlds
        if not (self.shortlist_count and fewer_first):
            return every
        finalists = self.finetuning.finalist_count if self.finetuning.timesteps else 0
        return min(every, max(self.shortlist_count, self.kept_pair_count, finalists))

    @property
    def judged_robot_count(self) -> int:
        """Robots side by side in an evaluation."""
        if self.ranked_design_count == self.evaluated_design_count:
            return self.environment_count
        robots = self.ranked_design_count * self.objective.worlds_per_design
        return min(self.environment_count, robots)

    @property
    def updates_per_vector_step(self) -> int:
        """Learner's updates after each action of all robots together."""
        return self.updates * (self.environment_count if self.update_every == "timestep" else 1)

    @property
    def first_learning_steps(self) -> int:
        """Times that a beginning which knows transitions learns from these before its robots walk,
        each of as many updates as after an action of all robots: a quarter as many as there are
        actions."""
        return self.round_count * self.task.action_count // 4

    @property
    def timesteps_per_round(self) -> int:
        """Actions of all robots in one episode each."""
        return self.environment_count * self.task.action_count

    @property
    def round_count(self) -> int:
        """Episodes of every robot from one beginning."""
        return math.ceil(self.total_timesteps / self.timesteps_per_round)

    @property
    def restart_timesteps(self) -> int:
        """Timesteps of learning from one beginning: `total_timesteps` in whole rounds."""
        return self.round_count * self.timesteps_per_round

    @property
    def training_timesteps(self) -> int:
        """Timesteps at the end of training, those of all its beginnings."""
        return self.restarts * self.restart_timesteps

    @property
    def finalist_timesteps(self) -> int:
        """Timesteps of fine-tuning for each finalist, in whole rounds."""
        return self.finetuning.round_count(self.timesteps_per_round) * self.timesteps_per_round


def paper_settings() -> CooptSettings:
    """The paper's experiment: one million timesteps."""
    return CooptSettings()


def quick_settings() -> CooptSettings:
    """A search of a few minutes: fewer timesteps, each used for more learning.

    Few robots side by side and many updates per action, a short warm-up and use of the mirror
    symmetry; the algorithm is the paper's.
    """
    return CooptSettings(
        environment_count=48,
        total_timesteps=20_160,
        task=CrawlingTask(time_limit_is_terminal=False),
        # The temperature falls by a fixed share per update; few updates must begin near its end.
        sac=SacSettings(batch_size=256, initial_temperature=0.02),
        schedule=EntropySchedule(
            decay_start_timestep=4_200, decay_end_timestep=18_900, final_entropy=2.0
        ),
        finetuning=FinetuningSettings(timesteps=0),
        learning_start_timestep=1_000,
        updates=16,
        mirror_transitions=True,
        checkpoint_interval_timesteps=5_000,
        shortlist_count=4,
        kept_pair_count=2,
    )


def fast_settings() -> CooptSettings:
    """Twelve short beginnings, the best of which is fine-tuned: two and a half hours on one core.

    In the measured physics one long training ends with the gaits that it came upon first
    (`reproduce/long_trainings`), so the time is spent on many as short as the demo's. The last four
    learn from what all before them saw and better the best of it (`reproduce/restarts`).
    """
    return replace(
        quick_settings(),
        restarts=12,
        pooled_restarts=4,
        finetuning=FinetuningSettings(finalist_count=5, timesteps=7_680),
        shortlist_count=6,
        kept_pair_count=5,
    )
