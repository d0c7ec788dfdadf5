"""A walk's summary tells that it was not on the ground that it names."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from pneumorph.base.run_folder import RunFolder
from pneumorph.catalogue.paper_robot import paper_robot
from pneumorph.gait.expert_gait import ExpertGait
from pneumorph.physics.ground import Ground, RoughGround
from pneumorph.physics.start_pose import StartPose
from pneumorph.study.simulated_walk import WalkSettings, simulate


def test_a_walk_beyond_the_edges_is_noted(tmp_path: Path) -> None:
    """Starting with its middle beyond its foremost edge and its hind legs on it."""
    usual = paper_robot("published")
    settings = WalkSettings(expert=ExpertGait(duration_s=0.5))
    for x_mm, noted in ((1040.0, True), (0.0, False)):
        physics = replace(
            usual.physics,
            ground=Ground(rough=RoughGround(2.0, 40.0)),
            start=StartPose(x_mm=x_mm),
        )
        folder = RunFolder(tmp_path / f"{x_mm:g}", "test")
        found = simulate(settings, replace(usual, physics=physics), folder)
        told = [note for note in found.notes if "beyond the edges of its ground" in note]
        assert len(told) == noted
