"""Run folders hold valid JSON and say when they are none."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from pneumorph.base.artefact import ArtefactError
from pneumorph.base.run_folder import RunFolder, default_folder, read_summary


def test_numbers_that_are_not_finite_become_null(tmp_path: Path) -> None:
    folder = RunFolder(tmp_path / "run", "baseline")
    path = folder.save_summary({"a": float("nan"), "b": [1.0, float("inf")], "c": {"d": (2, 3.5)}})
    assert json.loads(path.read_text()) == {
        "verb": "baseline", "a": None, "b": [1.0, None], "c": {"d": [2, 3.5]},
    }  # fmt: skip
    assert read_summary(tmp_path / "run")["verb"] == "baseline"


def test_default_folders_do_not_collide(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("time.strftime", lambda _: "20260101-000000")
    first = default_folder("mesh")
    first.mkdir(parents=True)
    assert first == Path("runs/mesh-20260101-000000")
    assert default_folder("mesh") == Path("runs/mesh-20260101-000000-2")


def test_a_verb_does_not_write_over_anothers_run(tmp_path: Path) -> None:
    RunFolder(tmp_path, "coopt").save_summary({})
    for verb in ("coopt", "demo"):  # a demo is a coopt run with a page
        RunFolder(tmp_path, verb).refuse_other_verb()
    with pytest.raises(ValueError, match=r"holds a run of `pneumorph coopt`.*choose another --out"):
        RunFolder(tmp_path, "baseline").refuse_other_verb()


def test_the_page_of_other_settings_goes(tmp_path: Path) -> None:
    """One of the same settings stays, and so does one that the run itself has drawn."""
    folder = RunFolder(tmp_path, "certify")
    page = folder / "report/page.html"
    page.write_text("six worlds")
    folder.save_settings({"world_count": 6, "worlds": (1, 2)})
    later = page.stat().st_mtime + 1.0
    folder.remove_earlier_page({"world_count": 6, "worlds": (1, 2)}, later)
    folder.remove_earlier_page({"world_count": 8, "worlds": (1, 2)}, later - 2.0)
    assert page.exists()
    folder.remove_earlier_page({"world_count": 8, "worlds": (1, 2)}, later)
    assert not page.exists()


def test_a_folder_is_written_by_one_process_at_a_time(tmp_path: Path) -> None:
    with RunFolder(tmp_path / "run", "coopt").alone():
        second = RunFolder(tmp_path / "run", "coopt").alone()
        with pytest.raises(ValueError, match="is being written by another process"), second:
            raise AssertionError
        with RunFolder(tmp_path / "other", "coopt").alone():
            pass
    with RunFolder(tmp_path / "run", "coopt").alone():
        pass


def test_a_folder_without_a_run_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ArtefactError, match=r"holds no summary\.json"):
        read_summary(tmp_path)
