"""What a design may have at one location, as text.

Entries are separated by spaces: ``0`` for no leg, else a kind of module and its regulators as in a
design's text, where ``*`` stands for any regulator: ``0 * b*`` allows no leg, the first or the
second kind of module on any regulator, ``1`` asks for the first kind on regulator 1, and ``c*+*``
for the third kind with regulators of their own for its two cavities.
"""

from __future__ import annotations

import re
from collections import Counter
from itertools import product

from pneumorph.robot.design import Fitting

_ENTRY = re.compile(r"([a-z]?)((?:[1-9][0-9]*|\*)(?:\+(?:[1-9][0-9]*|\*))*)", re.ASCII)


def site_options(
    text: str, location: int, regulator_count: int
) -> tuple[tuple[Fitting | None, ...], bool]:
    """What a location may carry.

    Args:
        text: The options.
        location: Number of the location.
        regulator_count: Regulators that ``*`` stands for.

    Returns:
        The options in the order of designs, None for no leg, and whether one of them names a
        regulator.

    Raises:
        ValueError: An entry is none or says what another one says, or it names a regulator that
            there is not.
    """
    found: list[Fitting | None] = []
    named = False
    for entry in text.split():
        if entry == "0":
            found.append(None)
            continue
        match = _ENTRY.fullmatch(entry)
        if match is None:
            raise ValueError(
                f"options[{location}] has {entry!r}, expected entries such as 0, 1, * or b*, "
                "separated by spaces"
            )
        kind, numbers = match.groups()
        choices = []
        for number in numbers.split("+"):
            named |= number != "*"
            if number != "*" and int(number) > regulator_count:
                raise ValueError(
                    f"options[{location}] names regulator {number}, expected 1 to {regulator_count}"
                )
            every = range(1, regulator_count + 1)
            choices.append(every if number == "*" else [int(number)])
        module = ord(kind or "a") - ord("a")
        found += [Fitting(location, module, regulators) for regulators in product(*choices)]
    counts = Counter(map(_driven, found))
    if len(counts) < len(found) or not found:
        twice = [str(each or 0) for each, count in counts.items() if count > 1]
        said = f", and it says {twice[0]} twice" if twice else ""
        raise ValueError(
            f"options[{location}] is {text!r}, expected one or more different entries{said}: such "
            'as "0 *" for no leg or one on any regulator, or "*+*" alone for two cavities on one '
            "regulator or on two, which holds what * says"
        )
    return tuple(sorted(found, key=_order)), named


def _driven(option: Fitting | None) -> Fitting | None:
    """The option, with one regulator named once where it drives every cavity."""
    if option is None or len(set(option.regulators)) > 1:
        return option
    return option._replace(regulators=option.regulators[:1])


def _order(option: Fitting | None) -> tuple[tuple[int, ...], int]:
    return ((0,), 0) if option is None else (option.regulators, option.module)
