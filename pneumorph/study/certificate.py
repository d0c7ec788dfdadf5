"""How far a run's robots will walk, in worlds that training never saw, and how sure that is."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from pneumorph.base.run_folder import RunFolder
from pneumorph.base.settings import settings_to_dict
from pneumorph.catalogue.idle_numbers import idle_notes, idle_numbers
from pneumorph.catalogue.robot_spec import RobotSpec
from pneumorph.catalogue.worlds_check import check_worlds
from pneumorph.environment.goal import Goal
from pneumorph.gait.phase_sweep import PhaseSweepSettings
from pneumorph.gait.walk import walk
from pneumorph.learn.failed_walks import counted_walks
from pneumorph.reduction.snapshot_range import RANGE_TOLERANCE
from pneumorph.robot.design import Design
from pneumorph.simulation.randomisation import World
from pneumorph.simulation.randomised_simulator import reduction_digests
from pneumorph.study.analysis import Walker, analysed_robot
from pneumorph.study.baseline import phase_notes
from pneumorph.study.certificate_notes import expert_notes, measured_notes, pair_notes
from pneumorph.study.certified_candidates import (
    Candidates,
    CertificateSettings,
    own_task_notes,
    unseen_worlds,
    worlds_of_training,
)
from pneumorph.study.certified_pairs import (
    Band,
    Certificate,
    CertifiedExpert,
    CertifiedPair,
    share_beyond,
)
from pneumorph.study.certified_walks import FullOrderWalk, full_order_walks
from pneumorph.study.measure_next import narrowings, worth_measuring
from pneumorph.study.near_worlds import near_worlds
from pneumorph.study.ranking_notes import ranking_notes
from pneumorph.study.recorded_walk import recorded_walk
from pneumorph.study.robustness import WalksInWorlds, walks_in_worlds
from pneumorph.study.sensitivity import sensitivities
from pneumorph.study.shown_worlds import record_shown_worlds
from pneumorph.study.toppled_note import toppled_share

EXPERT = "B"
"""What the expert's robot is called, as in the paper."""


def check_candidates(
    candidates: Candidates, settings: CertificateSettings, spec: RobotSpec
) -> None:
    """Refuse what `certify_once` refuses before the first walk; arguments and errors as there."""
    if settings.full:
        spec.check_reduction()
    spec.check_supply(pair.gait for pair in candidates.pairs)
    check_worlds(spec, settings.randomisation)


def certify_once(
    candidates: Candidates, settings: CertificateSettings, spec: RobotSpec, folder: RunFolder
) -> Certificate:
    """Walk pairs and the expert in unseen worlds, and say what to expect of them.

    Args:
        candidates: What is certified.
        settings: In which worlds, and whether as finite elements too.
        spec: What they walk as.
        folder: Keeps walks of finite elements and is told how far it is.

    Raises:
        FileNotFoundError: A reduction that worlds may have is missing.
        ArtefactError: The leg was reduced from other finite elements than are asked for, or a
            reduction that worlds may have is none.
        ValueError: The robot cannot be in the worlds (as of `check_worlds`), or a gait asks for
            more than its supply has.
    """
    start = time.monotonic()
    check_candidates(candidates, settings, spec)
    task, seen, goal = candidates.task, candidates.seen, candidates.task.goal
    walkers = [
        Walker(f"L{rank}", pair.design, pair.gait, task.settling_step_count)
        for rank, pair in enumerate(candidates.pairs, start=1)
    ]
    folder.progress.stage("tuning the expert's phase")
    drawn, count, seed = settings.randomisation, settings.world_count, settings.world_seed
    narrowed = candidates.drawn != drawn  # by what was measured, say; then nobody trained there
    tuning = worlds_of_training(None, drawn, seed, settings)[0] if narrowed else seen
    tuning = tuning[: settings.tuning_world_count]
    # For as long as the pairs, whatever the run's own baseline lasts.
    duration_s = walkers[0].gait.duration_s
    lasting = replace(candidates.baseline.gait, duration_s=duration_s)
    baseline = replace(candidates.baseline, gait=lasting)
    expert, phase_deg = _tuned_expert(baseline, spec, tuning, folder, goal)
    # What ranked the pairs of a robust run is its objective, which need not be the mean.
    seen_mean, best = candidates.seen_mean, 0
    if seen_mean is None:
        folder.progress.stage("walking in the training's worlds")
        there = _walked(spec, walkers, seen, folder, goal).achieved
        seen_mean = means_over_worlds(there)
        best = 0 if candidates.ranked_there else best_on_average(there)
    worlds = unseen_worlds(drawn, count, seed)
    folder.progress.stage(f"walking in {len(worlds)} unseen worlds")
    of_expert = _walked(spec, [expert], worlds, folder, goal)
    by_expert = of_expert.achieved[:, 0]
    walked = _walked(spec, walkers, worlds, folder, goal)
    by_pairs = walked.achieved
    alike = by_pairs
    if narrowed:
        folder.progress.stage(f"walking in {count} unseen worlds as the training's were")
        others = unseen_worlds(candidates.drawn, count, seed)
        alike = _walked(spec, walkers, others, folder, goal).achieved
    reported = [pair.achieved for pair in candidates.pairs]
    idle = idle_numbers(spec, drawn)
    evidence = _Evidence(
        spec,
        task.action_s(spec.physics.time_step_s),
        settings.cycle_s,
        {name: each for name, each in drawn.numbers_of(worlds).items() if name not in idle},
        by_expert,
        walked,
        _nominal(spec, walkers, goal),
        list(map(float, seen_mean)) if candidates.ranked_there else reported,
        alike,
        len(seen) if candidates.ranked_there else 0,
        goal,
    )
    folder.progress.stage("looking at the walks")
    certified = [
        evidence.of(place, walker, pair.gait_file)
        for place, (walker, pair) in enumerate(zip(walkers, candidates.pairs, strict=True))
    ]
    if settings.full:
        certified = _with_full_order(
            spec, settings, walkers, certified, best, worlds, by_pairs, folder, goal
        )
    folder.progress.stage("recording a median and a bad world")
    record_shown_worlds(spec, walkers[best], worlds, by_pairs[:, best], folder)
    chosen = certified[best]
    measured = {name: (value, deviation) for name, value, deviation in drawn.measured}
    could = narrowings(evidence.numbers, counted_walks(by_pairs[:, best]), measured)
    return Certificate(
        run=str(candidates.run),
        best=chosen.label,
        best_design=chosen.design,
        median=chosen.band.median,
        tenth_percentile=chosen.band.low,
        ninetieth_percentile=chosen.band.high,
        expert_median=(expert_band := Band.of(by_expert)).median,
        share_beyond_expert=chosen.share_beyond_expert,
        optimism=chosen.optimism,
        measure_next=worth_measuring(could.tests, could.chance),
        pairs=tuple(certified),
        expert=CertifiedExpert(str(expert.design), phase_deg, expert_band, len(tuning), narrowed),
        tests=could.tests,
        chance_narrowing=could.chance,
        world_count=len(worlds),
        distributions=settings_to_dict(drawn),
        reduction_digests=reduction_digests(drawn),
        numbers={name: tuple(values.tolist()) for name, values in evidence.numbers.items()},
        achieved=tuple(map(tuple, np.column_stack([by_expert, by_pairs]).tolist())),
        goal=goal,
        **spec.describe(),
        notes=(
            *spec.calibration_notes,
            *own_task_notes(candidates.own_task, goal, trained=candidates.ranked_there),
            *idle_notes(spec, drawn),
            *measured_notes(drawn, idle),
            *ranking_notes([pair.label for pair in certified], best, by_pairs, goal),
            *expert_notes(
                expert_band,
                candidates.baseline.gait.duration_s,
                duration_s,
                toppled_share(of_expert.lean_deg[:, 0]),
            ),
            *phase_notes(baseline.phases_deg, phase_deg),
            *pair_notes(certified, goal),
        ),
        wall_s=time.monotonic() - start,
    )


@dataclass(frozen=True, eq=False)
class _Evidence:
    """What a certificate is told from.

    Attributes:
        spec: What the pairs walked as.
        action_s: Length of an action [s].
        cycle_s: Length of a cycle [s].
        numbers: Of the unseen worlds by name, each (world,).
        by_expert: What the expert achieves there [the goal's unit], (world,); NaN where a
            simulation failed.
        walked: What the pairs do.
        nominal: In the world as it stands.
        promised: What the training says of its pairs.
        alike: What they do in unseen worlds that were drawn as the training's, (world, pair).
        promised_world_count: Over how many worlds the training's means are; 0 where it says what
            it found in one.
        goal: What is achieved.
    """

    spec: RobotSpec
    action_s: float
    cycle_s: float
    numbers: Mapping[str, np.ndarray]
    by_expert: np.ndarray
    walked: WalksInWorlds
    nominal: Sequence[float | None]
    promised: Sequence[float | None]
    alike: np.ndarray
    promised_world_count: int
    goal: Goal

    def of(self, place: int, walker: Walker, gait_file: str) -> CertifiedPair:
        """What is to be expected of one pair."""
        achieved, promised = self.walked.achieved[:, place], self.promised[place]
        alike = counted_walks(self.alike[:, place])
        counted, ratio = counted_walks(achieved), self.walked.range_ratio[:, place]
        known = ratio[~np.isnan(ratio)]
        trajectory = recorded_walk(
            self.spec,
            walker.design,
            walker.gait,
            record_every=5,
            settling_steps=walker.settling_steps,
        )
        cycle_s = min(self.cycle_s, walker.gait.duration_s)
        did = analysed_robot(walker, trajectory, self.spec, self.action_s, cycle_s, self.goal)
        return CertifiedPair(
            label=walker.label,
            design=str(walker.design),
            gait=gait_file,
            nominal=self.nominal[place],
            band=Band.of(achieved),
            share_beyond_expert=share_beyond(achieved, self.by_expert),
            promised=promised,
            optimism=None if promised is None else promised - float(alike.mean()),
            optimism_error=None if promised is None else self._error_of_optimism(alike),
            hub_load_share=did.hub_load_share,
            backsliding=did.backsliding,
            legs=did.legs,
            left_range_share=float(np.mean(known > RANGE_TOLERANCE)) if known.size else None,
            toppled_share=toppled_share(self.walked.lean_deg[:, place]),
            sensitivities=sensitivities(self.numbers, counted),
        )

    def _error_of_optimism(self, alike: np.ndarray) -> float | None:
        """Standard error of a mean over the training's worlds less one over unseen worlds that are
        drawn alike, in which a robot achieves this, (world,); None where there is no such mean."""
        if not self.promised_world_count or len(alike) < 2:
            return None
        per_world = 1.0 / self.promised_world_count + 1.0 / len(alike)
        return float(alike.std(ddof=1) * np.sqrt(per_world))


def best_on_average(achieved: np.ndarray) -> int:
    """Number of the gait whose mean is the largest, as of `means_over_worlds`; one that failed in
    all worlds comes behind all others: none is the best because it fails where others go backward.

    Args:
        achieved: In each world [any unit], (world, gait); NaN where the simulation failed.
    """
    lost = np.isnan(achieved).all(axis=0)
    return int(np.argmax(np.where(lost, -np.inf, means_over_worlds(achieved))))


def means_over_worlds(achieved: np.ndarray) -> np.ndarray:
    """Mean of each gait over worlds [the same unit], (gait,), walks that failed counted as by
    `counted_walks`, as a training counts them.

    Args:
        achieved: In each world [any unit], (world, gait); NaN where the simulation failed.
    """
    means: np.ndarray = counted_walks(achieved).mean(axis=0)
    return means


def _tuned_expert(
    sweep: PhaseSweepSettings,
    spec: RobotSpec,
    worlds: Sequence[World],
    folder: RunFolder,
    goal: Goal,
) -> tuple[Walker, float]:
    """The expert's robot at the phase of its largest mean, and that phase [degrees]."""
    design = Design.parse(sweep.design)
    gaits = [replace(sweep.gait, phase_deg=phase) for phase in sweep.phases_deg]
    achieved, *_ = walks_in_worlds(
        spec,
        [design] * len(gaits),
        gaits,
        worlds,
        sweep.settling_step_count,
        folder,
        goal,
        keep=True,
    )
    best = gaits[best_on_average(achieved)]
    return Walker(EXPERT, design, best, sweep.settling_step_count), best.phase_deg


def _walked(
    spec: RobotSpec,
    walkers: Sequence[Walker],
    worlds: Sequence[World],
    folder: RunFolder,
    goal: Goal,
) -> WalksInWorlds:
    """As `walks_in_worlds`; what a stopped certificate had walked is read."""
    return walks_in_worlds(
        spec,
        [each.design for each in walkers],
        [each.gait for each in walkers],
        worlds,
        walkers[0].settling_steps,
        folder,
        goal,
        keep=True,
    )


def _nominal(spec: RobotSpec, walkers: Sequence[Walker], goal: Goal) -> list[float | None]:
    """What walkers achieve in the world as it stands; None where a simulation failed."""
    walked = walk(
        spec.simulator([each.design for each in walkers]),
        [each.gait for each in walkers],
        duration_s=walkers[0].gait.duration_s,
        time_step_s=spec.physics.time_step_s,
        settling_step_count=walkers[0].settling_steps,
        record_step_count=100,
    )
    return [None if np.isnan(far) else float(far) for far in walked.achieved(goal)]


def worst_worlds(achieved: np.ndarray, count: int) -> list[int]:
    """Numbers of the worlds where a pair achieves least, the worst first.

    Args:
        achieved: By it in each, (world,); NaN where it failed, see `counted_walks`.
        count: How many.
    """
    order = np.argsort(counted_walks(achieved), kind="stable")
    return [int(number) for number in order[:count]]


def _with_full_order(
    spec: RobotSpec,
    settings: CertificateSettings,
    walkers: Sequence[Walker],
    pairs: Sequence[CertifiedPair],
    best: int,
    worlds: Sequence[World],
    by_pairs: np.ndarray,
    folder: RunFolder,
    goal: Goal,
) -> list[CertifiedPair]:
    """The pairs with their walks as finite elements, beside those on the robot's own legs: finite
    elements know nothing of the other reductions that worlds may have."""
    worst = worst_worlds(by_pairs[:, best], settings.worst_world_count)
    others = [number for number in worst if worlds[number].reduction]
    if others:
        own = [replace(worlds[number], reduction="") for number in others]
        by_pairs = by_pairs.copy()
        by_pairs[others, best] = _walked(spec, [walkers[best]], own, folder, goal).achieved[:, 0]
    # The best pair's first: who stops here has learned most.
    asked: list[tuple[int, int | None]] = [(best, number) for number in (None, *worst)]
    asked += [(place, None) for place in range(len(pairs)) if place != best]
    folder.progress.stage(f"{len(asked)} walks as finite elements")
    kept = full_order_walks(
        spec,
        [(walkers[place], None if number is None else worlds[number]) for place, number in asked],
        folder,
        spec.executor,
        goal,
    )
    folder.progress.stage("repeating reduced robots in worlds a thousandth away")
    nominal = World.nominal(spec.physics)
    found: list[list[FullOrderWalk]] = [[] for _ in pairs]
    for (place, number), walked in zip(asked, kept, strict=True):
        reduced = pairs[place].nominal if number is None else float(by_pairs[number, place])
        if reduced is not None and np.isnan(reduced):
            reduced = None
        here = nominal if number is None else replace(worlds[number], reduction="")
        near = _walked(spec, [walkers[place]], near_worlds(here, spec.physics), folder, goal)
        found[place].append(FullOrderWalk.of(number, walked, reduced, goal, near.achieved[:, 0]))
    return [
        replace(pair, full_order=tuple(walks)) for pair, walks in zip(pairs, found, strict=True)
    ]
