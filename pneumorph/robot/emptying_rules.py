"""Which rules leave no design, for the error that says that a space is empty."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any, TypeVar

from pneumorph.robot.design_choices import DesignChoices

Choices = TypeVar("Choices", bound=DesignChoices)

MOST_NAMED = 6
"""Rules that an error names."""


def emptying_rules(choices: DesignChoices) -> str:
    """Rules of an empty space without any one of which there would be designs, such as
    ``minimum_legs = 4 (12 designs without it)``, in words.

    Designs are counted before symmetries make one of several.

    Args:
        choices: The rules, which no design keeps to.
    """
    single = []
    for rule, without in relaxed_rules(choices):
        count = without.paths.count
        if count:
            single.append(f"{rule} ({count} design{'s' if count > 1 else ''} without it)")
    if not single:
        return "it takes more than one of them to leave none"
    others = f" or {len(single) - MOST_NAMED} more" if len(single) > MOST_NAMED else ""
    return f"what leaves none is {' or '.join(single[:MOST_NAMED])}{others}"


def relaxed_rules(choices: Choices) -> Iterator[tuple[str, Choices]]:
    """Each rule that forbids something, in words, and the choices without it."""
    # Designs that a symmetry turns into each other are there or not together.
    alone = replace(choices, symmetries=(), mirror="none")
    for name, value, changes in _relaxed(alone):
        yield f"{name} = {value!r:.60}", replace(alone, **changes)


def _relaxed(choices: DesignChoices) -> Iterator[tuple[str, Any, dict[str, Any]]]:
    """Each rule that forbids something, what it is, and the settings that are without it."""
    if choices.minimum_legs > 0:
        yield "minimum_legs", choices.minimum_legs, {"minimum_legs": 0}
    if choices.maximum_legs < choices.location_count:
        yield "maximum_legs", choices.maximum_legs, {"maximum_legs": choices.location_count}
    if choices.minimum_regulators > 0:
        yield "minimum_regulators", choices.minimum_regulators, {"minimum_regulators": 0}
    if choices.maximum_regulators is not None:
        yield "maximum_regulators", choices.maximum_regulators, {"maximum_regulators": None}
    for place, each in enumerate(choices.exclusions):
        others = tuple(rule for other, rule in enumerate(choices.exclusions) if other != place)
        yield f"exclusions[{place}]", each, {"exclusions": others}
    if len(choices.exclusions) > 1:
        yield "exclusions", list(choices.exclusions), {"exclusions": ()}
    for place, each in enumerate(choices.options):
        if "0" not in each.split():
            options = (*choices.options[:place], f"0 {each}", *choices.options[place + 1 :])
            yield f"options[{place}]", each, {"options": options}
    if choices.options:
        yield "options", list(choices.options), {"options": ()}
