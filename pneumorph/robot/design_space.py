"""Every design that may be built, in a defined order."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from math import comb

import numpy as np

from pneumorph.base.checked import Checked, Count, CountOrNone
from pneumorph.robot.design import MINIMUM_LEGS, Design, Fitting
from pneumorph.robot.site_options import site_options

DESIGN_LIMIT = 100_000
"""Most designs that are listed one by one."""


@dataclass(frozen=True)
class DesignSpace(Checked):
    """Designs of a hub with ``N`` locations, ``M`` regulators and a range of legs.

    The defaults are the paper's (section III-B): 41202 assignments, of which 6972 remain once
    the regulators' names are made canonical.

    A symmetry moves the leg of each location to another one, given as numbers of the locations
    where they go, such as ``7 6 5 4 3 2 1 0``. The mirror is one about the forward axis: a robot's
    image walks the mirrored path when its regulators do the same, so what is learned of one holds
    for the other.

    Attributes:
        location_count: Candidate locations ``N`` around the hub.
        regulator_count: Regulators ``M``.
        minimum_legs: Fewest legs of a design.
        maximum_legs: Most legs of a design.
        canonical: Keep one design of those that differ only by the names of their regulators.
        options: What each location may carry, see `site_options`; empty for no leg or one of the
            first kind on any regulator.
        minimum_regulators: Fewest different regulators of a design.
        maximum_regulators: Most different regulators of a design; None for all.
        exclusions: Locations of which one at most may carry a leg, such as ``0 1``.
        mirror: The mirror: ``radial`` (leg k goes to N - 1 - k), ``none``, or where legs go.
        symmetries: Keep one design of those that these turn into each other: ``mirror``, or where
            legs go.
    """

    location_count: Count = 8
    regulator_count: Count = 3
    minimum_legs: CountOrNone = MINIMUM_LEGS
    maximum_legs: int = 6
    canonical: bool = True
    options: tuple[str, ...] = ()
    minimum_regulators: CountOrNone = 0
    maximum_regulators: Count | None = None
    exclusions: tuple[str, ...] = ()
    mirror: str = "radial"
    symmetries: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        super().__post_init__()
        if not self.minimum_legs <= self.maximum_legs <= self.location_count:
            raise ValueError(
                f"legs from {self.minimum_legs} to {self.maximum_legs} on {self.location_count} "
                "locations, expected 0 <= minimum_legs <= maximum_legs <= location_count"
            )
        if self.options and len(self.options) != self.location_count:
            raise ValueError(
                f"options has {len(self.options)} entries, expected one for each of the "
                f"{self.location_count} locations"
            )
        _, named = self._options
        if named and self.canonical:
            raise ValueError(
                "options name regulators and canonical is true, expected canonical = false: "
                "regulators that differ may not be renamed"
            )
        idle = set(range(1, self.regulator_count + 1)) - {
            regulator for each in self._fittings for regulator in each.regulators
        }
        if idle:
            raise ValueError(
                f"regulator {min(idle)} of {self.regulator_count} drives nothing in any of the "
                "options, expected as many regulators as are used"
            )
        _ = self._excluded, self._mirror, self._symmetries  # refuse what is none

    @cached_property
    def _options(self) -> tuple[tuple[tuple[Fitting | None, ...], ...], bool]:
        texts = self.options or ("0 *",) * self.location_count
        found = [
            site_options(text, location, self.regulator_count)
            for location, text in enumerate(texts)
        ]
        return tuple(options for options, _ in found), any(named for _, named in found)

    @cached_property
    def _excluded(self) -> tuple[frozenset[int], ...]:
        return tuple(frozenset(self._numbers("exclusions", text)) for text in self.exclusions)

    @cached_property
    def _mirror(self) -> tuple[int, ...] | None:
        if self.mirror == "none":
            return None
        if self.mirror == "radial":
            return tuple(reversed(range(self.location_count)))
        return self._permutation("mirror", self.mirror)

    @cached_property
    def _symmetries(self) -> tuple[tuple[tuple[int, ...], bool], ...]:
        """Where legs go, and whether left and right are exchanged, by each."""
        found = []
        for text in self.symmetries:
            if text == "mirror":
                if self._mirror is None:
                    raise ValueError('symmetries has "mirror" and mirror is "none"')
                found.append((self._mirror, True))
            else:
                found.append((self._permutation("symmetries", text), False))
        return tuple(found)

    def _numbers(self, name: str, text: str) -> tuple[int, ...]:
        numbers = tuple(int(each) if each.isdecimal() else -1 for each in text.split())
        if not all(0 <= number < self.location_count for number in numbers):
            raise ValueError(
                f"{name} has {text!r}, expected numbers of locations from 0 to "
                f"{self.location_count - 1}, separated by spaces"
            )
        return numbers

    def _permutation(self, name: str, text: str) -> tuple[int, ...]:
        to = self._numbers(name, text)
        if sorted(to) != list(range(self.location_count)):
            raise ValueError(
                f"{name} has {text!r}, expected each of the {self.location_count} locations once: "
                "a symmetry leaves none without an image"
            )
        return to

    @property
    def has_mirror(self) -> bool:
        """Whether a design's mirror image is one of the robot's as well."""
        return self._mirror is not None

    @cached_property
    def module_count(self) -> int:
        """Kinds of modules that designs choose from."""
        return 1 + max((each.module for each in self._fittings), default=0)

    @cached_property
    def cavity_count(self) -> int:
        """Most cavities of a module that have regulators of their own."""
        return max((len(each.regulators) for each in self._fittings), default=1)

    @property
    def kinds(self) -> tuple[set[int], ...]:
        """Numbers of the modules that each location may carry."""
        return tuple(
            {each.module for each in options if each is not None} for options in self._options[0]
        )

    @property
    def _fittings(self) -> list[Fitting]:
        return [each for options in self._options[0] for each in options if each is not None]

    @property
    def is_plain(self) -> bool:
        """Whether legs, regulators and their names are all that there is to choose."""
        return self == DesignSpace(
            self.location_count,
            self.regulator_count,
            self.minimum_legs,
            self.maximum_legs,
            self.canonical,
            mirror=self.mirror,
        )

    @property
    def size(self) -> int:
        """Number of designs; of a space without further rules in closed form.

        Raw: sum over legs ``L`` of ``C(N, L) M^L``. Canonical: ``C(N, L)`` times the ways to
        split ``L`` legs into at most ``M`` unnamed groups, a sum of Stirling numbers.
        """
        if not self.is_plain:
            return len(self.designs)
        legs = range(self.minimum_legs, self.maximum_legs + 1)
        if not self.canonical:
            return sum(comb(self.location_count, leg) * self.regulator_count**leg for leg in legs)
        return sum(
            comb(self.location_count, leg)
            * sum(_stirling(leg, group) for group in range(self.regulator_count + 1))
            for leg in legs
        )

    def __len__(self) -> int:
        return self.size

    def __iter__(self) -> Iterator[Design]:
        return iter(self.designs)

    def __getitem__(self, index: int) -> Design:
        return self.designs[index]

    def __contains__(self, design: object) -> bool:
        return design in self._index

    @cached_property
    def designs(self) -> tuple[Design, ...]:
        """Every design, in lexicographic order of the assignment.

        Raises:
            ValueError: There is none, or there are more than `DESIGN_LIMIT`.
        """
        found: list[Design] = []
        for fittings in self._choices((), 0):
            design = Design.of(self.location_count, fittings)
            if self.symmetries and self.form(design)[0] != design:
                continue
            found.append(design)
            if len(found) > DESIGN_LIMIT:
                raise ValueError(
                    f"the design space holds more than {DESIGN_LIMIT} designs, expected fewer: "
                    "they are listed one by one; allow fewer legs, options or regulators"
                )
        if not found:
            raise ValueError(
                "the design space is empty: no design keeps to its options, counts of legs and "
                "regulators, and exclusions together"
            )
        return tuple(found)

    def _choices(self, start: tuple[Fitting, ...], location: int) -> Iterator[tuple[Fitting, ...]]:
        left = self.location_count - location
        used = {regulator for each in start for regulator in each.regulators}
        if len(start) > self.maximum_legs or len(start) + left < self.minimum_legs:
            return
        if len(used) > (self.maximum_regulators or self.regulator_count):
            return
        if left == 0:
            if len(used) >= self.minimum_regulators:
                yield start
            return
        taken = {each.location for each in start}
        barred = any(location in each and taken & each for each in self._excluded)
        for option in self._options[0][location]:
            if option is None:
                yield from self._choices(start, location + 1)
            elif not barred and (not self.canonical or _names_follow(option, max(used, default=0))):
                yield from self._choices((*start, option), location + 1)

    @cached_property
    def _index(self) -> dict[Design, int]:
        return {design: index for index, design in enumerate(self.designs)}

    def form(self, design: Design) -> tuple[Design, tuple[int, ...]]:
        """The design that stands for a design and all that are counted as one with it.

        Args:
            design: One of the robot's.

        Returns:
            The least of them, and which of the design's regulators, from 1, each of its regulators
            is; those that it does not use fill up in rising order.
        """
        names = tuple(range(1, self.regulator_count + 1))
        start = self._renamed(design, names)
        seen, waiting = dict([start]), [start]
        while waiting:
            current, order = waiting.pop()
            for to, reflected in self._symmetries:
                image = self._renamed(current.moved(to, reflected), order)
                if image[0] not in seen:
                    seen[image[0]] = image[1]
                    waiting.append(image)
        least = min(seen)
        return least, seen[least]

    def _renamed(self, design: Design, order: tuple[int, ...]) -> tuple[Design, tuple[int, ...]]:
        """A design whose regulators are those of `order`, and it under canonical names."""
        if not self.canonical:
            return design, order
        used = design.regulator_order()
        unused = [name for name in range(1, self.regulator_count + 1) if name not in used]
        return design.canonical(), tuple(order[name - 1] for name in (*used, *unused))

    def index(self, design: Design) -> int:
        """Place in `designs` of the design that stands for a design.

        Raises:
            ValueError: The design is not one of this space.
        """
        self.check(design)
        form = self.form(design)[0]
        if form not in self._index:
            raise ValueError(
                f"design {design} is not one of the space: its rules on options, regulators or "
                "exclusions do not allow it"
            )
        return self._index[form]

    def check(self, design: Design) -> None:
        """Raise `ValueError`, saying what is wrong, unless the design has as many locations, legs
        and regulators as the space allows, and at each location what is an option there."""
        if design.location_count != self.location_count:
            raise ValueError(
                f"design {design} has {design.location_count} locations, expected "
                f"{self.location_count}: write a 0 for each location without a leg"
            )
        design.check_regulators(self.regulator_count)
        if design.leg_count < self.minimum_legs:
            raise ValueError(
                f"design {design} has too few legs: {design.leg_count}, expected at least "
                f"{self.minimum_legs}; with fewer the robot cannot stand"
            )
        if design.leg_count > self.maximum_legs:
            raise ValueError(
                f"design {design} has too many legs: {design.leg_count}, expected at most "
                f"{self.maximum_legs}"
            )
        fittings = {each.location: each for each in design.fittings}
        for location, options in enumerate(self._options[0]):
            chosen = fittings.get(location)
            if chosen not in options:
                wanted = (self.options or ("0 *",) * self.location_count)[location]
                raise ValueError(
                    f"design {design} has {chosen or 'no leg'} at location {location}, expected "
                    f"one of the options {wanted!r}"
                )

    def parse(self, text: str) -> Design:
        """Read a design and check that it belongs to the space; canonical if the space is.

        Raises:
            ValueError: The text is no design, or the design is not of this space.
        """
        design = Design.parse(text)
        self.check(design)
        return self.form(design)[0]

    @cached_property
    def one_hot(self) -> np.ndarray:
        """One-hot rows of all designs, (design, feature) float32; see `Design.one_hot`."""
        return np.stack(
            [
                design.one_hot(self.regulator_count, self.module_count, self.cavity_count)
                for design in self.designs
            ]
        )

    @cached_property
    def _images(self) -> list[tuple[Design, tuple[int, ...]]]:
        """The mirror image of each design and the regulators of it; its own without a mirror."""
        to = self._mirror
        return [
            self.form(design if to is None else design.moved(to, reflected=True))
            for design in self.designs
        ]

    @cached_property
    def mirror_index(self) -> np.ndarray:
        """Index of the design that stands for each design's mirror image, shape (design,); its own
        of a robot without a mirror.

        Raises:
            ValueError: An image is not one of the space.
        """
        for design, (image, _) in zip(self.designs, self._images, strict=True):
            if image not in self._index:
                raise ValueError(
                    f"the mirror image {image} of design {design} is not one of the space, "
                    'expected options that are each other\'s images, or mirror = "none"'
                )
        return np.array([self._index[image] for image, _ in self._images])

    @cached_property
    def mirror_regulator(self) -> np.ndarray:
        """Which of a design's regulators drives each regulator of its mirror image.

        Regulator ``m`` (from 0) of the design that stands for the image must receive what
        regulator ``mirror_regulator[design, m]`` of the design receives, for the two robots to walk
        mirrored paths. Shape (design, M); unused regulators fill up in rising order.
        """
        return np.array([order for _, order in self._images]) - 1


def _names_follow(option: Fitting, highest: int) -> bool:
    """Whether each new name is one above the highest in use, as in canonical form."""
    for regulator in option.regulators:
        if regulator > highest + 1:
            return False
        highest = max(highest, regulator)
    return True


def _stirling(element_count: int, group_count: int) -> int:
    """Stirling number of the second kind: ways to split elements into nonempty groups."""
    if group_count == 0:
        return int(element_count == 0)
    if group_count > element_count:
        return 0
    return group_count * _stirling(element_count - 1, group_count) + _stirling(
        element_count - 1, group_count - 1
    )
