"""Soft actor-critic with a tuned temperature (Haarnoja et al. 2018, arXiv:1812.05905)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import optax

from pneumorph.base.artefact import ArtefactError
from pneumorph.base.checked import Bounds, Checked, Count, NotNegative, Positive, Share
from pneumorph.learn.networks import Policy, TwinCritic

DecayRate = Annotated[
    float, Bounds(least=0.0, below=1.0, why="at 1 the mean never takes a gradient in")
]
"""Of a running mean."""


@dataclass(frozen=True)
class SacSettings(Checked):
    """Hyperparameters of soft actor-critic. The defaults are the paper's (appendix A) or, where it
    gives none, those of the authors' experiment."""

    hidden_sizes: tuple[Count, ...] = (400, 200, 100)
    """Units of each hidden layer, from input to output, of the policy and of the value networks
    (paper). Smaller networks learn faster per update; many more designs than the paper's may need
    larger ones."""
    policy_learning_rate: Positive = 6e-4
    """Learning rate of the policy (Adam; paper). Lower it if returns rise and then collapse."""
    critic_learning_rate: Positive = 2e-3
    """Learning rate of the value networks (Adam; paper). Lower it if the critic's loss grows."""
    adam_beta_1: DecayRate = 0.9
    """Adam's decay rate of the gradient's running mean, from 0 to below 1 (paper). Rarely
    changed."""
    adam_beta_2: DecayRate = 0.999
    """Adam's decay rate of the squared gradient's running mean, from 0 to below 1 (paper). Rarely
    changed."""
    discount: Share = 0.95
    """Discount factor gamma per action, 0 to 1 (paper): how much the next action's reward counts
    beside this one's. Raise it for gaits that must look further ahead."""
    target_smoothing: Share = 0.01
    """How far the target networks move towards the value networks in each update, 0 to 1 (paper,
    tau). Smaller is steadier and slower."""
    batch_size: Count = 512
    """Transitions in one update (paper). More make an update less noisy and slower."""
    initial_temperature: Positive = 0.2
    """Entropy temperature alpha at the start [cm of reward per nat] (authors' experiment). It is
    tuned from there; begin lower if there are few updates."""
    temperature_learning_rate: NotNegative | None = None
    """Learning rate of log alpha (Adam); 0 keeps the temperature fixed. None: the policy's rate
    (authors' experiment)."""
    target_entropy: float | None = None
    """Entropy of the policy that the temperature is tuned to [nat]; higher explores more. None:
    minus the number of regulators, which is -3 for the paper's robot (authors' experiment)."""
    log_standard_deviation_range: tuple[float, float] = (-20.0, 2.0)
    """Lowest and highest natural logarithm of the policy's standard deviation (authors'
    experiment). Raise the first to keep the policy exploring."""

    def __post_init__(self) -> None:
        super().__post_init__()
        if not self.hidden_sizes:
            raise ValueError("hidden_sizes is empty, expected the units of one layer or more")
        low, high = self.log_standard_deviation_range
        if not low < high:
            raise ValueError(
                f"log_standard_deviation_range is {low}, {high}, expected a rising pair of numbers"
            )


class Batch(NamedTuple):
    """Transitions; with a leading axis ``update`` when several updates are made in one call."""

    observation: jax.Array  # (batch, observation)
    action: jax.Array  # (batch, action), each in [-1, 1]
    reward: jax.Array  # (batch,)
    next_observation: jax.Array  # (batch, observation)
    terminal: jax.Array  # (batch,), 1 where nothing follows


class SacState(eqx.Module):
    """Everything that learning changes."""

    policy: Policy
    critic: TwinCritic
    target_critic: TwinCritic
    log_temperature: jax.Array
    policy_optimiser: optax.OptState
    critic_optimiser: optax.OptState
    temperature_optimiser: optax.OptState
    key: jax.Array

    def arrays(self) -> dict[str, np.ndarray]:
        """All arrays by their numbers, for a checkpoint."""
        leaves = jax.tree.leaves(eqx.filter(self, eqx.is_array))
        return {str(number): np.asarray(leaf) for number, leaf in enumerate(leaves)}

    def restored(self, arrays: Mapping[str, np.ndarray]) -> SacState:
        """This state with the arrays that `arrays` gave.

        Raises:
            ArtefactError: One is missing, or of another shape.
        """
        dynamic, static = eqx.partition(self, eqx.is_array)
        old, structure = jax.tree.flatten(dynamic)
        new = [arrays.get(str(number)) for number in range(len(old))]
        for number, (ours, theirs) in enumerate(zip(old, new, strict=True)):
            if theirs is None or ours.shape != theirs.shape:
                raise ArtefactError(
                    f"array sac/{number} of the checkpoint has shape "
                    f"{None if theirs is None else theirs.shape}, expected {ours.shape}; its "
                    "networks were made with other settings"
                )
        # A copy in JAX's own memory: the learner reuses the memory it is given.
        leaves = [jnp.array(leaf) for leaf in new]
        return eqx.combine(jax.tree.unflatten(structure, leaves), static)


@dataclass(frozen=True)
class Sac:
    """The learner: sizes and settings, no state of its own.

    Learners of equal sizes and settings share their compiled functions.
    """

    observation_size: int
    """Numbers of an observation."""
    action_size: int
    """Numbers of an action."""
    settings: SacSettings
    """Hyperparameters."""

    @property
    def target_entropy(self) -> float:
        """Entropy the temperature is tuned to [nat]."""
        wanted = self.settings.target_entropy
        return -float(self.action_size) if wanted is None else wanted

    def _adam(self, rate: float) -> optax.GradientTransformation:
        return optax.adam(rate, b1=self.settings.adam_beta_1, b2=self.settings.adam_beta_2)

    @property
    def _policy_adam(self) -> optax.GradientTransformation:
        return self._adam(self.settings.policy_learning_rate)

    @property
    def _critic_adam(self) -> optax.GradientTransformation:
        return self._adam(self.settings.critic_learning_rate)

    @property
    def _temperature_adam(self) -> optax.GradientTransformation:
        rate = self.settings.temperature_learning_rate
        return self._adam(self.settings.policy_learning_rate if rate is None else rate)

    def initial_state(self, seed: int) -> SacState:
        """Draw the networks' weights."""
        policy_key, critic_key, key = jax.random.split(jax.random.PRNGKey(seed), 3)
        sizes = (self.observation_size, self.action_size, self.settings.hidden_sizes)
        policy = Policy(*sizes, policy_key, self.settings.log_standard_deviation_range)
        critic = TwinCritic(*sizes, critic_key)
        log_temperature = jnp.log(jnp.float32(self.settings.initial_temperature))
        return SacState(
            policy=policy,
            critic=critic,
            # A copy: the state is donated to the update, and no buffer can be donated twice.
            target_critic=jax.tree.map(jnp.copy, critic),
            log_temperature=log_temperature,
            policy_optimiser=self._policy_adam.init(eqx.filter(policy, eqx.is_array)),
            critic_optimiser=self._critic_adam.init(eqx.filter(critic, eqx.is_array)),
            temperature_optimiser=self._temperature_adam.init(log_temperature),
            key=key,
        )

    def sample_actions(
        self, state: SacState, observation: np.ndarray
    ) -> tuple[SacState, np.ndarray]:
        """Draw actions (batch, action) from the policy; the state's key moves on."""
        key, actions = _sample(state.policy, observation, state.key)
        return eqx.tree_at(lambda s: s.key, state, key), np.asarray(actions)

    def mode_actions(self, policy: Policy, observation: np.ndarray) -> np.ndarray:
        """Deterministic actions of a policy, (batch, action)."""
        return np.asarray(_mode(policy, observation))

    def values(self, state: SacState, observation: np.ndarray) -> np.ndarray:
        """Values of observations under the policy without noise, (batch,): the lower critic's."""
        return np.asarray(_values(state.policy, state.critic, observation))

    def update(self, state: SacState, batches: Batch) -> tuple[SacState, dict[str, jax.Array]]:
        """Make one update per leading entry of ``batches``, all in one compiled call.

        Args:
            state: Given up to the call: its memory is reused.
            batches: Fields of shape (update, batch, ...).

        Returns:
            The new state, and metrics averaged over the updates; still being computed when this
            returns.
        """
        state, metrics = _updates((self, batches), state)
        return state, metrics

    def one_update(self, state: SacState, batch: Batch) -> tuple[SacState, dict[str, jax.Array]]:
        """One update from one batch, to be compiled: values, policy, temperature, targets."""
        key, policy_key, target_key = jax.random.split(state.key, 3)
        temperature = jnp.exp(state.log_temperature)

        # Value: Q(s, a) = r + gamma (min Q'(s', a') - alpha log pi(a' | s')), a' from the policy.
        next_action, next_log_density = state.policy.sample(batch.next_observation, target_key)
        next_value = jnp.min(state.target_critic(batch.next_observation, next_action), axis=0)
        soft_value = next_value - temperature * next_log_density
        target = batch.reward + self.settings.discount * (1.0 - batch.terminal) * soft_value

        def critic_loss(critic: TwinCritic) -> jax.Array:
            values = critic(batch.observation, batch.action)
            return 0.5 * jnp.sum(jnp.mean((values - target) ** 2, axis=1))

        critic_value, gradient = eqx.filter_value_and_grad(critic_loss)(state.critic)
        step, critic_optimiser = self._critic_adam.update(gradient, state.critic_optimiser)
        critic = eqx.apply_updates(state.critic, step)

        # Policy: minimise alpha log pi(a | s) - min Q(s, a), a drawn by reparametrisation.
        def policy_loss(policy: Policy) -> tuple[jax.Array, jax.Array]:
            action, log_density = policy.sample(batch.observation, policy_key)
            value = jnp.min(critic(batch.observation, action), axis=0)
            return jnp.mean(temperature * log_density - value), log_density

        (policy_value, log_density), gradient = eqx.filter_value_and_grad(
            policy_loss, has_aux=True
        )(state.policy)
        step, policy_optimiser = self._policy_adam.update(gradient, state.policy_optimiser)
        policy = eqx.apply_updates(state.policy, step)

        # Temperature: rises while the policy's entropy is below its target. The loss is linear in
        # log alpha, so its gradient is this mean.
        slope = -jnp.mean(log_density + self.target_entropy)
        step, temperature_optimiser = self._temperature_adam.update(
            slope, state.temperature_optimiser
        )
        new_state = SacState(
            policy=policy,
            critic=critic,
            target_critic=jax.tree.map(self._follow, state.target_critic, critic),
            log_temperature=optax.apply_updates(state.log_temperature, step),
            policy_optimiser=policy_optimiser,
            critic_optimiser=critic_optimiser,
            temperature_optimiser=temperature_optimiser,
            key=key,
        )
        metrics = {
            "critic_loss": critic_value,
            "policy_loss": policy_value,
            "policy_entropy": -jnp.mean(log_density),
            "temperature": temperature,
            "mean_target_value": jnp.mean(target),
        }
        return new_state, metrics

    def _follow(self, target: jax.Array, source: jax.Array) -> jax.Array:
        share = self.settings.target_smoothing
        return (1.0 - share) * target + share * source


def _scan_updates(
    learner_and_batches: tuple[Sac, Batch], state: SacState
) -> tuple[SacState, dict[str, jax.Array]]:
    """Scan the updates; the memory of ``state`` is reused, that of the batches is not."""
    learner, batches = learner_and_batches
    start, static = eqx.partition(state, eqx.is_array)

    def one(carry: SacState, batch: Batch) -> tuple[SacState, dict[str, jax.Array]]:
        new_state, metrics = learner.one_update(eqx.combine(carry, static), batch)
        return eqx.filter(new_state, eqx.is_array), metrics

    end, metrics = jax.lax.scan(one, start, batches)
    return eqx.combine(end, static), jax.tree.map(jnp.mean, metrics)


_updates = eqx.filter_jit(_scan_updates, donate="all-except-first")


@eqx.filter_jit
def _sample(policy: Policy, observation: np.ndarray, key: jax.Array) -> tuple[jax.Array, jax.Array]:
    key, action_key = jax.random.split(key)
    return key, policy.sample(jnp.asarray(observation), action_key)[0]


@eqx.filter_jit
def _mode(policy: Policy, observation: np.ndarray) -> jax.Array:
    return policy.mode(jnp.asarray(observation))


@eqx.filter_jit
def _values(policy: Policy, critic: TwinCritic, observation: np.ndarray) -> jax.Array:
    batch = jnp.asarray(observation)
    return jnp.min(critic(batch, policy.mode(batch)), axis=0)
