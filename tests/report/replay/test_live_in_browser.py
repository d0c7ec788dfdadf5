"""A robot that is still being simulated appears in the browser frame by frame."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from test_replay_in_browser import PLAYER, ROUNDING_MM, OpenPage, recorded, shown

from pneumorph.catalogue.paper_robot import paper_robot
from pneumorph.gait.expert_gait import ExpertGait
from pneumorph.physics.open_loop_gait import sample_commands
from pneumorph.report.replay.live_replay import LiveReplay, LiveSettings
from pneumorph.simulation.reduced_robot import ReducedRobot
from pneumorph.simulation.rollout import rollout
from pneumorph.trajectory import Trajectory


def _frames(crawl: Trajectory, start: int, stop: int) -> Trajectory:
    arrays: dict[str, Any] = {
        name: value if name == "skin_triangles" else value[start:stop].copy()
        for name, value in crawl.arrays().items()
    }
    return replace(crawl, **arrays)


def test_the_page_shows_every_frame_as_it_comes(crawl: Trajectory, open_page: OpenPage) -> None:
    with LiveReplay("expert", LiveSettings(linger_s=120)) as live:
        live(_frames(crawl, 0, 1))
        page = open_page(live.address)
        page.wait_for_function("pneumorphReplay.players.length === 1")
        assert page.evaluate(f"{PLAYER}.robots[0].frames") == 1
        assert "live" in page.locator(".pr-clock").inner_text()
        # Pieces of a full robot begin with the last frame of the piece before.
        for start, stop in ((0, 5), (4, 10)):
            live(_frames(crawl, start, stop))
        page.wait_for_function(f"{PLAYER}.robots[0].frames === 10")
        # It moves by itself up to the newest frame and waits there.
        page.wait_for_function(f"{PLAYER}.time === {PLAYER}.duration")
        assert np.abs(shown(page) - recorded(crawl)[9]).max() < ROUNDING_MM
        # Colours reach to the highest pressure so far.
        assert page.evaluate(f"{PLAYER}.fullPressure") == 90.0
        higher = _frames(crawl, 10, 16)
        higher.regulated_kPa[-1] = 120.0
        live(higher)
        assert live.finish()
        page.wait_for_function(f"!{PLAYER}.live")
        assert page.evaluate(f"[{PLAYER}.fullPressure, {PLAYER}.stage.fullPressure]") == [120, 120]
    # The server has gone and the page has all it needs.
    page.evaluate(f"{PLAYER}.pause(); {PLAYER}.seek({crawl.time_s[3]})")
    assert np.abs(shown(page) - recorded(crawl)[3]).max() < ROUNDING_MM
    assert page.evaluate(f"{PLAYER}.robots[0].frames") == 16


def test_a_watched_rollout_tells_its_frames_and_is_not_changed_by_it(crawl: Trajectory) -> None:
    told: list[Trajectory] = []
    commands = sample_commands(ExpertGait(phase_deg=60), 0.01, 150)
    robot = paper_robot("published").assembly("1.0.0.2.2.0.0.1")
    watched = rollout(ReducedRobot(robot, watch=told.append), commands, record_every=10)[1]
    for name, value in crawl.arrays().items():
        assert np.array_equal(watched.arrays()[name], value), name
    assert [float(each.time_s[0]) for each in told] == crawl.time_s.tolist()
    nodes = [each.node_positions_mm[0] for each in told if each.node_positions_mm is not None]
    assert np.array_equal(np.array(nodes), crawl.node_positions_mm)
