"""Files and runs whose gaits a training is shown."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from pneumorph.base.layers import layered
from pneumorph.gait.gait_file import read_gait, write_gait
from pneumorph.gait.held_gait import HeldGait
from pneumorph.study.shown_gaits import digests_of_shown, shown_gaits
from pneumorph.study.training_options import PRESETS

EXAMPLES = Path(__file__).parent.parent.parent / "examples"
BY_HAND = EXAMPLES / "gaits/turn_by_hand.csv"
OPTIONS = layered(
    PRESETS["quick"](), [{"robot": {"described": str(EXAMPLES / "two_chambers.toml")}}]
)
SETTINGS, SPEC = OPTIONS.coopt, OPTIONS.robot.spec()


def test_a_gait_of_a_file_is_shown_as_it_is() -> None:
    (pair,) = shown_gaits([BY_HAND], SETTINGS, SPEC)
    gait, comments = read_gait(BY_HAND)
    assert str(SETTINGS.space[pair.design]) == comments["design"]
    np.testing.assert_array_equal(pair.held_kPa, gait.held_kPa)
    assert pair.source == "demonstration"


def test_who_goes_on_must_have_been_shown_the_same(tmp_path: Path) -> None:
    (pair,) = shown_gaits([BY_HAND], SETTINGS, SPEC)
    told = digests_of_shown([pair], SETTINGS)
    rounded = replace(pair, held_kPa=pair.held_kPa * (1.0 + 1e-12))
    assert digests_of_shown([rounded], SETTINGS) == told
    other = replace(pair, held_kPa=pair.held_kPa + 0.1)
    assert digests_of_shown([other], SETTINGS) != told


def test_what_is_no_gait_of_these_robots_is_refused_by_its_file(tmp_path: Path) -> None:
    def written(name: str, design: str | None, held_kPa: list[float]) -> Path:
        gait = HeldGait(np.zeros(1), np.array([held_kPa]), 1.0, maximum_pressure_kPa=200.0)
        return write_gait(tmp_path / name, gait, {} if design is None else {"design": design})

    cases = {
        r"nameless.csv does not say whose it is, expected a line such as # design: 0\.": (
            written("nameless.csv", None, [10.0] * 4)
        ),
        r"legs.csv, which is to be shown: design 1\.0\.0\.2\.2\.0\.0\.1 has 1 at location 0": (
            written("legs.csv", "1.0.0.2.2.0.0.1", [10.0] * 4)
        ),
        r"five.csv commands 5 regulators, expected at most 4": (
            written("five.csv", "0.1+1.0.2+2.0.1+1.0.2+2", [10.0] * 5)
        ),
        r"high.csv, which is to be shown: .*130": (
            written("high.csv", "0.1+1.0.2+2.0.1+1.0.2+2", [130.0] * 4)
        ),
    }
    for message, path in cases.items():
        with pytest.raises(ValueError, match=message):
            shown_gaits([path], SETTINGS, SPEC)
    with pytest.raises(ValueError, match=r"policy\.npz is a policy, expected a gait's file"):
        shown_gaits([tmp_path / "policy.npz"], SETTINGS, SPEC)
    with pytest.raises(ValueError, match="25 gaits are shown, expected at most 24"):
        shown_gaits([BY_HAND] * 25, SETTINGS, SPEC)
    with pytest.raises(FileNotFoundError, match=r"missing\.csv"):
        shown_gaits([tmp_path / "missing.csv"], SETTINGS, SPEC)
