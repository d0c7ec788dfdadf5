"""Which of many designs stand for all that symmetries turn into each other, in arrays."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from pneumorph.robot.design import Fitting

Product = tuple[tuple[int, ...], bool]
"""Where the legs of each location go, and whether left and right are exchanged."""


def least_of_their_classes(
    options: Sequence[Sequence[Fitting | None]],
    chosen: np.ndarray,
    products: Iterable[Product],
    cavity_count: int,
    canonical: bool,
) -> np.ndarray:
    """Whether each design is the least of those that count as one with it.

    The same as ``form(design)[0] == design`` of `pneumorph.robot.design_choices.DesignChoices`.

    Args:
        options: What each location may carry.
        chosen: Number of the option at each location, (design, location).
        products: All products of the symmetries.
        cavity_count: Most cavities of a module that have regulators of their own.
        canonical: Whether designs that differ only by the names of their regulators count as one;
            the designs then have their canonical names.

    Returns:
        (design,) bool.
    """
    regulators = np.zeros((*chosen.shape, cavity_count), dtype=int)
    kinds = np.zeros(chosen.shape, dtype=int)
    for location, here in enumerate(options):
        for number, each in enumerate(here):
            if each is not None:
                carry_it = chosen[:, location] == number
                regulators[carry_it, location, : len(each.regulators)] = each.regulators
                kinds[carry_it, location] = each.module
    own = _in_order(regulators, kinds)
    least = np.ones(len(chosen), dtype=bool)
    for to, reflected in products:
        image, image_kinds = np.empty_like(regulators), np.empty_like(kinds)
        image[:, to], image_kinds[:, to] = regulators, kinds
        if reflected:
            image = _backwards(image)
        if canonical:
            image = _by_first_appearance(image)
        difference = _in_order(image, image_kinds) - own
        first = np.argmax(difference != 0, axis=1)
        least &= difference[np.arange(len(chosen)), first] >= 0
    return least


def _in_order(regulators: np.ndarray, kinds: np.ndarray) -> np.ndarray:
    """Columns by which designs are ordered, the first before all others, (design, column): what
    `Design` compares, 0 for what it leaves out."""
    count, locations, cavities = regulators.shape
    others = regulators[:, :, 1:].reshape(count, locations * (cavities - 1))
    return np.hstack([regulators[:, :, 0], kinds, others])


def _backwards(regulators: np.ndarray) -> np.ndarray:
    """The regulators of each leg's cavities in reverse order, those that it has before zeros."""
    reverse = regulators[:, :, ::-1]
    order = np.argsort(reverse == 0, axis=2, kind="stable")
    return np.take_along_axis(reverse, order, axis=2)


def _by_first_appearance(regulators: np.ndarray) -> np.ndarray:
    """Regulators numbered from 1 in the order in which locations and their cavities name them."""
    flat = regulators.reshape(len(regulators), regulators[:1].size)
    names, places = np.arange(1, flat.max(initial=0) + 1), np.arange(flat.shape[1], dtype=np.int16)
    named_here = flat[:, None] == names[:, None]
    first = np.where(named_here, places, len(places)).min(axis=2)
    renamed = np.zeros((len(flat), 1 + len(names)), dtype=int)
    renamed[:, 1:] = 1 + np.argsort(np.argsort(first, axis=1, kind="stable"), axis=1)
    return np.take_along_axis(renamed, flat, axis=1).reshape(regulators.shape)
