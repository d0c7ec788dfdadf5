"""Which states of a part are seen, and how it is reduced to them: as what ships was made."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

from pneumorph.catalogue.leg_kinds import LegName
from pneumorph.reduction.blocked_snapshots import BlockedSnapshotSettings
from pneumorph.reduction.collect import SnapshotSettings
from pneumorph.reduction.ecsw import EcswSettings
from pneumorph.reduction.reduction_settings import ReductionSettings
from pneumorph.reduction.static_snapshots import StaticSnapshotSettings
from pneumorph.reduction.walk_snapshots import WalkSnapshotSettings
from pneumorph.study.gait_walks import GaitWalkSettings


@dataclass(frozen=True)
class ReduceSettings:
    """Which states of the part are seen, and how it is reduced to them."""

    snapshots: SnapshotSettings = field(default_factory=SnapshotSettings)
    walked: GaitWalkSettings = field(default_factory=GaitWalkSettings)
    """Gaits that full robots walk besides, such as learned ones."""
    reduction: ReductionSettings = field(default_factory=ReductionSettings)


_HYPERELASTIC = ReduceSettings(
    SnapshotSettings(
        static=StaticSnapshotSettings(
            bend_pressure_kPa=114.0, load_count=48, load_pressure_kPa=110.0
        ),
        walk=WalkSnapshotSettings(
            leg_counts=(2, 3),
            corner_limit=4,
            amplitude_kPa=110.0,
            pressure_rate_kPa_per_s=187.0,
        ),
    )
)
"""The leg that follows `HYPERELASTIC_PRESSURE_MAP`: 90 real kPa are 108 simulated ones."""

_MEASURED = ReduceSettings(
    SnapshotSettings(
        static=StaticSnapshotSettings(
            bend_pressure_kPa=105.0,
            bend_count=21,
            load_count=48,
            load_pressure_kPa=100.0,
            load_limit_mN=1000.0,
        ),
        blocked=BlockedSnapshotSettings(count=12, pressure_kPa=105.0),
        walk=WalkSnapshotSettings(
            leg_counts=(2, 3),
            corner_limit=4,
            amplitude_kPa=100.0,
            pressure_rate_kPa_per_s=150.0,
        ),
    ),
    # The stiff sheet is seen by its stress: sampled in modes it kept a bent leg from giving way
    # sideways and downwards (docs/physics.md).
    reduction=ReductionSettings(
        norm="shape",
        mode_limit=40,  # as many as the batched simulator takes
        stress_limit=16,
        bend_share=0.04,  # of what the curves' own modes leave
        load_share=0.33,
        blocked_share=0.02,
        answer_share=0.17,
        contact_flexibility=True,
        curve_tolerance=1e-3,
        ecsw=EcswSettings(
            hyperreduction_tolerance=0.003, element_limit=480, equilibrium_weight=20.0
        ),
    ),
)
"""Up to the pressure of the real leg."""

_OF_LEG = {"published": ReduceSettings(), "hyperelastic": _HYPERELASTIC, "measured": _MEASURED}


def shipped_settings(leg: LegName) -> ReduceSettings:
    """What made the leg of a name that ships."""
    return _OF_LEG[leg]


def learned_settings() -> ReduceSettings:
    """From equilibria of the published leg and given gaits, with more modes and elements."""
    return ReduceSettings(
        SnapshotSettings(walk=WalkSnapshotSettings(leg_counts=())),
        reduction=ReductionSettings(
            mode_tolerance=0.001,
            mode_limit=32,
            ecsw=EcswSettings(hyperreduction_tolerance=0.002, element_limit=800),
        ),
    )


def from_walks(leg: LegName) -> ReduceSettings:
    """From equilibria of a leg, as what ships has them, and walks that are there already; with more
    modes and elements for those that have few."""
    chosen = learned_settings() if leg == "published" else shipped_settings(leg)
    snapshots = replace(chosen.snapshots, walk=WalkSnapshotSettings(leg_counts=()))
    reduction = learned_settings().reduction
    if leg == "measured":
        # Learned walks ask for more elements than the preset's own; with fewer than the leg that
        # ships a leg of such walks went 4.2 % too far in the nominal world
        # (reproduce/long_trainings).
        finer = replace(chosen.reduction.ecsw, element_limit=600)
        reduction = replace(chosen.reduction, ecsw=finer)
    return ReduceSettings(snapshots, reduction=reduction)
