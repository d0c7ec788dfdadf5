"""A study in a folder is made once; another one there is refused by what differs."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path

import pytest

from pneumorph.study.finished_run import FinishedRun
from pneumorph.study.reduction_options import ReduceOptions
from pneumorph.study.study_once import study_folder, study_once


@dataclass(frozen=True)
class Length:
    """Settings of a walk."""

    seconds: float = 1.0
    name: str = "short"


@dataclass(frozen=True)
class Found:
    """What came of it."""

    status: str
    count: int


def once(folder: Path, asked: object, result: Found, **options: object) -> Found:
    def make() -> Found:
        made.append(result)
        return result

    made: list[Found] = []
    found = study_once(study_folder(folder, "simulate"), Found, asked, make, **options)  # type: ignore[arg-type]
    assert (found in made) == (found is result)
    return found


def test_a_finished_study_is_read_and_one_that_failed_made_again(tmp_path: Path) -> None:
    diverged, first, second = Found("diverged", 1), Found("completed", 2), Found("completed", 3)
    assert once(tmp_path, Length(), diverged) is diverged
    assert once(tmp_path, Length(), first) is first
    assert once(tmp_path, Length(), second) == first
    assert FinishedRun.read(tmp_path).settings == {"seconds": 1.0, "name": "short"}
    assert FinishedRun.read(tmp_path).verb == "simulate"


@pytest.mark.parametrize("by_name", [False, True])
def test_a_study_of_other_settings_is_refused(tmp_path: Path, by_name: bool) -> None:
    """A setting that the folder does not know had its default."""

    def asked(*settings: object) -> object:
        length = Length(*settings)  # type: ignore[arg-type]
        return {"length": length, "run": "here"} if by_name else length

    done = Found("completed", 1)
    once(tmp_path, asked(2.0), done)
    path = tmp_path / "settings.json"
    settings = json.loads(path.read_text())
    del (settings["length"] if by_name else settings)["name"]
    path.write_text(json.dumps(settings))
    assert once(tmp_path, asked(2.0), Found("completed", 2)) == done
    name, seconds = ("length", "length.seconds") if by_name else ("seconds", "seconds")
    with pytest.raises(ValueError, match=rf"\({seconds} is 2.0 there and 3.0 here\)"):
        once(tmp_path, asked(3.0), done)
    assert once(tmp_path, asked(3.0), Found("completed", 2), free=(name,)) == done
    with pytest.raises(ValueError, match="holds a run of `pneumorph simulate`"):
        study_once(study_folder(tmp_path, "analyse"), Found, asked(2.0), lambda: done)


def test_settings_of_an_earlier_version_are_the_same_settings(tmp_path: Path) -> None:
    done = Found("completed", 1)
    once(tmp_path, ReduceOptions(), done)
    path = tmp_path / "settings.json"
    older = path.read_text().replace('"leg": "published"', '"leg": "paper"')
    assert older != path.read_text()
    path.write_text(older)
    assert once(tmp_path, ReduceOptions(), Found("completed", 2)) == done
