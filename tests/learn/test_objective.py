"""What counts of distances in several worlds, in closed form, and a training that ranks by it."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import get_args

import numpy as np
import pytest
from gymnasium.spaces import Box
from helpers.toy_coopt import SPACE, CrawlersInWorlds, toy_settings

from pneumorph.environment.reward import RewardWeights
from pneumorph.environment.training_environment import TaskWrapper, TrainingEnvironment
from pneumorph.environment.viscous_crawler import viscous_crawler_robot
from pneumorph.learn.cooptimise import learn_in_folder
from pneumorph.learn.design_gait_pair import BestPairs
from pneumorph.learn.environments import crawling
from pneumorph.learn.evaluation import EVALUATION_SEED
from pneumorph.learn.finetuning import finalists
from pneumorph.learn.objective import Objective, ObjectiveKind, mean_of_worst
from pneumorph.learn.round_scores import RoundLevel, RoundScores
from pneumorph.learn.settings import FinetuningSettings
from pneumorph.learn.training import Training

DISTANCES = np.array([[4.0, 1.0, 3.0, 2.0], [5.0, 5.0, 5.0, 5.0]])


def test_objectives_are_what_their_names_say() -> None:
    assert Objective().of(DISTANCES) == pytest.approx([2.5, 5.0])
    lowered = Objective("mean_minus_deviations", deviations=2.0)
    # The variance of 1, 2, 3, 4 as a sample is 5/3.
    # And four normals have sqrt(8 / (3 pi)) of their deviation in expectation.
    deviation = np.sqrt(5.0 / 3.0) / np.sqrt(8.0 / (3.0 * np.pi))
    assert lowered.of(DISTANCES) == pytest.approx([2.5 - 2.0 * deviation, 5.0])
    # One and a half of four values: (1 + 2/2) / 1.5.
    assert mean_of_worst(DISTANCES, 0.375) == pytest.approx([2.0 / 1.5, 5.0])
    # The smallest of three normals lies 3 / (2 sqrt(pi)) below their mean, the worst third of all
    # phi(z) / q.
    worst = Objective("worst_share", share=1.0 / 3.0)
    below = 3.0 * np.exp(-0.5 * 0.4307273**2) / np.sqrt(2.0 * np.pi) / (1.5 / np.sqrt(np.pi))
    assert worst.of(DISTANCES[:, 1:]) == pytest.approx([2.0 - below, 5.0], abs=1e-6)
    assert mean_of_worst(DISTANCES, 1.0) == pytest.approx([2.5, 5.0])
    assert mean_of_worst(DISTANCES, 0.01) == pytest.approx([1.0, 5.0])
    whole = Objective("worst_share", share=1.0)
    assert whole.of(DISTANCES) == pytest.approx([2.5, 5.0])
    for objective in (Objective(), lowered, worst, whole):
        np.testing.assert_array_equal(objective.of(DISTANCES[:, :1]), DISTANCES[:, 0])


def test_the_mean_of_a_normals_worst_fifth() -> None:
    """m - s phi(z) / q with z its fifth percentile (Rockafellar and Uryasev), within four standard
    errors of 20 000 draws."""
    draws = np.random.default_rng(0).normal(3.0, 2.0, 20_000)
    expected = 3.0 - 2.0 * np.exp(-0.5 * 0.8416212**2) / np.sqrt(2.0 * np.pi) / 0.2
    assert mean_of_worst(draws, 0.2) == pytest.approx(expected, abs=4.0 * 2.0 / np.sqrt(4_000))


def test_standard_errors() -> None:
    """Of the mean s / sqrt(n), an identity; of the others what 400 repetitions scatter by, whose
    own error is 3.5 %, and the jackknife's bias in 40 worlds some per cent."""
    error = Objective().standard_error(DISTANCES)
    assert error == pytest.approx(DISTANCES.std(axis=1, ddof=1) / 2.0)
    drawn = np.random.default_rng(1).normal(size=(400, 40))
    for objective in (Objective("mean_minus_deviations"), Objective("worst_share")):
        scatter = objective.of(drawn).std()
        assert objective.standard_error(drawn).mean() == pytest.approx(scatter, rel=0.15)
    with pytest.raises(ValueError, match="1 worlds, expected at least 2 for mean: fewer"):
        Objective().standard_error(DISTANCES[:, :1])
    with pytest.raises(ValueError, match="2 worlds, expected at least 3 for worst_share"):
        Objective("worst_share").standard_error(DISTANCES[:, :2])
    with pytest.raises(ValueError, match="worlds_per_design is 2, expected at least 3 for worst"):
        Objective("worst_share", worlds_per_design=2)


@pytest.mark.parametrize("kind", ["mean_minus_deviations", "worst_share"])
def test_few_worlds_promise_no_more_than_many(kind) -> None:
    """Of normal distances three, four and thirty worlds say the same: m - s, and m - s phi(z) / q.
    Within four standard errors of 20 000 draws; uncorrected, four worlds are 0.08 and 0.24 off."""
    expected = {"mean_minus_deviations": -1.0, "worst_share": -1.2711}[kind]
    for count in (3, 4, 30):
        scores = Objective(kind).of(np.random.default_rng(count).normal(size=(20_000, count)))
        assert scores.mean() == pytest.approx(expected, abs=4.0 * scores.std() / np.sqrt(20_000))


def test_scores_are_centred_about_the_level_of_rounds() -> None:
    """Two rounds' levels 2 and 6: the second is shifted to their mean, 4, the third to the level
    that it moves by half."""
    level = RoundLevel(2)
    np.testing.assert_allclose(level.centred(np.array([1.0, 3.0])), [1.0, 3.0])
    np.testing.assert_allclose(level.centred(np.array([5.0, 7.0])), [3.0, 5.0])
    again = RoundLevel(2)
    again.restore(level.state())
    for each in (level, again):
        np.testing.assert_allclose(each.centred(np.array([8.0])), [6.0])
    assert Objective("worst_share").said == "mean over the worst 25 % of 32 worlds"
    np.testing.assert_array_equal(RoundLevel(0).centred(np.array([5.0])), [5.0])


def test_designs_that_failed_do_not_say_how_hard_a_round_was() -> None:
    """Of scores 0, 6 and 8 the first failed: the mean 7 is shifted to the level, not 14/3."""
    level = RoundLevel(1000)
    level.centred(np.array([2.0, 4.0]))
    scores = level.centred(np.array([0.0, 6.0, 8.0]), np.array([False, True, True]))
    np.testing.assert_allclose(scores, [-2.0, 4.0, 6.0])
    before = level.state()
    none = np.zeros(2, dtype=bool)
    np.testing.assert_array_equal(level.centred(np.array([0.0, -1.0]), none), [0.0, -1.0])
    assert level.state() == before


ROBUST = Objective("worst_share", 0.0, 0.5, worlds_per_design=4, evaluation_worlds=8)


def training(objective: Objective = ROBUST, rounds: int = 4) -> Training:
    settings = replace(toy_settings(rounds), objective=objective, mirror_transitions=False)
    return Training(crawling(viscous_crawler_robot, CrawlersInWorlds, settings), settings)


def test_a_rounds_designs_walk_in_the_same_worlds() -> None:
    """Sixteen robots are four designs in four worlds; scores are the objective of the returns."""
    trained = training()
    metrics = trained.run_round()
    designs = trained.environment.designs
    assert [designs[4 * i : 4 * i + 4] == (designs[4 * i],) * 4 for i in range(4)] == [True] * 4
    assert metrics["score_standard_error_cm"] > 0.0
    walked = [SPACE.index(designs[4 * i]) for i in range(4)]
    scores = trained.learned.distribution.scores[walked]
    assert metrics["round_score_cm"] == pytest.approx(scores.mean())
    # The mean over the worst half is less than that over all.
    assert scores.mean() < metrics["return_mean_cm"]
    assert trained.best.pairs == []
    assert (
        "round_score_cm"
        not in Training(
            crawling(viscous_crawler_robot, CrawlersInWorlds, toy_settings(4)), toy_settings(4)
        ).run_round()
    )


def test_rounds_in_the_nominal_world_have_a_design_for_each_robot() -> None:
    """One round of three actions by sixteen robots, and then designs in four worlds each."""
    trained = training(replace(ROBUST, nominal_until_timestep=1, centring_rounds=3))
    metrics = trained.run_round()
    designs = [SPACE.index(design) for design in trained.environment.designs]
    assert len(set(designs)) > 4
    assert "round_score_cm" not in metrics
    # What is no mean over worlds does not say how hard later rounds are.
    assert trained.learned.scores.level.level_cm is None
    assert trained.run_round()["score_standard_error_cm"] > 0.0
    assert trained.learned.scores.level.level_cm is not None
    designs = trained.environment.designs
    assert all(designs[4 * i : 4 * i + 4] == (designs[4 * i],) * 4 for i in range(4))


def test_gaits_are_ranked_by_the_objective_over_worlds_of_their_own() -> None:
    """Each pair's gait walked again in the worlds of an evaluation."""
    trained = training()
    trained.run_round()
    pairs = trained.evaluate()
    assert len(pairs) == len(SPACE)
    task = trained.settings.task
    for pair in (pairs[0], pairs[-1]):
        distances = []
        for number in range(2):
            simulator = CrawlersInWorlds([SPACE[pair.design]] * 4)
            simulator.redraw(EVALUATION_SEED + number)
            for held in pair.held_kPa:
                simulator.advance(np.tile(held, (4, 1)), task.action_step_count)
            distances.append(simulator.forward_position_mm / 10.0)
        walked = np.concatenate(distances)
        assert pair.score_cm == pytest.approx(ROBUST.of(walked), abs=1e-9)
        assert pair.distance_cm == pytest.approx(walked.mean(), abs=1e-9)
    assert finalists(trained, pairs)[0] == pairs[0].design


@pytest.mark.parametrize("mirrored", [False, True])
def test_a_design_that_is_drawn_twice_counts_with_all_its_walks(
    monkeypatch: pytest.MonkeyPatch, mirrored: bool
) -> None:
    """Its score is the mean of those of its walks through the worlds, of each design that was
    drawn: and where a mirror image counts for a design, of those of its image too."""
    settings = replace(toy_settings(4), objective=ROBUST, mirror_transitions=mirrored)
    trained = Training(crawling(viscous_crawler_robot, CrawlersInWorlds, settings), settings)
    pair = next(i for i, image in enumerate(SPACE.mirror_index) if image != i)
    image, other = (
        int(SPACE.mirror_index[pair]),
        next(i for i, image in enumerate(SPACE.mirror_index) if image == i),
    )
    drawn = np.array([pair, other, image if mirrored else pair, other])
    returns = np.random.default_rng(0).normal(size=16)
    monkeypatch.setattr(trained, "walk_and_learn", lambda *_: (returns, np.zeros(16, bool), []))
    monkeypatch.setattr(trained.learned.distribution, "sample", lambda *_: drawn)
    trained.run_round()
    by_world = returns.reshape(4, 4)
    for design, rows in ((pair, [0, 2]), (other, [1, 3]), *([(image, [0, 2])] * mirrored)):
        expected = ROBUST.of(by_world[rows]).mean()
        assert trained.learned.distribution.scores[design] == pytest.approx(expected)


@pytest.mark.parametrize("kind", get_args(ObjectiveKind))
def test_a_design_that_is_drawn_often_scores_no_higher(kind: ObjectiveKind) -> None:
    """What a score is on average does not depend on how often a round draws the design: worlds are
    shared, and eight robots in four worlds say no more of worlds than one does."""
    random = np.random.default_rng(0)
    scores = RoundScores(Objective(kind=kind, worlds_per_design=4), None)
    differences = []
    for _ in range(800):
        returns = random.normal(scale=5.0, size=4) + random.normal(scale=2.0, size=(9, 4))
        found = scores.of(np.array([0] + [1] * 8), returns.ravel(), np.zeros(36, bool))
        differences.append(found.scores_cm[1] - found.scores_cm[0])
    error = float(np.std(differences)) / math.sqrt(len(differences))
    assert abs(np.mean(differences)) < 4.0 * error  # by chance once in 16 000
    assert error < 0.2


class _Failing(CrawlersInWorlds):
    """Robots fail in marked worlds as their second action ends, and then begin anew."""

    failing_worlds: tuple[int, ...] = (0, 2)

    def reset(self, active: np.ndarray | None = None) -> None:
        super().reset(active)
        self._settled = 0 if active is None else self._settled

    def advance(self, command_kPa, step_count, active=None) -> None:
        super().advance(command_kPa, step_count, active)
        self._settled += 1
        if self._settled == 3:  # after settling and two actions
            marked = np.isin(np.arange(len(self._status)) % 4, self.failing_worlds)
            self._status[marked] = 1


def test_a_gait_is_that_of_a_world_where_its_robot_did_not_fail() -> None:
    """Worlds that differ do not change a gait; a robot that fails begins it anew."""
    settings = replace(toy_settings(1), objective=ROBUST, mirror_transitions=False)
    whole = Training(
        crawling(viscous_crawler_robot, CrawlersInWorlds, settings), settings
    ).evaluate()
    failing = Training(crawling(viscous_crawler_robot, _Failing, settings), settings).evaluate()
    gaits = {pair.design: pair.held_kPa for pair in whole}
    assert len(failing) == len(gaits)
    for pair in failing:
        np.testing.assert_array_equal(pair.held_kPa, gaits[pair.design])


def test_a_hard_round_is_no_merit_of_a_design_that_failed_everywhere(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Of a round far below the level before it, the others alone are shifted up."""
    trained = training(replace(ROBUST, centring_rounds=8))
    trained.learned.scores.level.centred(np.array([1000.0]))
    returns, failed = np.ones(16), np.arange(16) < 4
    monkeypatch.setattr(trained, "walk_and_learn", lambda *_: (returns, failed, []))
    monkeypatch.setattr(trained.learned.distribution, "sample", lambda *_: np.arange(4))
    trained.run_round()
    assert trained.learned.distribution.scores[0] == 0.0
    assert trained.learned.distribution.scores[1:4].min() > 100.0


def test_a_resumed_training_goes_on_to_the_same_scores() -> None:
    objective = replace(ROBUST, centring_rounds=3)
    whole, first, resumed = training(objective), training(objective), training(objective)
    for _ in range(4):
        whole.run_round()
    for _ in range(2):
        first.run_round()
    resumed.restore(first.arrays(), first.metadata())
    for _ in range(2):
        resumed.run_round()
    ours, theirs = (each.learned.distribution.scores for each in (resumed, whole))
    np.testing.assert_array_equal(ours, theirs)


def test_robots_that_cannot_share_worlds_are_refused() -> None:
    with pytest.raises(ValueError, match="16, expected a multiple of worlds_per_design, 5"):
        replace(toy_settings(1), objective=Objective(worlds_per_design=5))


def test_a_training_reports_distances_beside_what_ranked_its_pairs() -> None:
    """In one world: 0.05 cm taken off for each change of a pressure by its whole range; kept with
    the pairs, of which those of earlier versions have distances alone."""
    settings = toy_settings(1)
    task = replace(settings.task, reward=RewardWeights(pressure_change=0.05))
    trained = Training(
        crawling(
            viscous_crawler_robot,
            CrawlersInWorlds,
            replace(settings, task=task, mirror_transitions=False),
        ),
        replace(settings, task=task, mirror_transitions=False),
    )
    trained.run_round()
    trained.evaluate()
    kept = trained.best.arrays()
    for pair in trained.best.pairs:
        before = np.vstack([np.zeros(task.regulator_count), pair.held_kPa[:-1]])
        changes = np.abs(pair.held_kPa - before).sum() / task.maximum_pressure_kPa
        assert pair.score_cm == pytest.approx(pair.distance_cm - 0.05 * changes, abs=1e-6)
    again = BestPairs(SPACE, 5)
    again.restore(kept)
    assert [pair.score_cm for pair in again.pairs] == list(kept["score_cm"])
    again.restore({name: value for name, value in kept.items() if name != "score_cm"})
    assert [pair.score_cm for pair in again.pairs] == list(kept["distance_cm"])


def test_designs_are_ranked_where_they_are_judged_and_not_where_they_learn(
    tmp_path: Path,
) -> None:
    class Further(CrawlersInWorlds):
        """Robots that learn go twice as far as they are judged to."""

        @property
        def forward_position_mm(self) -> np.ndarray:
            return 2.0 * super().forward_position_mm

    settings = training(rounds=3).settings
    usual = crawling(viscous_crawler_robot, CrawlersInWorlds, settings)
    further = crawling(viscous_crawler_robot, Further, settings)
    both = Training(further, settings, usual)
    while not both.is_finished:
        both.run_round()
    learned = both.arrays(), both.metadata()
    judged = both.evaluate()
    alone, among_learners = Training(usual, settings), Training(further, settings)
    for each in (alone, among_learners):
        each.restore(*learned)
    assert [pair.distance_cm for pair in judged] == [p.distance_cm for p in alone.evaluate()]
    far = {pair.design: pair.distance_cm for pair in among_learners.evaluate()}
    assert all(far[pair.design] == pytest.approx(2.0 * pair.distance_cm) for pair in judged)
    # So are finalists, and a whole run in a folder.
    settings = replace(settings, finetuning=FinetuningSettings(1, settings.timesteps_per_round, 1))
    found = learn_in_folder(further, settings, tmp_path / "both", make_judged=usual)
    again = learn_in_folder(further, settings, tmp_path / "among_learners")
    assert found.finetuning_timesteps > 0
    shares = [a.score_cm / b.score_cm for a, b in zip(again.pairs, found.pairs, strict=False)]
    assert shares[0] == pytest.approx(2.0)


class Backwards(CrawlersInWorlds):
    """Robots that learn go the other way: who is worst judged does best."""

    @property
    def forward_position_mm(self) -> np.ndarray:
        return -super().forward_position_mm


def test_a_shortlist_is_made_in_few_worlds_where_robots_learn_and_ranked_where_they_are_judged(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """One policy with and without a list of three designs: who is on it is among the
    best in four of 16 worlds backwards, and fares in all of them as it does without."""
    episodes: list[tuple[type, int]] = []
    redraw = CrawlersInWorlds.redraw

    def noted(self: CrawlersInWorlds, number: int) -> None:
        episodes.append((type(self), len(self.forward_position_mm)))
        redraw(self, number)

    settings = training(replace(ROBUST, evaluation_worlds=16), rounds=3).settings
    shortlist = replace(settings, shortlist_count=3, kept_pair_count=2)
    few = replace(settings, objective=replace(ROBUST, evaluation_worlds=4))
    usual = crawling(viscous_crawler_robot, CrawlersInWorlds, settings)
    backwards = crawling(viscous_crawler_robot, Backwards, settings)
    every = Training(usual, settings)
    while not every.is_finished:
        every.run_round()
    monkeypatch.setattr(CrawlersInWorlds, "redraw", noted)
    evaluated = {}
    for name, trained in {
        "listed": Training(backwards, shortlist, usual),
        "all judged": Training(usual, settings),
        "few backwards": Training(backwards, few),
    }.items():
        trained.restore(every.arrays(), every.metadata())
        episodes.clear()
        evaluated[name] = trained.evaluate()
        if name == "listed":
            # All designs in four worlds, four at once, and three designs in 16.
            first = [(Backwards, 16)] * math.ceil(len(SPACE) / 4)
            assert episodes == first + [(CrawlersInWorlds, 12)] * 4
    listed, alone = evaluated["listed"], {pair.design: pair for pair in evaluated["all judged"]}
    assert len(alone) == len(SPACE) > len(listed) == 3
    for pair in listed:
        assert pair.score_cm == pytest.approx(alone[pair.design].score_cm, rel=1e-9)
        np.testing.assert_array_equal(pair.held_kPa, alone[pair.design].held_kPa)
    assert [pair.score_cm for pair in listed] == sorted((p.score_cm for p in listed), reverse=True)
    best = BestPairs(SPACE, 3)
    best.offer(evaluated["few backwards"])
    assert {pair.design for pair in listed} == {pair.design for pair in best.pairs}
    assert max(pair.score_cm for pair in listed) < evaluated["all judged"][0].score_cm


def test_how_many_designs_and_robots_an_evaluation_has() -> None:
    """As many as are asked for, however short the list; no list where that would save nothing."""
    settings = replace(
        training(replace(ROBUST, evaluation_worlds=16)).settings,
        shortlist_count=3,
        kept_pair_count=2,
    )
    assert (settings.ranked_design_count, settings.judged_robot_count) == (3, 12)
    assert replace(settings, kept_pair_count=5).ranked_design_count == 5
    tuned = replace(settings, finetuning=FinetuningSettings(4, 1, 1))
    assert (tuned.ranked_design_count, tuned.judged_robot_count) == (4, 16)
    for objective in (Objective(), replace(ROBUST, evaluation_worlds=4)):
        every = replace(settings, objective=objective)
        assert (every.ranked_design_count, every.judged_robot_count) == (len(SPACE), 16)
    firsts = [replace(ROBUST, evaluation_worlds=count).first_worlds for count in (3, 16, 24, 32)]
    assert firsts == [4, 4, 8, 8]


def test_an_environment_of_evaluations_that_is_none_for_what_is_learned_is_refused() -> None:
    settings = training().settings
    usual = crawling(viscous_crawler_robot, CrawlersInWorlds, settings)
    single = toy_settings(4)
    same = crawling(viscous_crawler_robot, CrawlersInWorlds, single)
    with pytest.raises(ValueError, match="expected an objective over several worlds"):
        Training(same, single, same)

    class Remembering(TaskWrapper):
        """One number more in its states."""

        def __init__(self, environment: TrainingEnvironment) -> None:
            super().__init__(environment)
            (size,) = environment.single_observation_space.shape
            self.single_observation_space = Box(-np.inf, np.inf, (size + 1,), np.float32)

    size = Training(usual, settings)._state_size
    with pytest.raises(ValueError, match=f"states of {size + 1} numbers .* expected {size}"):
        Training(usual, settings, lambda designs: Remembering(usual(designs)))
