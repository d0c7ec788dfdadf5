"""Soft actor-critic on probes whose values are known."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from pneumorph.learn.networks import FeedForward, Policy
from pneumorph.learn.replay_buffer import ReplayBuffer
from pneumorph.learn.sac import Batch, Sac, SacSettings, SacState
from pneumorph.robot.design_space import DesignSpace

COUNT, BATCH = 50, 64
SMALL = {"hidden_sizes": (32, 32), "batch_size": BATCH, "policy_learning_rate": 3e-3}
# Greedy: so small a temperature that entropy adds nothing to a value, and it stays so.
GREEDY = Sac(1, 1, SacSettings(**SMALL, initial_temperature=1e-6, temperature_learning_rate=0.0))


def batches(seed: int, observation: np.ndarray, reward, following: np.ndarray, terminal) -> Batch:
    """Transitions with uniform actions; ``reward`` maps observation and action to a reward."""
    rng = np.random.default_rng(seed)
    place = rng.integers(len(observation), size=(COUNT, BATCH))
    action = rng.uniform(-1, 1, (COUNT, BATCH, 1))
    seen = observation[place][..., None]
    return jax.tree.map(
        lambda values: jnp.asarray(values, jnp.float32),
        Batch(
            seen,
            action,
            reward(seen, action)[..., 0],
            following[place][..., None],
            terminal[place],
        ),
    )


def train(learner: Sac, calls: int, *probe) -> SacState:
    state = learner.initial_state(0)
    for call in range(calls):
        state, _ = learner.update(state, batches(call, *probe))
    return state


def values(state: SacState, observation: list[float], action: list[float]) -> np.ndarray:
    return np.asarray(
        state.critic(
            jnp.array(observation, jnp.float32)[:, None], jnp.array(action, jnp.float32)[:, None]
        )
    )


def test_value_of_a_constant_reward_is_the_reward() -> None:
    nothing = np.zeros(1)
    state = train(GREEDY, 6, nothing, lambda s, a: np.ones_like(a), nothing, np.ones(1))
    # 300 steps of Adam at 2e-3 leave it jittering by about its step times the slope of the net.
    np.testing.assert_allclose(values(state, [0, 0, 0], [-0.9, 0, 0.9]), 1.0, atol=0.05)


def test_value_of_a_reward_one_action_later_is_discounted() -> None:
    # From -1 one comes to +1 without reward; from +1 one ends with reward 1.
    state = train(
        GREEDY,
        20,
        np.array([-1.0, 1.0]),
        lambda s, a: np.where(s > 0, 1.0, 0.0),
        np.array([1.0, 1.0]),
        np.array([0.0, 1.0]),
    )
    found = values(state, [-1, 1], [0.3, 0.3])
    np.testing.assert_allclose(found[:, 1], 1.0, atol=0.05)  # jitter of Adam, as above
    # gamma times the target network's 1, which lags by (1 - 0.01)^1000, less than 1e-4.
    np.testing.assert_allclose(found[:, 0], 0.95, atol=0.05)


def test_value_of_a_reward_that_is_observed_is_the_observation() -> None:
    seen = np.array([-1.0, -0.5, 0.0, 0.5, 1.0])
    state = train(GREEDY, 10, seen, lambda s, a: s, seen, np.ones(5))
    found = values(state, [*seen, *seen], [-0.5] * 5 + [0.5] * 5)
    np.testing.assert_allclose(found, [[*seen, *seen]] * 2, atol=0.05)  # jitter of Adam, as above


def test_policy_and_value_tell_designs_apart() -> None:
    """The reward is the action, or its opposite for the odd designs; a batch mixes all of them."""
    space = DesignSpace(location_count=4, regulator_count=2, minimum_legs=2, maximum_legs=3)
    sign = np.where(np.arange(len(space)) % 2 == 0, 1.0, -1.0)
    features = space.one_hot
    # Without entropy the squashed policy would settle at an end of its range before the values are
    # learned, where its gradient vanishes.
    settings = SacSettings(**SMALL, temperature_learning_rate=0.01)
    learner = Sac(1 + features.shape[1], 1, settings)
    buffer = ReplayBuffer(4000, 1, 1, lambda indices: features[indices])
    rng = np.random.default_rng(0)
    designs, action = rng.integers(len(space), size=4000), rng.uniform(-1, 1, (4000, 1))
    nothing = np.zeros((4000, 1))
    buffer.add(
        state=nothing,
        design=designs,
        action=action,
        reward=sign[designs] * action[:, 0],
        next_state=nothing,
        terminal=np.ones(4000),
    )
    state = learner.initial_state(0)
    for _ in range(20):
        state, _ = learner.update(state, buffer.sample(COUNT, BATCH, rng))
    seen = np.concatenate([np.zeros((len(space), 1)), features], axis=1).astype(np.float32)
    found = np.asarray(state.critic(jnp.asarray(seen), jnp.full((len(space), 1), 0.8)))
    # Parity is the most rugged function of a design there is: each must be told from all others.
    np.testing.assert_allclose(found, [0.8 * sign] * 2, atol=0.1)  # twice the jitter
    # The entropy asked for keeps the best action's mode off the end of the range.
    assert (learner.mode_actions(state.policy, seen)[:, 0] * sign > 0.6).all()


@pytest.fixture(scope="module")
def tuned() -> tuple[Sac, SacState]:
    """Trained on the reward -(a - 0.5)^2 with a tuned temperature."""
    nothing = np.zeros(1)
    learner = Sac(1, 1, SacSettings(**SMALL, temperature_learning_rate=0.01))
    probe = (nothing, lambda s, a: -((a - 0.5) ** 2), nothing, np.ones(1))
    return learner, train(learner, 30, *probe)


def test_policy_finds_the_best_action(tuned: tuple[Sac, SacState]) -> None:
    learner, state = tuned
    action = learner.mode_actions(state.policy, np.zeros((1, 1), np.float32))
    # The fitted parabola's top is blurred by the residual error of the value network.
    np.testing.assert_allclose(action, 0.5, atol=0.1)


def test_temperature_holds_the_entropy_at_its_target(tuned: tuple[Sac, SacState]) -> None:
    learner, state = tuned
    assert learner.target_entropy == -1.0
    _, density = state.policy.sample(jnp.zeros((20000, 1)), jax.random.PRNGKey(1))
    # A control loop with Adam's steps of 1 % in alpha swings about its target.
    assert abs(-float(density.mean()) - learner.target_entropy) < 0.3


@pytest.mark.parametrize("first_is_lower", [True, False])
def test_the_policy_follows_the_lower_of_the_two_critics(first_is_lower: bool) -> None:
    """One critic promises more for larger actions, the other, the lower, for smaller."""
    low, high = sloped_critic(-1.0, -5.0), sloped_critic(1.0, 5.0)
    first, second = (low, high) if first_is_lower else (high, low)
    state = GREEDY.initial_state(0)
    state = eqx.tree_at(lambda s: (s.critic.first, s.critic.second), state, (first, second))
    nothing = np.zeros((1, 1), np.float32)
    before = float(GREEDY.mode_actions(state.policy, nothing)[0, 0])
    probe = batches(0, np.zeros(1), lambda s, a: np.zeros_like(a), np.zeros(1), np.ones(1))
    state, _ = GREEDY.update(state, probe)
    after = float(GREEDY.mode_actions(state.policy, nothing)[0, 0])
    # Fifty steps of Adam at 3e-3 on each weight of the policy. The critics' rewards are zero, but
    # steps of 2e-3 turn neither slope round.
    assert after < before - 0.2


def test_values_are_those_of_the_lower_critic() -> None:
    """Both what a critic learns from and what is told of a state."""
    low, high = sloped_critic(-1.0, -5.0), sloped_critic(1.0, 5.0)
    state = GREEDY.initial_state(0)
    state = eqx.tree_at(lambda s: (s.critic.first, s.critic.second), state, (high, low))
    targets = jax.tree.map(jnp.copy, (high, low))
    state = eqx.tree_at(lambda s: (s.target_critic.first, s.target_critic.second), state, targets)
    nothing = np.zeros((3, 1), np.float32)
    action = GREEDY.mode_actions(state.policy, nothing)[:, 0]
    np.testing.assert_allclose(GREEDY.values(state, nothing), -5.0 - action, rtol=1e-5)
    probe = batches(0, np.zeros(1), lambda s, a: np.zeros_like(a), np.zeros(1), np.zeros(1))
    _, metrics = GREEDY.update(state, probe)
    # 0.95 of -4 to -6, while the targets follow critics by a hundredth in each of fifty updates.
    assert -6.0 < float(metrics["mean_target_value"]) < -3.0


def sloped_critic(slope: float, offset: float) -> FeedForward:
    """A network whose value is slope times the action, plus an offset.

    Its first hidden unit is the action + 1, which is never negative, and is handed on.
    """
    network = FeedForward(2, SMALL["hidden_sizes"], 1, jax.random.PRNGKey(0))
    network = jax.tree.map(jnp.zeros_like, network)
    one, two, last = network.layers
    return eqx.tree_at(
        lambda n: (
            n.layers[0].weight, n.layers[0].bias, n.layers[1].weight, n.layers[2].weight,
            n.layers[2].bias,
        ),
        network,
        (
            one.weight.at[0, 1].set(1.0), one.bias.at[0].set(1.0), two.weight.at[0, 0].set(1.0),
            last.weight.at[0, 0].set(slope), last.bias.at[0].set(offset - slope),
        ),
    )  # fmt: skip


def test_log_density_is_that_of_the_squashed_gaussian() -> None:
    policy = Policy(2, 3, (8,), jax.random.PRNGKey(0))
    observation = jnp.asarray(np.random.default_rng(0).normal(size=(5, 2)), jnp.float32)
    action, density = policy.sample(observation, jax.random.PRNGKey(1))
    mean, log_std = (np.asarray(part, np.float64) for part in policy.distribution(observation))
    squashed = np.asarray(action, np.float64)
    noise = (np.arctanh(squashed) - mean) / np.exp(log_std)
    expected = np.sum(
        -0.5 * noise**2 - log_std - 0.5 * np.log(2 * np.pi) - np.log(1 - squashed**2), axis=1
    )
    # float32 actions near one lose digits of 1 - a^2.
    np.testing.assert_allclose(np.asarray(density), expected, rtol=1e-4)


def test_extreme_actions_have_finite_density() -> None:
    policy = Policy(1, 1, (4,), jax.random.PRNGKey(0))
    last = policy.network.layers[-1]
    policy = eqx.tree_at(lambda p: p.network.layers[-1].bias, policy, jnp.array([50.0, 9.0]))
    _, density = policy.sample(jnp.zeros((100, 1)), jax.random.PRNGKey(0))
    assert np.isfinite(density).all()
    assert last.bias is not None
    assert float(policy.distribution(jnp.zeros((1, 1)))[1][0, 0]) == 2.0  # clipped


def test_several_updates_in_one_call_equal_one_after_another() -> None:
    nothing = np.zeros(1)
    probe = batches(0, nothing, lambda s, a: a, nothing, np.ones(1))
    together, _ = GREEDY.update(GREEDY.initial_state(1), probe)
    state = GREEDY.initial_state(1)
    for number in range(COUNT):
        state, _ = GREEDY.update(state, jax.tree.map(lambda v, n=number: v[n : n + 1], probe))
    for ours, theirs in zip(
        jax.tree.leaves(eqx.filter(together, eqx.is_array)),
        jax.tree.leaves(eqx.filter(state, eqx.is_array)),
        strict=True,
    ):
        # The compiler may order float32 sums differently; Adam's division magnifies that.
        np.testing.assert_allclose(ours, theirs, atol=1e-3)


def test_settings_are_checked() -> None:
    with pytest.raises(ValueError, match="hidden_sizes is empty"):
        SacSettings(hidden_sizes=())
    with pytest.raises(ValueError, match="discount must be at least 0 and at most 1"):
        SacSettings(discount=1.5)
    for name in ("adam_beta_1", "adam_beta_2"):
        with pytest.raises(ValueError, match=f"{name} must be at least 0 and below 1, got 1.0"):
            SacSettings(**{name: 1.0})
        assert getattr(SacSettings(**{name: 0.0}), name) == 0.0
    with pytest.raises(ValueError, match="critic_learning_rate must be finite, got nan"):
        SacSettings(critic_learning_rate=float("nan"))
    with pytest.raises(ValueError, match=r"log_standard_deviation_range is 2\.0, -20\.0"):
        SacSettings(log_standard_deviation_range=(2.0, -20.0))
