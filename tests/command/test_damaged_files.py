"""A value of a file in the place of another: success, or one line that names the file.

`EXAMPLES=500 pytest tests/command/test_damaged_files.py` draws more of them, and
`python -m helpers.damaged_values` makes them all.
"""

from __future__ import annotations

import os
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from helpers.corruption import few
from helpers.damaged_values import (
    VERBS,
    Damage,
    all_damages,
    call_on_whole_files,
    call_with,
    complaint,
    whole_files,
    write_damaged,
)
from helpers.synthetic_part import synthetic_reduced_part
from hypothesis import given, settings
from hypothesis import strategies as st

from pneumorph.cli import run

EXAMPLES = int(os.environ.get("EXAMPLES", "0"))
FEW = {"run/summary.json": 12, "run/settings.json": 10, "run/training/metrics.jsonl": 5}
"""Examples of each file; fewer of others, which one verb or two read."""
GAIT = """time_s,regulator_1_kPa,regulator_2_kPa,regulator_3_kPa
0,10,20,30
1,10,20,30
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    made = whole_files(tmp_path_factory.mktemp("damaged"))
    assert call_on_whole_files(made) == []
    return made


@pytest.mark.parametrize("file", VERBS)
def test_a_damaged_value_is_read_or_refused_by_its_file(file: str, folder: Path) -> None:
    damages = [each for each in all_damages(folder) if each.file == file]

    @settings(few, max_examples=EXAMPLES or FEW.get(file, 6))
    @given(damage=st.sampled_from(damages))
    def holds(damage: Damage) -> None:
        assert complaint(damage, call_with(damage, folder)) == ""

    holds()


@pytest.mark.parametrize(
    ("file", "place", "value", "call", "said"),
    [
        ("run/summary.json", ("pairs", 0, "design"), "x", "report", "pairs.0.design: "),
        ("run/summary.json", ("pairs", 0, "design"), "x", "evaluate", "pairs.0.design: "),
        ("run/summary.json", ("pairs", 0, "distance_cm"), "nan", "report", "pairs.0.distance_cm"),
        ("run/summary.json", ("pairs", 0, "distance_cm"), "nan", "evaluate", "pairs.0.distance_cm"),
        ("run/summary.json", ("verb",), "x", "evaluate", "verb: 'x', expected one of mesh, "),
        ("run/summary.json", ("phases_deg",), "[]", "report", "distances_cm has 2 numbers"),
        ("run/settings.json", ("robot", "physics"), "x", "report", "physics: expected a table"),
        ("run/training/metrics.jsonl", (1,), "x", "report", "line 2: expected a table"),
        ("run/training/metrics.jsonl", (0, "timestep"), "x", "watch", "line 1: timestep: "),
        ("rig.json", ("channels",), "3", "deploy", "channels: expected a list, got 3"),
        ("leg.npz", ("skin",), "huge", "simulate", "skin has 1000000, expected 0 to "),
        ("leg.npz", ("tetrahedron_index",), "huge", "simulate", "tetrahedron_index has 1000000"),
    ],
)  # fmt: skip
def test_a_damaged_value_is_told_with_its_place(
    file: str, place: tuple[str | int, ...], value: str, call: str, said: str, folder: Path
) -> None:
    damage = next(
        each
        for each in all_damages(folder)
        if (each.file, each.arguments[0]) == (file, call)
    )  # fmt: skip
    ended = call_with(replace(damage, place=place, value=value), folder, limit_s=600.0)
    last = ended.said.splitlines()[-1]
    assert ended.ended == 1
    assert said in last
    assert Path(file).name in last


def test_a_page_says_which_gaits_are_not_there(folder: Path, tmp_path: Path) -> None:
    gait = folder / "run" / "training" / "gaits" / "L1.csv"
    content = gait.read_bytes()
    summary = folder / "run" / "summary.json"
    whole = summary.read_bytes()
    gait.unlink()
    write_damaged(summary, ("pairs", 1, "gait"), "null")
    try:
        assert run(["report", str(folder / "run"), "--figure-files", "--out", str(tmp_path)]) == 0
    finally:
        gait.write_bytes(content)
        summary.write_bytes(whole)
    text = (tmp_path / "page.html").read_text()
    assert f"Gaits that are not there, and not drawn: L1 ({gait}), L2 (no file is named)." in text


@pytest.mark.parametrize("verb", ["report", "evaluate"])
@pytest.mark.parametrize("named", ["../../leg.npz", "/etc/passwd", "training/../../leg.npz"])
def test_a_gait_outside_the_run_is_not_read(
    verb: str, named: str, folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    summary = folder / "run" / "summary.json"
    whole = summary.read_text()
    summary.write_text(whole.replace("training/gaits/L1.csv", named))
    try:
        assert run([verb, str(folder / "run"), "--out", str(tmp_path / "out")]) == 1
    finally:
        summary.write_text(whole)
    assert f"{summary}: pairs.0.gait: '{named}' is no file in" in capsys.readouterr().err


Write = Callable[[Path], object]


@pytest.mark.parametrize(
    ("name", "content", "command", "said"),
    [
        ("gait.csv", f"# design: a.b\n{GAIT}", "simulate --gait", "design: design 'a.b' is not"),
        ("gait.csv", f"# design: 9.1\n{GAIT}", "simulate --gait", "location 0 to regulator 9"),
        ("gait.npz", "PK", "simulate --gait", "is not a readable Policy file"),
        ("leg.md", "# A leg", "simulate --part", "it is no npz archive of plain arrays"),
        ("walk.md", "# A walk", "replay", "it is no npz archive of plain arrays"),
        ("settings.yaml", "a: 1", "simulate --settings", "is YAML by its name, expected JSON"),
        ("settings.json", '{"expert": 3}', "simulate --settings",
         "walk.expert: expected a table of phase_deg, "),
        ("gait.yaml", "a: [1", "exchange", "in line 1, column"),
        ("gait.yaml", "setup: 3", "exchange", "settings is missing"),
        ("gait.yaml", "settings: 3", "exchange", "settings is 3, expected a table"),
        ("rig.toml", "[[channels]]", "deploy --dry-run --rig", "the rig has 1 channels"),
        ("pairs.csv", "1,2", "calibrate --pairs", "needs at least 3 points, got 1"),
        ("pairs.csv", "1,2\n1,2\n1,2", "calibrate --pairs", "all 3 points are at 1"),
        ("pairs.csv", "1,9\n2,6\n3,3", "calibrate --pairs", "expected it to rise"),
        ("bends.csv", "30,0.3\n60,0.8\n90,1.2", "calibrate --bends", "or the bends not in degrees"),
        ("bench.csv", "weighing,46\nweighing,-4", "calibrate --bench",
         "row 2: a reading of 'weighing' is -4, expected leg_mass_g above 0"),
    ],
)  # fmt: skip
def test_a_damaged_file_is_told_in_one_line(
    name: str,
    content: str,
    command: str,
    said: str,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    header = {"pairs.csv": "real_pressure_kPa,simulated_pressure_kPa\n",
              "bends.csv": "pressure_kPa,bend_deg\n",
              "bench.csv": "test,reading\n"}.get(name, "")  # fmt: skip
    file = tmp_path / name
    file.write_text(header + content)
    assert run([*command.split(), str(file), "--out", str(tmp_path / "out")]) == 1
    (line,) = [each for each in capsys.readouterr().err.splitlines() if "pneumorph: " in each]
    assert str(file) in line
    assert said in line


def test_sampled_points_are_those_of_the_mesh() -> None:
    part = synthetic_reduced_part(mode_count=4, cells=(4, 4, 4))
    counts = part.metadata["point_counts"]
    assert counts == {kind: len(getattr(part, f"{kind}_index")) for kind in counts}
    beyond = part.membrane_index + 1
    with pytest.raises(ValueError, match=f"membrane_index has {counts['membrane']}, expected 0 to"):
        replace(part, membrane_index=beyond)
    with pytest.raises(ValueError, match="skin has -1, expected 0 to"):
        replace(part, skin=part.skin - np.int32(1))
    with pytest.raises(ValueError, match="attachment_nodes has 1000000"):
        replace(part, metadata={**part.metadata, "attachment_nodes": [10**6]})


def test_a_gait_of_another_design_is_told(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    gait = folder / "run" / "training" / "gaits" / "L1.csv"
    whole = gait.read_text()
    gait.write_text(re.sub("# design: .*", "# design: 1.1.1.1.0.0.0.0", whole))
    try:
        assert run(["evaluate", str(folder / "run"), "--out", str(tmp_path / "out")]) == 1
    finally:
        gait.write_text(whole)
    said = capsys.readouterr().err
    assert f"{gait} is of design 1.1.1.1.0.0.0.0, expected " in said
    assert "summary.json has at pairs.0: one of them is of another run" in said
