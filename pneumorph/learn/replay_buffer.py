"""The most recent transitions of all designs."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import jax.numpy as jnp
import numpy as np

from pneumorph.learn.sac import Batch

FIELDS = ("state", "design", "action", "reward", "next_state", "terminal")


class ReplayBuffer:
    """A ring of transitions; the design is kept as its index and told in one-hot form on drawing.

    A design takes 8 bytes that way instead of 128, which is most of an observation.
    """

    def __init__(
        self,
        capacity: int,
        state_size: int,
        action_size: int,
        design_features: Callable[[np.ndarray], np.ndarray],
        earlier: Sequence[Mapping[str, np.ndarray]] = (),
    ) -> None:
        """Make a buffer without transitions of its own.

        Args:
            capacity: Transitions kept.
            state_size: Numbers of an observation that come before the design's.
            action_size: Numbers of an action.
            design_features: From indices of designs, (...), to what an observation says of each,
                (..., feature) float32.
            earlier: What other buffers' `arrays` gave: drawn as its own, but never replaced.
        """
        if capacity < 1:
            raise ValueError(f"capacity is {capacity}, expected at least 1")
        self.capacity = capacity
        self._features = design_features
        own: dict[str, np.ndarray] = {
            "state": np.zeros((capacity, state_size), np.float32),
            "design": np.zeros(capacity, np.int64),
            "action": np.zeros((capacity, action_size), np.float32),
            "reward": np.zeros(capacity, np.float32),
            "next_state": np.zeros((capacity, state_size), np.float32),
            "terminal": np.zeros(capacity, np.float32),
        }
        self.earlier_count = sum(len(before["design"]) for before in earlier)
        # Those of before come first: what can be drawn is always one stretch.
        self._arrays = {
            name: np.concatenate([*(before[name] for before in earlier), values])
            for name, values in own.items()
        }
        self.added_count = 0

    def __len__(self) -> int:
        """Number of its own transitions."""
        return min(self.added_count, self.capacity)

    def check(self, transitions: Mapping[str, np.ndarray]) -> None:
        """Refuse what no buffer like this one held.

        Args:
            transitions: What another's `arrays` gave.

        Raises:
            KeyError: A field is missing.
            ValueError: One is of another shape.
        """
        count = len(transitions["design"])
        for name in FIELDS:
            expected = (count, *self._arrays[name].shape[1:])
            if transitions[name].shape != expected:
                raise ValueError(
                    f"{name} has shape {transitions[name].shape}, expected {expected}; the "
                    "transitions are of other robots"
                )

    def add(
        self,
        *,
        state: np.ndarray,
        design: np.ndarray,
        action: np.ndarray,
        reward: np.ndarray,
        next_state: np.ndarray,
        terminal: np.ndarray,
    ) -> None:
        """Add transitions, shape (n, ...) each; the oldest make room.

        Raises:
            ValueError: A reward is not finite.
        """
        if not np.isfinite(reward).all():
            raise ValueError(
                f"reward holds {reward[~np.isfinite(reward)][0]}, expected finite ones"
            )
        count = len(design)
        places = self.earlier_count + (self.added_count + np.arange(count)) % self.capacity
        for name, values in zip(
            FIELDS, (state, design, action, reward, next_state, terminal), strict=True
        ):
            self._arrays[name][places] = values
        self.added_count += count

    @property
    def rewards_of_going_on(self) -> np.ndarray:
        """Rewards [cm] of the transitions that did not end an episode for good, (n,)."""
        known = slice(self.earlier_count + len(self))
        rewards: np.ndarray = self._arrays["reward"][known][self._arrays["terminal"][known] == 0.0]
        return rewards

    def sample(self, update_count: int, batch_size: int, rng: np.random.Generator) -> Batch:
        """Draw batches uniformly with replacement, fields of shape (update, batch, ...)."""
        known = self.earlier_count + len(self)
        if not known:
            raise ValueError("the replay buffer is empty, expected transitions to draw from")
        places = rng.integers(known, size=(update_count, batch_size))
        drawn = {name: values[places] for name, values in self._arrays.items()}
        features = self._features(drawn["design"])
        return Batch(
            observation=jnp.asarray(np.concatenate([drawn["state"], features], axis=-1)),
            action=jnp.asarray(drawn["action"]),
            reward=jnp.asarray(drawn["reward"]),
            next_observation=jnp.asarray(np.concatenate([drawn["next_state"], features], axis=-1)),
            terminal=jnp.asarray(drawn["terminal"]),
        )

    def arrays(self) -> dict[str, np.ndarray]:
        """Everything held but what is earlier, for a checkpoint."""
        own = slice(self.earlier_count, self.earlier_count + len(self))
        held = {name: values[own] for name, values in self._arrays.items()}
        return {**held, "added_count": np.array(self.added_count)}

    def restore(self, arrays: Mapping[str, np.ndarray]) -> None:
        """Take over what `arrays` gave; later draws are the same as without the detour."""
        self.added_count = int(arrays["added_count"])
        for name in FIELDS:
            self._arrays[name][self.earlier_count :][: len(self)] = arrays[name]
