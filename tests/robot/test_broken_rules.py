"""What forbids a design is named."""

from __future__ import annotations

import pytest

from pneumorph.robot.broken_rules import broken_rules
from pneumorph.robot.design import Design
from pneumorph.robot.design_space import DesignSpace


@pytest.mark.parametrize(
    ("rules", "design", "why"),
    [
        ({"maximum_legs": 3}, "1.1.1.1", "it breaks maximum_legs = 3"),
        ({"maximum_regulators": 1}, "1.2.0.1", "it breaks maximum_regulators = 1"),
        ({"exclusions": ("0 1",)}, "1.1.0.1", "it breaks exclusions[0] = '0 1'"),
        ({"minimum_legs": 3}, "0.1.0.0", "it breaks minimum_legs = 3"),
        (
            {"maximum_legs": 3, "exclusions": ("0 1",)},
            "1.1.1.1",
            "it breaks more than one of its rules",
        ),
        ({"options": ("0 *", "*", "*", "0 *")}, "0.0.1.1", "it breaks options[1] = '*' or options"),
    ],
)
def test_the_rule_that_forbids_a_design_is_named(rules: dict, design: str, why: str) -> None:
    space = DesignSpace(
        location_count=4, regulator_count=2, **{"minimum_legs": 1, "maximum_legs": 4, **rules}
    )
    assert not space.holds(Design.parse(design))
    assert broken_rules(space, Design.parse(design)).startswith(why)
