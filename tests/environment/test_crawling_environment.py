"""The vector environment keeps the paper's task and Gymnasium's rules."""

from collections.abc import Callable
from functools import partial
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from gymnasium.utils.passive_env_checker import check_action_space, check_observation_space
from gymnasium.vector import AutoresetMode, SyncVectorEnv

from pneumorph.environment.crawling_environment import CrawlingEnvironment
from pneumorph.environment.crawling_task import CrawlingTask
from pneumorph.environment.single_crawling_environment import SingleCrawlingEnvironment
from pneumorph.environment.viscous_crawler import ViscousCrawler, viscous_crawler_robot
from pneumorph.robot.design import Design

DESIGNS = [
    Design.parse(text)
    for text in ("1.0.0.2.2.0.0.1", "1.2.0.0.3.0.0.0", "0.1.0.2.0.1.0.3", "1.0.1.0.0.2.0.0")
]


class FragileCrawler(ViscousCrawler):
    """Fails, with a position of NaN, in the robots whose first pressure command is above 80."""

    def advance(self, command_kPa: np.ndarray, step_count: int, active: Any = None) -> None:
        super().advance(command_kPa, step_count, active)
        broken = command_kPa[:, 0] > 80.0
        self._forward_mm[broken] = np.nan
        self._status[broken] = 1


class RecordingCrawler(ViscousCrawler):
    """Notes every call."""

    def __init__(self, robots: list[Design]) -> None:
        self.calls: list[tuple] = []
        super().__init__(robots)

    def set_robots(self, robots: Any) -> None:
        self.calls.append(("set_robots", tuple(robots)))
        super().set_robots(robots)

    def reset(self, active: Any = None) -> None:
        self.calls.append(("reset", active))
        super().reset(active)

    def advance(self, command_kPa: np.ndarray, step_count: int, active: Any = None) -> None:
        self.calls.append(("advance", command_kPa.copy(), step_count))
        super().advance(command_kPa, step_count, active)


def make(
    designs: list[Design] = DESIGNS,
    simulator: Callable = ViscousCrawler,
    task: CrawlingTask | None = None,
) -> CrawlingEnvironment:
    return CrawlingEnvironment(designs, viscous_crawler_robot, simulator, task)


def random_actions(count: int, seed: int = 0, robots: int = len(DESIGNS)) -> np.ndarray:
    return np.random.default_rng(seed).uniform(-1, 1, (count, robots, 3)).astype(np.float32)


def test_observation_is_four_actions_newest_first_then_the_one_hot_design() -> None:
    environment = make()
    observation, _ = environment.reset()
    assert environment.single_observation_space.shape == (44,)
    np.testing.assert_array_equal(observation[:, :12], 0.0)
    actions = random_actions(6)
    for action in actions:
        observation = environment.step(action)[0]
    for robot, design in enumerate(DESIGNS):
        np.testing.assert_array_equal(
            observation[robot, :12], actions[[5, 4, 3, 2], robot].reshape(-1)
        )
        np.testing.assert_array_equal(observation[robot, 12:], design.one_hot(3))


def test_simulator_settles_15_steps_and_holds_each_action_100_steps() -> None:
    simulators: list[RecordingCrawler] = []

    def factory(robots: Any) -> RecordingCrawler:
        simulators.append(RecordingCrawler(robots))
        return simulators[-1]

    environment = make(simulator=factory)
    environment.reset()
    actions = random_actions(2)
    environment.step(actions[0])
    environment.step(actions[1])
    calls = simulators[0].calls
    assert [call[0] for call in calls] == ["set_robots", "reset", "advance", "advance", "advance"]
    assert [call[2] for call in calls[2:]] == [15, 100, 100]
    np.testing.assert_array_equal(calls[2][1], np.zeros((4, 3)))
    np.testing.assert_allclose(calls[3][1], 45.0 * (actions[0].astype(float) + 1.0))


def test_robots_that_begin_anew_settle_alone() -> None:
    """The first fails in its first action: it is put back and falls, and the others wait."""
    moved: list[tuple[int, Any]] = []

    class Watched(FragileCrawler):
        def advance(self, command_kPa: np.ndarray, step_count: int, active: Any = None) -> None:
            moved.append((step_count, None if active is None else list(active)))
            super().advance(command_kPa, step_count, active)

    environment = make(simulator=Watched)
    environment.reset()
    first = np.full((4, 3), -1.0, np.float32)
    first[0, 0] = 1.0  # 90 kPa
    environment.step(first)
    environment.step(-np.ones((4, 3), np.float32))
    assert moved == [(15, None), (100, None), (15, [True, False, False, False]), (100, None)]


def test_reward_is_the_forward_travel_in_cm() -> None:
    environment = make()
    environment.reset()
    total = np.zeros(4)
    for action in random_actions(19):
        _, reward, *_, info = environment.step(action)
        np.testing.assert_array_equal(reward, info["forward_travel_cm"])
        total += reward
        np.testing.assert_allclose(info["distance_cm"], total, atol=1e-12)  # rounding of sums
    # The sum of the differences is the position: rounding again.
    position_mm = environment._simulator.forward_position_mm
    np.testing.assert_allclose(total, position_mm / 10.0, atol=1e-12)


@pytest.mark.parametrize("terminal", [True, False])
def test_twentieth_step_ends_the_episode(terminal: bool) -> None:
    environment = make(task=CrawlingTask(time_limit_is_terminal=terminal))
    first, _ = environment.reset()
    actions = random_actions(20)
    for action in actions[:19]:
        _, _, terminated, truncated, info = environment.step(action)
        assert not terminated.any()
        assert not truncated.any()
        assert "final_obs" not in info
    observation, _, terminated, truncated, info = environment.step(actions[19])
    np.testing.assert_array_equal(terminated, np.full(4, terminal))
    np.testing.assert_array_equal(truncated, np.full(4, not terminal))
    np.testing.assert_array_equal(observation, first)
    np.testing.assert_array_equal(np.stack(info["final_obs"])[:, :3], actions[19])
    np.testing.assert_array_equal(info["final_info"]["distance_cm"], info["distance_cm"])


def test_second_episode_equals_the_first() -> None:
    environment = make()
    environment.reset()
    actions = random_actions(20)
    first = [environment.step(action)[1] for action in actions]
    second = [environment.step(action)[1] for action in actions]
    np.testing.assert_array_equal(first, second)
    environment.step(actions[0])
    environment.reset()
    np.testing.assert_array_equal([environment.step(action)[1] for action in actions], first)


def test_reset_gives_new_designs() -> None:
    environment = make()
    environment.reset()
    environment.step(random_actions(1)[0])
    observation, _ = environment.reset(options={"designs": DESIGNS[::-1]})
    assert environment.designs == tuple(DESIGNS[::-1])
    environment.reset(options={"designs": [str(design) for design in DESIGNS[::-1]]})
    with pytest.raises(TypeError, match=r"designs is '1.* expected one for each robot, in a list"):
        environment.reset(options={"designs": "1.0.0.2.2.0.0.1"})
    assert environment.designs == tuple(DESIGNS[::-1])
    np.testing.assert_array_equal(observation[0, 12:], DESIGNS[-1].one_hot(3))
    rewards = [environment.step(action)[1] for action in random_actions(5)]
    alone = make(DESIGNS[-1:])
    alone.reset()
    expected = [alone.step(action[:1])[1] for action in random_actions(5)]
    np.testing.assert_array_equal(np.array(rewards)[:, 0], np.array(expected)[:, 0])


def test_a_diverged_robot_ends_alone_and_harms_no_other() -> None:
    actions = random_actions(20)
    actions[:, :, 0] = np.minimum(actions[:, :, 0], 0.5)
    healthy = make(simulator=FragileCrawler)
    healthy.reset()
    expected = [healthy.step(action)[1] for action in actions]

    environment = make(simulator=FragileCrawler)
    environment.reset()
    actions[7, 2, 0] = 1.0
    others = [0, 1, 3]
    for number, action in enumerate(actions):
        observation, reward, terminated, truncated, info = environment.step(action)
        assert np.isfinite(reward).all()
        assert np.isfinite(observation).all()
        np.testing.assert_array_equal(reward[others], expected[number][others])
        if number == 7:
            np.testing.assert_array_equal(terminated, [False, False, True, False])
            np.testing.assert_array_equal(info["status"], [0, 0, 1, 0])
            np.testing.assert_array_equal(info["_final_obs"], terminated)
            assert reward[2] == 0.0
            assert info["final_obs"][0] is None
            np.testing.assert_array_equal(observation[2, :12], 0.0)
        elif number == 19:
            np.testing.assert_array_equal(terminated, [True, True, False, True])
        else:
            assert not terminated.any()
        assert not truncated.any()
    # The robot's next episode began with its eighth action and is an ordinary one.
    alone = make(DESIGNS[2:3], FragileCrawler)
    alone.reset()
    for action in actions[8:]:
        last = alone.step(action[2:3])
    assert reward[2] == last[1][0]
    assert info["distance_cm"][2] == last[4]["distance_cm"][0]


@pytest.mark.parametrize("simulator", [ViscousCrawler, FragileCrawler])
def test_batch_equals_gymnasiums_own_vector_environment(simulator: Callable) -> None:
    environment = make(simulator=simulator)
    reference = SyncVectorEnv(
        [
            partial(SingleCrawlingEnvironment, design, viscous_crawler_robot, simulator)
            for design in DESIGNS
        ],
        autoreset_mode=AutoresetMode.SAME_STEP,
    )
    assert environment.metadata["autoreset_mode"] == reference.metadata["autoreset_mode"]
    assert environment.observation_space == reference.observation_space
    assert environment.action_space == reference.action_space
    observation, _ = environment.reset(seed=1)
    np.testing.assert_array_equal(observation, reference.reset(seed=1)[0])
    for action in random_actions(45, seed=3):
        ours, theirs = environment.step(action), reference.step(action)
        for mine, other in zip(ours[:4], theirs[:4], strict=True):
            np.testing.assert_array_equal(mine, other)
            assert mine.dtype == other.dtype
        ended = ours[2] | ours[3]
        assert ("final_obs" in theirs[4]) == ended.any()
        for robot in np.flatnonzero(ended):
            np.testing.assert_array_equal(
                ours[4]["final_obs"][robot], theirs[4]["final_obs"][robot]
            )
            for name in ("status", "distance_cm", "forward_travel_cm"):
                assert ours[4]["final_info"][name][robot] == theirs[4]["final_info"][name][robot]


def test_gymnasiums_checkers_pass(recwarn: pytest.WarningsRecorder) -> None:
    single = SingleCrawlingEnvironment(DESIGNS[0], viscous_crawler_robot, ViscousCrawler)
    check_env(single)
    # The one remark left: the environment has no entry in Gymnasium's registry to make it from.
    remarks = [str(warning.message) for warning in recwarn if "WARN" in str(warning.message)]
    assert all("not having a spec" in remark for remark in remarks)
    environment = make()
    check_observation_space(environment.single_observation_space)
    check_action_space(environment.single_action_space)
    assert environment.reset()[0] in environment.observation_space
    observation, reward, terminated, truncated, _ = environment.step(
        environment.action_space.sample()
    )
    assert observation in environment.observation_space
    assert reward.shape == terminated.shape == truncated.shape == (4,)


def test_gymnasiums_wrappers_work() -> None:
    environment = gymnasium.wrappers.vector.RecordEpisodeStatistics(make())
    environment.reset()
    total = np.zeros(4)
    for action in random_actions(20):
        _, reward, *_, info = environment.step(action)
        total += reward
    np.testing.assert_allclose(info["episode"]["r"], total, atol=1e-12)  # rounding of sums
    np.testing.assert_array_equal(info["episode"]["l"], 20)


def test_single_environment_takes_a_new_design() -> None:
    single = SingleCrawlingEnvironment(DESIGNS[0], viscous_crawler_robot, ViscousCrawler)
    observation, _ = single.reset(options={"design": DESIGNS[1]})
    np.testing.assert_array_equal(observation[12:], DESIGNS[1].one_hot(3))
    for wrong in ("desing", "designs"):
        with pytest.raises(ValueError, match=f"reset option '{wrong}' is .*, expected 'design':"):
            single.reset(options={wrong: DESIGNS[0]})


def test_bad_calls_are_refused() -> None:
    environment = make()
    with pytest.raises(gymnasium.error.ResetNeeded, match="before the first step"):
        environment.step(np.zeros((4, 3)))
    with pytest.raises(ValueError, match="got 1 designs, expected 4"):
        environment.reset(options={"designs": DESIGNS[:1]})
    with pytest.raises(ValueError, match="reset option 'design' is unknown"):
        environment.reset(options={"design": DESIGNS[0]})
    environment.reset()
    with pytest.raises(ValueError, match=r"shape \(4, 2\), expected \(robot, regulator\)"):
        environment.step(np.zeros((4, 2)))
    with pytest.raises(ValueError, match=r"action\[0, 0\] is nan"):
        environment.step(np.full((4, 3), np.nan))
    with pytest.raises(ValueError, match="designs is empty"):
        make([])
    with pytest.raises(ValueError, match="has 3 locations, expected 8"):
        make([DESIGNS[0], Design.parse("1.1.1")])
    with pytest.raises(ValueError, match="location 0 to regulator 4, expected 1 to 3"):
        make([Design.parse("4.1.1.0.0.0.0.0")])


@pytest.mark.parametrize("refused_by", ["the seed", "the design", "the builder", "the simulator"])
def test_designs_that_are_refused_change_nothing(refused_by: str) -> None:
    """What goes on is the episode of before, in its own physics."""
    wrong = Design.parse("1.1.1" if refused_by == "the design" else "3.0.0.0.3.0.0.3")
    redrawn: list[int] = []

    def build(design: Design) -> Design:
        if refused_by == "the builder" and design == wrong:
            raise ValueError("no such robot: 3 locations, 3.0")
        return design

    class Drawn(ViscousCrawler):
        def redraw(self, number: int) -> None:
            redrawn.append(number)

        def set_robots(self, robots: Any) -> None:
            if wrong in robots:
                raise ValueError("no such robot: 3 locations, 3.0")
            super().set_robots(robots)

    environment, other = (CrawlingEnvironment(DESIGNS, build, Drawn) for _ in range(2))
    actions = random_actions(3)
    for each in (environment, other):
        each.reset(seed=1)
        each.step(actions[0])
    redrawn.clear()
    if refused_by == "the seed":
        with pytest.raises(gymnasium.error.Error, match="actual value: -1"):
            environment.reset(seed=-1, options={"designs": DESIGNS[::-1]})
    else:
        with pytest.raises(ValueError, match="3 locations"):
            environment.reset(seed=2, options={"designs": [*DESIGNS[:0:-1], wrong]})
    assert redrawn == []
    assert environment.designs == tuple(DESIGNS)
    for action in actions[1:]:
        ours, theirs = environment.step(action), other.step(action)
        for mine, expected in zip(ours[:4], theirs[:4], strict=True):
            np.testing.assert_array_equal(mine, expected)
    environment.reset(seed=2, options={"designs": DESIGNS[::-1]})
    assert (environment.designs, redrawn) == (tuple(DESIGNS[::-1]), [2])


def test_robots_that_are_kept_are_limited(monkeypatch: pytest.MonkeyPatch) -> None:
    """A design is built again after its robot was forgotten, never twice while it is kept."""
    monkeypatch.setattr("pneumorph.environment.crawling_environment._KEPT_ROBOTS", 2)
    built: list[Design] = []

    def build(design: Design) -> Design:
        built.append(design)
        return design

    designs = [Design.parse(text) for text in ("1.2.0.0", "0.1.2.0", "0.0.1.2")]
    environment = CrawlingEnvironment(designs[:1], build, ViscousCrawler)
    for design in (designs[0], designs[1], designs[0], designs[2], designs[2], designs[0]):
        environment.reset(options={"designs": [design]})
    assert built == [designs[0], designs[1], designs[2], designs[0]]
