"""Run a verb in a folder of its own, unless it is there already and was completed."""

from __future__ import annotations

import shlex
from pathlib import Path
from typing import Any

from pneumorph.base.run_folder import SUMMARY, read_summary
from pneumorph.cli import run


def run_once(folder: Path, *arguments: object) -> dict[str, Any]:
    """Return the summary of ``pneumorph ARGUMENTS --out FOLDER``, running it where it is missing.

    Args:
        folder: The run folder; a run that was stopped there or failed goes on, as its verb does.
        arguments: The verb and its flags.

    Raises:
        ValueError: The folder holds the run of another command.
        RuntimeError: The verb failed.
    """
    words = [*map(str, arguments), "--out", str(folder)]
    command = shlex.join(["pneumorph", *words])
    if (folder / SUMMARY).exists():
        summary = read_summary(folder)
        there = summary.get("made_by", {}).get("command")
        if there != command:
            raise ValueError(
                f"{folder} holds the run of `{there}`, expected that of `{command}`; choose "
                "another folder"
            )
        if summary.get("status", "completed") == "completed":
            return summary
    if run(words) != 0:
        raise RuntimeError(f"`{command}` failed; see its message above")
    return read_summary(folder)
