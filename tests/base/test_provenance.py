"""Summaries say what made them: the command as typed, and the commit of a source tree."""

from __future__ import annotations

import re
import shlex
import subprocess
from pathlib import Path

import pytest

from pneumorph.base import provenance


def test_the_command_can_be_typed_again() -> None:
    arguments = ["simulate", "--out", "a folder", "--design", "1.0.0.2.2.0.0.1"]
    made = provenance.made_by(arguments)
    assert shlex.split(made["command"]) == ["pneumorph", *arguments]
    assert made["commit"] is None or re.fullmatch(r"[0-9a-f]{40}( with changes)?", made["commit"])


def test_a_commit_is_named_only_where_the_source_is_tracked(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A package installed inside somebody's repository is not of that repository's commit."""
    package = tmp_path / "environment" / "pneumorph"
    (package / "base").mkdir(parents=True)
    (package / "base" / "provenance.py").write_text("")
    monkeypatch.setattr(provenance, "_PACKAGE", package)
    git = ["git", "-C", str(tmp_path), "-c", "user.name=a", "-c", "user.email=a@b.c"]

    def call(*arguments: str) -> None:
        subprocess.run([*git, *arguments], check=True, capture_output=True)

    call("init")
    call("commit", "--allow-empty", "-m", "start")
    assert provenance.source_commit() is None
    call("add", "-A")
    call("commit", "-m", "source")
    commit = provenance.source_commit()
    assert commit is not None
    assert re.fullmatch(r"[0-9a-f]{40}", commit)
    (package / "base" / "provenance.py").write_text("changed")
    assert provenance.source_commit() == f"{commit} with changes"
