"""What a certificate says: of the expert, of each pair, and of the tests that would say more."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from pneumorph.base.result import in_cm
from pneumorph.catalogue.robot_mass import RobotMass
from pneumorph.environment.goal import FORWARD, Goal
from pneumorph.learn.failed_walks import counted_walks
from pneumorph.physics.calibration import UsedCalibration
from pneumorph.physics.physics import Physics
from pneumorph.reduction.part_summary import PartsSummary, PartSummary
from pneumorph.study.analysis import AnalysedLeg
from pneumorph.study.certified_walks import FullOrderWalk
from pneumorph.study.measure_next import ExpectedNarrowing
from pneumorph.study.sensitivity import BAND, Sensitivity, weighted_quantiles


@dataclass(frozen=True)
class Band:
    """What a robot achieves over the worlds [the goal's unit]; a failed simulation counts as of
    `counted_walks`.

    Percentiles are Hazen's, ``numpy.percentile(..., method="hazen")``. Their standard errors, from
    one draw of as many worlds to another, are those of Maritz and Jarrett, A note on estimating the
    variance of the sample median, J. Am. Stat. Assoc. 73 (1978) 194; None in files of earlier
    versions.
    """

    low: float = field(metadata=in_cm("low_cm"))
    """10th percentile."""
    median: float = field(metadata=in_cm("median_cm"))
    high: float = field(metadata=in_cm("high_cm"))
    """90th percentile."""
    mean: float = field(metadata=in_cm("mean_cm"))
    deviation: float = field(metadata=in_cm("deviation_cm"))
    """Standard deviation over the worlds."""
    failed_count: int
    """Worlds in which the simulation failed."""
    low_error: float | None = field(default=None, metadata=in_cm("low_error_cm"))
    median_error: float | None = field(default=None, metadata=in_cm("median_error_cm"))
    high_error: float | None = field(default=None, metadata=in_cm("high_error_cm"))

    @classmethod
    def of(cls, achieved: np.ndarray) -> Band:
        """That of what was achieved (world,), NaN where a simulation failed."""
        from scipy.stats.mstats import mjci

        counted = counted_walks(achieved)
        low, median, high = weighted_quantiles(counted, np.ones(len(counted)))
        errors = map(float, mjci(counted, BAND)) if len(counted) > 1 else (None,) * len(BAND)
        return cls(
            float(low),
            float(median),
            float(high),
            float(counted.mean()),
            float(counted.std(ddof=1)),
            int(np.isnan(achieved).sum()),
            *errors,
        )


def share_beyond(achieved: np.ndarray, other: np.ndarray) -> float:
    """Share of the worlds in which one achieves more than another.

    Args:
        achieved: By the one, (world,); NaN where its simulation failed, which is never more.
        other: By the other, (world,), which counts as 0 where it failed.
    """
    return float(np.mean(np.nan_to_num(achieved, nan=-np.inf) > np.nan_to_num(other)))


@dataclass(frozen=True)
class CertifiedExpert:
    """The expert's robot in the same worlds."""

    design: str
    phase_deg: float
    """Of the largest mean in the training's worlds."""
    band: Band
    tuning_world_count: int | None = None
    """In how many of them; None in files of earlier versions."""
    tuned_as_drawn: bool = False
    """Whether in worlds drawn as the unseen ones instead, because the training's are drawn from
    something else, such as where a calibration has narrowed them."""


@dataclass(frozen=True)
class CertifiedPair:
    """What is to be expected of a design with its gait."""

    label: str
    design: str
    gait: str
    nominal: float | None = field(metadata=in_cm("nominal_cm"))
    """In the world as it stands."""
    band: Band
    share_beyond_expert: float
    """Share of the worlds in which it achieves more than the expert's robot does there; never where
    its own simulation failed."""
    promised: float | None = field(metadata=in_cm("promised_cm"))
    """What the run said of it [the goal's unit]: where it ranked pairs over worlds the mean there,
    otherwise what it reported."""
    optimism: float | None = field(metadata=in_cm("optimism_cm"))
    """The same less the mean over unseen worlds that are drawn as the training's were: what
    choosing the best made of it and, of a run that did not rank over worlds, also how much harder
    these are than the one it walked in."""
    optimism_error: float | None = field(
        default=None, metadata=in_cm("optimism_error_cm"), kw_only=True
    )
    """Standard error of that [the goal's unit], as both means are over so many worlds; None where
    what the run reported is of one world, and in files of earlier versions."""
    hub_load_share: float
    """Share of the weight that the floor bears through the hub, in the world as it stands."""
    backsliding: float | None = field(metadata=in_cm("backsliding_cm"))
    """Mean furthest slide back from the goal in a cycle there."""
    legs: tuple[AnalysedLeg, ...]
    """How much of its friction each leg uses there."""
    left_range_share: float | None
    """Share of the worlds in which a leg left its snapshots' range; None where not known."""
    toppled_share: float | None = field(default=None, kw_only=True)
    """Share of the worlds in which its hub leaned so far that it fell over; None where not known,
    as in files of earlier versions."""
    sensitivities: tuple[Sensitivity, ...]
    """To each uncertain number, the most important first."""
    full_order: tuple[FullOrderWalk, ...] = ()


@dataclass(frozen=True)
class RoundPair:
    """A pair of a round, and how both models walked it."""

    label: str
    design: str
    gait: str
    full_order: tuple[FullOrderWalk, ...]


@dataclass(frozen=True)
class CertifiedRound:
    """A leg, the pairs that were ranked with it, and how they walk as finite elements."""

    leg: PartSummary
    pairs: tuple[RoundPair, ...]
    agrees: bool
    """Whether both models agree in all of the walks."""
    made_s: float
    """What it took to reduce the leg and to fine-tune the pairs on it [s]; 0 of those of the
    run."""


@dataclass(frozen=True)
class Certificate:
    """What a run's robots will do, and how sure that is."""

    run: str
    best: str
    """Label of the pair that the training ranked first over its worlds, by its objective; of a run
    that ranked in one world, that with the largest mean over worlds drawn to choose in."""
    best_design: str
    median: float = field(metadata=in_cm("median_cm"))
    """Of what the best pair achieves of the goal [its unit], as the next two."""
    tenth_percentile: float = field(metadata=in_cm("tenth_percentile_cm"))
    ninetieth_percentile: float = field(metadata=in_cm("ninetieth_percentile_cm"))
    expert_median: float = field(metadata=in_cm("expert_median_cm"))
    share_beyond_expert: float
    """As of the best pair, 0 to 1."""
    optimism: float | None = field(metadata=in_cm("optimism_cm"))
    """As of the best pair [the goal's unit]."""
    measure_next: str | None
    """The test that would narrow the best pair's band most; of some that do as much as nine tenths
    of that, the quickest. None where none does more than chance may."""
    pairs: tuple[CertifiedPair, ...]
    expert: CertifiedExpert
    tests: tuple[ExpectedNarrowing, ...]
    """What could be measured, the most useful first."""
    world_count: int
    distributions: dict[str, Any]
    """What the worlds were drawn from."""
    numbers: dict[str, tuple[float, ...]]
    """What differed, by name, (world,) each; names that end in a unit are in it, others are
    factors and coefficients."""
    achieved: tuple[tuple[float, ...], ...] = field(metadata=in_cm("distances_cm"))
    """By the expert and then each pair [the goal's unit], (world, robot); NaN where a simulation
    failed."""
    damping: str
    calibration: UsedCalibration
    leg: PartsSummary
    physics: Physics
    notes: tuple[str, ...]
    wall_s: float
    """Wall time of all [s]."""
    reduction_digests: dict[str, str] = field(default_factory=dict)
    """Of the other reductions that worlds may have, by their files."""
    chance_narrowing: float | None = field(default=None, metadata=in_cm("chance_narrowing_cm"))
    """What the best of the tests would seem to narrow the band by in one of twenty cases in which
    nothing depended on anything; None in files of earlier versions."""
    rounds: tuple[CertifiedRound, ...] = ()
    """Where pairs walked as finite elements: the run's leg, then each that was reduced again."""
    goal: Goal = FORWARD
    mass: RobotMass | None = None
    """What they weigh; None in files of earlier versions."""
