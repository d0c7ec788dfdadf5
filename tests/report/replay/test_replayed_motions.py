"""What a replay is told of recorded files: their names, designs, and the physics of their walks."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pneumorph.base.run_folder import RunFolder
from pneumorph.base.settings import settings_to_dict
from pneumorph.hardware.marker_track import VideoSettings
from pneumorph.physics.physics import Physics
from pneumorph.report.marker_actor import MarkerActor
from pneumorph.report.replay.replayed_motions import motion, replay_motions
from pneumorph.report.scene import Actor
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
    assert shown.label == named
    made = replay_motions([shown], RunFolder(tmp_path / "out", "replay"))
    assert made.robots == (named,)
    page = Path(made.page).read_text()
    design = crawl.metadata["design"]
    assert f"<title>{named}, {design}, published physics but for friction</title>" in page
    assert f'{{"told":"{design}, published physics but for friction"}});' in page


def test_a_robot_of_unknown_physics_is_told_by_its_name(crawl: Trajectory, tmp_path: Path) -> None:
    replace(crawl, metadata={"design": "1.0.0.2.2.0.0.1"}).save(tmp_path / "walk.npz")
    assert motion(str(tmp_path / "walk.npz"), VideoSettings()).label == "walk"


def labels(page: str) -> list[str]:
    """Those of a page's robots."""
    return [json.loads(each) for each in re.findall(r'"label":("(?:[^"\\]|\\.)*"),"lane_mm"', page)]


def test_what_all_robots_share_is_said_once_and_the_rest_beside_each(
    crawl: Trajectory, tmp_path: Path
) -> None:
    def walked(design: str, physics: Physics) -> Actor:
        metadata = {"design": design, "settings": settings_to_dict(physics)}
        return Actor.of(replace(crawl, metadata=metadata), f"robot {design}")

    def page(*motions: Actor | MarkerActor) -> str:
        return Path(replay_motions(motions, RunFolder(tmp_path, "replay")).page).read_text()

    one, other = "1.0.0.2.2.0.0.1", "1.0.0.3.3.0.0.1"
    marker = MarkerActor(np.arange(2.0), np.zeros((2, 2)), *[np.ones((2, 1))] * 2, "real")
    said = page(walked(one, FAST), walked(other, FAST), marker)
    assert labels(said) == [f"robot {one}\n{one}", f"robot {other}\n{other}", "real"]
    assert '{"told":"published physics but for friction"}' in said
    assert said.count("but for friction") == 2  # in its title too
    said = page(walked(one, FAST), walked(one, Physics()))
    assert labels(said) == [
        f"robot {one}\npublished physics but for friction",
        f"robot {one}\npublished physics",
    ]
    assert f'{{"told":"{one}"}}' in said
    said = page(marker)
    assert labels(said) == ["real"]
    assert '"told"' not in said


@pytest.mark.parametrize("spacing_mm", [0.0, 10.0, 340.0])
def test_labels_do_not_cover_each_other(
    spacing_mm: float, crawl: Trajectory, tmp_path: Path, open_page: Callable[[Path], Any]
) -> None:
    """Of robots on top of each other, or behind each other in a side view; the first is on top."""
    motions = [Actor.of(crawl, f"robot {number}") for number in range(3)]
    made = replay_motions(motions, RunFolder(tmp_path, "replay"), spacing_mm=spacing_mm)
    page = open_page(Path(made.page))
    assert "published physics" in page.locator(".pr-legend").inner_text()
    for camera in ("orbit", "side"):
        page.evaluate(f"pneumorphReplay.players[0].setCamera('{camera}')")
        page.evaluate(
            "new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))"
        )
        boxes = [each.bounding_box() for each in page.locator(".pr-labels div").all()]
        assert len(boxes) == 3
        for upper, lower in pairwise(boxes):
            assert upper["y"] + upper["height"] <= lower["y"] + 0.5
    page.evaluate("pneumorphReplay.players[0].seek(1.5)")
    assert "ended" not in page.locator(".pr-labels").inner_text()


def test_a_player_says_that_a_walk_was_over(
    crawl: Trajectory, tmp_path: Path, open_page: Callable[[Path], Any]
) -> None:
    longer = replace(crawl, time_s=2.0 * crawl.time_s)
    motions = [Actor.of(crawl, "short"), Actor.of(longer, "long")]
    page = open_page(Path(replay_motions(motions, RunFolder(tmp_path, "replay")).page))
    for time_s, ended in ((1.5, False), (2.0, True)):
        page.evaluate(f"pneumorphReplay.players[0].seek({time_s})")
        short, long = (each.inner_text() for each in page.locator(".pr-labels div").all())
        assert short.endswith("cm, ended at 1.5 s") == ended
        assert "ended" not in long
