"""Refuse rules that allow a design and not the one that a symmetry makes of it.

Designs of which one is to stand for all must all be allowed or none: otherwise the one that stands
for them may be none of the space, and those that are would be lost.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from itertools import combinations

from pneumorph.robot.design import Fitting
from pneumorph.robot.least_designs import Product


def check_closed(
    options: Sequence[Sequence[Fitting | None]],
    excluded: Collection[Collection[int]],
    symmetry: Product,
    said: str,
    remedy: str,
) -> None:
    """Refuse options and exclusions that a symmetry does not turn into each other.

    Counts of legs and regulators are the same of a design and its image, and options of a space
    whose regulators may be renamed name none, so this is all there is to compare.

    Args:
        options: What each location may carry, None for no leg.
        excluded: Locations of which one at most may carry a leg.
        symmetry: Where the leg of each location goes, and whether it is a mirror.
        said: What the symmetry is, for the error.
        remedy: What else to do.

    Raises:
        ValueError: A location may carry what the one that its leg goes to may not, or two are
            excluded together and their images are not.
    """
    to, reflected = symmetry
    for location, here in enumerate(options):
        image = {_moved(each, to[location], reflected) for each in here}
        if image != set(options[to[location]]):
            raise ValueError(
                f"{said} takes what is at location {location} to location {to[location]}, which "
                f"may carry something else: options[{location}] and options[{to[location]}] are "
                f"not each other's images; expected options that are, or {remedy}"
            )
    pairs = {pair for each in excluded for pair in combinations(sorted(each), 2)}
    for one, other in sorted(pairs):
        a, b = sorted((to[one], to[other]))
        if (a, b) not in pairs:
            raise ValueError(
                f"{said} takes locations {one} and {other}, of which exclusions allow one at most, "
                f"to {a} and {b}, of which they allow both; expected exclusions that are each "
                f"other's images, or {remedy}"
            )


def _moved(option: Fitting | None, location: int, reflected: bool) -> Fitting | None:
    if option is None:
        return None
    regulators = option.regulators[::-1] if reflected else option.regulators
    return option._replace(location=location, regulators=regulators)
