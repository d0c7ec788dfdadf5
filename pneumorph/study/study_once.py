"""A study in a folder of its own, made unless it is there already."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any, TypeVar

from pneumorph.base.progress import Progress
from pneumorph.base.provenance import source
from pneumorph.base.result import result_to_dict
from pneumorph.base.run_folder import SETTINGS, SUMMARY, RunFolder, read_settings, read_summary
from pneumorph.base.settings import differences, settings_from_dict, settings_to_dict
from pneumorph.study.finished_run import FinishedRun
from pneumorph.study.survived import NONE_SURVIVED

Result = TypeVar("Result")


def study_folder(path: Path, verb: str) -> RunFolder:
    """The folder of a study that a program makes; what it prints goes to standard error.

    Args:
        path: Where.
        verb: Which verb makes such a study; verbs that take a run take this one's folder, too.
    """
    return RunFolder(path, verb, Progress(), source())


def study_once(
    folder: RunFolder,
    kind: type[Result],
    asked: Any,
    make: Callable[[], Result],
    *,
    begun: bool = False,
    free: Collection[str] = (),
    later: Collection[str] = (),
) -> Result:
    """Return the result that a folder holds, or make it there and keep it with its settings.

    A study whose status is not ``completed``, such as a walk that diverged, is made again.

    Args:
        folder: The folder; nobody else may write into it meanwhile.
        kind: Class of the result.
        asked: What decides the result, as ``settings.json`` shall hold it: a settings class, or
            settings classes and JSON values by name.
        make: Makes the result in the folder; called where there is none.
        begun: Whether a study that was stopped there must be of the same settings. Most find out
            for themselves.
        free: Names of what is asked that may differ: it does not decide the result.
        later: Names of what is asked that folders of earlier versions do not say; where one says
            nothing of it, that is taken to be the same.

    Raises:
        ValueError: The folder holds a study of other settings or of another kind, or another
            process writes into it.
        ArtefactError: The folder is damaged.
    """
    with folder.alone():
        folder.refuse_other_verb()
        finished = (folder.path / SUMMARY).exists()
        if (finished or begun) and (folder.path / SETTINGS).exists():
            refuse_others(folder.path, asked, free, later)
        if finished:
            # Not a verb's run alone: a step of a study is of what its folder says.
            place = folder.path
            found = FinishedRun(place, read_summary(place), read_settings(place)).result(kind)
            if getattr(found, "status", "completed") in ("completed", NONE_SURVIVED):
                return found
        return make_study(folder, asked, make)


def make_study(folder: RunFolder, asked: Any, make: Callable[[], Result]) -> Result:
    """Make a study in a folder and keep it there with its settings; arguments as `study_once`."""
    folder.save_settings({name: _plain(value) for name, value in _by_name(asked).items()})
    found = make()
    folder.save_summary(result_to_dict(found))
    return found


def refuse_others(
    folder: Path, asked: Any, free: Collection[str] = (), later: Collection[str] = ()
) -> None:
    """Refuse a folder whose settings are of another study; arguments as `study_once`.

    Raises:
        ValueError: They are; names the first that differs.
    """
    there: Mapping[str, Any] = read_settings(folder)
    if is_dataclass(asked):
        # Read as settings: one that is newer than the study had its default.
        there = _by_name(settings_from_dict(type(asked), there))
    for name, value in _by_name(asked).items():
        if name in later and name not in there:
            continue
        kept = there.get(name)
        if is_dataclass(value) and isinstance(kept, Mapping):
            kept = settings_from_dict(type(value), kept)
        theirs, ours = _plain(kept), _plain(value)
        if name not in free and theirs != ours:
            raise ValueError(
                f"{folder} holds a run of other settings ({_apart(name, theirs, ours)}), expected "
                "the same; choose another folder"
            )


def _apart(name: str, kept: Any, asked: Any) -> str:
    """The first setting that differs, with both values where they are short."""
    found = differences(kept, asked, name)
    if not found:
        return f"{name} differs"
    name, theirs, ours = found[0]
    said = f"{name} is {theirs!r} there and {ours!r} here"
    return said if len(said) <= 160 else f"{name} differs"


def _by_name(asked: Any) -> dict[str, Any]:
    if is_dataclass(asked):
        return {field.name: getattr(asked, field.name) for field in fields(asked)}
    return dict(asked)


def _plain(value: Any) -> Any:
    """A setting as JSON holds it."""
    return settings_to_dict({"value": value})["value"]
