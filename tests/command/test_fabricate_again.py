"""A workshop makes what is in the folder: nothing of another design may lie there."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from pneumorph.base.artefact import ArtefactError
from pneumorph.cli import run
from pneumorph.study.finished_run import FinishedRun

pytest.importorskip("netgen.occ")
PLATE = Path(__file__).parents[2] / "examples" / "plate.toml"


def test_solids_of_an_earlier_design_go_and_other_files_stay(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Of a design with short legs, whose moulds the new one has no use for."""
    there = {"short_core": {"step": "short_core.step", "stl": "short_core.stl"},
             "hub": {"step": "hub.step", "stl": "hub.stl"},
             "short_leg": {"step": None, "stl": "gone.stl"}}  # fmt: skip
    for name in ("short_core.step", "short_core.stl", "hub.stl", "notes.stl"):
        (tmp_path / name).write_text("of another design")
    (tmp_path / "summary.json").write_text(json.dumps({"verb": "fabricate", "solids": there}))
    command = ["fabricate", "1.0.2.2.0.1", "--robot", str(PLATE), "--surface-size-mm", "20"]
    assert run([*command, "--out", str(tmp_path)]) == 0
    assert not list(tmp_path.glob("short_*"))
    assert (tmp_path / "notes.stl").read_text() == "of another design"
    assert (tmp_path / "hub.stl").read_bytes() != b"of another design"
    said = capsys.readouterr()
    assert "removed what was made there before: short_core.step, short_core.stl\n" in (
        said.out + said.err
    )


def test_what_walked_is_built_where_a_run_found_no_best() -> None:
    def design(summary: dict[str, str]) -> str:
        return FinishedRun(Path("run"), summary, {}).chosen_design

    assert design({"verb": "simulate", "design": "1.0.2.2.0.1"}) == "1.0.2.2.0.1"
    assert design({"verb": "coopt", "best_design": "1.0.2", "design": "1.2.0"}) == "1.0.2"
    with pytest.raises(ArtefactError, match="best_design"):
        design({"verb": "reduce"})
