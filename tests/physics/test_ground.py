"""Grounds: drawn, built and read."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from pneumorph.base.settings import settings_from_dict, settings_to_dict
from pneumorph.physics.floor import HeightField, PlaneFloor
from pneumorph.physics.ground import Ground, RoughGround, Steps
from pneumorph.physics.height_grid import HeightGrid
from pneumorph.physics.height_map import HeightMap
from pneumorph.physics.physics import Physics
from pneumorph.physics.start_pose import StartPose

ROUGH = Ground(rough=RoughGround(3.0, 40.0, seed=2))


def test_rough_ground_has_the_roughness_and_the_slopes_that_are_asked_for() -> None:
    """<h^2> = s^2, <h(0) h(d)> = s^2 exp(-d^2 / l^2), <h_x^2> = 2 s^2 / l^2.

    A square of side L has about L^2 / (pi l^2) independent patches, 1000 here, whose squares have a
    relative deviation of sqrt(2): 4.5 % of the mean square and half of that of its root.
    """
    spacing, length = 4.0, 40.0
    heights = RoughGround(3.0, length, seed=5).heights_mm((560, 560), spacing)
    assert heights.std() == pytest.approx(3.0, rel=0.1)
    for shift in (5, 10, 15):
        expected = 9.0 * np.exp(-((shift * spacing / length) ** 2))
        found = np.mean(heights * np.roll(heights, shift, axis=0))
        assert found == pytest.approx(expected, abs=0.2 * 9.0)
    grid = HeightGrid(heights, spacing)
    slopes = grid.nodes[:, :, 1:3] / spacing
    assert slopes.std(axis=(0, 1)) == pytest.approx(3.0 * np.sqrt(2.0) / length, rel=0.1)


def test_a_seed_is_a_surface() -> None:
    one, again, other = (
        RoughGround(1.0, 40.0, seed).heights_mm((60, 50), 5.0) for seed in (1, 1, 2)
    )
    np.testing.assert_array_equal(one, again)
    assert np.abs(one - other).max() > 1.0


def test_steps_rise_one_after_the_other() -> None:
    steps = Steps(rise_mm=8.0, start_mm=100.0, run_mm=20.0, tread_mm=50.0, count=2)
    x = np.array([0.0, 100.0, 110.0, 120.0, 170.0, 180.0, 190.0, 900.0])
    np.testing.assert_allclose(steps.height(x), [0, 0, 4, 8, 8, 12, 16, 16], atol=1e-12)
    grid = Ground(steps=steps).grid()
    # A cubic that begins at a node is the spline's own but for its second derivative's jump of
    # 6 rise / run^2 = 0.12 / mm, which it smooths over a spacing of 5 mm: under d^2 / 12 of it.
    assert np.abs(grid.height(x, 0.0 * x) - steps.height(x)).max() < 0.12 * 25.0 / 12.0


def test_heights_of_map_roughness_and_steps_add_up(tmp_path: Path) -> None:
    hills = np.add.outer(np.linspace(0.0, 2.0, 40), np.linspace(-1.0, 1.0, 50))
    np.save(tmp_path / "hills.npy", hills)
    both = Ground(HeightMap(tmp_path / "hills.npy", mm_per_pixel=5.0), ROUGH.rough, Steps(4.0, 0.0))
    x, y = np.meshgrid(np.linspace(-100, 100, 9), np.linspace(-80, 80, 9))
    alone = [replace(both, rough=RoughGround(), steps=Steps()), replace(both, steps=Steps())]
    mapped, rough = (each.grid().height(x, y) for each in alone)
    rough = rough - mapped
    assert rough.std() > 0.5
    # Splines are linear in their heights.
    stepped = replace(both, rough=RoughGround()).grid().height(x, y) - mapped
    np.testing.assert_allclose(both.grid().height(x, y), mapped + rough + stepped, atol=1e-12)
    assert both.description.startswith("height map hills.npy with roughness of 3 mm")


def test_no_place_is_above_its_tiles_ceiling_or_steeper_than_the_steepest() -> None:
    grid = ROUGH.grid()
    rng = np.random.default_rng(0)
    x, y = rng.uniform(grid.x_mm[0], grid.x_mm[-1], 4000), rng.uniform(-600.0, 600.0, 4000)
    side = grid.tile_cells * grid.spacing_mm
    tiles = [((at - first) // side).astype(int) for at, first in ((x, grid.x_mm[0]), (y, -600.0))]
    height, ceiling = grid.height(x, y), grid.ceilings[tiles[0], tiles[1]]
    assert np.all(height <= ceiling)
    # Of a surface that is alike over 40 mm a tile of 20 mm is not far below its ceiling.
    assert np.mean(ceiling - height) < 3.0
    slope = np.hypot(*grid.gradient(x, y))
    assert slope.max() <= grid.steepest < 2.0 * slope.max()


def test_nodes_are_the_splines_own() -> None:
    """Hermite's polynomial of a cell is the spline there: at its middle, from its corners."""
    grid = ROUGH.grid()
    half = np.array([[0.5, 0.125], [0.5, -0.125]])  # of value and slope at either end
    i, j = 123, 77
    corners = grid.nodes[i : i + 2, j : j + 2].reshape(2, 2, 2, 2)  # last two: by y, by x
    middle = np.einsum("pa,qb,pqba->", half, half, corners)
    at = grid.x_mm[i] + 2.5, grid.y_mm[j] + 2.5
    assert middle == pytest.approx(grid.height(*map(np.array, at)), abs=1e-12)


def test_a_plane_is_a_plane_and_says_nothing_of_a_ground() -> None:
    points = np.zeros((1, 3))
    assert Physics().floor(points) == PlaneFloor(Physics().floor_height_mm)
    assert "ground" not in Physics().described()
    uneven = Physics(ground=ROUGH)
    assert uneven.described()["ground"] == settings_to_dict(ROUGH)
    assert settings_from_dict(Physics, settings_to_dict(uneven)) == uneven


def test_a_ground_above_a_standing_robot_is_lowered_until_it_touches() -> None:
    grid, x = ROUGH.grid(), np.linspace(-200.0, 200.0, 30)
    points = np.column_stack([x, 0.3 * x, np.full(30, -10.0)])
    floor = Physics(ground=ROUGH, floor_height_mm=-10.0).floor(points)
    assert isinstance(floor, HeightField)
    assert floor.gap(points).min() == pytest.approx(0.0, abs=1e-12)
    below = Physics(ground=ROUGH, floor_height_mm=-40.0).floor(points)
    assert below.gap(np.array([[0.0, 0.0, 0.0]]))[0] > 25.0
    assert isinstance(below, HeightField)
    assert below.base_mm == -40.0
    assert grid is ROUGH.grid()


def test_a_file_that_has_changed_is_read_again(tmp_path: Path) -> None:
    import os

    ground, file = Ground(HeightMap(tmp_path / "hills.npy")), tmp_path / "hills.npy"
    told: set[str] = set()
    for number, height in enumerate((1.0, 2.0)):
        np.save(file, np.full((5, 5), height))
        os.utime(file, ns=(number, number))
        assert ground.grid().height(np.zeros(1), np.zeros(1)) == pytest.approx(height)
        told.add(ground.file_identity()["map_digest"])
    assert len(told) == 2
    assert ROUGH.file_identity() == {}


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: RoughGround(-1.0), "roughness_mm must be at least 0, got -1"),
        (
            lambda: Ground(rough=RoughGround(1.0, 10.0)),
            r"rough.correlation_mm is 10, expected at least 4 times spacing_mm, 5",
        ),
        (
            lambda: Ground(steps=Steps(5.0, run_mm=1.0)),
            r"steps.run_mm is 1, expected at least 2 times spacing_mm, 5",
        ),
        (
            lambda: Ground(steps=Steps(8.0, count=20)).grid(),
            r"steps.start_mm 150, run_mm 20, tread_mm 100 and count 20 make steps from 150 to 2450 "
            r"mm along x, expected within the ground, from -1000 to 1000 mm",
        ),
        (
            lambda: Ground(steps=Steps(8.0, 990.0)).grid(),
            r"from 990 to 1010 mm .* length_mm larger",
        ),
        (lambda: Ground(steps=Steps(8.0, -1200.0)).grid(), r"from -1200 to -1180 mm along x, exp"),
        (lambda: replace(ROUGH, length_mm=1e9), "expected at least 4 along each side and at most"),
        (lambda: replace(ROUGH, width_mm=10.0), r"has 400 x 2 cells of spacing_mm 5, expected"),
        (
            lambda: Ground(rough=RoughGround(1.0, 1e6)).grid(),
            r"rough.correlation_mm is 1e\+06, expected at most half of the ground's shorter side",
        ),
    ],
)
def test_grounds_that_cannot_be_are_refused(make, message) -> None:
    with pytest.raises(ValueError, match=message):
        make()


def test_steps_that_a_ground_has_no_room_for_are_refused_where_its_map_is_read(
    tmp_path: Path,
) -> None:
    """They would be missing from the heights and told in the description."""
    np.save(tmp_path / "hills.npy", np.zeros((200, 200)))
    map_of_hills = HeightMap(tmp_path / "hills.npy")
    ground = Ground(map_of_hills, steps=Steps(8.0))
    message = r"physics.ground.steps.start_mm 150.* from -99.5 to 99.5 mm.* the map hills.npy"
    for told in (ground.grid, lambda: ground.floor(-10.0, np.zeros((1, 3)))):
        with pytest.raises(ValueError, match=message):
            told()
    moved = replace(ground, map=replace(map_of_hills, centre_x_mm=70.5))
    assert np.ptp(moved.grid().nodes[..., 0]) == pytest.approx(8.0)  # it ends where the map does
    assert Ground(map_of_hills, steps=Steps(0.0, 5e3)).grid().height(*np.zeros(2)) == 0.0


def test_steps_may_end_where_the_ground_does_and_those_without_a_rise_anywhere() -> None:
    assert np.ptp(Ground(steps=Steps(8.0, 980.0)).grid().nodes[..., 0]) == pytest.approx(8.0)
    assert np.ptp(Ground(steps=Steps(8.0, -1000.0)).grid().nodes[..., 0]) == pytest.approx(8.0)
    assert Ground(steps=Steps(0.0, 5000.0, count=1000)).is_plane
    assert Ground(length_mm=10.0).is_plane


def test_a_start_beyond_the_edges_of_a_map_or_of_roughness_is_refused(tmp_path: Path) -> None:
    """It would be on a level floor while the description tells of the ground."""
    points = np.array([[-50.0, -40.0, 0.0], [60.0, 40.0, 0.0]])
    rough = Physics(ground=ROUGH)
    beyond = replace(rough, start=StartPose(x_mm=1060.0, y_mm=20.0))
    message = (
        r"physics\.start\.x_mm and y_mm put the robot from 1010 to 1120 mm along x and from -20 to "
        r"60 mm along y, .* \(roughness of 3 mm .*\), from -1000 to 1000 mm along x and from -600 "
        r"to 600 mm along y.*physics\.ground\.length_mm"
    )
    with pytest.raises(ValueError, match=message):
        beyond.floor(points)
    with pytest.raises(ValueError, match="from 610 to 690 mm along y"):
        replace(rough, start=StartPose(y_mm=650.0)).floor(points)
    np.save(tmp_path / "hills.npy", np.eye(101))
    hills = replace(rough, ground=Ground(HeightMap(tmp_path / "hills.npy")))
    with pytest.raises(
        ValueError, match=r"from -50 to 50 mm along x.*make the map larger or move it"
    ):
        replace(hills, start=StartPose(x_mm=-120.0)).floor(points)
    # One that stands partly on it meets it; steps go on at both sides.
    replace(rough, start=StartPose(x_mm=1040.0)).floor(points)
    hills.floor(3.0 * points)
    steps = Ground(steps=Steps(8.0))
    replace(beyond, ground=steps, start=StartPose(y_mm=5000.0)).floor(points)


def test_a_walk_off_a_map_or_roughness_is_told_and_no_other() -> None:
    time_s = np.array([0.0, 0.1, 0.2])
    path = np.array([[990.0, 0.0, 9.0], [1000.0, 600.0, 9.0], [1001.0, 0.0, 9.0]])
    note = ROUGH.left_note("L1", time_s, path)
    assert note is not None
    assert note.startswith("L1 was beyond the edges of its ground (roughness of 3 mm")
    assert "from 0.2 s on" in note
    assert ROUGH.left_note("L1", time_s[:2], path[:2]) is None
    assert Ground().left_note("L1", time_s, path) is None
    assert Ground(steps=Steps(8.0)).left_note("L1", time_s, path) is None
