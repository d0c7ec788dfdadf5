"""A pair that is ahead of the best in unseen worlds is named, and only where it surely is."""

import numpy as np

from pneumorph.environment.goal import FORWARD
from pneumorph.study.ranking_notes import ranking_notes

LABELS = ("L1", "L2", "L3")


def test_only_a_pair_that_is_surely_ahead_is_named():
    draw = np.random.default_rng(0)
    common = draw.normal(20.0, 8.0, 200)
    walked = np.column_stack([common, common + draw.normal(1.0, 2.0, 200), common - 1.0])
    (note,) = ranking_notes(LABELS, 0, walked, FORWARD)
    ahead = walked[:, 1] - walked[:, 0]
    assert note.startswith(f"L2 achieves {ahead.mean():.1f} cm more than L1 on average")
    assert f"standard error {ahead.std(ddof=1) / np.sqrt(200):.1f} cm" in note
    assert f"more in {100 * np.mean(ahead > 0):.0f} % of them" in note
    # The same lead that other worlds scatter by counts for nothing.
    apart = np.column_stack([common, draw.permutation(common) + 1.0, common - 1.0])
    assert ranking_notes(LABELS, 0, apart, FORWARD) == ()
    assert ranking_notes(LABELS, 1, walked, FORWARD) == ()


def test_a_walk_that_failed_counts_as_none_and_one_world_says_nothing():
    walked = np.full((50, 2), 10.0)
    walked[::2, 0] = np.nan
    assert "L2 achieves 5.0 cm more" in ranking_notes(LABELS[:2], 0, walked, FORWARD)[0]
    assert ranking_notes(LABELS[:2], 0, walked[:1], FORWARD) == ()
