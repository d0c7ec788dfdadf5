"""Which design stands for a space: its own image, with most legs, driven by both waves."""

from __future__ import annotations

import pytest

from pneumorph.robot.design import Design
from pneumorph.robot.design_space import DesignSpace
from pneumorph.robot.usual_design import usual_design

FIVE = "0 4 3 2 1"
"""One site ahead, two on either side."""


@pytest.mark.parametrize(
    ("space", "expected"),
    [
        (DesignSpace(), "0.1.1.2.2.1.1.0"),
        (DesignSpace(5, 3, 3, 5, mirror=FIVE), "1.1.2.2.1"),
        (DesignSpace(5, 3, 3, 4, mirror=FIVE), "0.1.2.2.1"),
        (DesignSpace(5, 2, 3, 5, exclusions=("0 1",), mirror=FIVE), "0.1.2.2.1"),
        # None is its own image: the sides are driven by regulators of their own.
        (DesignSpace(4, 2, 3, 4, False, ("1", "1", "2", "2")), "1.1.2.2"),
        (DesignSpace(4, 2, 3, 4, mirror="none"), "1.1.1.2"),
        # 24 640 000 of them, which are not listed.
        (DesignSpace(8, 4, 4, 6, options=("0 * b* c* d*",) * 8), "0.1.1.2.2.1.1.0"),
    ],
)
def test_most_legs_that_are_their_own_image(space: DesignSpace, expected: str) -> None:
    found = usual_design(space)
    assert found in space
    if not space.is_listed:
        assert space.is_own_image(found)
        assert found.leg_count == space.maximum_legs
        assert len(set(found.assignment) - {0}) == 2
    else:
        assert found == Design.parse(expected)
