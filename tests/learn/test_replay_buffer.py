"""The replay buffer keeps the newest transitions and gives them back whole."""

import numpy as np
import pytest

from pneumorph.learn.replay_buffer import ReplayBuffer

FEATURES = np.eye(3, dtype=np.float32)


def filled(capacity: int, count: int) -> ReplayBuffer:
    """Transitions whose every number tells which one it is."""
    buffer = ReplayBuffer(capacity, 2, 1, FEATURES.__getitem__)
    for number in range(0, count, 2):
        pair = np.arange(number, number + 2, dtype=float)
        buffer.add(
            state=np.stack([pair, -pair], axis=1),
            design=(pair % 3).astype(int),
            action=pair[:, None] / 1000,
            reward=pair,
            next_state=np.stack([pair + 1, -pair - 1], axis=1),
            terminal=pair % 2,
        )
    return buffer


def test_transitions_come_back_whole() -> None:
    batch = filled(100, 20).sample(3, 50, np.random.default_rng(0))
    number = np.asarray(batch.reward)
    assert number.shape == (3, 50)
    assert set(number.ravel()) == set(range(20))
    one_hot = FEATURES[(number % 3).astype(int)]
    np.testing.assert_array_equal(
        batch.observation, np.concatenate([np.stack([number, -number], -1), one_hot], -1)
    )
    np.testing.assert_array_equal(
        batch.next_observation,
        np.concatenate([np.stack([number + 1, -number - 1], -1), one_hot], -1),
    )
    np.testing.assert_array_equal(np.asarray(batch.action)[..., 0], np.float32(number / 1000))
    np.testing.assert_array_equal(batch.terminal, number % 2)


def test_rewards_of_what_ended_no_episode_are_those_known() -> None:
    """Every second one did; those of earlier beginnings are known as well."""
    assert filled(100, 20).rewards_of_going_on.tolist() == [*range(0, 20, 2)]
    assert set(filled(7, 24).rewards_of_going_on) == {18, 20, 22}
    later = ReplayBuffer(5, 2, 1, FEATURES.__getitem__, [filled(100, 6).arrays()])
    assert later.rewards_of_going_on.tolist() == [0, 2, 4]


def test_oldest_make_room() -> None:
    buffer = filled(7, 24)
    assert len(buffer) == 7
    drawn = np.asarray(buffer.sample(1, 500, np.random.default_rng(0)).reward)
    assert set(drawn.ravel()) == set(range(17, 24))


@pytest.mark.parametrize("count", [4, 24])
def test_restored_buffer_draws_and_overwrites_the_same(count: int) -> None:
    buffer, copy = filled(7, count), ReplayBuffer(7, 2, 1, FEATURES.__getitem__)
    copy.restore(buffer.arrays())
    for one in (buffer, copy):
        one.add(
            state=np.zeros((1, 2)),
            design=np.zeros(1),
            action=np.zeros((1, 1)),
            reward=np.array([99.0]),
            next_state=np.zeros((1, 2)),
            terminal=np.zeros(1),
        )
    ours, theirs = (one.sample(2, 9, np.random.default_rng(3)) for one in (buffer, copy))
    for mine, other in zip(ours, theirs, strict=True):
        np.testing.assert_array_equal(mine, other)


def test_bad_calls_are_refused() -> None:
    with pytest.raises(ValueError, match="the replay buffer is empty"):
        ReplayBuffer(5, 2, 1, FEATURES.__getitem__).sample(1, 1, np.random.default_rng(0))
    with pytest.raises(ValueError, match="reward holds nan, expected finite"):
        ReplayBuffer(5, 2, 1, FEATURES.__getitem__).add(
            state=np.zeros((1, 2)),
            design=np.zeros(1),
            action=np.zeros((1, 1)),
            reward=np.array([np.nan]),
            next_state=np.zeros((1, 2)),
            terminal=np.zeros(1),
        )
    with pytest.raises(ValueError, match="capacity is 0"):
        ReplayBuffer(0, 2, 1, FEATURES.__getitem__)


def test_earlier_transitions_are_drawn_alike_and_never_replaced() -> None:
    earlier = [filled(100, 4).arrays(), filled(100, 6).arrays()]
    buffer = ReplayBuffer(7, 2, 1, FEATURES.__getitem__, earlier)
    assert (buffer.earlier_count, len(buffer)) == (10, 0)
    drawn = np.asarray(buffer.sample(1, 2000, np.random.default_rng(0)).reward).ravel()
    counts = np.bincount(drawn.astype(int), minlength=6)
    # 0 to 3 are there twice; five standard deviations of so many draws.
    shares = np.array([2, 2, 2, 2, 1, 1]) / 10
    assert np.abs(counts / 2000 - shares).max() < 5 * np.sqrt(0.2 * 0.8 / 2000)
    for source in (24, 30):
        own = filled(7, source)
        buffer.restore(own.arrays())
        drawn = np.asarray(buffer.sample(1, 2000, np.random.default_rng(1)).reward).ravel()
        assert set(drawn) == {*range(6), *range(source - 7, source)}
        for name, values in own.arrays().items():
            np.testing.assert_array_equal(buffer.arrays()[name], values)
