"""The design of a space that stands for it where none is named."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import groupby, product

from pneumorph.robot.design import Design, Fitting
from pneumorph.robot.design_space import DesignSpace

_WAVES = 2
"""Regulators that the expert's gait drives."""
_MOST_TRIED = 100_000


def usual_design(space: DesignSpace) -> Design:
    """The design of most legs that is its own mirror image, by which regulator its legs are on; of
    several one that both waves of the expert's gait drive, then the first.

    Where none is its own image, or the robot has no mirror, it is the first of most legs. Of spaces
    that are not listed, it is looked for among designs of two regulators and each site's first
    module that are their own images, and is the first design where there is none.

    Raises:
        ValueError: The space is empty.
    """
    if not space.is_listed:
        found = max(_images(space), key=_merit, default=None)
        return space.first if found is None else space.form(found)[0]
    designs = sorted(space.designs, key=lambda each: -each.leg_count)
    for _, group in groupby(designs, key=lambda each: each.leg_count):
        found = max((each for each in group if space.is_own_image(each)), key=_merit, default=None)
        if found is not None:
            return found
    most = designs[0].leg_count
    return max((each for each in designs if each.leg_count == most), key=_merit)


def _merit(design: Design) -> tuple[int, int]:
    """Legs, and how many waves of the expert's gait drive some."""
    used = {regulator for each in design.fittings for regulator in each.regulators}
    return design.leg_count, len(used & set(range(1, _WAVES + 1)))


def _images(space: DesignSpace) -> Iterable[Design]:
    """Simple designs that are their own mirror images."""
    pairs = space.mirror_pairs
    if 3 ** len(pairs) > _MOST_TRIED:
        return
    for regulators in product((1, 2, 0), repeat=len(pairs)):
        fittings = [
            Fitting(site, 0, (regulator,))
            for pair, regulator in zip(pairs, regulators, strict=True)
            for site in pair
            if regulator
        ]
        design = Design.of(space.location_count, fittings)
        if fittings and space.holds(design):
            yield design
