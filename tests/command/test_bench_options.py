"""What a robot brings to the benchmarks of it."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from helpers.run_json import run_json


def test_it_brings_its_number_of_regulators(
    leg: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Designs that were drawn once had a third regulator."""
    found = run_json(
        f"bench engine --part {leg} --physics.regulator-count 2 --robot-count 3 --action-count 1 "
        f"--action-steps 5 --settling-steps 1 --threads 1 --out {tmp_path / 'out'}",
        capsys,
    )
    assert found["robots"] == 3


def test_a_whole_robots_gait_has_as_many(asked: Callable[[str], Any]) -> None:
    options = asked("bench full --physics.regulator-count 4")
    assert options.expert.regulator_count == options.space.regulator_count == 4
    usual = asked("bench full")
    assert usual.expert.regulator_count == usual.space.regulator_count == 3
    assert (usual.benchmark.maximum_kPa, usual.expert.amplitude_kPa) == (90.0, 45.0)
