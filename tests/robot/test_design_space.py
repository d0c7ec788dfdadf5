"""The design space has the paper's size, a defined order, and refuses what is not in it."""

from dataclasses import replace
from itertools import product

import numpy as np
import pytest

from pneumorph.robot.design import Design
from pneumorph.robot.design_space import DesignSpace


def test_paper_space_has_6972_canonical_and_41202_raw_designs() -> None:
    canonical, raw = DesignSpace(), DesignSpace(canonical=False)
    assert canonical.size == len(canonical.designs) == 6972
    assert raw.size == len(raw.designs) == 41202
    assert {design.canonical() for design in raw} == set(canonical.designs)


@pytest.mark.parametrize(
    ("locations", "regulators", "minimum", "maximum"),
    [(4, 2, 1, 4), (5, 3, 2, 4), (3, 1, 0, 3), (4, 5, 3, 4)],
)
def test_enumeration_equals_brute_force(
    locations: int, regulators: int, minimum: int, maximum: int
) -> None:
    everything = [
        Design(assignment)
        for assignment in product(range(regulators + 1), repeat=locations)
        if minimum <= np.count_nonzero(assignment) <= maximum
    ]
    raw = DesignSpace(locations, regulators, minimum, maximum, canonical=False)
    assert list(raw) == everything
    space = DesignSpace(locations, regulators, minimum, maximum)
    assert list(space) == [design for design in everything if design == design.canonical()]
    assert space.size == len(space.designs)


def test_order_is_lexicographic_and_index_is_its_inverse() -> None:
    space = DesignSpace()
    assert list(space) == sorted(space)
    for index in (0, 1, 3500, 6971):
        assert space.index(space[index]) == index
    assert str(space[0]) == "0.0.0.0.0.1.1.1"


def test_index_accepts_any_numbering_of_the_regulators() -> None:
    space = DesignSpace()
    assert space.index(Design.parse("3.0.0.1.1.0.0.3")) == space.index(
        Design.parse("1.0.0.2.2.0.0.1")
    )
    assert str(space.parse("3.0.0.1.1.0.0.3")) == "1.0.0.2.2.0.0.1"


def test_one_hot_rows_are_the_designs_own() -> None:
    space = DesignSpace(4, 2, 1, 3)
    for row, design in zip(space.one_hot, space, strict=True):
        np.testing.assert_array_equal(row, design.one_hot(2))


def test_mirror_tables_say_which_regulator_drives_which() -> None:
    space = DesignSpace()
    np.testing.assert_array_equal(space.mirror_index[space.mirror_index], np.arange(len(space)))
    for index in range(0, len(space), 97):
        source = space.mirror_regulator[index]
        assert sorted(source) == [0, 1, 2]
        mirrored = space[index].mirror()
        image = space[space.mirror_index[index]]
        for location, regulator in image.legs:
            assert mirrored.assignment[location] == source[regulator - 1] + 1


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("1.0.0.2.0.0.0.0", "too few legs: 2, expected at least 3"),
        ("1.1.1.1.1.1.1.0", "too many legs: 7, expected at most 6"),
        ("1.0.4.2.0.0.0.0", "location 2 to regulator 4, expected 1 to 3"),
        ("1.0.2.2", "has 4 locations, expected 8"),
    ],
)
def test_designs_outside_the_space_are_refused(text: str, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        DesignSpace().parse(text)


def test_impossible_spaces_are_refused() -> None:
    with pytest.raises(ValueError, match="minimum_legs <= maximum_legs"):
        DesignSpace(minimum_legs=5, maximum_legs=4)
    with pytest.raises(ValueError, match="regulator_count must be at least 1, got 0"):
        DesignSpace(regulator_count=0)


def test_equal_spaces_are_listed_once() -> None:
    """A robot's file is read some ten times for one training, each time with a space of its own."""
    turned = DesignSpace(location_count=4, maximum_legs=4, symmetries=("1 2 3 0",))
    first, second = (replace(turned) for _ in range(2))
    assert first is not second
    assert first.designs is second.designs
    assert len(replace(turned, symmetries=()).designs) > len(first.designs)
