"""Gaits that a training is shown: its first round walks them, and they compete at the end."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from helpers.toy_coopt import (
    SPACE,
    TASK,
    TIME_STEP_S,
    CrawlersInWorlds,
    make_simulator,
    toy_settings,
)

from pneumorph.environment.viscous_crawler import viscous_crawler_robot
from pneumorph.gait.gait_file import read_gait
from pneumorph.gait.held_gait import HeldGait
from pneumorph.learn.cooptimise import learn_in_folder
from pneumorph.learn.demonstrations import known_pair
from pneumorph.learn.design_gait_pair import DesignGaitPair
from pneumorph.learn.environments import crawling
from pneumorph.learn.evaluation import evaluation_seeds
from pneumorph.learn.objective import Objective
from pneumorph.learn.settings import CooptSettings, FinetuningSettings
from pneumorph.learn.training import Training
from pneumorph.robot.design import Design

ACTION_S = TASK.action_step_count * TIME_STEP_S
# Round the square of two pressures, which carries a viscous crawler furthest; of 1.0.2.0 forward.
SQUARE_KPA = np.array([[90.0, 0.0], [90.0, 90.0], [0.0, 90.0], [0.0, 0.0]])
NAMED, NAMED_KPA = Design.parse("2.0.1.0"), SQUARE_KPA[:, ::-1]
ROBUST = Objective("mean", worlds_per_design=4, evaluation_worlds=8)


def shown(
    design: Design = NAMED, held_kPa: np.ndarray = NAMED_KPA, hold_s: float = ACTION_S
) -> DesignGaitPair:
    gait = HeldGait.evenly(held_kPa, hold_s)
    return known_pair(gait, design, SPACE, TASK, ACTION_S, "demonstration")


def training(settings: CooptSettings, demonstrations: list[DesignGaitPair]) -> Training:
    factory = make_simulator if not settings.objective.is_robust else CrawlersInWorlds
    environments = crawling(viscous_crawler_robot, factory, settings)
    return Training(environments, settings, demonstrations=demonstrations)


def test_a_gait_fills_an_episode_under_the_names_of_its_design() -> None:
    """The design 2.0.1.0 is 1.0.2.0 of the space, whose first regulator is its second; four
    pressures fill sixteen actions four times."""
    pair = shown()
    assert str(SPACE[pair.design]) == "1.0.2.0"
    np.testing.assert_array_equal(pair.held_kPa, np.tile(SQUARE_KPA, (4, 1)))
    own = shown(Design.parse("1.0.2.0"), SQUARE_KPA)
    assert own.design == pair.design
    np.testing.assert_array_equal(own.held_kPa, pair.held_kPa)


def test_an_action_has_what_a_gait_comes_to_by_its_end() -> None:
    """Of pressures that change thrice in an action the third; eight actions are half an episode."""
    third_s = ACTION_S / 3.0
    rising = np.stack([np.arange(24.0), np.arange(24.0)[::-1]], axis=1)
    pair = shown(Design.parse("1.0.2.0"), rising, third_s)
    expected = np.arange(2.0, 2.0 + 3.0 * TASK.action_count, 3.0) % 24.0
    np.testing.assert_array_equal(pair.held_kPa[:, 0], expected)
    np.testing.assert_array_equal(pair.held_kPa[:, 1], 23.0 - expected)


@pytest.mark.parametrize("worlds", [1, 4])
def test_half_of_a_beginnings_first_robots_walk_what_is_shown(
    worlds: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of the designs of a round, 16 or four, half have those of two gaits in turn; the last of
    each does exactly that, others nearly, and the rest what the policy says, as without."""
    settings = replace(toy_settings(2), restarts=2, mirror_transitions=False)
    settings = replace(settings, objective=replace(ROBUST, worlds_per_design=worlds))
    pairs = [shown(), shown(Design.parse("1.1.0.2"))]
    rounds = {}
    for name, demonstrations in (("with", pairs), ("without", [])):
        trained, noted = training(settings, demonstrations), []
        step = trained.environment.step

        def noting(action, noted=noted, trained=trained, step=step):
            noted.append((np.array(action), trained.environment.designs))
            return step(action)

        monkeypatch.setattr(trained, "_step", noting)
        while not trained.is_finished:
            if trained.is_restart_over:
                trained.begin_again()
            trained.run_round()
        rounds[name] = noted
    count, length = 16 // worlds, TASK.action_count
    for number in range(4):
        actions, designs = zip(*rounds["with"][number * length :][:length], strict=True)
        plain, own = zip(*rounds["without"][number * length :][:length], strict=True)
        robots = np.array(actions)
        drawn = count - count // 2
        for place in range(count // 2):
            first = (drawn + place) * worlds
            walked = robots[:, first : first + worlds]
            exact = TASK.action(pairs[place % 2].held_kPa)[:, None]
            if number in (0, 2):  # of two rounds from each beginning the first
                assert designs[0][first] == SPACE[pairs[place % 2].design]
                off = np.abs(walked - exact)
                # Five standard deviations of the noise, clipped at the range's ends.
                is_exact = place >= count // 2 - 2
                assert (off.max() == 0.0) if is_exact else (0.0 < off.max() < 1.0)
            else:
                assert np.abs(walked - exact).max() > 0.5
        if number == 0:
            half = drawn * worlds
            assert designs[0][:half] == own[0][:half]
            np.testing.assert_array_equal(robots[:, :half], np.array(plain)[:, :half])


def test_a_shown_design_counts_as_its_gait_does_and_says_nothing_of_the_round() -> None:
    """Seven robots walk it with noise before the eighth does without."""
    trained = training(toy_settings(2), [shown()])
    trained.run_round()
    (alone,) = trained.evaluate_shown()
    scores = trained.learned.distribution.scores
    assert scores[shown().design] == pytest.approx(alone.score_cm, abs=1e-5)
    centred = replace(toy_settings(2), objective=replace(ROBUST, centring_rounds=8))
    trained = training(centred, [shown()])
    returns = []
    walk = trained.walk_and_learn

    def noting(designs, *others):
        found = walk(designs, *others)
        returns.append(found[0][designs != shown().design])
        return found

    trained.walk_and_learn = noting  # type: ignore[method-assign]
    trained.run_round()
    assert trained.learned.scores.level.level_cm == pytest.approx(returns[0].mean())


@pytest.mark.parametrize(("objective", "restarts"), [(Objective(), 1), (ROBUST, 1), (ROBUST, 2)])
def test_a_gait_that_nothing_beats_is_what_a_training_finds(
    objective: Objective, restarts: int, tmp_path: Path
) -> None:
    """A training of one round knows nothing; it walks as far as the gait alone does in the same
    worlds, and its finalists have that design."""
    settings = replace(toy_settings(1), objective=objective, restarts=restarts)
    settings = replace(settings, finetuning=FinetuningSettings(1, settings.timesteps_per_round, 1))
    factory = make_simulator if not objective.is_robust else CrawlersInWorlds
    pair = shown()
    found = learn_in_folder(
        crawling(viscous_crawler_robot, factory, settings),
        settings,
        tmp_path,
        demonstrations=[pair],
        time_step_s=TIME_STEP_S,
    )
    best = found.pairs[0]
    assert (best.design, best.source) == ("1.0.2.0", "demonstration")
    assert any("1.0.2.0: no gait scores higher than one shown" in each for each in found.remarks)
    held = read_gait(tmp_path / best.gait)[0].held_kPa
    np.testing.assert_array_equal(held, pair.held_kPa)
    assert (tmp_path / "finetuned/1.0.2.0.npz").is_file()
    far = []
    for seed in evaluation_seeds(objective) if objective.is_robust else [0]:
        simulator = factory([SPACE[pair.design]] * 4)
        if objective.is_robust:
            simulator.redraw(seed)
        for pressures in held:
            simulator.advance(np.tile(pressures, (4, 1)), TASK.action_step_count)
        far += list(simulator.forward_position_mm / 10.0)
    assert best.distance_cm == pytest.approx(np.mean(far), rel=1e-6)


def test_what_cannot_be_shown_is_refused() -> None:
    with pytest.raises(ValueError, match=r"9 gaits are shown, expected at most 8: .* 16 designs"):
        training(toy_settings(1), [shown()] * 9)
    with pytest.raises(ValueError, match="3 gaits are shown, expected at most 2"):
        training(replace(toy_settings(1), objective=ROBUST), [shown()] * 3)
    with pytest.raises(ValueError, match="regulator 2, expected 1 to 1"):
        shown(held_kPa=SQUARE_KPA[:, :1])
    with pytest.raises(ValueError, match="location"):
        shown(Design.parse("1.0.2"))
    high = HeldGait(np.array([0.0]), np.array([[130.0, 0.0]]), 1.0, maximum_pressure_kPa=150.0)
    with pytest.raises(ValueError, match="130"):
        known_pair(high, NAMED, SPACE, TASK, ACTION_S, "demonstration")
