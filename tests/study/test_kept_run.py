"""What is kept of a run never costs the run, or what was kept before."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest

from pneumorph.study.kept_run import keep_run

SHIPPED = Path(__file__).parents[2] / "reproduce" / "fast_schedule" / "seed_0"


@pytest.fixture
def run(tmp_path: Path) -> Path:
    """A run with its gaits where a training leaves them."""
    folder = shutil.copytree(SHIPPED, tmp_path / "run")
    shutil.move(folder / "gaits", folder / "training" / "gaits")
    summary = json.loads((folder / "summary.json").read_text())
    for pair in summary["pairs"]:
        pair["gait"] = f"training/{pair['gait']}"
    summary["best_gait"] = summary["pairs"][0]["gait"]
    (folder / "summary.json").write_text(json.dumps(summary))
    return folder


def _files(folder: Path) -> dict[Path, bytes]:
    found = (each for each in folder.rglob("*") if each.is_file())
    return {each.relative_to(folder): each.read_bytes() for each in found}


def test_a_run_is_kept_with_its_gaits(run: Path, tmp_path: Path) -> None:
    before = _files(run)
    kept = keep_run(run, tmp_path / "kept")
    for pair in kept.pairs:
        content = (tmp_path / "kept" / pair.gait).read_bytes()
        assert content == before[Path("training") / pair.gait]
    assert _files(run) == before


@pytest.mark.parametrize("inside", ["training", "kept/there"])
def test_keeping_a_run_inside_of_itself_is_refused(inside: str, run: Path) -> None:
    before = _files(run)
    with pytest.raises(ValueError, match=r"is inside the run, expected a folder outside of"):
        keep_run(run, run / inside)
    assert _files(run) == before


def test_a_run_that_lacks_a_gait_replaces_nothing(run: Path, tmp_path: Path) -> None:
    keep_run(run, tmp_path / "kept")
    before = _files(tmp_path / "kept")
    next((run / "training" / "gaits").glob("*.csv")).unlink()
    with pytest.raises(FileNotFoundError):
        keep_run(run, tmp_path / "kept")
    assert _files(tmp_path / "kept") == before
