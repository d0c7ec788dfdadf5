"""Designs of several kinds of modules and cavities, and spaces with rules and symmetries."""

from __future__ import annotations

import re
from dataclasses import replace
from itertools import product
from typing import Any

import numpy as np
import pytest

from pneumorph.learn.settings import CooptSettings
from pneumorph.robot.design import Design, Fitting
from pneumorph.robot.design_space import DesignSpace


@pytest.mark.parametrize("text", ["1.0.2", "b1.0.2", "c2+1.0.1", "0.b3+3+1.0", "1.0.0.2.2.0.0.1"])
def test_text_is_read_back(text: str) -> None:
    design = Design.parse(text)
    assert str(design) == text
    assert Design.of(design.location_count, design.fittings) == design


def test_entries_say_kind_and_regulators() -> None:
    design = Design.parse("b2+3.0.1")
    assert design.fittings == (Fitting(0, 1, (2, 3)), Fitting(2, 0, (1,)))
    assert design.legs == ((0, 2), (2, 1))
    assert design.highest_regulator == 3
    assert str(design.canonical()) == "b1+2.0.3"
    # Left for right: sites, and cavities that lie side by side.
    assert str(design.mirror()) == "1.0.b3+2"
    # A first kind on one regulator is a design as it always was.
    assert Design.parse("a1.0.2") == Design((1, 0, 2)) == Design((1, 0, 2), (0, 0, 0), ((), (), ()))


def test_one_hot_tells_kinds_and_cavities_apart() -> None:
    row = Design.parse("b2+1.0").one_hot(2, module_count=2, cavity_count=2).reshape(2, 7)
    np.testing.assert_array_equal(row, [[0, 0, 0, 0, 1, 1, 0], [1, 0, 0, 0, 0, 0, 0]])
    with pytest.raises(ValueError, match="kind b at location 0, expected a, the only kind"):
        Design.parse("b2+1.0").one_hot(2)
    with pytest.raises(ValueError, match="kind c at location 1, expected a to b"):
        Design.parse("1.c1").one_hot(2, module_count=2)
    with pytest.raises(ValueError, match="on 2 regulators at location 0, expected at most 1"):
        Design.parse("b2+1.0").one_hot(2, module_count=2)


@pytest.mark.parametrize("text", ["1.b0.2", "1..2", "B1.0", "1+.0", "1.0+1", "+1.0"])
def test_what_is_no_design_is_refused(text: str) -> None:
    with pytest.raises(ValueError, match=r"design|modules|others"):
        Design.parse(text)


def brute_force(
    space: DesignSpace, entries: list[list[str]], images: list[tuple[tuple[int, ...], bool]]
) -> set[frozenset[Design]]:
    """Classes of designs under names of regulators and symmetries, by trying everything."""
    every = {Design.parse(".".join(chosen)) for chosen in product(*entries)}
    legal = {
        each
        for each in every
        if space.minimum_legs <= each.leg_count <= space.maximum_legs
        and len(each.regulator_order()) >= space.minimum_regulators
    }
    classes = {each: {other for other in legal if other.canonical() == each.canonical()}
               for each in legal}  # fmt: skip
    for _ in range(4):
        for each, own in classes.items():
            for to, reflected in images:
                own |= {
                    member
                    for other in set(own)
                    for member in classes.get(other.moved(to, reflected), set())
                }
            classes[each] = own
    return {frozenset(own) for own in classes.values()}


def test_a_space_has_one_design_of_each_class() -> None:
    """Against every assignment of 4 sites tried one by one, with a mirror and a half turn."""
    space = DesignSpace(
        location_count=4,
        regulator_count=2,
        minimum_legs=2,
        maximum_legs=3,
        minimum_regulators=2,
        options=("0 * b*",) * 4,
        symmetries=("mirror", "2 3 0 1"),
    )
    entries = [["0", "1", "2", "b1", "b2"]] * 4
    classes = brute_force(space, entries, [((3, 2, 1, 0), True), ((2, 3, 0, 1), False)])
    assert len(space) == len(classes)
    for each in classes:
        assert len({space.index(design) for design in each}) == 1
        (place,) = {space.index(design) for design in each}
        assert space[place] in each
        assert space[place] == min(each & {d.canonical() for d in each})


@pytest.mark.parametrize(
    "rules",
    [
        {"symmetries": ("mirror", "2 3 0 1")},
        {"symmetries": ("1 2 3 0",), "mirror": "1 0 3 2", "canonical": False},
        {"symmetries": ("mirror",), "canonical": False},
        {"symmetries": ("3 2 1 0",)},
    ],
)
def test_all_at_once_stand_for_their_classes_as_one_by_one(rules: dict[str, Any]) -> None:
    """Legs of one, two and three cavities, two of them of one kind."""
    options = ("0 * b*+* c*+*+*",) * 4
    space = DesignSpace(4, 2, 0, 4, options=options, **rules)
    every = np.array(list(space.paths))
    drawn = np.random.default_rng(3).choice(len(every), 300, replace=False)
    designs = [space.of_options(numbers) for numbers in every[drawn]]
    one_by_one = [space.form(design)[0] == design for design in designs]
    assert 30 < sum(one_by_one) < 270
    np.testing.assert_array_equal(space.stand_for_all(every[drawn]), one_by_one)


def test_options_and_exclusions_hold_for_every_design() -> None:
    space = DesignSpace(
        location_count=3,
        regulator_count=2,
        minimum_legs=1,
        maximum_legs=3,
        options=("0 *", "1", "0 b*+*"),
        canonical=False,
        exclusions=("0 2",),
        mirror="none",
    )
    assert [str(each) for each in space] == [
        "0.1.0", "0.1.b1+1", "0.1.b1+2", "0.1.b2+1", "0.1.b2+2", "1.1.0", "2.1.0",
    ]  # fmt: skip
    assert (space.module_count, space.cavity_count) == (2, 2)
    assert space.one_hot.shape == (7, 3 * (1 + 2 * 2 + 2))
    np.testing.assert_array_equal(space.mirror_index, np.arange(7))
    with pytest.raises(ValueError, match="has 2 at location 1, expected one of the options '1'"):
        space.index(Design.parse("0.2.0"))
    with pytest.raises(ValueError, match="rules on options, regulators or exclusions"):
        space.index(Design.parse("1.1.b1+1"))
    assert space.broken_exclusion(Design.parse("1.1.b1+1")) == (0, 2)
    assert all(space.broken_exclusion(each) is None for each in space)


def test_the_mirror_moves_legs_and_regulators_where_it_says() -> None:
    """Four sites in two rows: left and right of each row are each other's image."""
    space = DesignSpace(
        location_count=4, regulator_count=3, minimum_legs=2, maximum_legs=4,
        options=("0 * b*",) * 4, mirror="1 0 3 2",
    )  # fmt: skip
    for place, design in enumerate(space):
        image = space[int(space.mirror_index[place])]
        source = space.mirror_regulator[place] + 1
        entries = {each.location: each for each in design.fittings}
        assert len(entries) == image.leg_count
        for location, module, regulators in image.fittings:
            own = entries[location ^ 1]
            assert (own.module, own.regulators[0]) == (module, source[regulators[0] - 1])


@pytest.mark.parametrize(
    ("settings", "why"),
    [
        ({"options": ("0 *",)}, "options has 1 entries, expected one for each of the 3"),
        ({"options": ("0 *", "x", "0 *")}, r"options\[1\] has 'x'"),
        ({"options": ("0 *", "0 4", "0 *"), "canonical": False}, "names regulator 4"),
        ({"options": ("0 *", "0 1", "0 *")}, "canonical = false"),
        ({"options": ("0 * *", "0 *", "0 *")}, "different entries, and it says 1 twice"),
        ({"options": ("0 b* b*+*", "0 *", "0 *")}, "entries, and it says b1 twice"),
        ({"options": ("0 * *+*", "0 *", "0 *")}, r"'0 \* \*\+\*', expected one or more different"),
        ({"mirror": "0 0 1"}, "each of the 3 locations once"),
        ({"symmetries": ("0 1 3",)}, "numbers of locations from 0 to 2"),
        ({"mirror": "none", "symmetries": ("mirror",)}, 'mirror is "none"'),
        ({"exclusions": ("0 7",)}, "exclusions has '0 7'"),
    ],
)
def test_a_rule_that_is_none_is_refused(settings: dict[str, object], why: str) -> None:
    with pytest.raises(ValueError, match=why):
        DesignSpace(
            location_count=3, regulator_count=2, minimum_legs=1, maximum_legs=3,
            **settings,  # type: ignore[arg-type]
        )  # fmt: skip


@pytest.mark.parametrize(
    ("settings", "rules"),
    [
        # A leg at most is left: none or one of 3, on one canonical regulator; without exclusions
        # two or three legs on at most two regulators, 3 * 2 + 4.
        (
            {"minimum_legs": 2, "exclusions": ("0 1 2",)},
            "minimum_legs = 2 (4 designs without it) or exclusions[0] = '0 1 2' (10 designs",
        ),
        ({"minimum_legs": 2, "exclusions": ("0 1", "1 2", "0 2")}, "exclusions = ["),
        (
            {"maximum_legs": 1, "minimum_legs": 1, "minimum_regulators": 2},
            "maximum_legs = 1 (6 designs without it) or minimum_regulators = 2 (3 designs",
        ),
        # Without the first location's leg, or with 0 and any leg everywhere.
        (
            {"options": ("*", "*", "0 *"), "minimum_legs": 1, "maximum_legs": 1},
            "maximum_legs = 1 (6 designs without it) or options[0] = '*' (1 design without it) "
            "or options[1] = '*' (1 design without it) or options = ",
        ),
        (
            {"minimum_legs": 2, "minimum_regulators": 2, "exclusions": ("0 1 2", "0 2 1")},
            "exclusions = [",
        ),
        (
            {"options": ("*", "*", "0 *"), "minimum_legs": 1, "maximum_legs": 1,
             "minimum_regulators": 2, "exclusions": ("0 1 2",)},
            "it takes more than one of them to leave none",
        ),
    ],
)  # fmt: skip
def test_an_empty_space_names_the_rules_that_empty_it(settings: dict[str, Any], rules: str) -> None:
    space = DesignSpace(
        **{"location_count": 3, "regulator_count": 2, "maximum_legs": 3, **settings}
    )  # type: ignore[arg-type]
    with pytest.raises(ValueError, match=f"design space is empty.*{re.escape(rules)}"):
        _ = space.designs


def test_a_space_beyond_the_limit_is_not_listed() -> None:
    with pytest.raises(ValueError, match="more than 100000 designs"):
        _ = DesignSpace(location_count=12, regulator_count=4, maximum_legs=12).designs


def test_nothing_is_learned_from_an_image_that_there_is_not() -> None:
    with pytest.raises(ValueError, match=r"mirror_transitions is true and space\.mirror"):
        CooptSettings(mirror_transitions=True, space=DesignSpace(mirror="none"))
    unlike = DesignSpace(location_count=2, minimum_legs=1, maximum_legs=2, options=("0 *", "0 b*"))
    with pytest.raises(ValueError, match="is not one of the space"):
        _ = unlike.mirror_index
    with pytest.raises(ValueError, match=r"options\[0\] and options\[1\] are not each other's"):
        unlike.check_images()
    many = DesignSpace(location_count=12, regulator_count=4, maximum_legs=8)
    many.check_images()
    with pytest.raises(ValueError, match=r"0 and 1, of which .* to 10 and 11, of which"):
        replace(many, exclusions=("0 1",)).check_images()
    replace(many, exclusions=("0 1", "10 11")).check_images()


@pytest.mark.parametrize(
    ("options", "exclusions", "symmetry", "closed"),
    [
        (("0 *+*", "0 *+*", "0 b*", "0 b*"), (), "1 0 3 2", True),
        (("0 *+*", "0 *+*", "0 b*", "0 *"), (), "1 0 3 2", False),
        (("*+*", "0 *+*", "0 b*", "0 b*"), (), "1 0 3 2", False),
        (("0 *",) * 4, ("0 2",), "1 2 3 0", False),
        (("0 *",) * 4, ("0 2", "1 3"), "1 2 3 0", True),
        (("0 * b*",) * 4, ("0 1", "2 3"), "mirror", True),
        (("0 * b*",) * 4, ("0 1 2",), "mirror", False),
    ],
)
def test_symmetries_keep_one_of_each_class_or_are_refused(
    options: tuple[str, ...], exclusions: tuple[str, ...], symmetry: str, closed: bool
) -> None:
    """Every design that the rules allow has its class in the space, by brute force over all."""
    rules = {
        "location_count": 4, "regulator_count": 2, "minimum_legs": 2, "maximum_legs": 3,
        "options": options, "exclusions": exclusions,
    }  # fmt: skip
    every = DesignSpace(**rules)  # type: ignore[arg-type]
    if not closed:
        with pytest.raises(ValueError, match=r"symmetry .* each other's images.* or no such"):
            DesignSpace(**rules, symmetries=(symmetry,))  # type: ignore[arg-type]
        return
    fewer = DesignSpace(**rules, symmetries=(symmetry,))  # type: ignore[arg-type]
    classes = {frozenset(fewer.members(design)) for design in every}
    assert len(fewer) == len(classes) < len(every)
    for members in classes:
        assert len(members & set(fewer)) == 1
        assert members <= set(every)


@pytest.mark.parametrize("text", ["2", "2 2"])
def test_an_exclusion_of_a_single_location_is_refused(text: str) -> None:
    with pytest.raises(ValueError, match=f"exclusions has '{text}', expected two different"):
        DesignSpace(exclusions=(text,))


def test_a_regulator_that_nothing_uses_is_refused() -> None:
    with pytest.raises(ValueError, match="regulator 3 of 3 drives nothing"):
        DesignSpace(
            location_count=2, regulator_count=3, minimum_legs=1, maximum_legs=2, canonical=False,
            options=("0 1", "0 2"), mirror="none",
        )  # fmt: skip


def test_more_regulators_than_cavities_are_told_at_once() -> None:
    """Without building what 99 of them may drive."""
    space = DesignSpace(
        location_count=6, regulator_count=99, minimum_legs=3, maximum_legs=4, mirror="none",
        options=("0 * b*+*",) * 6,
    )  # fmt: skip
    assert space.idle_regulators == tuple(range(9, 100))
    with pytest.raises(ValueError, match="M is 99 and no design uses regulator 9 to 99, expected"):
        space.refuse_idle_regulators("M", "so there")
