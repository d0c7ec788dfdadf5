"""A design: which candidate locations of the hub carry a leg, and which regulator inflates each.

Its text has an entry for each location, joined by dots: ``0`` for no leg, else the number of a
regulator, as in ``1.0.0.2.2.0.0.1``. Where a robot has several kinds of modules, a letter says
which: ``b2`` is the second kind that the location allows, on regulator 2, no letter the first.
Cavities of one module that have regulators of their own are joined by a plus sign: ``b2+3``.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

MINIMUM_LEGS = 3
"""Fewest legs of a crawling design (paper, section III-B)."""

_ENTRY = re.compile(r"([a-z]?)([0-9]+(?:\+[0-9]+)*)", re.ASCII)


def module_letter(kind: int) -> str:
    """The letter of a kind of modules: ``a`` for number 0, ``b`` for 1."""
    return chr(ord("a") + kind)


class Fitting(NamedTuple):
    """What a design has at one location."""

    location: int
    module: int
    """Number of its kind among those that the location allows, from 0."""
    regulators: tuple[int, ...]
    """Numbers, from 1: one for all of its cavities, or one for each."""

    def __str__(self) -> str:
        return self.letter + "+".join(map(str, self.regulators))

    @property
    def letter(self) -> str:
        """Of its kind; empty for the first."""
        return module_letter(self.module) if self.module else ""


@dataclass(frozen=True, order=True)
class Design:
    """Legs of one robot, told by the regulator of each location.

    Designs are identified by this content, are hashable, and sort lexicographically.

    Attributes:
        assignment: Per location around the hub, 0 for no leg, else the number (from 1) of the
            regulator its first cavity is connected to. Of a radial robot, leg ``k`` of ``n`` sits
            at ``360 (k + 1/2) / n`` degrees from the forward axis, counter-clockwise from above.
        modules: Per location the number of its kind of module, from 0; empty where all are of the
            first kind.
        others: Per location the regulators of its second and further cavities; empty where each
            module has one regulator for all of its cavities.
    """

    assignment: tuple[int, ...]
    modules: tuple[int, ...] = ()
    others: tuple[tuple[int, ...], ...] = ()

    def __post_init__(self) -> None:
        assignment = tuple(self.assignment)
        if not assignment:
            raise ValueError(
                "assignment has no locations, expected one number per location of the hub"
            )
        for location, regulator in enumerate(assignment):
            if isinstance(regulator, bool) or not isinstance(regulator, int | np.integer):
                raise ValueError(
                    f"assignment[{location}] is {regulator!r}, expected a whole number: 0 for no "
                    "leg, else the number of a regulator"
                )
            if regulator < 0:
                raise ValueError(
                    f"assignment[{location}] is {regulator}, expected 0 for no leg or the number "
                    "of a regulator, counted from 1"
                )
        object.__setattr__(self, "assignment", tuple(int(regulator) for regulator in assignment))
        for name in ("modules", "others"):
            if len(getattr(self, name)) not in (0, len(assignment)):
                raise ValueError(
                    f"{name} has {len(getattr(self, name))} entries, expected none, or one for "
                    f"each of the {len(assignment)} locations"
                )
        kinds, others = tuple(map(int, self.modules)), tuple(map(tuple, self.others))
        for location, regulator in enumerate(self.assignment):
            kind = kinds[location] if kinds else 0
            if not 0 <= kind < 26 or (regulator == 0 and kind != 0):
                raise ValueError(
                    f"modules[{location}] is {kind}, expected 0 to 25, and 0 where there is no leg"
                )
            if others and any(each < 1 for each in (*others[location], regulator or 1)):
                raise ValueError(
                    f"others[{location}] is {others[location]}, expected numbers of regulators, "
                    "counted from 1"
                )
            if others and others[location] and regulator == 0:
                raise ValueError(
                    f"others[{location}] is {others[location]}, expected () where there is no leg"
                )
        # One way to say the same: designs are compared by their content.
        object.__setattr__(self, "modules", kinds if any(kinds) else ())
        object.__setattr__(self, "others", others if any(others) else ())

    @classmethod
    def of(cls, location_count: int, fittings: Iterable[Fitting]) -> Design:
        """The design of these legs; other locations have none.

        Raises:
            ValueError: A location is taken twice or does not exist.
        """
        entries: dict[int, Fitting] = {}
        for each in fittings:
            if each.location in entries or not 0 <= each.location < location_count:
                raise ValueError(
                    f"location {each.location} is given twice or is not one of 0 to "
                    f"{location_count - 1}"
                )
            entries[each.location] = each
        found = [entries.get(location) for location in range(location_count)]
        return cls(
            tuple(0 if each is None else each.regulators[0] for each in found),
            tuple(0 if each is None else each.module for each in found),
            tuple(() if each is None else each.regulators[1:] for each in found),
        )

    @classmethod
    def parse(cls, text: str | Design) -> Design:
        """Read a design such as ``1.0.0.2.2.0.0.1`` or ``1.0.b2+3``, as `str` writes it; one that
        is a design already stays as it is.

        Raises:
            TypeError: It is neither.
            ValueError: The text is not whole numbers joined by dots.
        """
        if isinstance(text, Design):
            return text
        if not isinstance(text, str):
            raise TypeError(f"design is {text!r:.60}, expected text such as 1.0.0.2.2.0.0.1")
        fields = text.strip().split(".")
        matches = [_ENTRY.fullmatch(field) for field in fields]
        if not all(matches):
            raise ValueError(
                f"design {text!r} is not whole numbers joined by dots, expected one per location "
                "such as 1.0.0.2.2.0.0.1 (0 = no leg, else the regulator; b2 for the second kind "
                "of module, 2+3 for two cavities)"
            )
        kinds, numbers = zip(*(match.groups() for match in matches if match), strict=True)
        regulators = [tuple(int(number) for number in each.split("+")) for each in numbers]
        return cls(
            tuple(first for first, *_ in regulators),
            tuple(ord(kind or "a") - ord("a") for kind in kinds),
            tuple(each[1:] for each in regulators),
        )

    def __str__(self) -> str:
        text = ["0"] * self.location_count
        for each in self.fittings:
            text[each.location] = str(each)
        return ".".join(text)

    @property
    def fittings(self) -> tuple[Fitting, ...]:
        """Each leg with its kind and all of its regulators, in order of location."""
        return tuple(
            Fitting(
                location,
                self.modules[location] if self.modules else 0,
                (regulator, *(self.others[location] if self.others else ())),
            )
            for location, regulator in enumerate(self.assignment)
            if regulator > 0
        )

    @property
    def highest_regulator(self) -> int:
        """Highest number of a regulator, 0 without legs."""
        return max((max(each.regulators) for each in self.fittings), default=0)

    @property
    def location_count(self) -> int:
        """Number of candidate locations around the hub."""
        return len(self.assignment)

    @property
    def leg_count(self) -> int:
        """Number of legs."""
        return sum(regulator > 0 for regulator in self.assignment)

    @property
    def legs(self) -> tuple[tuple[int, int], ...]:
        """(location, regulator) of each leg, in order of location; regulators count from 1."""
        return tuple(
            (location, regulator)
            for location, regulator in enumerate(self.assignment)
            if regulator > 0
        )

    def angle_rad(self, location: int) -> float:
        """Direction of a location, counter-clockwise from the forward (x) axis [rad]."""
        return 2.0 * math.pi * (location + 0.5) / self.location_count

    def regulator_order(self) -> tuple[int, ...]:
        """Regulators in order of first appearance: entry ``i`` becomes regulator ``i + 1``."""
        return tuple(dict.fromkeys(r for each in self.fittings for r in each.regulators))

    def canonical(self) -> Design:
        """The same robot with its regulators renumbered in order of first appearance.

        Designs that differ only by the names of their regulators have the same canonical form.
        """
        number = {old: new for new, old in enumerate(self.regulator_order(), start=1)}
        return Design.of(
            self.location_count,
            [
                each._replace(regulators=tuple(number[old] for old in each.regulators))
                for each in self.fittings
            ],
        )

    def mirror(self) -> Design:
        """The mirror image of a radial robot about the forward axis, regulators' names kept.

        Leg ``k`` of ``n`` goes to location ``n - 1 - k``, its cavities in reverse order, left for
        right. The result need not be canonical: driven by the same pressures it walks the mirrored
        path.
        """
        return self.moved(tuple(reversed(range(self.location_count))), reflected=True)

    def moved(self, to: Sequence[int], reflected: bool = False) -> Design:
        """The design with the legs of each location at another one.

        Args:
            to: Where each location's leg goes, (location,): a permutation.
            reflected: Whether cavities change order as well, as in a mirror.
        """
        return Design.of(
            self.location_count,
            [
                each._replace(
                    location=to[each.location],
                    regulators=each.regulators[::-1] if reflected else each.regulators,
                )
                for each in self.fittings
            ],
        )

    def one_hot(
        self, regulator_count: int, module_count: int = 1, cavity_count: int = 1
    ) -> np.ndarray:
        """One one-hot vector per location, concatenated (paper, appendix A).

        Args:
            regulator_count: Number of regulators ``M``.
            module_count: Kinds of modules ``K``.
            cavity_count: Most cavities of a module with regulators of their own ``C``, in all
                designs that are told alike.

        Returns:
            shape (location x (1 + K M + (C - 1) M),) float32; the first entry of each block says
            "no leg", the next the kind and its first cavity's regulator, the last the other
            cavities' regulators.

        Raises:
            ValueError: A leg's regulator is above ``regulator_count``, its kind is not one of
                ``module_count``, or it is on more regulators than ``cavity_count``.
        """
        self.check_regulators(regulator_count)
        first = 1 + module_count * regulator_count
        block = np.zeros(
            (self.location_count, first + (cavity_count - 1) * regulator_count), np.float32
        )
        block[:, 0] = 1.0
        for location, module, regulators in self.fittings:
            if module >= module_count:
                letter, last = module_letter(module), module_letter(module_count - 1)
                kinds = "a, the only kind" if module_count == 1 else f"a to {last}"
                raise ValueError(
                    f"design {self} has a leg of kind {letter} at location {location}, expected "
                    f"{kinds}"
                )
            if len(regulators) > cavity_count:
                raise ValueError(
                    f"design {self} has a leg on {len(regulators)} regulators at location "
                    f"{location}, expected at most {cavity_count}: its numbers have room for "
                    f"cavity_count = {cavity_count} a leg, which in an environment is the most "
                    "that a leg of its first designs has: make it with one that has a leg on "
                    f"{len(regulators)}"
                )
            block[location, 0] = 0.0
            block[location, module * regulator_count + regulators[0]] = 1.0
            for number, regulator in enumerate(regulators[1:]):
                block[location, first + number * regulator_count + regulator - 1] = 1.0
        return block.reshape(-1)

    def check_regulators(self, regulator_count: int) -> None:
        """Raise `ValueError` where a leg is on a regulator that does not exist."""
        for location, _, regulators in self.fittings:
            if max(regulators) > regulator_count:
                raise ValueError(
                    f"design {self} connects location {location} to regulator {max(regulators)}, "
                    f"expected 1 to {regulator_count}, as many regulators as there are"
                )
