"""How pairs fare in worlds drawn at random, and how their ranking changes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from pneumorph.base.result import in_cm
from pneumorph.base.run_folder import RunFolder, made_once
from pneumorph.catalogue.robot_spec import RobotSpec
from pneumorph.environment.goal import FORWARD, Goal
from pneumorph.gait.walk import walk
from pneumorph.learn.failed_walks import counted_walks
from pneumorph.physics.open_loop_gait import OpenLoopGait
from pneumorph.reduction.snapshot_range import RANGE_TOLERANCE, furthest_ratio
from pneumorph.robot.design import Design
from pneumorph.simulation.randomisation import Randomisation, World
from pneumorph.study.kept_walks import walks_identity
from pneumorph.study.sensitivity import weighted_quantiles
from pneumorph.study.toppled_note import toppled_share

KEPT_WALKS = "in_worlds"
"""Folder of walks that are kept until all that they are for is done."""
SIDE_BY_SIDE = 96
"""Robots that walk at once."""


@dataclass(frozen=True)
class PairInWorlds:
    """What one pair achieves over all worlds [the goal's unit]; failed simulations count as of
    `counted_walks`."""

    label: str
    nominal: float = field(metadata=in_cm("nominal_distance_cm"))
    """In the world as it stands."""
    mean: float = field(metadata=in_cm("mean_distance_cm"))
    deviation: float | None = field(metadata=in_cm("deviation_cm"))
    """Standard deviation; None for a single world."""
    tenth_percentile: float = field(metadata=in_cm("tenth_percentile_cm"))
    """Linear between the middles of worlds, as of a certificate's bands."""
    best_share: float
    """Share of the worlds in which it is the best."""


@dataclass(frozen=True, eq=False)
class Robustness:
    """Pairs in worlds drawn at random."""

    world_count: int
    failed_count: int
    """Walks whose simulation failed, of all pairs."""
    nominal_ranking: tuple[str, ...]
    """Labels by what they achieve in the world as it stands."""
    robust_ranking: tuple[str, ...]
    """Labels by the mean of that."""
    kendall_tau: float | None
    """Agreement of the two rankings; None for a single pair."""
    pairs: tuple[PairInWorlds, ...]
    distributions: dict[str, Any]
    """What the worlds were drawn from."""
    worlds: tuple[World, ...]
    achieved: np.ndarray = field(metadata=in_cm("distances_cm"))
    """What of the goal was achieved [its unit], (world, pair); NaN where a simulation failed."""
    left_range_share: float | None = None
    """Share, 0 to 1, of the walks that left the range of their legs' snapshots, where the reduced
    leg extrapolates; None where that is not known."""
    range_ratio: float | None = None
    """The furthest that any leg went, relative to its furthest snapshot."""
    goal: Goal = FORWARD
    toppled_share: float | None = None
    """Share of the walks in which the hub leaned so far that the robot fell over; None where that
    is not known."""


class WalksInWorlds(NamedTuple):
    """What pairs do in worlds, (world, pair) each."""

    achieved: np.ndarray
    """What of the goal was achieved [its unit]; NaN where a simulation failed."""
    range_ratio: np.ndarray
    """How far any leg went relative to the furthest snapshot it was reduced from; NaN where that is
    not known."""
    lean_deg: np.ndarray
    """How far the hub leaned at most, looked at every hundred steps [degrees]; NaN likewise."""


def walks_in_worlds(
    spec: RobotSpec,
    designs: Sequence[Design],
    gaits: Sequence[OpenLoopGait],
    worlds: Sequence[World],
    settling_steps: int,
    folder: RunFolder,
    goal: Goal = FORWARD,
    keep: bool = False,
) -> WalksInWorlds:
    """Walk every pair in every world.

    Args:
        spec: What they walk as.
        designs: Of the pairs.
        gaits: Of the pairs, as long as each other.
        worlds: Where they walk.
        settling_steps: Time steps before their gaits begin.
        folder: Is told how far it is.
        goal: What counts of a walk.
        keep: Leave what is finished in the folder's `KEPT_WALKS`, and read what is there.
    """
    robots = [spec.assembly(design) for design in designs]

    def walked(chosen: Sequence[World]) -> dict[str, Any]:
        simulator = spec.simulator_in_worlds(
            robots * len(chosen), [world for world in chosen for _ in robots]
        )
        found = walk(
            simulator,
            list(gaits) * len(chosen),
            duration_s=gaits[0].duration_s,
            time_step_s=spec.physics.time_step_s,
            settling_step_count=settling_steps,
            record_step_count=100,
        )
        unknown = np.full(len(gaits) * len(chosen), np.nan)
        ways = {
            "achieved": found.achieved(goal),
            "range_ratio": found.range_ratio,
            "lean_deg": unknown if found.lean_deg is None else found.lean_deg,
        }
        return {name: each.reshape(-1, len(robots)).tolist() for name, each in ways.items()}

    ways = []
    together = max(1, SIDE_BY_SIDE // len(robots))
    for begin in range(0, len(worlds), together):
        chosen = worlds[begin : begin + together]
        if keep:
            made_of = walks_identity(spec, designs, gaits, chosen, settling_steps, goal)
            file = folder / f"{KEPT_WALKS}/{made_of[:16]}.json"
            ways.append(made_once(file, partial(walked, chosen), made_of=made_of))
        else:
            ways.append(walked(chosen))
        folder.progress(begin + len(chosen), len(worlds), "walking in worlds")
    # A failed walk is NaN, which files have as null.
    return WalksInWorlds(
        *(
            np.array([row for way in ways for row in way[name]], dtype=float)
            for name in WalksInWorlds._fields
        )
    )


def draw_worlds(randomisation: Randomisation, count: int, seed: int) -> list[World]:
    """Worlds of a seed."""
    rng = np.random.default_rng([seed, 5])
    return [randomisation.draw(rng) for _ in range(count)]


def _shares_of_best(achieved: np.ndarray) -> np.ndarray:
    """Share of the worlds in which each pair achieves most, (pair,): those that do as much share a
    world, a failed simulation is never the best.

    Args:
        achieved: In each world, (world, pair); NaN where a simulation failed.
    """
    sound = np.where(np.isnan(achieved), -np.inf, achieved)
    most = sound.max(axis=1, keepdims=True)
    best = (sound == most) & np.isfinite(most)
    shares: np.ndarray = (best / np.maximum(best.sum(axis=1, keepdims=True), 1)).mean(axis=0)
    return shares


def robustness(
    labels: Sequence[str],
    nominal: np.ndarray,
    achieved: np.ndarray,
    worlds: Sequence[World] = (),
    distributions: dict[str, Any] | None = None,
    range_ratios: np.ndarray | None = None,
    goal: Goal = FORWARD,
    lean_deg: np.ndarray | None = None,
) -> Robustness:
    """Summarise what was achieved over worlds.

    Args:
        labels: Name of each pair, best first.
        nominal: What each achieves in the simulated world as it stands [the goal's unit], (pair,).
        achieved: The same in worlds, (world, pair); NaN where a simulation failed.
        worlds: The worlds.
        distributions: What they were drawn from.
        range_ratios: As `walks_in_worlds` returns them, (world, pair).
        goal: What was achieved.
        lean_deg: As `walks_in_worlds` returns it, (world, pair).
    """
    from scipy.stats import kendalltau

    counted = counted_walks(achieved)
    mean, best = counted.mean(axis=0), _shares_of_best(achieved)
    known = np.zeros(0) if range_ratios is None else range_ratios[~np.isnan(range_ratios)]
    stands = ~np.isnan(nominal)
    ranked = stands.sum() > 1
    tau = kendalltau(nominal[stands], mean[stands]).statistic if ranked else None
    return Robustness(
        world_count=len(counted),
        failed_count=int(np.isnan(achieved).sum()),
        nominal_ranking=tuple(labels[i] for i in np.argsort(-nominal, kind="stable")),
        robust_ranking=tuple(labels[i] for i in np.argsort(-mean, kind="stable")),
        kendall_tau=None if tau is None else float(tau),
        pairs=tuple(
            PairInWorlds(
                label,
                float(nominal[i]),
                float(mean[i]),
                float(counted[:, i].std(ddof=1)) if len(counted) > 1 else None,
                float(weighted_quantiles(counted[:, i], np.ones(len(counted)), (0.1,))[0]),
                float(best[i]),
            )
            for i, label in enumerate(labels)
        ),
        distributions=distributions or {},
        worlds=tuple(worlds),
        achieved=achieved,
        left_range_share=None if known.size == 0 else float(np.mean(known > RANGE_TOLERANCE)),
        range_ratio=furthest_ratio(range_ratios),
        goal=goal,
        toppled_share=None if lean_deg is None else toppled_share(lean_deg.ravel()),
    )
