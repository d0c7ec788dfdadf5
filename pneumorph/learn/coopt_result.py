"""What co-optimisation found and where its time went, as in a training's ``summary.json``."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from pneumorph.learn.training import STAGES

SUMMARY_FILE = "summary.json"
"""Of a training's folder: its result."""


@dataclass(frozen=True)
class SeenPair:
    """A design, and how far a gait was seen to take it.

    Attributes:
        design: Text of the design.
        distance_cm: As of a `DesignGaitPair`, and so are the rest [cm].
        score_cm: What it is ranked by [cm].
        source: What the gait is from, such as ``policy``.
        timestep: Timestep of training at which it was seen.
        achieved: What of the task's goal it achieved [its unit]; None in files of an earlier
            version, whose distance it is where that was the goal.
    """

    design: str
    distance_cm: float
    score_cm: float
    source: str
    timestep: int
    achieved: float | None = field(default=None, kw_only=True)


@dataclass(frozen=True)
class KeptPair(SeenPair):
    """One whose gait is a file.

    Attributes:
        gait: The file, from the training's folder.
    """

    gait: str


@dataclass(frozen=True, kw_only=True)
class CooptResult:
    """What a training found.

    Attributes:
        policy_best_design: The best design of the last evaluation of the policy; None where no
            simulation came to its end, and so is its distance.
        policy_best_distance_cm: Its distance there [cm].
        pairs: The best pairs, the highest score first: of those seen and those of the
            finalists' policies.
        seen_pairs: The best that were seen before fine-tuning, the highest score first.
        timesteps: Actions of all robots.
        finetuning_timesteps: Those of fine-tuning, which `timesteps` does not count.
        update_count: Updates of the networks.
        failed_episode_count: Episodes whose simulation failed.
        seed: Where what is random was drawn.
        wall_s: Wall time of training [s], without fine-tuning.
        simulate_s: What of it the robots took [s].
        learn_s: Drawing actions and updating the networks [s].
        log_s: Metrics and checkpoints [s].
        evaluate_s: Evaluations without noise [s].
        finetuning_wall_s: Wall time of fine-tuning [s]; None where there was none.
        remarks: Where the run went on after a stop, and what was lost.
        restart_scores_cm: What the best pair of each beginning scored, where there were several
            [cm]; None where no simulation came to its end.
        evaluation_timesteps: Actions of all walks that ranked gaits, at evaluations and after
            fine-tuning, which neither of the others counts; None where an earlier version began.
    """

    policy_best_design: str | None
    policy_best_distance_cm: float | None
    pairs: tuple[KeptPair, ...]
    seen_pairs: tuple[SeenPair, ...]
    timesteps: int
    finetuning_timesteps: int
    update_count: int
    failed_episode_count: int
    seed: int
    wall_s: float
    simulate_s: float
    learn_s: float
    log_s: float
    evaluate_s: float
    finetuning_wall_s: float | None
    remarks: tuple[str, ...]
    restart_scores_cm: tuple[float | None, ...] = ()
    evaluation_timesteps: int | None = None

    @property
    def best(self) -> KeptPair | None:
        """The pair of highest score; None where no simulation came to its end."""
        return self.pairs[0] if self.pairs else None

    @property
    def other_s(self) -> float:
        """Wall time of training that was none of its stages' [s]."""
        return self.wall_s - sum(getattr(self, f"{stage}_s") for stage in STAGES)

    @property
    def learn_and_log_share(self) -> float:
        """Share of learning and logging in the wall time of training."""
        return (self.learn_s + self.log_s) / self.wall_s

    def derived(self) -> dict[str, Any]:
        """The best pair and what follows of the times, for those who read the file."""
        names = ("design", "distance_cm", "gait", "source")
        return {
            **{f"best_{name}": getattr(self.best, name, None) for name in names},
            "other_s": self.other_s,
            "learn_and_log_share": self.learn_and_log_share,
        }
