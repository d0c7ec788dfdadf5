"""Which rules of a space forbid a design, for errors and notes that say so."""

from __future__ import annotations

from dataclasses import replace

from pneumorph.robot.design import Design
from pneumorph.robot.design_space import DesignSpace
from pneumorph.robot.emptying_rules import MOST_NAMED, relaxed_rules


def broken_rules(space: DesignSpace, design: Design) -> str:
    """Rules without any one of which a space would hold a design that it does not, such as
    ``it breaks maximum_legs = 4``, in words.

    Args:
        space: The space.
        design: One that it does not hold.
    """
    # Designs that a symmetry turns into each other are there or not together.
    alone = replace(space, symmetries=(), mirror="none")
    single = [
        f"{name} = {value!r:.60}"
        for name, value, changes in relaxed_rules(alone)
        if replace(alone, **changes).holds(design)
    ]
    return f"it breaks {' or '.join(single[:MOST_NAMED]) or 'more than one of its rules'}"
