"""Letters of designs are told as the modules that they stand for."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from pneumorph.catalogue.module_letters import module_letters
from pneumorph.catalogue.robot_description import RobotDescription

EXAMPLES = Path(__file__).parents[2] / "examples"


@pytest.mark.parametrize(
    ("allowed", "words"),
    [
        ([("leg",), ("leg",)], ""),
        ([("long", "short")] * 3, "no letter: long, b: short"),
        (
            [("long", "short"), ("foot",), ("long", "short")],
            "no letter: long, b: short at sites 0, 2; no letter: foot at site 1",
        ),
    ],
)
def test_letters_in_words(allowed: list[tuple[str, ...]], words: str) -> None:
    assert module_letters(allowed) == words


def test_letters_of_a_description_are_those_that_its_designs_are_read_with() -> None:
    robot = RobotDescription.read(EXAMPLES / "plate.toml")
    assert robot.letters == (
        "no letter: long, b: short at sites 0, 2, 3, 5; no letter: long at sites 1, 4"
    )
    mounts = robot.spec().assembly("b1.1.2.0.0.0").mounts
    short, *long = (np.ptp(mount.part.rest_nodes[:, 0]) for mount in mounts)
    np.testing.assert_allclose(long, short / robot.modules["short"].size_factor, rtol=1e-12)
