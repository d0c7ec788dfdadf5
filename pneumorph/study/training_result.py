"""What a training found, and what it took."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from pneumorph.base.run_folder import TRAINING_FOLDER
from pneumorph.catalogue.robot_mass import RobotMass
from pneumorph.environment.reward_term import RewardTerm
from pneumorph.learn.coopt_result import CooptResult, SeenPair
from pneumorph.learn.settings import CooptSettings
from pneumorph.learn.training import STAGES
from pneumorph.physics.calibration import UsedCalibration
from pneumorph.physics.physics import Physics
from pneumorph.reduction.part_summary import PartsSummary
from pneumorph.study.baseline import BestPhase
from pneumorph.study.certified_pairs import Certificate
from pneumorph.study.survived import status_of

_TIMES = (*(f"{stage}_s" for stage in STAGES), "other_s", "learn_and_log_share")


@dataclass(frozen=True)
class LearnedPair:
    """A design, its distance and where it was seen.

    Where designs walk in several worlds each, the distance is the mean over them.
    """

    design: str
    distance_cm: float | None
    source: str
    timestep: int | None = None
    """None in runs of an earlier version."""
    gait: str | None = None
    """File of the gait, from the run's folder; None where none was written."""
    score_cm: float | None = None
    """What it was ranked by, see `ranked_by` of the training; None in runs of an earlier version,
    whose distance it is."""
    achieved: float | None = None
    """As the distance, what of the goal; None in runs of an earlier version."""


@dataclass(frozen=True, kw_only=True)
class TrainingResult(BestPhase):
    """What a training found, and what it took; the expert's best phase stands beside it.

    Fields with a default are missing in runs of earlier versions.
    """

    best_design: str | None
    best_distance_cm: float | None
    """Of the first pair, forward [cm]; over worlds the mean; None where no robot survived."""
    best_gait: str | None
    """File of its gait, from the run's folder."""
    replayed_distance_cm: float | None = None
    """That of the gait file, walked once more in the nominal world [cm]."""
    best_achieved: float | None = None
    """What of the goal the best pair achieved [its unit]; None as there."""
    replayed_achieved: float | None = None
    """What the gait file does."""
    timesteps: int
    """Actions of all robots."""
    finetuning_timesteps: int
    """Those of fine-tuning, which the others do not count."""
    evaluation_timesteps: int | None = None
    """Actions of all walks that ranked gaits, which neither of these counts; None where an earlier
    version began."""
    update_count: int
    """Updates of the networks."""
    failed_episode_count: int
    """Episodes whose simulation failed."""
    seed: int
    pairs: tuple[LearnedPair, ...]
    """The best design-gait pairs, the highest score first."""
    seen_pairs: tuple[LearnedPair, ...] = ()
    """The best that were seen before fine-tuning, the highest score first."""
    restart_scores_cm: tuple[float | None, ...] = ()
    """What the best pair of each beginning scored [cm], where there were several; None where no
    simulation came to its end."""
    notes: tuple[str, ...] = ()
    """What learning and the certificate remark."""
    damping: str
    calibration: UsedCalibration | None = None
    leg: PartsSummary | None = None
    wall_s: float
    """Wall time of all [s]."""
    training_wall_s: float
    """Of it that of the training [s]."""
    simulate_s: float
    """Where the wall time of training went, as the next four say [s]."""
    learn_s: float
    log_s: float
    evaluate_s: float
    other_s: float | None = None
    learn_and_log_share: float
    """Share of learning and logging in the training's wall time, 0 to 1."""
    finetuning_wall_s: float | None = None
    """Wall time of fine-tuning [s]."""
    randomisation: dict[str, Any] | None = None
    """Distributions of the worlds it was trained in; None for one world."""
    physics: Physics | None = None
    """What the robots were simulated in; None in files of earlier versions."""
    mass: RobotMass | None = None
    """What they weigh; None in files of earlier versions."""
    ranked_by: str | None = None
    """What the scores of the pairs are, where designs walked in several worlds each or something is
    taken off for how they walk; None for the distance in one world."""
    own_task: str | None = None
    """What its environment was called, where the task was none of the package's."""
    certificate: Certificate | None = None
    """What is to be expected of the pairs in unseen worlds, where that was asked for."""
    shown: tuple[str, ...] = ()
    """Designs of the gaits that learning was shown, each with a digest of its pressures."""
    status: str = "completed"
    """``completed``, or that no robot survived."""

    @property
    def nominal_distance_cm(self) -> float | None:
        """`replayed_distance_cm`, where robots were trained in drawn worlds and not in that one."""
        return self.replayed_distance_cm if self.randomisation else None

    @property
    def nominal_achieved(self) -> float | None:
        """The same of the goal."""
        return self.replayed_achieved if self.randomisation else None

    def __repr__(self) -> str:
        """In a line; the fields are what ``summary.json`` has."""
        achieved = self.best_distance_cm if self.goal.is_forward else self.best_achieved
        best = f"{self.best_design}: {'nothing' if achieved is None else self.goal.said(achieved)}"
        return f"TrainingResult({best}, {len(self.pairs)} pairs, {self.timesteps} timesteps)"

    def derived(self) -> dict[str, Any]:
        """Of the best pair over unseen worlds, for those who read the file."""
        names = ("median", "tenth_percentile", "expert_median")
        found, ending = self.certificate, "_cm" if self.goal.unit == "cm" else ""
        if found is None:
            return {}
        told = {f"{name}{ending}": getattr(found, name) for name in names}
        return {**told, "share_beyond_expert": found.share_beyond_expert}


def fields_of_learned(learned: CooptResult) -> dict[str, Any]:
    """What the learner tells, as fields of a `TrainingResult`."""
    best = learned.best
    counts = ("timesteps", "finetuning_timesteps", "evaluation_timesteps", "update_count")
    same = (*counts, "failed_episode_count", *_TIMES, "finetuning_wall_s", "restart_scores_cm")
    return {
        **{name: getattr(learned, name) for name in same},
        "status": status_of(best),
        "best_design": None if best is None else best.design,
        "best_distance_cm": None if best is None else best.distance_cm,
        "best_achieved": None if best is None else best.achieved,
        "best_gait": None if best is None else f"{TRAINING_FOLDER}/{best.gait}",
        "pairs": tuple(_learned(each, f"{TRAINING_FOLDER}/{each.gait}") for each in learned.pairs),
        "seen_pairs": tuple(_learned(each) for each in learned.seen_pairs),
        "training_wall_s": learned.wall_s,
    }


def ranked_by(
    settings: CooptSettings, own_task: str | None = None, terms: Sequence[RewardTerm] = ()
) -> str | None:
    """What pairs are ranked by, for a person; None for the distance.

    Args:
        settings: Of the training.
        own_task: Name of a task of one's own.
        terms: Its terms.
    """
    said = [settings.objective.said] if settings.objective.is_robust else []
    if own_task is not None:
        usual = settings.task.reward.said or settings.task.goal.label
        of_terms = " ".join([usual, *(term.said for term in terms)])
        said.append(f"reward of {own_task}" + (f" ({of_terms})" if terms else ""))
    elif settings.task.reward.said:
        said.append(settings.task.reward.said)
    return ", ".join(said) or None


def _learned(pair: SeenPair, gait: str | None = None) -> LearnedPair:
    return LearnedPair(
        pair.design,
        pair.distance_cm,
        pair.source,
        pair.timestep,
        gait,
        pair.score_cm,
        pair.achieved,
    )
