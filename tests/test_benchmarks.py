"""The developers' measurements run."""

from __future__ import annotations

import importlib.util
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from helpers.synthetic_part import synthetic_reduced_part

SCRIPT = Path(__file__).parent.parent / "benchmarks" / "engine_profile.py"


def test_the_engine_is_profiled_with_one_thing_varied_at_a_time(tmp_path: Path) -> None:
    specification = importlib.util.spec_from_file_location("engine_profile", SCRIPT)
    assert specification is not None
    assert specification.loader is not None
    script = importlib.util.module_from_spec(specification)
    specification.loader.exec_module(script)
    part = synthetic_reduced_part(mode_count=6, cells=(6, 4, 4))
    part = replace(part, snapshot_range=np.eye(6))  # each array that has modes is cut
    path = part.save(tmp_path / "leg.npz")
    script.main(tmp_path, robots=(1, 2), legs=(3,), modes=(2, 4), batch=2, threads=1, part=path)
    rows = json.loads((tmp_path / "engine_profile.json").read_text())["rows"]
    assert [(row["axis"], row["value"]) for row in rows] == [
        ("robots", 1), ("robots", 2), ("legs", 3), ("modes", 2), ("modes", 4), ("threads", 1),
    ]  # fmt: skip
    assert all(row["stage_us"]["elements"] > 0 for row in rows)
    assert rows[2]["mean_legs"] == 3
    assert (tmp_path / "engine_profile.png").stat().st_size > 1000
    # The part that costs less is the whole one with its last modes at rest.
    cut = script.with_first_modes(part, 4)
    assert cut.positions([0.1, 0.2, 0.0, 0.3]) == pytest.approx(
        part.positions([0.1, 0.2, 0.0, 0.3, 0.0, 0.0]), abs=1e-10
    )
