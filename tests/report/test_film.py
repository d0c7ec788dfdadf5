"""Films hold as many frames as they should, show the robots, and refuse what cannot be drawn."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from pneumorph.base.settings import settings_to_dict
from pneumorph.catalogue.leg_kinds import leg_kind
from pneumorph.report.film import FilmSettings, side_by_side, write_film
from pneumorph.report.frame_painter import FramePainter
from pneumorph.report.marker_actor import MarkerActor
from pneumorph.report.physics_words import physics_of_walks
from pneumorph.report.scene import Actor, full_pressure_kPa, paper_shape
from pneumorph.robot.design import Design

SMALL = FilmSettings(width=240, frames_per_second=5)
FROM_ABOVE = FilmSettings(width=480, azimuth_deg=0.0, elevation_deg=90.0)


def test_mp4_has_the_length_of_the_trajectory(make_trajectory, tmp_path: Path) -> None:
    import av

    actors = side_by_side([Actor.of(make_trajectory(), "a"), Actor.of(make_trajectory(), "b")])
    told: list[tuple[int, int]] = []
    path = write_film(
        tmp_path / "f.mp4", actors, SMALL, lambda done, total, _: told.append((done, total))
    )
    with av.open(str(path)) as container:
        frames = [frame.to_ndarray(format="rgb24") for frame in container.decode(video=0)]
    assert len(frames) == 11  # 2 s at 5 frames a second, both ends
    assert frames[0].shape[1] == 240
    assert told[-1] == (11, 11)


def test_the_robot_moves_by_its_distance_at_the_scale_of_the_film(make_trajectory) -> None:
    actor = Actor.of(make_trajectory(speed_mm_per_s=20.0), "a")
    painter = FramePainter([actor], FROM_ABOVE)
    first, last = np.asarray(painter.paint(0.0)), np.asarray(painter.paint(2.0))

    def left_edge(image: np.ndarray) -> int:
        # Legs are coloured, floor and disk and captions are grey.
        coloured = np.ptp(image.astype(int), axis=2) > 40
        return int(np.flatnonzero(coloured.any(axis=0))[0])

    moved_mm = (left_edge(last) - left_edge(first)) / painter.pixels_per_mm
    assert moved_mm == pytest.approx(40.0, abs=1.5 / painter.pixels_per_mm)  # one pixel each end


def test_a_hub_that_no_leg_stands_behind_is_in_the_picture(make_trajectory) -> None:
    """All legs of the robot are on its left side, and nearly all of the hub is to their right."""
    actor = Actor.of(make_trajectory("0.1.1.0.0.0.0.0", speed_mm_per_s=20.0), "a")
    nodes, trajectory = actor.shape.hub_nodes_mm, actor.trajectory
    for azimuth_deg in (0.0, 90.0, 180.0):
        view = FilmSettings(width=240, azimuth_deg=azimuth_deg)
        painter = FramePainter([actor], view, captions=False)
        for turn, place in zip(trajectory.hub_rotation, trajectory.hub_position_mm, strict=True):
            seen = painter._camera.project(nodes @ turn.T + place)[:, :2]
            assert np.all(seen >= -1e-6)
            assert np.all(seen <= np.array(painter.size) + 1e-6)


@pytest.mark.parametrize("upper", [0, 1])
def test_the_nearer_of_two_boxes_is_seen(make_trajectory, upper: int) -> None:
    """From above, whichever leg comes first; areas are those of the boxes at the film's scale."""
    trajectory = make_trajectory()
    corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
    boxes = [corners * [50, 40, 10] + [200, 0, 10], corners * [20, 20, 10] + [200, 0, 60]]
    legs = np.array([boxes[leg == upper] for leg in (0, 1)], dtype=np.float32)
    nodes = np.tile(legs, (21, 1, 1, 1))
    shape = paper_shape(Design.parse("1.2"), len(trajectory.skin_triangles))
    actor = Actor(replace(trajectory, node_positions_mm=nodes), "a", shape)
    painter = FramePainter([actor], FROM_ABOVE, captions=False)
    red, _, blue = np.moveaxis(np.asarray(painter.paint(1.0)).astype(int), 2, 0)
    seen = [(blue - red > 40).sum(), (red - blue > 40).sum()]  # regulator 1 is blue, 2 orange
    area_mm2 = {upper: 40 * 40, 1 - upper: 100 * 80 - 40 * 40}
    for leg in (0, 1):
        # The outlines of both boxes are at most 360 + 160 mm long and may be a pixel off.
        assert seen[leg] / painter.pixels_per_mm**2 == pytest.approx(
            area_mm2[leg], abs=520 / painter.pixels_per_mm
        )


def test_the_path_is_drawn_up_to_now(make_trajectory) -> None:
    actor = Actor.of(make_trajectory(speed_mm_per_s=60.0), "a")
    painter = FramePainter([actor, replace(actor, lane_mm=600.0)], FROM_ABOVE)
    way = np.array([0, 114, 178])  # the colour of the first robot's path; no leg has it
    dark = [
        (np.abs(np.asarray(painter.paint(t)).astype(int) - way).max(axis=2) < 3).sum()
        for t in (0.0, 2.0)
    ]
    assert dark[1] > dark[0]


def test_a_measured_robot_moves_by_its_path(make_trajectory, tmp_path: Path) -> None:
    """A triad of orange, green and blue, 20 mm/s forward; the film is as long as its track."""
    time_s = np.linspace(0.0, 3.0, 31)
    path = np.column_stack([20.0 * time_s, 0.0 * time_s])
    marker = MarkerActor(time_s, path, np.zeros((31, 1)), np.zeros((31, 1)), "real")
    painter = FramePainter([marker], replace(FROM_ABOVE, elevation_deg=60.0))

    def right_edge(image: np.ndarray) -> int:
        red, green, blue = np.moveaxis(image.astype(int), 2, 0)
        return int(np.flatnonzero(((red - blue > 60) & (red > green + 20)).any(axis=0))[-1])

    moved = right_edge(np.asarray(painter.paint(3.0))) - right_edge(np.asarray(painter.paint(0.0)))
    assert moved / painter.pixels_per_mm == pytest.approx(60.0, abs=1.5 / painter.pixels_per_mm)
    both = side_by_side([Actor.of(make_trajectory(), "simulated"), marker])
    with Image.open(write_film(tmp_path / "f.gif", both, SMALL)) as film:
        assert film.n_frames == 16  # 3 s at 5 frames a second, both ends


def test_legs_can_be_coloured_by_pressure(make_trajectory) -> None:
    actor = Actor.of(make_trajectory(), "a")
    slack, full = (actor.colours(frame, "pressure")[0] for frame in (0, 10))
    # 0 and 90 kPa: the ends of cividis, dark blue and yellow.
    np.testing.assert_allclose(slack, [0.0, 0.135, 0.305], atol=0.01)
    np.testing.assert_allclose(full, [0.996, 0.909, 0.218], atol=0.01)


def test_colours_are_full_at_the_highest_pressure_of_all_that_are_shown(make_trajectory) -> None:
    """At 90 kPa or more, whichever robot reaches it."""
    usual = make_trajectory()
    high = replace(usual, regulated_kPa=usual.regulated_kPa * (120.0 / 90.0))
    a, b = Actor.of(usual, "a"), Actor.of(high, "b")
    assert [full_pressure_kPa(each) for each in ([a], [a, b])] == [90.0, 120.0]
    low = Actor.of(replace(usual, regulated_kPa=0.5 * usual.regulated_kPa), "c")
    assert full_pressure_kPa([low]) == 90.0
    for by in ("regulator", "pressure"):
        # At the peaks, and at 90 of 120 kPa.
        np.testing.assert_array_equal(b.colours(10, by), a.colours(10, by))
        assert (a.colours(10, by, 120.0)[0] != a.colours(10, by)[0]).any()
    alone = FramePainter([a], SMALL, captions=False).paint(1.0)
    beside = FramePainter([a], SMALL, captions=False, full_kPa=120.0).paint(1.0)
    assert (np.asarray(alone) != np.asarray(beside)).any()


def test_a_film_names_the_physics_once(make_trajectory) -> None:
    """Below the clock; trajectories of earlier versions do not know theirs."""
    measured = {"settings": settings_to_dict(leg_kind("measured").physics) | {"threads": 2}}
    old, new = make_trajectory(), replace(make_trajectory(), metadata=measured)
    damaged = replace(old, metadata={"settings": {"damping": 3}})
    assert physics_of_walks([old, new, new, damaged]) == "measured physics"
    shape = paper_shape(Design.parse("1.0.0.2.2.0.0.1"), len(old.skin_triangles))
    painters = (FramePainter([Actor(each, "a", shape)], FROM_ABOVE) for each in (new, old))
    told, untold = (np.asarray(painter.paint(0.0)) for painter in painters)
    changed = np.argwhere((told != untold).any(axis=2))
    assert len(changed) > 50
    assert changed.max(axis=0)[0] < 60
    assert changed.max(axis=0)[1] < 240


def test_gif(make_trajectory, tmp_path: Path) -> None:
    actors = [Actor.of(make_trajectory(), "a")]
    with Image.open(write_film(tmp_path / "f.gif", actors, SMALL)) as film:
        assert film.n_frames == 11


@pytest.mark.parametrize("per_second", [15, 30, 50])
def test_a_gif_lasts_as_long_as_its_frames(
    make_trajectory, tmp_path: Path, per_second: int
) -> None:
    """Its frames last whole hundredths of a second, which are cut down neither alone nor in sum."""
    trajectory = make_trajectory()
    short = replace(trajectory, time_s=0.5 * trajectory.time_s)
    settings = FilmSettings(width=160, frames_per_second=per_second)
    with Image.open(write_film(tmp_path / "f.gif", [Actor.of(short, "a")], settings)) as film:
        lasting_ms = 0
        for number in range(film.n_frames):
            film.seek(number)
            lasting_ms += film.info["duration"]
    # Of 1 s, both ends; the sum is rounded once, to 10 ms.
    assert abs(lasting_ms - 1e3 * (per_second + 1) / per_second) <= 5.0


def test_a_gif_of_more_frames_than_viewers_show_is_refused(make_trajectory, tmp_path: Path) -> None:
    settings = replace(SMALL, frames_per_second=60)
    with pytest.raises(ValueError, match=r"has 60 frames per second, expected at most 50 of a GIF"):
        write_film(tmp_path / "f.gif", [Actor.of(make_trajectory(), "a")], settings)


def test_a_trajectory_of_the_skin_alone_gives_the_same_picture(make_trajectory) -> None:
    whole = make_trajectory()
    nodes = np.concatenate([np.full((21, 4, 1, 3), 7e3), whole.node_positions_mm], axis=2)
    inside = replace(whole, node_positions_mm=nodes, skin_triangles=whole.skin_triangles + 1)
    thin = inside.with_skin_only()
    assert thin.node_positions_mm.shape == whole.node_positions_mm.shape
    pictures = [FramePainter([Actor.of(t, "a")], SMALL).paint(1.0) for t in (inside, thin)]
    assert np.array_equal(*pictures)


def test_what_cannot_be_drawn_is_refused(make_trajectory, tmp_path: Path) -> None:
    trajectory = make_trajectory()
    with pytest.raises(ValueError, match="holds no node positions or no skin"):
        Actor.of(replace(trajectory, node_positions_mm=None), "a")
    with pytest.raises(ValueError, match="neither what its robot looks like nor its design"):
        Actor.of(replace(trajectory, metadata={}), "a")
    with pytest.raises(ValueError, match="2 regulators, expected one for each of the 4 legs"):
        Actor(trajectory, "a", paper_shape(Design.parse("1.2"), len(trajectory.skin_triangles)))
    with pytest.raises(ValueError, match=r"ends in '\.avi', expected \.mp4 or \.gif"):
        write_film(tmp_path / "f.avi", [Actor.of(trajectory, "a")])
    with pytest.raises(ValueError, match="at least one robot"):
        FramePainter([])
    with pytest.raises(ValueError, match="speed must be positive, got 0"):
        FilmSettings(speed=0)
    with pytest.raises(ValueError, match="elevation_deg must be above 0 and at most 90, got 0"):
        FilmSettings(elevation_deg=0)  # a buried viewer
