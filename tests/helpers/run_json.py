"""A verb's answer, as a program that calls it reads it."""

import json
from typing import Any

import pytest

from pneumorph.cli import run


def run_json(command: str, capsys: pytest.CaptureFixture[str]) -> dict[str, Any]:
    """Run a verb that must succeed, and return what it prints with ``--json``."""
    capsys.readouterr()
    assert run([*command.split(), "--json"]) == 0
    content: dict[str, Any] = json.loads(capsys.readouterr().out)
    return content
