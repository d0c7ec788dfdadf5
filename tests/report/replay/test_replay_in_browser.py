"""The page in headless Chromium: positions are the trajectory's, and every control works."""

from __future__ import annotations

import io
import os
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pneumorph.base.heading import LEAST_UPRIGHT
from pneumorph.base.settings import settings_to_dict
from pneumorph.environment.goal import Goal
from pneumorph.geometry.pose import rotation_about
from pneumorph.physics.ground import Ground, RoughGround
from pneumorph.physics.physics import Physics
from pneumorph.report.film import side_by_side
from pneumorph.report.marker_actor import MarkerActor
from pneumorph.report.replay.page import page_of, player_of, replay_assets, write_replay
from pneumorph.report.replay.replay_data import ReplaySettings, replay_data
from pneumorph.report.scene import Actor
from pneumorph.trajectory import Trajectory

SETTINGS = ReplaySettings(tolerance_mm=2e-4)
OpenPage = Callable[[Path | str], Any]
PLAYER = "pneumorphReplay.players[0]"
# Beside the tolerance: positions up to 300 mm, coefficients and the pose in single precision.
ROUNDING_MM = SETTINGS.tolerance_mm + 10 * 300 * 2**-24


@pytest.fixture(scope="session")
def replay_file(crawl: Trajectory, tmp_path_factory: pytest.TempPathFactory) -> Path:
    time_s = np.linspace(0.0, 1.5, 31)
    path = np.column_stack([20.0 * time_s, 3.0 * time_s])
    marker = MarkerActor(time_s, path, np.full((31, 2), 30.0), np.full((31, 2), 20.0), "real")
    actors = side_by_side([Actor.of(crawl, "expert"), marker])
    return write_replay(tmp_path_factory.mktemp("replay") / "replay.html", actors, SETTINGS)


def shown(page: Any, robot: int = 0) -> np.ndarray:
    """Node positions read back from the page, (leg, node, 3)."""
    flat = page.evaluate(f"Array.from({PLAYER}.nodePositions({robot}))")
    legs = page.evaluate(f"{PLAYER}.robots[{robot}].legs")
    return np.array(flat).reshape(legs, -1, 3)


def recorded(trajectory: Trajectory) -> np.ndarray:
    nodes = trajectory.with_skin_only().node_positions_mm
    assert nodes is not None
    return nodes


def picture(page: Any) -> np.ndarray:
    """The 3D picture as it stands on the screen, (row, column, 3)."""
    from PIL import Image

    page.evaluate("new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))")
    content = page.locator(".pr-view").screenshot()
    return np.asarray(Image.open(io.BytesIO(content)).convert("RGB")).astype(int)


def test_positions_of_every_frame_are_the_trajectorys(
    crawl: Trajectory, replay_file: Path, open_page: OpenPage
) -> None:
    page = open_page(replay_file)
    for frame in (0, 7, 15):
        page.evaluate(f"{PLAYER}.seek({crawl.time_s[frame]})")
        assert np.abs(shown(page) - recorded(crawl)[frame]).max() < ROUNDING_MM
        point = page.evaluate(f"{PLAYER}.trackedPoint()")
        np.testing.assert_allclose(point, crawl.tracked_point_mm[frame], atol=ROUNDING_MM)
        pressures = page.evaluate(f"{PLAYER}.pressures()")
        np.testing.assert_allclose(pressures, crawl.regulated_kPa[frame], rtol=1e-6)
    assert page.evaluate(f"{PLAYER}.distance()") == pytest.approx(
        crawl.forward_distance_cm, abs=ROUNDING_MM / 10
    )
    assert page.evaluate(f"{PLAYER}.trackedPoint(1)")[:2] == pytest.approx([30.0, 4.5])


@pytest.mark.parametrize("goal", [Goal("turn_right"), Goal("heading", heading_deg=120.0)])
def test_what_is_told_of_a_robot_is_its_goal(
    goal: Goal, crawl: Trajectory, tmp_path: Path, open_page: OpenPage
) -> None:
    """Turns are counted beyond a circle: angles of single precision, 4e-6 degrees, over frames."""
    turns = np.linspace(0.0, 540.0, len(crawl.time_s))
    spun = replace(crawl, hub_rotation=np.stack([rotation_about("z", each) for each in turns]))
    page = open_page(write_replay(tmp_path / "goal.html", [Actor.of(spun, "spun", goal)]))
    frames, player = range(len(turns)), f"{PLAYER}.motions[0]"
    told = [page.evaluate(f"{player}.achieved({frame})") for frame in frames]
    np.testing.assert_allclose(told, goal.along(spun), atol=1e-3)
    page.evaluate(f"{PLAYER}.seek({spun.time_s[-1]})")
    achieved = goal.achieved(spun)
    assert achieved is not None
    assert goal.said(achieved) in page.locator(".pr-view").inner_text()


@pytest.mark.parametrize("axis", ["x", "y"])
def test_a_robot_that_turned_over_has_not_turned(
    axis: str, crawl: Trajectory, tmp_path: Path, open_page: OpenPage
) -> None:
    """Onto its back and further round, and then to the left where it stands again."""
    goal, count = Goal("turn_left"), len(crawl.time_s)
    over = [rotation_about(axis, each) for each in np.linspace(0.0, 360.0, count)]
    back = [rotation_about(axis, each) for each in np.linspace(0.0, 180.0, count)]
    left = [
        rotation_about("z", each) @ tipped
        for each, tipped in zip(np.linspace(0.0, 50.0, count), over, strict=True)
    ]
    walks = [replace(crawl, hub_rotation=np.stack(each)) for each in (back, over, left)]
    assert [goal.achieved(walk) for walk in walks] == pytest.approx([0.0, 0.0, 50.0], abs=1e-9)
    actors = side_by_side([Actor.of(walk, str(n), goal) for n, walk in enumerate(walks)])
    page = open_page(write_replay(tmp_path / "over.html", actors))
    for number, walk in enumerate(walks):
        player = f"{PLAYER}.motions[{number}]"
        told = [page.evaluate(f"{player}.achieved({frame})") for frame in range(count)]
        np.testing.assert_allclose(told, goal.along(walk), atol=1e-3)
    # Between two frames it faces where it did as well.
    for time_s, expected in ((0.5 * (crawl.time_s[7] + crawl.time_s[8]), 0.0),
                             (crawl.time_s[-1], 0.0)):  # fmt: skip
        page.evaluate(f"{PLAYER}.seek({time_s})")
        assert page.evaluate(f"{PLAYER}.motions[0].achieved()") == pytest.approx(expected, abs=1e-3)


def test_the_player_holds_the_heading_from_the_same_tilt_on(
    crawl: Trajectory, tmp_path: Path, open_page: OpenPage
) -> None:
    """Just above it a robot that tips over to the side while it turns is still seen to turn."""
    goal, count = Goal("turn_left"), len(crawl.time_s)
    limit_deg = np.degrees(np.arccos(LEAST_UPRIGHT))
    for lean_deg, expected in ((limit_deg - 0.1, 40.0), (limit_deg + 0.1, 0.0)):
        tipped = rotation_about("x", lean_deg)
        turns = [rotation_about("z", each) @ tipped for each in np.linspace(0.0, 40.0, count)]
        walk = replace(crawl, hub_rotation=np.stack(turns))
        page = open_page(write_replay(tmp_path / "lean.html", [Actor.of(walk, "a", goal)]))
        told = page.evaluate(f"{PLAYER}.motions[0].achieved({count - 1})")
        assert told == pytest.approx(expected, abs=1e-3)
        assert goal.achieved(walk) == pytest.approx(expected, abs=1e-9)


def test_robots_of_several_goals_are_compared_by_their_way_forward(
    crawl: Trajectory, tmp_path: Path, open_page: OpenPage
) -> None:
    goals = (Goal(), Goal("heading", heading_deg=-90.0))
    for chosen, name in ((goals, "forward distance (cm)"), (goals[1:] * 2, "travel to the right")):
        actors = side_by_side([Actor.of(crawl, f"to {each.label}", each) for each in chosen])
        page = open_page(write_replay(tmp_path / f"{len(set(chosen))}.html", actors))
        assert page.evaluate(f"{PLAYER}.chart.way.name").startswith(name)
        far = page.evaluate(f"{PLAYER}.chart.way.of({PLAYER}.motions[1], {len(crawl.time_s) - 1})")
        expected = (Goal() if len(set(chosen)) > 1 else goals[1]).achieved(crawl)
        assert far == pytest.approx(expected, abs=ROUNDING_MM / 10)


def test_positions_between_frames_lie_between_them(
    crawl: Trajectory, replay_file: Path, open_page: OpenPage
) -> None:
    page = open_page(replay_file)
    page.evaluate(f"{PLAYER}.seek({0.5 * (crawl.time_s[9] + crawl.time_s[10])})")
    middle = recorded(crawl)[9:11].mean(axis=0)
    # The pose turns by less than 1e-3 rad a frame, so its chord leaves the arc by 1e-7 of 300 mm;
    # what remains is the product of turn and bend, below a hundredth of the motion.
    moved = np.abs(np.diff(recorded(crawl)[9:11], axis=0)).max()
    assert np.abs(shown(page) - middle).max() < 0.01 * moved + ROUNDING_MM


def test_contact_points_are_the_skin_at_the_floor(
    crawl: Trajectory, replay_file: Path, open_page: OpenPage
) -> None:
    page = open_page(replay_file)
    page.evaluate(f"{PLAYER}.seek(0)")
    points = np.array(page.evaluate(f"Array.from({PLAYER}.contactPoints())")).reshape(-1, 3)
    nodes = recorded(crawl)[0].reshape(-1, 3)
    floor = crawl.metadata["settings"]["floor_height_mm"]
    assert len(points) == (nodes[:, 2] <= floor + 0.2).sum() > 0
    assert points[:, 2].max() <= floor + 0.2 + ROUNDING_MM


def test_a_ground_is_drawn_and_points_that_touch_it_are_told(
    crawl: Trajectory, tmp_path: Path, open_page: OpenPage
) -> None:
    """Between the heights that the page has they are bilinear, and so are these."""
    from scipy.interpolate import RegularGridInterpolator

    ground = settings_to_dict(Ground(rough=RoughGround(6.0, 60.0, seed=4)))
    settings = {**crawl.metadata["settings"], "ground": ground}
    metadata = {**crawl.metadata, "settings": settings, "ground_base_mm": -14.0}
    actor = Actor.of(replace(crawl, metadata=metadata), "on a ground")
    surface = actor.ground
    assert surface is not None
    page = open_page(write_replay(tmp_path / "ground.html", [actor], SETTINGS))
    page.evaluate(f"{PLAYER}.seek(0)")
    points = np.array(page.evaluate(f"Array.from({PLAYER}.contactPoints())")).reshape(-1, 3)
    below = RegularGridInterpolator((surface.x_mm, surface.y_mm), surface.height_mm)
    nodes = recorded(crawl)[0].reshape(-1, 3)
    touching = nodes[:, 2] - below(nodes[:, :2]) <= 0.2
    assert abs(len(points) - touching.sum()) <= 1  # one may be within rounding of the limit
    assert 10 < len(points) < len(nodes)
    uneven = picture(page)
    alone = write_replay(tmp_path / "plane.html", [Actor.of(crawl, "on a plane")], SETTINGS)
    level = picture(open_page(alone))
    assert (uneven != level).any(axis=2).mean() > 0.5  # its slopes are shaded


def test_a_slope_is_told_and_gravity_points_down_the_screen(
    crawl: Trajectory, tmp_path: Path, open_page: OpenPage
) -> None:
    settings = {**crawl.metadata["settings"], "floor_slope_deg": 10.0}
    climb = replace(crawl, metadata={**crawl.metadata, "settings": settings})
    page = open_page(write_replay(tmp_path / "climb.html", [Actor.of(climb, "climb")], SETTINGS))
    assert "floor rising forward by 10 degrees" in page.locator(".pr-legend").inner_text()
    x, _, z = Physics(floor_slope_deg=10.0).gravity_vector
    stage = f"{PLAYER}.stage"
    for view in ("orbit", "side"):
        page.evaluate(f"{PLAYER}.setCamera('{view}')")
        across, up = page.evaluate(
            f"(() => {{ const camera = {stage}.camera; camera.updateMatrixWorld();"
            f" const g = new THREE.Vector3({x}, 0, {z}).normalize()"
            ".transformDirection(camera.matrixWorldInverse); return [g.x, g.y]; })()"
        )
        assert across == pytest.approx(0.0, abs=1e-6)
        assert up < 0.0


def test_robots_are_all_in_view(crawl: Trajectory, tmp_path: Path, open_page: OpenPage) -> None:
    assert crawl.node_positions_mm is not None
    way = np.linspace(0.0, 350.0, len(crawl.time_s))[:, None] * np.array([1.0, 0.0, 0.0])
    far = replace(
        crawl,
        hub_position_mm=crawl.hub_position_mm + way,
        tracked_point_mm=crawl.tracked_point_mm + way,
        node_positions_mm=(crawl.node_positions_mm + way[:, None, None]).astype(np.float32),
    )
    actors = side_by_side([Actor.of(far, "far"), Actor.of(crawl, "near")])
    page = open_page(write_replay(tmp_path / "view.html", actors, SETTINGS))
    page.set_viewport_size({"width": 1250, "height": 600})
    page.evaluate("new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))")
    for view, time_s in ((None, 0.0), (None, 1e3), ("orbit", 0.0), ("top", 1e3), ("side", 1e3)):
        if view is not None:
            page.evaluate(f"{PLAYER}.setCamera('{view}')")
        page.evaluate(f"{PLAYER}.seek({time_s})")
        seen = page.evaluate(
            f"(() => {{ const {{ camera, actors }} = {PLAYER}.stage; camera.updateMatrixWorld();"
            " return actors.flatMap(({ motion }) => { const p = motion.positions, found = [];"
            " for (let i = 0; i < p.length; i += 3) { const at = new THREE.Vector3("
            "p[i], p[i + 1] + motion.robot.lane_mm, p[i + 2]).project(camera);"
            " found.push([at.x, at.y]); } return found; }); })()"
        )
        assert np.abs(seen).max() < 1.0


def test_dragging_the_time_line_moves_the_robot(
    crawl: Trajectory, replay_file: Path, open_page: OpenPage
) -> None:
    page = open_page(replay_file)
    before = picture(page)
    chart = page.locator(".pr-chart").bounding_box()
    x0, x1 = (page.evaluate(f"{PLAYER}.chart.xAt({t})") for t in (0.1, crawl.time_s[12]))
    y = chart["y"] + chart["height"] / 2
    page.mouse.move(chart["x"] + x0, y)
    page.mouse.down()
    page.mouse.move(chart["x"] + x1, y, steps=3)
    page.mouse.up()
    # A pixel of the time line is 2 ms here.
    assert page.evaluate(f"{PLAYER}.time") == pytest.approx(crawl.time_s[12], abs=0.004)
    page.evaluate(f"{PLAYER}.seek({crawl.time_s[12]})")
    assert np.abs(shown(page) - recorded(crawl)[12]).max() < ROUNDING_MM
    after = picture(page)
    coloured = np.ptp(after, axis=2) > 40  # legs; floor, disk and words are grey
    assert coloured.mean() > 0.003
    assert (np.abs(after - before).max(axis=2) > 30).mean() > 0.001
    page.locator(".pr-slider").press("Home")
    assert page.evaluate(f"{PLAYER}.time") == 0.0


def test_play_pause_step_and_speed(replay_file: Path, open_page: OpenPage) -> None:
    page = open_page(replay_file)
    page.get_by_label("speed").select_option("0.1")
    page.get_by_role("button", name="Play").click()
    page.wait_for_function(f"{PLAYER}.time > 0.02")
    page.get_by_role("button", name="Pause").click()
    paused = page.evaluate(f"{PLAYER}.time")
    assert 0.02 < paused < 1.5
    page.wait_for_timeout(200)
    assert page.evaluate(f"{PLAYER}.time") == paused
    page.evaluate(f"{PLAYER}.seek(0.52)")
    for name, expected in (("forward", 0.6), ("forward", 0.7), ("back", 0.6)):
        page.get_by_role("button", name=f"One frame {name}").click()
        assert page.evaluate(f"{PLAYER}.time") == pytest.approx(expected, abs=1e-6)
    page.evaluate(f"{PLAYER}.seek(0.52)")
    page.get_by_role("button", name="One frame back").click()
    assert page.evaluate(f"{PLAYER}.time") == pytest.approx(0.5, abs=1e-6)
    page.get_by_label("speed").select_option("8")
    page.get_by_role("button", name="Play").click()
    page.wait_for_function(f"{PLAYER}.time === {PLAYER}.duration && !{PLAYER}.playing")


@pytest.mark.alone
@pytest.mark.skipif(
    os.getloadavg()[0] > 1.5 * (os.cpu_count() or 1), reason="other programs have the processors"
)
def test_six_legs_for_20_s_are_small_and_drawn_30_times_a_second(
    crawl: Trajectory, tmp_path: Path, open_page: OpenPage
) -> None:
    """The six legs are those of the walk, two of them twice, at 201 instants of it."""
    frame = np.arange(201) % len(crawl.time_s)
    drawn = ("skin_triangles", "node_positions_mm", "contact_force_mN", "contact_velocity_mm_per_s")
    arrays = {name: value[frame] for name, value in crawl.arrays().items() if name not in drawn}
    six = [0, 1, 2, 3, 0, 1]
    nodes = recorded(crawl)[frame][:, six]
    shape = {n: v[six] for n, v in vars(crawl.shape).items() if n.startswith("leg_")}
    skin = crawl.with_skin_only().skin_triangles
    long = replace(
        crawl,
        **{**arrays, "time_s": 0.1 * np.arange(201)},
        node_positions_mm=nodes,
        skin_triangles=skin,
        contact_force_mN=None,
        contact_velocity_mm_per_s=None,
        shape=replace(crawl.shape, **shape),
        metadata={},
    )
    file = write_replay(tmp_path / "six.html", [Actor.of(long, "six")])
    assert file.stat().st_size < 15e6
    page = open_page(file)
    # The best of some windows: the first ones settle how fine the picture can be.
    rates = [page.evaluate(f"{PLAYER}.frameRate(2)") for _ in range(5)]
    assert max(rates) > 30.0


def test_colours_are_full_at_the_highest_pressure_also_of_a_frame_that_is_left_out(
    crawl: Trajectory, tmp_path: Path, open_page: OpenPage
) -> None:
    pressures = crawl.regulated_kPa.copy()
    pressures[6, 0] = 120.0  # at 0.6 s, between two kept frames
    actors = [Actor.of(replace(crawl, regulated_kPa=pressures), "a")]
    settings = ReplaySettings(frame_interval_s=0.4)
    page = open_page(write_replay(tmp_path / "replay.html", actors, settings))
    page.get_by_label("colour").select_option("pressure")
    assert "0 to 120 kPa" in page.locator(".pr-legend").inner_text()


def test_cameras_and_colours_change_the_picture(replay_file: Path, open_page: OpenPage) -> None:
    page = open_page(replay_file)
    page.evaluate(f"{PLAYER}.seek(1.5)")
    seen = {"orbit": picture(page)}
    for camera in ("top", "side", "follow"):
        page.get_by_label("camera").select_option(camera)
        seen[camera] = picture(page)
    for camera in ("top", "side", "follow"):
        assert (np.abs(seen[camera] - seen["orbit"]).max(axis=2) > 30).mean() > 0.005
    page.get_by_label("colour").select_option("pressure")
    assert "90 kPa" in page.locator(".pr-legend").inner_text()
    by_pressure = picture(page)
    assert (np.abs(by_pressure - seen["follow"]).max(axis=2) > 30).mean() > 0.002


def test_some_of_many_robots_can_be_mounted(
    crawl: Trajectory, tmp_path: Path, open_page: OpenPage
) -> None:
    """As the explorer does: one set of data, players made and disposed of."""
    data = replay_data([Actor.of(crawl, f"robot {i}") for i in range(3)])
    file = tmp_path / "page.html"
    file.write_text(f"<!doctype html><meta charset=utf-8>{replay_assets()}<div id=a></div>")
    page = open_page(file)
    page.evaluate("(data) => { window.data = data; }", data)
    mount = "pneumorphReplay.mount(document.getElementById('a'), data, {robots: [%d]})"
    for robot in (2, 1):
        page.evaluate(f"{{ {mount % robot}; }}")
        labels = page.evaluate(f"{PLAYER}.robots.map((each) => each.label)")
        assert labels == [f"robot {robot}"]
        page.evaluate(f"{PLAYER}.dispose()")
    assert page.evaluate("pneumorphReplay.players.length") == 0


def test_a_page_without_webgl_still_tells_positions(
    crawl: Trajectory, replay_file: Path, open_page: OpenPage, tmp_path: Path
) -> None:
    broken = (
        "<script>HTMLCanvasElement.prototype.getContext = ((real) => function (kind, ...rest) {"
    )
    broken += "return kind.startsWith('webgl') || kind.startsWith('experimental') ? null"
    broken += " : real.call(this, kind, ...rest); })(HTMLCanvasElement.prototype.getContext);"
    broken += "console.error = () => {};</script>"
    file = tmp_path / "page.html"
    file.write_text(replay_file.read_text().replace("<head>", f"<head>{broken}", 1))
    page = open_page(file)
    assert "no 3D" in page.locator(".pr-labels").inner_text()
    page.evaluate(f"{PLAYER}.seek({crawl.time_s[5]})")
    assert np.abs(shown(page) - recorded(crawl)[5]).max() < ROUNDING_MM


def test_a_page_needs_data_of_its_version(tmp_path: Path, open_page: OpenPage) -> None:
    file = tmp_path / "page.html"
    file.write_text(page_of("empty", "<div id=a></div>"))
    page = open_page(file)
    message = page.evaluate(
        "(() => { try { pneumorphReplay.mount(document.getElementById('a'), {}); }"
        " catch (error) { return error.message; } })()"
    )
    assert message.startswith("not replay data of version 2")


def test_a_page_may_hold_the_player_twice(
    crawl: Trajectory, tmp_path: Path, open_page: OpenPage
) -> None:
    """As two cells of a notebook do; an error of a script fails the fixture that opens the page."""
    fragment = replay_assets() + player_of(replay_data([Actor.of(crawl, "a")], SETTINGS))
    path = tmp_path / "twice.html"
    path.write_text(f"<meta charset='utf-8'>{fragment}{fragment}")
    page = open_page(path)
    assert page.evaluate("pneumorphReplay.players.length") == 2
    page.evaluate(f"pneumorphReplay.players[1].seek({crawl.time_s[7]})")
    flat = page.evaluate("Array.from(pneumorphReplay.players[1].nodePositions(0))")
    assert np.abs(np.array(flat) - recorded(crawl)[7].ravel()).max() < ROUNDING_MM
