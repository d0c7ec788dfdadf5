"""The policy's and the value's feed-forward networks (paper, appendix A)."""

from __future__ import annotations

import equinox as eqx
import jax
import jax.numpy as jnp


class FeedForward(eqx.Module):
    """Linear layers with rectifiers between them, applied to a whole batch at once."""

    layers: tuple[eqx.nn.Linear, ...]

    def __init__(
        self, input_size: int, hidden_sizes: tuple[int, ...], output_size: int, key: jax.Array
    ) -> None:
        """Draw the weights uniformly from +-1/sqrt(inputs of the layer)."""
        sizes = (input_size, *hidden_sizes, output_size)
        keys = jax.random.split(key, len(sizes) - 1)
        self.layers = tuple(
            eqx.nn.Linear(fan_in, fan_out, key=layer_key)
            for fan_in, fan_out, layer_key in zip(sizes[:-1], sizes[1:], keys, strict=True)
        )

    def __call__(self, batch: jax.Array) -> jax.Array:
        """Map inputs of shape (batch, input) to outputs of shape (batch, output)."""
        for layer in self.layers[:-1]:
            batch = jax.nn.relu(_apply(layer, batch))
        return _apply(self.layers[-1], batch)


def _apply(layer: eqx.nn.Linear, batch: jax.Array) -> jax.Array:
    assert layer.bias is not None
    return batch @ layer.weight.T + layer.bias


class Policy(eqx.Module):
    """Gaussian squashed by tanh: action = tanh(mean + exp(log_std) noise), each in (-1, 1)."""

    network: FeedForward
    action_size: int = eqx.field(static=True)
    log_std_range: tuple[float, float] = eqx.field(static=True)

    def __init__(
        self,
        observation_size: int,
        action_size: int,
        hidden_sizes: tuple[int, ...],
        key: jax.Array,
        log_std_range: tuple[float, float] = (-20.0, 2.0),
    ) -> None:
        """Draw the weights; log_std is clipped to its range."""
        self.network = FeedForward(observation_size, hidden_sizes, 2 * action_size, key)
        self.action_size = action_size
        self.log_std_range = log_std_range

    @property
    def observation_size(self) -> int:
        """Numbers that it observes."""
        return int(self.network.layers[0].weight.shape[1])

    def distribution(self, observation: jax.Array) -> tuple[jax.Array, jax.Array]:
        """Mean and log standard deviation before squashing, each (batch, action)."""
        output = self.network(observation)
        mean, log_std = output[:, : self.action_size], output[:, self.action_size :]
        return mean, jnp.clip(log_std, *self.log_std_range)

    def sample(self, observation: jax.Array, key: jax.Array) -> tuple[jax.Array, jax.Array]:
        """Draw actions (batch, action) and their log density (batch,).

        With ``a = tanh(u)`` the density of ``u`` is divided by ``1 - tanh(u)^2``, whose logarithm
        is ``2 (log 2 - u - softplus(-2 u))`` without loss of digits (Haarnoja et al. 2018, app. C).
        """
        mean, log_std = self.distribution(observation)
        noise = jax.random.normal(key, mean.shape)
        unsquashed = mean + jnp.exp(log_std) * noise
        log_density = -0.5 * noise**2 - log_std - 0.5 * jnp.log(2.0 * jnp.pi)
        squash = 2.0 * (jnp.log(2.0) - unsquashed - jax.nn.softplus(-2.0 * unsquashed))
        return jnp.tanh(unsquashed), jnp.sum(log_density - squash, axis=1)

    def mode(self, observation: jax.Array) -> jax.Array:
        """The deterministic action tanh(mean), (batch, action)."""
        return jnp.tanh(self.distribution(observation)[0])


class TwinCritic(eqx.Module):
    """Two action-value networks; their minimum curbs overestimation (Fujimoto et al. 2018)."""

    first: FeedForward
    second: FeedForward

    def __init__(
        self,
        observation_size: int,
        action_size: int,
        hidden_sizes: tuple[int, ...],
        key: jax.Array,
    ) -> None:
        """Draw the weights of both networks independently."""
        first_key, second_key = jax.random.split(key)
        size = observation_size + action_size
        self.first = FeedForward(size, hidden_sizes, 1, first_key)
        self.second = FeedForward(size, hidden_sizes, 1, second_key)

    def __call__(self, observation: jax.Array, action: jax.Array) -> jax.Array:
        """Both values of each observation and action, (2, batch)."""
        inputs = jnp.concatenate([observation, action], axis=1)
        return jnp.stack([self.first(inputs)[:, 0], self.second(inputs)[:, 0]])
