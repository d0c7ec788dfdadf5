"""What a page is told of robots gives back their trajectories."""

from __future__ import annotations

import base64
from dataclasses import replace

import numpy as np
import pytest

from pneumorph.catalogue.leg_kinds import load_default_leg
from pneumorph.report.film import side_by_side
from pneumorph.report.marker_actor import MarkerActor
from pneumorph.report.replay.page import replay_fragment, script_json
from pneumorph.report.replay.replay_data import ReplaySettings, replay_data
from pneumorph.report.scene import Actor
from pneumorph.trajectory import Trajectory


def _decoded(text: str, width: int) -> np.ndarray:
    return np.frombuffer(base64.b64decode(text), dtype="<f4").reshape(-1, width)


def test_legs_of_all_reduced_robots_share_the_modes_of_the_reduced_leg(
    crawl: Trajectory,
) -> None:
    actors = side_by_side([Actor.of(crawl, "a"), Actor.of(crawl, "b")])
    # Positions of 300 mm are known to 2^-24 of that; a few roundings.
    data = replay_data(actors, ReplaySettings(tolerance_mm=8 * 300 * 2**-24))
    (basis,) = data["bases"]
    assert basis["mode_count"] <= load_default_leg("published").mode_count
    assert [robot["lane_mm"] for robot in data["robots"]] == [340.0, 0.0]
    for robot in data["robots"]:
        assert robot["frames"] == len(crawl.time_s)
        assert robot["largest_error_mm"] <= 8 * 300 * 2**-24


def test_frames_can_be_thinned_and_the_last_stays(crawl: Trajectory) -> None:
    data = replay_data([Actor.of(crawl, "a")], ReplaySettings(frame_interval_s=0.4))
    times = _decoded(data["robots"][0]["time_s"], 1)[:, 0]
    np.testing.assert_allclose(times, [0.0, 0.4, 0.8, 1.2, 1.5], atol=1e-6)
    pressures = _decoded(data["robots"][0]["regulated_kPa"], 3)
    np.testing.assert_allclose(pressures, crawl.regulated_kPa[[0, 4, 8, 12, 15]], rtol=1e-6)


def test_a_robot_whose_design_is_not_known_is_shown_all_the_same(crawl: Trajectory) -> None:
    nameless = replace(crawl, metadata={})
    data = replay_data([Actor.of(nameless, "a")])
    assert data["robots"][0]["regulators"] == [[1], [2], [2], [1]]
    assert data["robots"][0]["floor_mm"] is None
    assert data["robots"][0]["largest_error_mm"] <= 0.01


def test_a_floor_that_is_no_plane_has_no_height(crawl: Trajectory) -> None:
    def floor(description: str) -> float | None:
        metadata = {**crawl.metadata, "contact": {"floor": description}}
        robot = replay_data([Actor.of(replace(crawl, metadata=metadata), "a")])["robots"][0]
        height: float | None = robot["floor_mm"]
        return height

    assert floor("plane at -12.797 mm") == -12.797
    assert floor("height map of 3 x 3") is None


def test_a_measured_robot_is_its_path(crawl: Trajectory) -> None:
    time_s = np.array([0.0, 1.0, 3.0])
    path = np.array([[0.0, 0.0], [5.0, 1.0], [9.0, -1.0]])
    marker = MarkerActor(time_s, path, np.ones((3, 2)), np.zeros((3, 2)), "real")
    real = replay_data(side_by_side([Actor.of(crawl, "simulated"), marker]))["robots"][1]
    assert real["kind"] == "measured"
    np.testing.assert_allclose(_decoded(real["tracked_mm"], 3)[:, :2], path)


def test_what_cannot_be_replayed_is_refused(crawl: Trajectory) -> None:
    with pytest.raises(ValueError, match="at least one robot"):
        replay_data([])
    with pytest.raises(ValueError, match="tolerance_mm must be positive, got -1"):
        ReplaySettings(tolerance_mm=-1)
    with pytest.raises(ValueError, match="frame_interval_s must be at least 0, got -1"):
        ReplaySettings(frame_interval_s=-1)
    nodes = np.array(crawl.node_positions_mm)
    nodes[3] = np.nan
    with pytest.raises(ValueError, match="the simulation diverged"):
        replay_data([Actor.of(replace(crawl, node_positions_mm=nodes, status="diverged"), "a")])
    path = np.zeros((2, 2))
    with pytest.raises(ValueError, match=r"shape \(2, 2\), expected \(3, 2\)"):
        MarkerActor(np.arange(3.0), path, np.ones((3, 1)), np.ones((3, 1)), "real")
    with pytest.raises(ValueError, match="commanded_kPa of 'real' has 1 frames, expected 2"):
        MarkerActor(np.arange(2.0), path, np.ones((1, 1)), np.ones((2, 1)), "real")


def test_a_label_cannot_end_the_script_it_stands_in(crawl: Trajectory) -> None:
    assert "</script>" not in script_json({"label": "</script><b>"})
    assert replay_fragment([Actor.of(crawl, "</script>")]).count("</script>") == 1
