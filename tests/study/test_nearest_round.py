"""Which leg is certified where reduced robots and finite elements part to the end."""

from dataclasses import replace
from pathlib import Path
from typing import cast

import numpy as np
import pytest

from pneumorph.catalogue.robot_spec import RobotSpec
from pneumorph.reduction.part_summary import PartSummary
from pneumorph.study.certified_candidates import CertificateSettings
from pneumorph.study.certified_pairs import CertifiedRound, RoundPair, share_beyond
from pneumorph.study.certified_rounds import _ending, _of_rounds, nearest_round
from pneumorph.study.certified_walks import FullOrderWalk


def a_round(*reduced_cm: float | None, full_cm: float | None = 20.0, states: str = "walk"):
    """Of one pair in as many worlds, the first of which is the nominal one."""
    walks = tuple(
        FullOrderWalk(
            None if number == 0 else number,
            full_cm,
            reduced,
            None,
            full_cm is not None and reduced is not None and abs(reduced - full_cm) < 0.5,
            "finished",
            states=f"{states}_{number}.npz",
        )
        for number, reduced in enumerate(reduced_cm)
    )
    leg = cast(PartSummary, type("Leg", (), {"part": f"{states}/leg.npz"}))
    pair = RoundPair("L1", "1.1.1", f"{states}/L1.csv", walks)
    return CertifiedRound(leg, (pair,), all(walk.agrees for walk in walks), 1.0)


def test_the_nearest_leg_is_certified_unless_the_last_one_agrees() -> None:
    worse, better, agreed = a_round(24.0, 21.0), a_round(21.0, 21.0), a_round(20.1, 20.1)
    assert nearest_round([worse]) == 0
    assert nearest_round([worse, better]) == 1
    assert nearest_round([better, worse]) == 0
    assert nearest_round([better, better]) == 1
    assert nearest_round([better, worse, agreed]) == 2
    # What does not come to its end is nearest to nothing.
    assert nearest_round([worse, a_round(20.1, None)]) == 0
    assert nearest_round([a_round(20.1, full_cm=None), worse]) == 1


def test_it_is_told_how_to_walk_with_it() -> None:
    rounds = [a_round(21.0), a_round(24.0, states="one"), a_round(22.0, states="two")]
    assert _of_rounds(rounds[:1], 0, "L1", Path("run"), False) == ()
    (of_run,) = _of_rounds(rounds, 0, "L1", Path("run"), False)
    assert "run's own leg" in of_run
    (middle,) = _of_rounds(rounds, 1, "L1", Path("run"), False)
    assert "nearest round's leg" in middle
    assert middle.endswith("--part one/leg.npz --design 1.1.1 --gait one/L1.csv")
    (last,) = _of_rounds(rounds, 2, "L1", Path("run"), True)
    assert "last round's leg" in last
    assert "part = 'two/leg.npz' of its module" in last


def test_agreement_on_walks_that_the_leg_was_made_from_is_told() -> None:
    first, same, other = a_round(24.0, 24.0), a_round(20.1, 20.1), a_round(20.1, states="other")
    settings, spec = CertificateSettings(full=True), cast(RobotSpec, None)
    told = _ending([first, same], settings, spec)
    assert told == (
        "reduced robots and finite elements agree, after 1 new reductions; 2 of the 2 walks are "
        "among the leg's own snapshots"
    )
    assert _ending([first, other], settings, spec) == (
        "reduced robots and finite elements agree, after 1 new reductions"
    )


@pytest.mark.parametrize(("failed", "share"), [([], 0.5), ([0], 0.5), ([1], 0.25)])
def test_who_fails_is_not_beyond_and_an_expert_that_fails_achieves_nothing(
    failed: list[int], share: float
) -> None:
    by_expert = np.array([5.0, -3.0, np.nan, np.nan])
    achieved = np.array([4.0, -1.0, 1.0, -1.0])
    achieved[failed] = np.nan
    assert share_beyond(achieved, by_expert) == share


def test_a_chaotic_walk_chooses_no_leg() -> None:
    """What it says of a leg is luck."""
    poor, good = a_round(23.0), a_round(20.1)
    lucky = replace(good.pairs[0].full_order[0], full=25.0, reduced=24.9, repeats=False)
    unlucky = replace(lucky, reduced=3.0)

    def beside(told: CertifiedRound, walk: FullOrderWalk) -> CertifiedRound:
        (pair,) = told.pairs
        return replace(told, pairs=(replace(pair, full_order=(*pair.full_order, walk)),))

    rounds = [beside(poor, lucky), replace(beside(good, unlucky), agrees=False)]
    assert nearest_round(rounds) == 1


def of_walks(*walks: tuple[float | None, float, bool]) -> CertifiedRound:
    """Of one pair in as many worlds: finite elements, reduced robot, whether it repeats."""
    told = a_round(*(reduced for _, reduced, _ in walks))
    (pair,) = told.pairs
    changed = tuple(
        replace(walk, full=full, repeats=repeats, agrees=False)
        for walk, (full, _, repeats) in zip(pair.full_order, walks, strict=True)
    )
    return replace(told, pairs=(replace(pair, full_order=changed),), agrees=False)


def test_a_walk_that_never_ends_does_not_hide_the_others() -> None:
    """As finite elements, in every round: once all rounds were equally far, and the last won."""
    near = of_walks((20.0, 20.5, True), (None, 18.0, True))
    far = of_walks((20.0, 29.0, True), (None, 18.0, True))
    assert nearest_round([near, far]) == 0
    assert nearest_round([far, near]) == 1
    # Fewer that do not end count more than how near the others are.
    assert nearest_round([of_walks((20.0, 29.0, True), (18.0, 18.0, True)), near]) == 0


def test_a_round_of_chaotic_walks_alone_is_the_nearest_to_nothing() -> None:
    near = of_walks((20.0, 20.5, True), (20.0, 20.4, True))
    chaotic = of_walks((20.0, 29.0, False), (20.0, 3.0, False))
    unended = of_walks((20.0, 29.0, True), (None, 18.0, True))
    assert nearest_round([near, chaotic]) == nearest_round([unended, chaotic]) == 0
    assert nearest_round([chaotic, near]) == nearest_round([chaotic, unended]) == 1
