"""The scripts of the experiments as modules, and their calls."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest
import tyro

REPRODUCE = Path(__file__).parent.parent.parent / "reproduce"
FEW_ACTIONS: dict[str, Any] = {
    "baseline": {"phase_step_deg": 90.0, "gait": {"duration_s": 0.4, "period_s": 0.4}},
    "coopt": {
        "environment_count": 4,
        "total_timesteps": 12,
        "evaluated_design_count": 2,
        "kept_pair_count": 1,
        "learning_start_timestep": 100,
        "task": {"action_count": 3, "action_step_count": 10},
        "schedule": {"decay_start_timestep": 0, "decay_end_timestep": 12},
    },
}
"""A training of a dozen actions, as settings over a preset."""


def script(name: str, file: str = "run") -> ModuleType:
    """The module of an experiment's run.py, or of another of its files."""
    path = REPRODUCE / name / f"{file}.py"
    specification = importlib.util.spec_from_file_location(f"reproduce_{name}_{file}", path)
    assert specification is not None
    assert specification.loader is not None
    module = importlib.util.module_from_spec(specification)
    sys.modules[specification.name] = module  # where its dataclasses look their annotations up
    specification.loader.exec_module(module)
    return module


def call(name: str, monkeypatch: pytest.MonkeyPatch, *arguments: object) -> None:
    """Run an experiment as its command does."""
    monkeypatch.setattr(sys, "argv", ["run.py", *map(str, arguments)])
    tyro.cli(script(name).main)
