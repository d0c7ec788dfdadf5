"""Which rules of a space forbid a design, for errors and notes that say so."""

from __future__ import annotations

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
    single = [rule for rule, without in relaxed_rules(space) if without.holds(design)]
    return f"it breaks {' or '.join(single[:MOST_NAMED]) or 'more than one of its rules'}"
