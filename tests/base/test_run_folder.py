"""Run folders hold valid JSON and say when they are none."""

from __future__ import annotations

import io
import json
from pathlib import Path

import pytest

from pneumorph.base.artefact import ArtefactError
from pneumorph.base.progress import Progress
from pneumorph.base.run_folder import RunFolder, default_folder, read_settings, read_summary


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


def test_a_page_of_an_earlier_run_is_told(tmp_path: Path) -> None:
    """And one that the run itself has drawn is not."""
    told = io.StringIO()
    folder = RunFolder(tmp_path, "certify", Progress(told))
    page = folder / "report/page.html"
    page.write_text("six worlds")
    drawn_s = page.stat().st_mtime
    folder.tell_of_earlier_page(drawn_s - 1.0)
    assert told.getvalue() == ""
    folder.tell_of_earlier_page(drawn_s + 1.0)
    assert f"{page} is older than this run; `pneumorph report {tmp_path}`" in told.getvalue()


@pytest.mark.parametrize("inside", ["", "run"])
def test_a_file_is_no_folder(tmp_path: Path, inside: str) -> None:
    file = tmp_path / "mesh.npz"
    file.write_bytes(b"")
    folder = RunFolder(file / inside, "coopt")
    for use in (folder.refuse_file, folder.alone().__enter__):
        with pytest.raises(ValueError, match=r"mesh\.npz is a file, expected the folder of a run"):
            use()


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


ASKED, OTHER = {"seed": 1}, {"seed": 2}


def settings_of(folder: Path) -> dict[str, int] | None:
    path = folder / "settings.json"
    return json.loads(path.read_text()) if path.exists() else None


@pytest.mark.parametrize("before", ["no folder", "empty", "unfinished", "finished", "resumable"])
def test_settings_are_there_from_the_beginning(tmp_path: Path, before: str) -> None:
    """Unless another run's are those of what is there; one that fails at once changes nothing."""
    path = tmp_path / "run"
    folder = RunFolder(path, "coopt")
    earlier = None if before in ("no folder", "empty") else OTHER
    if before != "no folder":
        path.mkdir()
    if earlier is not None:
        folder.save_settings(earlier)
    if before == "finished":
        folder.save_summary({})
    if before == "resumable":
        (folder / "training/checkpoint.npz").touch()
    put_back = folder.begin(ASKED, fresh=before == "no folder", resumable=before == "resumable")
    stay = before in ("finished", "resumable")
    assert settings_of(path) == (OTHER if stay else ASKED)
    put_back()
    assert settings_of(path) == earlier
    assert path.exists() == (before != "no folder")


def test_settings_of_a_run_that_made_something_stay(tmp_path: Path) -> None:
    folder = RunFolder(tmp_path, "search")
    folder.save_settings(OTHER)
    put_back = folder.begin(ASKED, fresh=False)
    (folder / "search.jsonl").touch()
    put_back()
    assert settings_of(tmp_path) == ASKED


def test_what_a_stopped_run_needs_is_there_until_the_summary_is(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = RunFolder(tmp_path, "certify")
    (folder / "walks/a.json").touch()
    folder.keep_until_summary(tmp_path / "walks")

    def full(*_: object) -> Path:
        raise OSError("No space left on device")

    with monkeypatch.context() as patch:
        patch.setattr("pneumorph.base.run_folder.write_json", full)
        with pytest.raises(OSError, match="No space"):
            folder.save_summary({})
    assert (tmp_path / "walks/a.json").exists()
    folder.save_summary({})
    assert not (tmp_path / "walks").exists()


def test_what_is_no_folder_is_told_as_what_it_is(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    for name, told in (("file", "is a file"), ("nowhere", "does not exist")):
        for read in (read_summary, read_settings):
            with pytest.raises(ArtefactError, match=f"{name} {told}, expected the folder of"):
                read(tmp_path / name)
