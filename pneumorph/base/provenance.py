"""Which source, command and machine made a run, so that anyone can repeat it."""

from __future__ import annotations

import platform
import shlex
import subprocess
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pneumorph import __version__
from pneumorph.base.machine import describe_machine

_PACKAGE = Path(__file__).parents[1]


@dataclass(frozen=True)
class Provenance:
    """What made a run."""

    version: str
    """Of the package."""
    machine: str
    commit: str | None = None
    """Commit of the source tree; None for an installed package."""
    python: str | None = None
    """An earlier version did not name it."""
    command: str | None = None
    """None for a run that no command line asked for."""


def made_by(arguments: Sequence[str]) -> dict[str, Any]:
    """Return what a summary says of its making.

    Args:
        arguments: Arguments of the command line, the verb first.
    """
    return {"command": shlex.join(["pneumorph", *arguments]), **source()}


def source() -> dict[str, Any]:
    """Return which source and machine make a run, for one that no command line asked for."""
    return {
        "version": __version__,
        "commit": source_commit(),
        "python": platform.python_version(),
        "machine": describe_machine(),
    }


def source_commit() -> str | None:
    """Return the commit of the source tree that runs, "... with changes" where files differ.

    None for an installed package: the version says which one it is. A repository that merely
    holds the environment the package is installed in does not count, since it does not track it.
    """
    if _git("ls-files", "--error-unmatch", "base/provenance.py") is None:
        return None
    commit = _git("rev-parse", "HEAD")
    if commit is None:
        return None
    changed = _git("status", "--porcelain", "--untracked-files=no", "--", ".", "../engine")
    return f"{commit} with changes" if changed else commit


def _git(*arguments: str) -> str | None:
    """Return git's answer in the package's folder; None where it has none."""
    try:
        answer = subprocess.run(
            ["git", *arguments], cwd=_PACKAGE, capture_output=True, text=True, timeout=10
        )
    except (OSError, subprocess.SubprocessError):
        return None
    return answer.stdout.strip() if answer.returncode == 0 else None
