"""Gaits converted: above the usual limit, and with settings that have no effect."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pneumorph.base.run_folder import RunFolder
from pneumorph.exchange.conversion import ConversionSettings, convert
from pneumorph.exchange.sorotraj import read_sorotraj, write_sorotraj
from pneumorph.gait.expert_gait import ExpertGait
from pneumorph.gait.gait_file import gait_remarks, read_gait, write_gait
from pneumorph.gait.held_gait import HeldGait
from pneumorph.gait.interpolated_gait import InterpolatedGait
from pneumorph.physics.physics import Physics
from pneumorph.study.gait_source import find_gait

pytest.importorskip("yaml")

HIGH = HeldGait(
    np.array([0.0, 1.0]),
    np.array([[120.0, 0.0], [0.0, 116.5]]),
    2.0,
    maximum_pressure_kPa=120.0,
)


def converted(source: Path, folder: Path, **settings: Any) -> Path:
    """What a gait's file becomes."""
    told = convert(str(source), ConversionSettings(**settings), RunFolder(folder, "exchange"))
    assert told.gait is not None
    return Path(told.gait)


@pytest.mark.parametrize("kPa_per_unit", [1.0, 6.894757])
def test_a_gait_above_the_usual_limit_is_read_back(kPa_per_unit: float, tmp_path: Path) -> None:
    source = write_gait(tmp_path / "high.csv", HIGH, {"design": "1.0.0.2.2.0.0.1"})
    there = converted(source, tmp_path / "there", kPa_per_unit=kPa_per_unit)
    read = read_sorotraj(there)
    assert read.maximum_pressure_kPa == 120.0
    np.testing.assert_allclose(read.pressure_kPa(0.5), [120.0, 0.0], rtol=1e-12)
    walked = find_gait(there, None, ExpertGait())
    np.testing.assert_allclose(walked.gait.pressure_kPa(1.5), [0.0, 116.5], rtol=1e-12)
    held, remarks = read_gait(converted(there, tmp_path / "back", to="csv", hold_s=0.5))
    assert remarks == {"design": "1.0.0.2.2.0.0.1", "maximum_pressure_kPa": "120.0"}
    np.testing.assert_allclose(held.held_kPa[[0, 2]], HIGH.held_kPa, rtol=1e-12)


@pytest.mark.parametrize(
    "gait", [HIGH, InterpolatedGait(np.array([0.0, 1.0]), np.full((2, 1), 100.0), 110.0)]
)
def test_a_gait_that_is_written_says_its_limit(
    gait: HeldGait | InterpolatedGait, tmp_path: Path
) -> None:
    """Also where no remark of an earlier file does."""
    path = write_sorotraj(tmp_path / "gait.yaml", gait)
    assert read_sorotraj(path).maximum_pressure_kPa == gait.maximum_pressure_kPa
    usual = HeldGait.evenly(np.array([[40.0]]), 1.0)
    assert "maximum_pressure_kPa" not in gait_remarks(write_sorotraj(path, usual))
    without = replace(gait, maximum_pressure_kPa=np.inf)
    highest = without.pressure_kPa(0.5).max()
    assert read_sorotraj(write_sorotraj(path, without)).maximum_pressure_kPa == highest


@pytest.mark.parametrize(
    ("remark", "message"),
    [
        ("# maximum_pressure_kPa: 110", r"is 120\.0, expected a finite number from 0 to 110"),
        ("# maximum_pressure_kPa: high", "maximum_pressure_kPa is 'high', expected a positive"),
        ("# maximum_pressure_kPa: inf", "maximum_pressure_kPa is 'inf', expected a positive"),
        ("", r"is 120\.0, expected a finite number from 0 to 90"),
    ],
)
def test_pressures_above_what_a_file_says_are_refused(
    remark: str, message: str, tmp_path: Path
) -> None:
    path = write_sorotraj(tmp_path / "gait.yaml", HIGH)
    path.write_text(path.read_text().replace("# maximum_pressure_kPa: 120.0", remark))
    with pytest.raises(ValueError, match=message) as refused:
        read_sorotraj(path)
    assert str(path) in str(refused.value)


UNUSED: list[tuple[str, str, dict[str, Any], str]] = [
    ("g.csv", "csv", {"kPa_per_unit": 6.894757}, "--kPa-per-unit .* CSV file are in kPa"),
    ("g.csv", "csv", {"repetitions": 3}, "--repetitions .* with a sorotraj file"),
    ("g.csv", "sorotraj", {"repetitions": 3}, "--repetitions .* with a sorotraj file"),
    ("g.csv", "csv", {"hold_s": 0.5}, "--hold-s .* a CSV file says itself how long"),
    ("g.csv", "sorotraj", {"hold_s": 0.5}, "--hold-s .* converted to sorotraj"),
    ("g.yaml", "sorotraj", {"hold_s": 0.5}, "--hold-s .* converted to sorotraj"),
    ("g.csv", "csv", {"mesh": Path("leg.npz")}, "--mesh .* with --to sofa or --to part"),
    ("g.yaml", "csv", {"physics": Physics(friction=0.3)}, "--physics.friction .* --to sofa"),
    ("shipped", "sofa", {"repetitions": 2}, "--repetitions .* with a sorotraj file"),
    ("shipped", "sofa", {"kPa_per_unit": 2.0}, "--kPa-per-unit .* shipped is converted to sofa"),
    ("folder", "part", {"physics": Physics(friction=0.3)}, "--physics.friction .* --to sofa"),
]


@pytest.mark.parametrize(("name", "to", "given", "message"), UNUSED)
def test_settings_without_effect_are_refused(
    name: str, to: Any, given: dict[str, Any], message: str, tmp_path: Path
) -> None:
    """Named, with what they are for; nothing is written."""
    usual = HeldGait.evenly(np.array([[40.0]]), 1.0)
    write_gait(tmp_path / "g.csv", usual)
    write_sorotraj(tmp_path / "g.yaml", usual)
    source = str(tmp_path / name) if name.startswith("g.") else name
    with pytest.raises(ValueError, match=f"{message}.*; it would be ignored"):
        convert(source, ConversionSettings(to, **given), RunFolder(tmp_path / "out", "exchange"))
    assert not list((tmp_path / "out").glob("*.*"))


def test_settings_with_an_effect_are_accepted(tmp_path: Path) -> None:
    """Each in a conversion that looks at it; defaults say nothing."""
    for name, to, given in (
        ("g.yaml", "csv", {"kPa_per_unit": 2.0, "repetitions": 3, "hold_s": 0.5}),
        ("g.yaml", "sorotraj", {"kPa_per_unit": 2.0, "repetitions": 3}),
        ("g.csv", "sorotraj", {"kPa_per_unit": 2.0}),
        ("shipped", "sofa", {"mesh": Path("leg.npz"), "physics": Physics(friction=0.3)}),
        ("folder", "part", {"mesh": Path("leg.npz")}),
    ):
        ConversionSettings(to=to, **given).refuse_unused(name)  # type: ignore[arg-type]
    for name, to in (("g.csv", "csv"), ("g.csv", "sorotraj"), ("shipped", "sofa"), ("f", "part")):
        ConversionSettings(to=to).refuse_unused(name)  # type: ignore[arg-type]
    gait = HeldGait.evenly(np.array([[40.0]]), 1.0)
    unit = converted(write_gait(tmp_path / "g.csv", gait), tmp_path / "psi", kPa_per_unit=2.0)
    assert "[0.0, 20.0]" in unit.read_text()
    np.testing.assert_allclose(read_sorotraj(unit).pressure_kPa(0.5), 40.0)
