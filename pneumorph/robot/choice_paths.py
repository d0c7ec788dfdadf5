"""Choices made one after another under common rules, as paths through a graph of layers.

What the rules need to know of the choices so far, such as how many legs there are, is a node; all
paths that come to the same node have the same choices left. So paths are counted, weighed and
drawn in time and memory that grow with nodes and not with paths (dynamic programming; for weights
that are sums over places this is the forward-backward recursion of hidden Markov models, Baum
1972).
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from functools import cached_property
from typing import Any

import numpy as np

NONE = -1
"""Where no node follows."""


class ChoicePaths:
    """All ways through places at each of which one of some options is chosen.

    Attributes:
        option_counts: Options of each place.
        following: For each place the node that follows, (node, option) int, or `NONE` where the
            rules forbid the option or leave no way to the end after it.
    """

    def __init__(
        self,
        option_counts: Sequence[int],
        start: Any,
        step: Callable[[Any, int, int], Any],
        ends: Callable[[Any], bool],
    ) -> None:
        """Follow all choices once.

        Args:
            option_counts: Options of each place.
            start: What is known before the first choice, hashable.
            step: From what is known, the place and the option to what is known after it; None where
                the option is forbidden.
            ends: Whether what is known after the last choice keeps to the rules.
        """
        self.option_counts = tuple(option_counts)
        layers: list[dict[Any, int]] = [{start: 0}]
        tables = []
        for place, count in enumerate(self.option_counts):
            after: dict[Any, int] = {}
            table = np.full((len(layers[-1]), count), NONE)
            for known, node in layers[-1].items():
                for option in range(count):
                    reached = step(known, place, option)
                    if reached is not None:
                        table[node, option] = after.setdefault(reached, len(after))
            layers.append(after)
            tables.append(table)
        # Ways to the end, exact: there may be more than a float can count.
        ways = [int(ends(known)) for known in layers[-1]]
        self._ways = [ways]
        for table in reversed(tables):
            later = [*self._ways[0], 0]  # the last is that of NONE
            table[np.array([*map(bool, later[:-1]), False])[table] == 0] = NONE
            self._ways.insert(0, [sum(later[node] for node in row) for row in table])
        self.following = tuple(tables)

    @property
    def count(self) -> int:
        """Number of paths, exact."""
        return self._ways[0][0]

    def allows(self, options: Sequence[int]) -> bool:
        """Whether these options, one for each place, are a path."""
        node = 0
        for table, option in zip(self.following, options, strict=True):
            node = int(table[node, option])
            if node == NONE:
                return False
        return True

    def allows_any(self, wanted: Mapping[int, Collection[int]]) -> bool:
        """Whether a path has one of the wanted options at each place that is named."""
        nodes = {0}
        for place, table in enumerate(self.following):
            options = list(wanted.get(place, range(table.shape[1])))
            nodes = {*table[sorted(nodes)][:, options].ravel().tolist()} - {NONE}
        return bool(nodes)

    def __iter__(self) -> Iterator[tuple[int, ...]]:
        """Every path, in lexicographic order of its options."""
        yield from self._from((), 0)

    def _from(self, options: tuple[int, ...], node: int) -> Iterator[tuple[int, ...]]:
        if len(options) == len(self.following):
            yield options
            return
        for option, after in enumerate(self.following[len(options)][node]):
            if after != NONE:
                yield from self._from((*options, option), int(after))


class WeighedPaths:
    """Paths with probabilities ``p ~ exp(sum of the weights of their options)``.

    Attributes:
        log_total: Logarithm of the sum of all paths' weights; of zero weights that of their number.
    """

    def __init__(self, paths: ChoicePaths, weights: Sequence[np.ndarray]) -> None:
        """Weigh all paths.

        Args:
            paths: The paths; there must be one.
            weights: For each place a weight of each option, (option,).

        Raises:
            ValueError: There is no path.
        """
        if paths.count == 0:
            raise ValueError("there is no path, expected rules that leave one")
        self.paths = paths
        self._weights = weights
        last = max((int(table.max()) for table in paths.following[-1:]), default=0)
        # Logarithm of the weight of all ways on from each node.
        ahead = np.zeros(last + 1)
        self._chosen: list[np.ndarray] = []
        for table, weight in zip(reversed(paths.following), reversed(list(weights)), strict=True):
            terms = np.where(table == NONE, -np.inf, weight + ahead[table])
            highest = terms.max(axis=1)
            # A node that leads nowhere is never reached.
            highest = np.where(np.isfinite(highest), highest, 0.0)
            shares = np.exp(terms - highest[:, None])
            total = shares.sum(axis=1)
            self._chosen.append(shares / np.where(total > 0.0, total, 1.0)[:, None])
            with np.errstate(divide="ignore"):
                ahead = highest + np.log(total)
        self._chosen.reverse()
        self.log_total = float(ahead[0])

    @cached_property
    def _reached(self) -> list[np.ndarray]:
        """Probability of each node before each place."""
        found: list[np.ndarray] = [np.ones(1)]
        tables = self.paths.following
        # The last nodes of a layer may be such as nothing leads to.
        for table, after, chosen in zip(tables, tables[1:], self._chosen, strict=False):
            flow = found[-1][:, None] * chosen
            allowed = table != NONE
            found.append(np.bincount(table[allowed], flow[allowed], minlength=len(after)))
        return found

    @cached_property
    def marginals(self) -> list[np.ndarray]:
        """Probability of each option at each place, (option,) each: the gradient of `log_total` by
        the weights."""
        return [
            reached @ chosen for reached, chosen in zip(self._reached, self._chosen, strict=False)
        ]

    @cached_property
    def entropy(self) -> float:
        """Entropy over the paths [nat], exact, by the chain rule over places."""
        total = 0.0
        for reached, chosen in zip(self._reached, self._chosen, strict=False):
            logarithms = np.log(np.where(chosen > 0.0, chosen, 1.0))
            total -= float(reached @ (chosen * logarithms).sum(axis=1))
        return total

    def log_probability(self, options: np.ndarray) -> np.ndarray:
        """Logarithm of the probability of paths, (n,).

        Args:
            options: Of each path, (n, place), each a path.
        """
        sums = np.zeros(len(options))
        for weight, column in zip(self._weights, np.transpose(options), strict=True):
            sums += weight[column]
        logarithms: np.ndarray = sums - self.log_total
        return logarithms

    def sample(self, count: int, rng: np.random.Generator) -> np.ndarray:
        """Draw paths independently; their options, (count, place). None is drawn in vain: an option
        that the rules forbid has no share."""
        nodes = np.zeros(count, dtype=int)
        drawn = np.empty((count, len(self._chosen)), dtype=int)
        for place, (table, chosen) in enumerate(
            zip(self.paths.following, self._chosen, strict=True)
        ):
            cumulative = np.cumsum(chosen, axis=1)
            # Below the sum, which is one but for rounding: the first beyond it has a share.
            marks = rng.random(count) * cumulative[nodes, -1]
            drawn[:, place] = (cumulative[nodes] <= marks[:, None]).sum(axis=1)
            nodes = table[nodes, drawn[:, place]]
        return drawn
