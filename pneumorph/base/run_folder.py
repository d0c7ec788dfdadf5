"""The folder of one run: what was asked, what came out, and every file it made."""

from __future__ import annotations

import errno
import fcntl
import json
import math
import os
import shutil
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from pneumorph.base.artefact import ArtefactError, read_json, write_atomically, write_json
from pneumorph.base.progress import Progress
from pneumorph.base.result import finite

SUMMARY = "summary.json"
SETTINGS = "settings.json"
TRAINING_FOLDER = "training"


class RunFolder:
    """A folder that a verb writes into, with a progress display.

    Args:
        path: The folder; made with the first file.
        verb: Name of the verb.
        progress: Where the verb says how far it is.
        provenance: What made the run, for its summary and its page.
        summary_only: Whether the caller wants the summary alone, and no page served meanwhile.
    """

    def __init__(
        self,
        path: Path,
        verb: str,
        progress: Progress | None = None,
        provenance: Mapping[str, Any] | None = None,
        summary_only: bool = False,
    ) -> None:
        self.path = path
        self.verb = verb
        self.summary_only = summary_only
        self.progress = progress or Progress(quiet=True)
        self.provenance = {} if provenance is None else {"made_by": dict(provenance)}
        self._until_summary: list[Path] = []

    def __truediv__(self, name: str) -> Path:
        """Return the path of a file of this run; the folder it is in exists."""
        target = self.path / name
        target.parent.mkdir(parents=True, exist_ok=True)
        return target

    def refuse_file(self) -> None:
        """Tell a file that stands where the folder should be.

        Raises:
            ValueError: There is one, or the folder would lie in one.
        """
        for place in (self.path, *self.path.parents):
            if place.is_file():
                raise ValueError(f"{place} is a file, expected the folder of a run or a new one")

    def refuse_other_verb(self) -> None:
        """Keep a verb from writing over another's run.

        Raises:
            ValueError: The folder holds the summary of another verb.
        """
        if not (self.path / SUMMARY).exists():
            return
        other = read_summary(self.path).get("verb")
        if other != self.verb and {other, self.verb} != {"coopt", "demo"}:  # a demo is a coopt run
            raise ValueError(
                f"{self.path} holds a run of `pneumorph {other}`, expected a folder of its own for "
                f"`{self.verb}`; choose another --out"
            )

    @contextmanager
    def alone(self) -> Iterator[None]:
        """Hold the folder, so that no second process writes into it.

        The kernel lets go of it when this process ends, however it does. Where the file system
        knows no locks of folders, such as NFS, nothing is held.

        Raises:
            ValueError: Another process holds it, or a file stands there.
        """
        self.refuse_file()
        self.path.mkdir(parents=True, exist_ok=True)
        held = os.open(self.path, os.O_RDONLY)
        try:
            try:
                fcntl.flock(held, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except OSError as error:
                if error.errno == errno.EWOULDBLOCK:
                    raise ValueError(
                        f"{self.path} is being written by another process, expected a "
                        "folder of its own for each; wait for that process, or choose another --out"
                    ) from None
            yield
        finally:
            os.close(held)

    def begin(
        self, content: dict[str, Any], fresh: bool, resumable: bool = False
    ) -> Callable[[], None]:
        """Write the resolved settings at once, so that a run that is killed can be resumed with
        them. Those of a finished run stay until another is finished there.

        Args:
            content: The settings.
            fresh: Whether the folder is made for this run.
            resumable: Whether the run goes on with a checkpoint, whose settings stay.

        Returns:
            What leaves the folder as it was, for a run that fails before it made anything.
        """
        settings = self.path / SETTINGS
        there = settings.exists()
        kept = there and resumable and any(self.path.rglob("checkpoint*.npz"))
        if kept or (self.path / SUMMARY).exists():
            return lambda: None
        before = settings.read_bytes() if there else None
        self.save_settings(content)
        written_ns = settings.stat().st_mtime_ns

        def put_back() -> None:
            with suppress(OSError):  # such as of a full disk, which the run has failed of
                others = (file for file in self.path.rglob("*") if file != settings)
                if any(file.lstat().st_mtime_ns >= written_ns for file in others):
                    return
                if before is not None:
                    write_atomically(settings, lambda stream: stream.write(before))
                    return
                settings.unlink()
                if fresh:
                    self.path.rmdir()

        return put_back

    def keep_until_summary(self, folder: Path) -> None:
        """Have a folder removed once the summary is there: until then a stopped run needs it."""
        self._until_summary.append(folder)

    def save_settings(self, content: dict[str, Any]) -> Path:
        """Write the resolved settings."""
        return write_json(self / SETTINGS, content)

    def save_summary(self, content: dict[str, Any]) -> Path:
        """Write the summary and the verb that made it; numbers that are not finite become null."""
        head = {"verb": self.verb, **self.provenance}
        path = write_json(self / SUMMARY, {**head, **finite(content)})
        for folder in self._until_summary:
            shutil.rmtree(folder, ignore_errors=True)
        return path

    def tell_of_earlier_page(self, begun_s: float) -> None:
        """Say where the folder has a page of an earlier run, which shows what that one found.

        Args:
            begun_s: When this run began [seconds since 1970]; a page that it wrote itself is new.
        """
        page = self.path / "report" / "page.html"
        if page.exists() and page.stat().st_mtime < begun_s:
            self.progress.say(
                f"{page} is older than this run; `pneumorph report {self.path}` draws it again"
            )


def default_folder(verb: str) -> Path:
    """Return runs/VERB-TIME, with a number behind it where that exists already."""
    name = f"{verb}-{time.strftime('%Y%m%d-%H%M%S')}"
    path, number = Path("runs") / name, 2
    while path.exists():
        path, number = Path("runs") / f"{name}-{number}", number + 1
    return path


def read_summary(folder: Path) -> dict[str, Any]:
    """Return the summary of an earlier run.

    Raises:
        ArtefactError: The folder holds no summary: the run did not finish or is no run; or a number
            is NaN or infinite, which no run writes.
    """
    return _read(folder, SUMMARY)


def read_settings(folder: Path) -> dict[str, Any]:
    """Return the resolved settings of an earlier run; raises as `read_summary`."""
    return _read(folder, SETTINGS)


def _read(folder: Path, name: str) -> dict[str, Any]:
    path = folder / name
    if not folder.is_dir():
        what = "is a file" if folder.exists() else "does not exist"
        raise ArtefactError(f"{folder} {what}, expected the folder of a finished pneumorph run")
    if not path.exists():
        stopped = name == SUMMARY and (folder / SETTINGS).exists()
        raise ArtefactError(
            f"{folder} holds no {name}; it is not the folder of a finished pneumorph run"
            + (
                f", but has {SETTINGS}: a run may have been stopped there, and the same command "
                "with the same --out goes on with it (coopt with --resume; deploy, but for finite "
                "elements behind a virtual rig, begins anew with another --out)"
                if stopped
                else ""
            )
        )
    content = read_json(path, path.stem)
    _refuse_not_finite(content, path, "")
    return content


def _refuse_not_finite(value: Any, path: Path, place: str) -> None:
    """Refuse NaN and infinity, which are no JSON: runs write null, and none counts with them."""
    if isinstance(value, float) and not math.isfinite(value):
        raise ArtefactError(f"{path}: {place}: {value}, expected a finite number, or null for none")
    if isinstance(value, dict | list):
        items = value.items() if isinstance(value, dict) else enumerate(value)
        for name, each in items:
            _refuse_not_finite(each, path, f"{place}.{name}" if place else str(name))


def made_once(path: Path, make: Callable[[], Mapping[str, Any]], **made_of: Any) -> dict[str, Any]:
    """Return what a JSON file holds; make and write it where it is missing.

    Args:
        path: The file.
        make: Makes its content, JSON values; numbers that are not finite become null.
        made_of: What the content depends on, JSON values; kept in the file beside it.

    Raises:
        ValueError: The file was made of something else.
    """
    if not path.exists():
        write_json(path, finite({**made_of, **make()}))
    content = read_json(path, "JSON")
    for name, wanted in json.loads(json.dumps(made_of)).items():
        if content.get(name) != wanted:
            raise ValueError(
                f"{path} was made with {name} {content.get(name)}, expected {wanted}; choose "
                "another folder"
            )
    return content
