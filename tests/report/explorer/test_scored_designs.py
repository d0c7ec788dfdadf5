"""What is known of designs comes from a run's own files, and stands at the right design."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pneumorph.base.artefact import ArtefactError
from pneumorph.base.settings import settings_to_dict
from pneumorph.environment.crawling_task import CrawlingTask
from pneumorph.learn.checkpoint import save_checkpoint
from pneumorph.learn.design_distribution import gibbs
from pneumorph.learn.factored_distribution import FactoredDistribution
from pneumorph.learn.settings import CooptSettings
from pneumorph.physics.physics import Physics
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


ROBUST = {"kind": "mean_minus_deviations", "worlds_per_design": 4, "evaluation_worlds": 16}
RANKED_BY = "mean less 1 standard deviations of 16 worlds"


def trained(
    folder: Path,
    arrays: dict[str, np.ndarray],
    pairs: list[dict[str, Any]],
    summary: dict[str, Any] | None = None,
    **coopt: Any,
) -> FinishedRun:
    """A run whose newest checkpoint has arrays of a distribution."""
    metadata = {
        "timestep": 1, "update_count": 0, "failure_count": 0, "seconds": {}, "random_state": "{}",
        "settings": {}, "provenance": {}, "wall_s": 1.0, "remarks": [],
    }  # fmt: skip
    named = {f"distribution/{name}": values for name, values in arrays.items()}
    save_checkpoint(folder / "training", named, metadata)
    asked = {"space": settings_to_dict(SPACE), "task": settings_to_dict(TASK), **coopt}
    return FinishedRun(folder, {"pairs": pairs, **(summary or {})}, {"coopt": asked})


def test_a_training_gives_scores_probabilities_and_pairs(tmp_path: Path) -> None:
    """Of an earlier version, which has zero where a design never walked, or failed."""
    scores = np.arange(SPACE.size, dtype=float)
    arrays = {"scores": scores, "inverse_temperature": np.array(0.5)}
    scored = scored_by_training(trained(tmp_path, arrays, PAIRS))
    assert scored.space == SPACE
    assert np.isnan(scored.score_cm[0])  # never tried, or failed
    assert np.array_equal(scored.score_cm[1:], scores[1:])
    np.testing.assert_allclose(scored.probability, gibbs(scores, 0.5))
    assert scored.pairs[SPACE.index(Design.parse("1.2.1.2"))] == ("L1", 3.5)
    assert np.isnan(scored.pairs[SPACE.index(Design.parse("0.1.1.2"))][1])


def test_a_best_pair_has_what_ranked_it_whatever_it_did_in_training(tmp_path: Path) -> None:
    """The run's own order of its pairs is that of the page."""
    scores = np.full(SPACE.size, 9.0)
    scores[0] = 0.0
    pairs = [
        {"design": str(SPACE[index]), "distance_cm": 2.5, "score_cm": score_cm}
        for index, score_cm in ((1, 1.5), (0, 1.25))
    ]
    run = trained(tmp_path, {"scores": scores, "inverse_temperature": np.array(0.5)}, pairs)
    assert scored_by_training(run).score_cm[:3].tolist() == [1.25, 1.5, 9.0]


def test_a_design_that_did_not_walk_has_no_score(tmp_path: Path) -> None:
    """A checkpoint has for it what is expected of any; it says which walked, and in which worlds.
    Their probabilities are those that they are drawn with."""
    scores = np.full(SPACE.size, -10.5)
    scores[:4] = 7.0, -1e3, 12.0, 3.0
    walked, failing, nominal = np.zeros((3, SPACE.size), dtype=bool)
    walked[:4], failing[1], nominal[2] = True, True, True
    arrays = {
        "scores": scores, "inverse_temperature": np.array(0.5), "walked": walked,
        "failing": failing, "nominal": nominal, "untried_cm": np.array(-10.5),
    }  # fmt: skip
    told = {"ranked_by": RANKED_BY, "physics": settings_to_dict(Physics(friction=0.8))}
    robust = scored_by_training(trained(tmp_path, arrays, [], told, objective=ROBUST))
    assert np.flatnonzero(np.isfinite(robust.score_cm)).tolist() == [0, 3]
    assert robust.score_cm[[0, 3]].tolist() == [7.0, 3.0]
    np.testing.assert_allclose(robust.probability, gibbs(scores, 0.5))
    assert "newest mean less 1 standard deviations of 4 worlds in training;" in robust.meaning
    assert f"of a best pair what ranked it at the end, {RANKED_BY}" in robust.meaning
    assert "walked last in a single world" in robust.meaning
    assert "Robots walk in published physics but for friction, published damping, friction 0.8" in (
        robust.meaning
    )
    assert robust.of_pairs == "mean over the training's worlds"
    centred = trained(
        tmp_path / "centred", arrays, [], told, objective={**ROBUST, "centring_rounds": 8}
    )
    assert "worlds in training, less how easy its round was for all designs; of a best pair" in (
        scored_by_training(centred).meaning
    )
    one = scored_by_training(trained(tmp_path / "one", arrays, []))
    assert np.flatnonzero(np.isfinite(one.score_cm)).tolist() == [0, 2, 3]
    assert one.meaning == (
        "Score: newest distance in training; of a best pair what ranked it at the end. None where "
        "a design did not walk, or failed."
    )
    assert one.of_pairs == ""
    del arrays["nominal"]  # of an earlier version
    earlier = trained(tmp_path / "earlier", arrays, [], told, objective=ROBUST)
    assert np.flatnonzero(np.isfinite(scored_by_training(earlier).score_cm)).tolist() == [0, 2, 3]


@pytest.mark.parametrize("mirrored", [False, True])
def test_of_designs_beyond_a_list_scores_of_single_worlds_are_left_out(
    mirrored: bool, tmp_path: Path
) -> None:
    """Unless the mirror image walked in several, where its score counts as well."""
    asked = {"distribution": "factored", "objective": ROBUST, "mirror_transitions": mirrored}
    own = trained(tmp_path, {}, [], **asked).structured("coopt", CooptSettings)
    assert own.mirrored_scores == mirrored
    distribution = FactoredDistribution(SPACE, own.schedule, own.factored, mirrored)
    images = SPACE.images(np.arange(SPACE.size))[0]
    first, *others = np.flatnonzero(images != np.arange(SPACE.size)).tolist()
    fallen = next(each for each in others if each != images[first])
    of_one = np.array([first, fallen])
    distribution.take_round(of_one, np.array([12.0, -1e3]), np.array([False, True]))
    in_worlds = np.array([images[first]])
    distribution.take_round(in_worlds, np.array([5.0]), np.array([False]), in_worlds=True)
    scored = scored_by_training(trained(tmp_path, distribution.arrays(), [], **asked))
    assert scored.indices is not None
    known = dict(zip(scored.indices.tolist(), scored.score_cm.tolist(), strict=True))
    assert known[int(images[first])] == 5.0
    assert np.isnan(known[fallen])
    if mirrored:
        assert known[first] == 5.0
    else:
        assert np.isnan(known[first])


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
    assert scored.meaning == "Score: distance of the pairs of runs/e, reduced model."
    told = {"pairs": PAIRS, "model": "reduced", "physics": settings_to_dict(Physics(friction=0.8))}
    of_known = scored_by_evaluation(FinishedRun(Path("runs/e"), told, {}), SPACE)
    assert "model. Robots walk in published physics but for friction" in of_known.meaning
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
