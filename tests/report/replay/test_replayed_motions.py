"""What a replay is told of recorded files: their names, and the physics that they walked in."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from pneumorph.base.run_folder import RunFolder
from pneumorph.base.settings import settings_to_dict
from pneumorph.hardware.marker_track import VideoSettings
from pneumorph.physics.physics import Physics
from pneumorph.report.replay.replayed_motions import motion, replay_motions
from pneumorph.trajectory import Trajectory

FAST = Physics(friction=0.3)


@pytest.mark.parametrize("name", ["trajectory.npz", "other.npz"])
@pytest.mark.parametrize("label", ["", "mine"])
def test_a_robot_is_told_with_its_physics(
    name: str, label: str, crawl: Trajectory, tmp_path: Path
) -> None:
    """A file of a run by the run's folder, any other by its own name."""
    known = replace(crawl, metadata={**crawl.metadata, "settings": settings_to_dict(FAST)})
    folder = tmp_path / "run"
    known.save(folder / name)
    path = folder if name == "trajectory.npz" else folder / name
    shown = motion(f"{label}={path}" if label else str(path), VideoSettings())
    named = label or path.stem
    assert shown.label == f"{named}\npublished physics but for friction"
    made = replay_motions([shown], RunFolder(tmp_path / "out", "replay"))
    assert made.robots == (named,)
    page = Path(made.page).read_text()
    assert f"<title>{named}, published physics but for friction</title>" in page


def test_a_robot_of_unknown_physics_is_told_by_its_name(crawl: Trajectory, tmp_path: Path) -> None:
    replace(crawl, metadata={"design": "1.0.0.2.2.0.0.1"}).save(tmp_path / "walk.npz")
    assert motion(str(tmp_path / "walk.npz"), VideoSettings()).label == "walk"
