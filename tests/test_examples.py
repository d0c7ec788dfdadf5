"""The examples run, and what they assert holds."""

from __future__ import annotations

import importlib.util
import json
from pathlib import Path

EXAMPLES = Path(__file__).parent.parent / "examples"


def test_from_simulation_to_the_virtual_rig(tmp_path: Path) -> None:
    """The whole path, two trials each; its numbers are asserted by the example itself."""
    specification = importlib.util.spec_from_file_location(
        "sim_to_real", EXAMPLES / "sim_to_real.py"
    )
    assert specification is not None
    assert specification.loader is not None
    example = importlib.util.module_from_spec(specification)
    specification.loader.exec_module(example)
    found = example.main([str(tmp_path), "--trials", "2"])
    for robot in found["robots"].values():
        assert len(robot["distances_cm"]) == 2
        assert robot["spread_cm"] < 3.0
    for name in ("transfer_rewards.png", "transfer_gaits.png"):
        assert (tmp_path / "transfer" / name).stat().st_size > 10_000
    assert found["calibration"]["fit"]["pressure"]["r_squared"] > 0.999
    fitted = json.loads((tmp_path / "calibration" / "calibration.json").read_text())
    assert fitted["source"]["pressure"]["bent"]["name"] == "the published leg that ships"
