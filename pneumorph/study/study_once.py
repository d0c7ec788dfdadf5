"""A study in a folder of its own, made unless it is there already."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import is_dataclass
from pathlib import Path
from typing import Any, TypeVar

from pneumorph.base.progress import Progress
from pneumorph.base.provenance import source
from pneumorph.base.result import result_to_dict
from pneumorph.base.run_folder import SETTINGS, SUMMARY, RunFolder, read_settings
from pneumorph.base.settings import settings_from_dict, settings_to_dict
from pneumorph.study.finished_run import FinishedRun

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
    asked: Mapping[str, Any],
    make: Callable[[], Result],
    *,
    begun: bool = False,
    free: Collection[str] = (),
) -> Result:
    """Return the result that a folder holds, or make it there and keep it with its settings.

    Args:
        folder: The folder; nobody else may write into it meanwhile.
        kind: Class of the result.
        asked: What decides the result, as ``settings.json`` shall hold it: settings classes and
            JSON values by name.
        make: Makes the result in the folder; called where there is none.
        begun: Whether a study that was stopped there must be of the same settings. Most find out
            for themselves.
        free: Names of what is asked that may differ: it does not decide the result.

    Raises:
        ValueError: The folder holds a study of other settings, or another process writes into it.
        ArtefactError: The folder is damaged.
    """
    with folder.alone():
        finished = (folder.path / SUMMARY).exists()
        if (finished or begun) and (folder.path / SETTINGS).exists():
            _refuse_others(folder.path, {k: v for k, v in asked.items() if k not in free})
        if finished:
            return FinishedRun.read(folder.path).result(kind)
        folder.save_settings({name: _plain(value) for name, value in asked.items()})
        found = make()
        folder.save_summary(result_to_dict(found))
    return found


def _refuse_others(folder: Path, asked: Mapping[str, Any]) -> None:
    there = read_settings(folder)
    for name, value in asked.items():
        kept = there.get(name)
        if is_dataclass(value) and isinstance(kept, Mapping):
            # Read as settings: one that is newer than the study had its default.
            kept = _plain(settings_from_dict(type(value), kept))
        if kept != _plain(value):
            raise ValueError(
                f"{folder} holds a run of other settings ({name} differs), expected the same; "
                "choose another folder"
            )


def _plain(value: Any) -> Any:
    return settings_to_dict(value) if is_dataclass(value) else value
