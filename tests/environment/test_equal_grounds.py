"""Designs are one, or each other's images, only on a floor that does not tell them apart."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from pneumorph.environment.equal_grounds import check_equal_grounds, roughness_note
from pneumorph.physics.ground import Ground, RoughGround, Steps
from pneumorph.physics.height_map import HeightMap
from pneumorph.physics.physics import Physics
from pneumorph.physics.start_pose import StartPose
from pneumorph.robot.design_space import DesignSpace

SPACE = DesignSpace(location_count=4, maximum_legs=4)
TURNED = replace(SPACE, mirror="none", symmetries=("1 2 3 0",))
ALONE = replace(SPACE, mirror="none")
STEPS = Ground(steps=Steps(rise_mm=8.0))
ROUGH = Ground(rough=RoughGround(3.0))


def map_of(folder: Path, grey: np.ndarray) -> Physics:
    """A map of 10 mm to a pixel, its rows from +y to -y."""
    file = folder / "map.png"
    Image.fromarray(grey.astype(np.uint8)).save(file)
    return Physics(ground=Ground(map=HeightMap(path=file, mm_per_pixel=10.0)))


@pytest.fixture
def ridge() -> np.ndarray:
    """Along the forward axis, highest in the middle and ahead."""
    y, x = np.mgrid[-20:21, -30:31]
    grey: np.ndarray = 150.0 * np.exp(-(y**2) / 50.0) + x + 30
    return grey


@pytest.mark.parametrize(
    ("physics", "said"),
    [
        (Physics(floor_slope_deg=10.0), "slope of 10 degrees"),
        (Physics(ground=STEPS), "steps"),
    ],
)
def test_what_lies_forward_is_elsewhere_for_what_is_turned(physics: Physics, said: str) -> None:
    with pytest.raises(ValueError, match=f"under '1 2 3 0', .* has a {said}"):
        check_equal_grounds(TURNED, physics)
    for space in (SPACE, replace(SPACE, symmetries=("mirror",)), ALONE):
        check_equal_grounds(space, physics)
    check_equal_grounds(TURNED, Physics())


def test_a_map_must_be_its_own_image_about_where_robots_start(
    tmp_path: Path, ridge: np.ndarray
) -> None:
    physics = map_of(tmp_path, ridge)
    check_equal_grounds(SPACE, physics)
    with pytest.raises(ValueError, match="height map, which is somewhere else"):
        check_equal_grounds(TURNED, physics)
    beside = replace(physics, start=StartPose(y_mm=50.0))
    with pytest.raises(ValueError, match=r"differs by up to [45]\.\d+ mm .* \(y = 50 mm\)"):
        check_equal_grounds(SPACE, beside)
    check_equal_grounds(ALONE, beside)
    ridge[:15] += 40.0
    with pytest.raises(ValueError, match=r"differs by up to 1\.\d+ mm"):
        check_equal_grounds(replace(SPACE, symmetries=("mirror",)), map_of(tmp_path, ridge))


def test_roughness_on_a_map_does_not_count(tmp_path: Path, ridge: np.ndarray) -> None:
    """The surface that is drawn was taken for the map's difference."""
    physics = map_of(tmp_path, ridge)
    rough = RoughGround(3.0, 60.0)
    check_equal_grounds(SPACE, replace(physics, ground=replace(physics.ground, rough=rough)))
    ridge[:15] += 40.0
    physics = map_of(tmp_path, ridge)
    with pytest.raises(ValueError, match=r"differs by up to 1\.\d+ mm"):
        check_equal_grounds(SPACE, replace(physics, ground=replace(physics.ground, rough=rough)))


def test_one_rough_surface_for_all_is_told() -> None:
    physics = Physics(ground=ROUGH)
    check_equal_grounds(SPACE, physics)
    told = roughness_note(SPACE, physics, redrawn=False)
    assert told is not None
    assert told.startswith("all robots walk on one rough surface")
    assert roughness_note(TURNED, physics, redrawn=False) == told
    assert roughness_note(SPACE, physics, redrawn=True) is None
    assert roughness_note(ALONE, physics, redrawn=False) is None
    assert roughness_note(SPACE, Physics(ground=STEPS), redrawn=False) is None


@pytest.mark.parametrize("covered_aside", [0, 8])
def test_what_lies_beyond_the_nearer_edge_of_a_map_counts(
    tmp_path: Path, ridge: np.ndarray, covered_aside: int
) -> None:
    """Bumps to the left alone: to the right the map ends before it has been as far, and goes on
    level. Of 10 mm to a pixel so many are there; robots start at the edge where none is."""
    grey = np.zeros((31 + covered_aside, 41))
    grey[:20] = ridge[:20, :41]  # rows from +y, 80 mm and more to the left of the start
    physics = map_of(tmp_path, grey)
    off_centre = replace(physics.ground.map, centre_y_mm=10.0 * (30 - covered_aside) / 2.0)
    physics = replace(physics, ground=Ground(map=off_centre))
    grid = physics.ground.grid()
    assert grid.y_mm[0] == pytest.approx(-10.0 * covered_aside)
    assert np.ptp(grid.height(grid.x_mm, np.full(41, 70.0))) < 0.1
    with pytest.raises(ValueError, match="between the left and the right of where robots start"):
        check_equal_grounds(SPACE, physics)
    check_equal_grounds(ALONE, physics)
