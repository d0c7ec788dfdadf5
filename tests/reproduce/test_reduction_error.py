"""Variants of the measured leg beside its finite elements."""

from __future__ import annotations

import json
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pytest
from helpers.experiment_scripts import script

from pneumorph.base.run_folder import RunFolder
from pneumorph.catalogue.robot_options import RobotOptions


def test_every_point_are_all_points_of_the_solid() -> None:
    """Their measures are its volume, and the sampled ones are among them."""
    module, spec = script("reduction_error"), RobotOptions().spec()
    part, usual = spec.module.full, spec.module.reduced
    every = module.reduced(spec.module, module.Variant(every_point=True))
    assert every.tetrahedron_measure.sum() == pytest.approx(part.element_groups[0].measure.sum())
    # The file was made on another processor, which rounds sums over ten nodes otherwise.
    every_gradient, gradient = every.tetrahedron_mode_gradient, usual.tetrahedron_mode_gradient
    rounding = 2e-14 * np.abs(gradient).max()
    np.testing.assert_allclose(
        every_gradient[usual.tetrahedron_index], gradient, rtol=0.0, atol=rounding
    )
    alike = usual.tetrahedron_weight * every.tetrahedron_measure[usual.tetrahedron_index]
    np.testing.assert_allclose(usual.tetrahedron_measure, alike, rtol=1e-12)


def test_walks_are_told_by_variant(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """One of the walks that ship, and the learned robots in one world."""
    module = script("reduction_error")
    usual = module.walks()
    few = {"animations": usual["animations"][2:], "heldout": [], "periodic": []}
    monkeypatch.setattr(module, "walks", lambda: few)
    first = module.learned_walks()[:1]
    monkeypatch.setattr(module, "learned_walks", lambda: first)
    module.main(("as it ships", "points that follow the modes"), 1, tmp_path)
    found = json.loads((tmp_path / "walks.json").read_text())
    assert list(found) == ["as it ships", "points that follow the modes"]
    ships, modes = (found[name]["animations"]["six_leg"] for name in found)
    assert ships["full_cm"] == modes["full_cm"]
    assert ships["node_error_mm"] < modes["node_error_mm"] < 1.0
    for told in found.values():
        assert len(told["worlds"]) == 7
        assert all(10.0 < own["median_cm"] < 60.0 for own in told["worlds"].values())
        assert [each["full"] for each in told["learned"].values()] == [29.95]
        assert all(20.0 < each["reduced"] < 40.0 for each in told["learned"].values())


def test_learned_robots_are_those_of_the_pages() -> None:
    """As they ship they achieve what the page and reproduce/long_trainings say of their reduced
    robots; another processor rounds otherwise, which moves them by hundredths of a centimetre."""
    module, said = (
        script("reduction_error"),
        {"long_trainings/seed_1/gaits/L1.csv, world 116": 13.71},
    )
    said |= {"reduction_error/rough_ground.csv": 15.25, "robots/earlier_heading.csv": 6.56}
    said["robots/earlier_turning.csv"] = 67.5  # degrees
    known = {each.name: each for each in module.learned_walks()}
    assert len(known) == 11
    with TemporaryDirectory() as work:
        folder = RunFolder(Path(work), "reduction_error")
        for name, reduced in said.items():
            found = known[name].achieved(known[name].spec(), folder)
            assert found == pytest.approx(reduced, abs=1.5 if reduced > 60.0 else 0.3)
