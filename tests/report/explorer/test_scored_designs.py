"""What is known of designs comes from a run's own files, and stands at the right design."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from pneumorph.base.artefact import ArtefactError
from pneumorph.base.settings import settings_to_dict
from pneumorph.environment.crawling_task import CrawlingTask
from pneumorph.learn.checkpoint import save_checkpoint
from pneumorph.learn.design_distribution import gibbs
from pneumorph.report.explorer.page import explorer_data
from pneumorph.report.explorer.scored_designs import (
    ScoredDesigns,
    recorded_walks,
    scored_by_evaluation,
    scored_by_training,
    unscored,
)
from pneumorph.report.replay.replay_data import ReplaySettings
from pneumorph.report.style import regulator_colour
from pneumorph.robot.design import Design
from pneumorph.robot.design_space import DesignSpace
from pneumorph.study.finished_run import FinishedRun

SPACE = DesignSpace(location_count=4, regulator_count=2, maximum_legs=4)
TASK = CrawlingTask(regulator_count=2)
PAIRS = [{"design": "1.2.1.2", "distance_cm": 3.5}, {"design": "0.1.1.2", "distance_cm": None}]


def test_a_training_gives_scores_probabilities_and_pairs(tmp_path: Path) -> None:
    scores = np.arange(SPACE.size, dtype=float)
    arrays = {"distribution/scores": scores, "distribution/inverse_temperature": np.array(0.5)}
    metadata = {
        "timestep": 1, "update_count": 0, "failure_count": 0, "seconds": {}, "random_state": "{}",
        "settings": {}, "provenance": {}, "wall_s": 1.0, "remarks": [],
    }  # fmt: skip
    save_checkpoint(tmp_path / "training", arrays, metadata)
    asked = {"space": settings_to_dict(SPACE), "task": settings_to_dict(TASK)}
    run = FinishedRun(tmp_path, {"pairs": PAIRS}, {"coopt": asked})
    scored = scored_by_training(run)
    assert scored.space == SPACE
    assert np.isnan(scored.score_cm[0])  # never tried, or failed
    assert np.array_equal(scored.score_cm[1:], scores[1:])
    np.testing.assert_allclose(scored.probability, gibbs(scores, 0.5))
    assert scored.pairs[SPACE.index(Design.parse("1.2.1.2"))] == ("L1", 3.5)
    assert np.isnan(scored.pairs[SPACE.index(Design.parse("0.1.1.2"))][1])
    # A best pair that training itself did not score, as a mirror image, has what ranked it.
    first = {"design": str(SPACE[0]), "distance_cm": 2.5, "score_cm": 1.25}
    scored_first = {"design": str(SPACE[1]), "distance_cm": 2.0, "score_cm": 1.5}
    run = FinishedRun(tmp_path, {"pairs": [first, scored_first]}, {"coopt": asked})
    assert scored_by_training(run).score_cm[:2].tolist() == [1.25, scores[1]]


def test_scores_of_another_space_are_refused(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"score_cm has shape \(3,\), expected"):
        ScoredDesigns(SPACE, np.zeros(3))


def test_a_run_of_another_kind_is_refused_by_what_it_is(tmp_path: Path) -> None:
    with pytest.raises(ArtefactError, match=r"has no pairs, expected a list.*`pneumorph reduce`"):
        scored_by_evaluation(FinishedRun(tmp_path, {"verb": "reduce"}, {}), SPACE)
    damaged = FinishedRun(tmp_path, {"verb": "evaluate", "pairs": [{"design": 3}]}, {})
    with pytest.raises(ArtefactError, match=r"summary\.json: it is no BestPairs: .*distance_cm"):
        scored_by_evaluation(damaged, SPACE)


def test_an_evaluation_scores_its_pairs_alone() -> None:
    run = FinishedRun(Path("runs/e"), {"pairs": PAIRS, "model": "reduced"}, {})
    scored = scored_by_evaluation(run, SPACE)
    assert np.flatnonzero(np.isfinite(scored.score_cm)) == [SPACE.index(Design.parse("1.2.1.2"))]
    assert scored.probability is None
    assert not np.isfinite(unscored(SPACE).score_cm).any()


def test_walks_are_put_to_their_designs(make_trajectory, tmp_path: Path) -> None:
    space = DesignSpace()
    make_trajectory().save(tmp_path / "best_trajectory.npz")
    make_trajectory("2.0.0.1.1.0.0.2").save(tmp_path / "trajectory_full_L2.npz")
    make_trajectory("1.0.0.0.0.0.0.1").save(
        tmp_path / "trajectory.npz"
    )  # two legs: not of the space
    (place,) = found = recorded_walks(space, [tmp_path])
    assert place == space.index(Design.parse("1.0.0.2.2.0.0.1"))
    assert [label for label, _ in found[place]] == ["learned", "L2"]


def test_of_more_designs_than_can_be_listed_some_are_shown() -> None:
    """Each once, all of them members; their regulators have colours however many there are."""
    space = DesignSpace(location_count=8, regulator_count=8, minimum_legs=5, canonical=False)
    shown = unscored(space)
    names = [str(design) for design in shown.designs]
    assert len(set(names)) == len(names) == len(shown.score_cm) > 400
    assert all(Design.parse(name) in space for name in names)
    assert f"{len(names)} of {len(space)} designs" in shown.meaning
    data = explorer_data(shown, "walk DESIGN", ReplaySettings())
    assert data["designs"] == names
    assert data["colours"] == [regulator_colour(number) for number in range(9)]


def test_symmetric_designs_are_told_where_images_count_as_one() -> None:
    """Counted as one with its image, a design need not be its own."""
    apart = DesignSpace(location_count=4, regulator_count=2, maximum_legs=4)
    merged = DesignSpace(
        location_count=4, regulator_count=2, maximum_legs=4, symmetries=("mirror",)
    )
    assert len(merged) < len(apart)
    told = dict(zip(map(str, apart), unscored(apart).is_symmetric, strict=True))
    found = unscored(merged)
    assert [told[str(design)] for design in found.designs] == found.is_symmetric.tolist()
    assert 0 < found.is_symmetric.sum() < len(merged)
