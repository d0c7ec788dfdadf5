"""What a search for gaits or designs found, as its run's files hold it."""

from __future__ import annotations

from dataclasses import KW_ONLY, dataclass, field
from pathlib import Path

from pneumorph.base.artefact import read_json, reading
from pneumorph.base.result import in_cm, result_from_dict
from pneumorph.catalogue.robot_mass import RobotMass
from pneumorph.environment.goal import FORWARD, Goal
from pneumorph.learn.search_run import CURVE_FILE
from pneumorph.physics.calibration import UsedCalibration
from pneumorph.physics.physics import Physics


@dataclass(frozen=True)
class FoundPair:
    """A design with the best gait that was found for it; no values where none walked."""

    design: str
    distance_cm: float | None
    gait: str | None
    """File of the gait, from the run's folder."""
    timestep: int | None
    """When it was found: actions of all robots until then."""
    score_cm: float | None = None
    """What it was ranked by; in runs of an earlier version None."""
    achieved: float | None = None
    """What of the goal it achieved [its unit]; in runs of an earlier version None."""


@dataclass(frozen=True)
class DesignsBestGait(FoundPair):
    """The best gait of one design, beside what was learned for it."""

    _: KW_ONLY
    why: str
    """Why the design is among them: the expert's, L1, asked for, drawn at random."""
    late_gain_cm: float | None
    """What the last quarter of the search added [cm]: where it is much, the search was too
    short."""
    policy_distance_cm: float | None
    """How far the learned run's one policy carries the design, without noise [cm forward]."""
    learned_distance_cm: float | None
    """How far the run's own pair comes in the worlds of the search, with the gait of the policy
    that was fine-tuned for it [cm forward]; in files of earlier versions in those of its run."""
    policy_achieved: float | None = None
    """What of the goal that policy achieves [its unit]."""
    learned_achieved: float | None = None
    """What that pair does."""

    def with_policy_and_own(self, goal: Goal) -> tuple[float | None, float | None]:
        """What the design achieves with the shared policy and with its own gait [the goal's unit],
        in files of any version."""
        if goal.is_forward:
            return self.policy_distance_cm, self.distance_cm
        return self.policy_achieved, self.achieved


@dataclass(frozen=True)
class PolicyGap:
    """How much more designs' own gaits achieve than the shared policy does."""

    count: int
    """Of the designs."""
    mean: float
    """[the goal's unit], as the largest."""
    largest: float


@dataclass(frozen=True)
class SearchFindings:
    """What a search found."""

    method: str
    best_design: str | None
    best_distance_cm: float | None
    """In one world; the mean over those of an evaluation where there are several."""
    timesteps: int
    """Actions of all robots, until the search was over."""
    simulated_s: float
    """Simulated time of all robots [s], until the search was over."""
    notes: tuple[str, ...]
    seed: int
    damping: str
    wall_s: float
    """Wall time of all [s]."""
    calibration: UsedCalibration | None = None
    designs: tuple[DesignsBestGait, ...] | None = None
    """Of a search for the gaits of designs."""
    policy_gaps: dict[str, PolicyGap] | None = field(default=None, metadata=in_cm("policy_gaps_cm"))
    """The same, by why a design is among them."""
    pairs: tuple[FoundPair, ...] | None = None
    """Of a search of designs and gaits together: the best, the highest score first."""
    physics: Physics | None = None
    """What the robots were simulated in; None in files of earlier versions."""
    mass: RobotMass | None = None
    """What they weigh; None in files of earlier versions."""
    goal: Goal = FORWARD
    best_achieved: float | None = None
    """What of the goal the best pair achieved; None in files of earlier versions."""
    finalist_timesteps: int | None = None
    """Actions of the walks in an evaluation's worlds after that; None in files of earlier
    versions."""
    status: str = "completed"
    """``completed``, or that no robot survived."""


@dataclass(frozen=True)
class SearchCurve:
    """The best of a search over its time, an entry for each generation."""

    timesteps: tuple[int, ...]
    simulated_s: tuple[float, ...]
    """Simulated time of all robots [s]."""
    best_achieved: tuple[float, ...] = field(metadata=in_cm("best_distance_cm"))
    """Of the best pair so far; NaN before any robot came to the end of its walk."""
    goal: Goal = FORWARD

    @classmethod
    def read(cls, folder: Path) -> SearchCurve:
        """The curve of a finished search.

        Raises:
            FileNotFoundError: It has none.
            ArtefactError: It is damaged.
        """
        path = folder / CURVE_FILE
        with reading(path, "search curve"):
            return result_from_dict(cls, read_json(path, "search curve"))
