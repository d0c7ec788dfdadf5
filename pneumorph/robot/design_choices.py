"""Which designs may be built: what locations may carry, counts, exclusions and symmetries."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from pneumorph.base.checked import Checked, Count, CountOrNone
from pneumorph.robot.choice_paths import ChoicePaths
from pneumorph.robot.closed_rules import check_closed
from pneumorph.robot.design import MINIMUM_LEGS, Design, Fitting
from pneumorph.robot.least_designs import Product, least_of_their_classes
from pneumorph.robot.site_options import site_options


@dataclass(frozen=True)
class DesignChoices(Checked):
    """What may be chosen at ``N`` locations of a hub with ``M`` regulators.

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
        options: What each location may carry, such as ``0 * b*``: no leg (0), or a first or a
            second kind of leg (b) on any regulator (*). Empty: 0 or * everywhere.
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
        most = min(self.maximum_regulators or self.regulator_count, self.regulator_count)
        if self.minimum_regulators > most:
            raise ValueError(
                f"minimum_regulators is {self.minimum_regulators}, expected at most {most}, as "
                "many regulators as a design may use"
            )
        if self.options and len(self.options) != self.location_count:
            raise ValueError(
                f"options has {len(self.options)} entries, expected one for each of the "
                f"{self.location_count} locations"
            )
        idle = set(range(1, self.regulator_count + 1)) - {
            regulator for each in self._fittings for regulator in each.regulators
        }
        if idle:
            raise ValueError(
                f"regulator {min(idle)} of {self.regulator_count} drives nothing in any of the "
                "options, expected as many regulators (regulator_count) as are used"
            )
        if self._options[1] and self.canonical:
            raise ValueError(
                "options name regulators and canonical is true, expected canonical = false: "
                "regulators that differ may not be renamed"
            )
        _ = self._mirror, self._excluded  # refuse what is none
        remedy = "no such symmetry (leave it out of space.symmetries, or same in a robot's file)"
        for text, symmetry in zip(self.symmetries, self._symmetries, strict=True):
            said = f"the symmetry {text!r}"
            check_closed(self._options[0], self._excluded, symmetry, said, remedy)

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
        found = tuple(frozenset(self._numbers("exclusions", text)) for text in self.exclusions)
        for text, locations in zip(self.exclusions, found, strict=True):
            if len(locations) < 2:
                raise ValueError(
                    f"exclusions has {text!r}, expected two different locations or more, of which "
                    "one at most may carry a leg; a location that may carry none has options 0"
                )
        return found

    def broken_exclusion(self, design: Design) -> tuple[int, ...] | None:
        """Locations with legs of which one at most may carry one; None where a design keeps to all
        exclusions."""
        legs = {each.location for each in design.fittings}
        broken = (tuple(sorted(legs & each)) for each in self._excluded)
        return next((each for each in broken if len(each) > 1), None)

    @cached_property
    def _mirror(self) -> tuple[int, ...] | None:
        if self.mirror == "none":
            return None
        if self.mirror == "radial":
            return tuple(reversed(range(self.location_count)))
        return self._permutation("mirror", self.mirror)

    @cached_property
    def _symmetries(self) -> tuple[Product, ...]:
        """Those that `symmetries` names."""
        found = []
        for text in self.symmetries:
            if text == "mirror":
                if self._mirror is None:
                    raise ValueError('symmetries has "mirror" and mirror is "none"')
                found.append((self._mirror, True))
            else:
                found.append((self._permutation("symmetries", text), False))
        return tuple(found)

    @cached_property
    def _products(self) -> tuple[Product, ...]:
        """Different products of the symmetries, that which moves nothing first."""
        start = (tuple(range(self.location_count)), False)
        seen, waiting = {start: None}, [start]
        while waiting:
            current, turned = waiting.pop()
            for to, reflected in self._symmetries:
                product = (tuple(to[each] for each in current), turned != reflected)
                if product not in seen:
                    seen[product] = None
                    waiting.append(product)
        return tuple(seen)

    @property
    def symmetry_moves(self) -> tuple[Product, ...]:
        """Where each location's leg goes, and whether cavities change order as well, for each
        design that is counted as one with another but for the names of its regulators; that which
        moves nothing first."""
        return self._products

    @property
    def mirror_move(self) -> Product | None:
        """The same of the mirror image; None of a robot without a mirror."""
        return None if self._mirror is None else (self._mirror, True)

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

    def check_images(self) -> None:
        """Refuse rules that allow a design and not its mirror image.

        Raises:
            ValueError: Options or exclusions are not each other's images.
        """
        if self._mirror is not None:
            remedy = 'no mirror (space.mirror "none", or mirror = false in a robot\'s file)'
            said, mirror = "the mirror", (self._mirror, True)
            check_closed(self._options[0], self._excluded, mirror, said, remedy)

    @property
    def has_mirror(self) -> bool:
        """Whether a design's mirror image is one of the robot's as well."""
        return self._mirror is not None

    @property
    def mirror_pairs(self) -> tuple[tuple[int, ...], ...]:
        """Locations that the mirror turns into each other, one or two each; of a robot without a
        mirror each alone."""
        to = self._mirror or tuple(range(self.location_count))
        return tuple(dict.fromkeys(tuple(sorted({site, to[site]})) for site in range(len(to))))

    def is_own_image(self, design: Design) -> bool:
        """Whether a design's legs stand and are driven as those of its mirror image; never where
        the robot has no mirror."""
        return self._mirror is not None and design.moved(self._mirror, reflected=True) == design

    def has_own_form(self, design: Design) -> bool:
        """The same where the names of regulators do not count."""
        if self._mirror is None:
            return False
        image = design.moved(self._mirror, reflected=True)
        return self.is_own_image(design) or (
            self.canonical and image.canonical() == design.canonical()
        )

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
        return tuple({each.module for each in fittings} for fittings in self.fittings)

    @property
    def fittings(self) -> tuple[tuple[Fitting, ...], ...]:
        """What each location may carry, besides nothing."""
        return tuple(
            tuple(each for each in options if each is not None) for options in self._options[0]
        )

    @property
    def _fittings(self) -> list[Fitting]:
        return [each for fittings in self.fittings for each in fittings]

    @cached_property
    def paths(self) -> ChoicePaths:
        """Every design under its canonical name as options of its locations, one after another;
        those that symmetries turn into each other apart."""
        options, last = self._options[0], [max(each, default=-1) for each in self._excluded]
        most = self.maximum_regulators or self.regulator_count

        def step(known: Any, location: int, number: int) -> Any:
            """From legs, regulators in use and exclusions that a leg has taken so far."""
            legs, used, taken = known
            option = options[location][number]
            if option is not None:
                here = {place for place, each in enumerate(self._excluded) if location in each}
                if here & taken or (self.canonical and not _names_follow(option, len(used))):
                    return None
                legs, used, taken = legs + 1, used | {*option.regulators}, taken | here
            if legs > self.maximum_legs or len(used) > most:
                return None
            return legs, used, frozenset(each for each in taken if last[each] > location)

        return ChoicePaths(
            [len(each) for each in options],
            (0, frozenset(), frozenset()),
            step,
            lambda known: (
                known[0] >= self.minimum_legs and len(known[1]) >= self.minimum_regulators
            ),
        )

    def allows_together(self, wanted: Mapping[int, Collection[Fitting]]) -> bool:
        """Whether a design has at each location that is named one of the legs that are named."""
        options = self._options[0]
        return self.paths.allows_any(
            {
                location: [n for n, option in enumerate(options[location]) if option in legs]
                for location, legs in wanted.items()
            }
        )

    @property
    def idle_regulators(self) -> tuple[int, ...]:
        """Regulators that no design uses, from 1; where there are more of them than a design has
        cavities, and their names mean nothing, those that are too many."""
        cavities = (max((len(leg.regulators) for leg in legs), default=0) for legs in self.fittings)
        most = sum(sorted(cavities, reverse=True)[: self.maximum_legs])
        if self.canonical and self.regulator_count > most:
            return tuple(range(most + 1, self.regulator_count + 1))
        return tuple(
            number
            for number in range(1, self.regulator_count + 1)
            if not any(
                self.allows_together({location: [leg for leg in legs if number in leg.regulators]})
                for location, legs in enumerate(self.fittings)
            )
        )

    def refuse_idle_regulators(self, setting: str, remedy: str) -> None:
        """Refuse regulators that no design uses.

        Args:
            setting: Says how many there are, for the error.
            remedy: What else the error says to do.

        Raises:
            ValueError: There is one.
        """
        if idle := self.idle_regulators:
            named = ", ".join(map(str, idle))
            if len(idle) > 4 and idle[-1] - idle[0] == len(idle) - 1:
                named = f"{idle[0]} to {idle[-1]}"
            raise ValueError(
                f"{setting} is {self.regulator_count} and no design uses regulator {named}, "
                f"expected as many regulators as are used; {remedy}"
            )

    def of_options(self, numbers: Sequence[int] | np.ndarray) -> Design:
        """The design of an option's number for each location."""
        chosen = (options[at] for options, at in zip(self._options[0], numbers, strict=True))
        return Design.of(self.location_count, [each for each in chosen if each is not None])

    def stand_for_all(self, numbers: np.ndarray) -> np.ndarray:
        """Whether each design is its own `form`, (design,) bool, from an option's number for each
        location, (design, location)."""
        return least_of_their_classes(
            self._options[0], numbers, self._products, self.cavity_count, self.canonical
        )

    def form(self, design: Design) -> tuple[Design, tuple[int, ...]]:
        """The design that stands for a design and all that are counted as one with it.

        Args:
            design: One of the robot's.

        Returns:
            The least of them, and which of the design's regulators, from 1, each of its regulators
            is; those that it does not use fill up in rising order.
        """
        members = self.members(design)
        least = min(members)
        return least, members[least]

    def members(self, design: Design) -> dict[Design, tuple[int, ...]]:
        """All designs that are counted as one with a design, itself among them, under canonical
        names; with each which of the design's regulators, from 1, each of its own is."""
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
        return seen

    def _renamed(self, design: Design, order: tuple[int, ...]) -> tuple[Design, tuple[int, ...]]:
        """A design whose regulators are those of `order`, and it under canonical names."""
        if not self.canonical:
            return design, order
        used = design.regulator_order()
        unused = [name for name in range(1, self.regulator_count + 1) if name not in used]
        return design.canonical(), tuple(order[name - 1] for name in (*used, *unused))

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


def _names_follow(option: Fitting, highest: int) -> bool:
    """Whether each new name is one above the highest in use, as in canonical form."""
    for regulator in option.regulators:
        if regulator > highest + 1:
            return False
        highest = max(highest, regulator)
    return True
