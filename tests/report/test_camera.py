"""The camera is orthographic: its scale is one number, and the floor can be read back."""

from __future__ import annotations

import numpy as np
import pytest

from pneumorph.physics.physics import Physics
from pneumorph.report.camera import fitted_camera

_BOX = np.array([[x, y, z] for x in (-100.0, 200.0) for y in (-80.0, 80.0) for z in (0.0, 50.0)])


def test_everything_is_in_the_image() -> None:
    camera = fitted_camera(_BOX, width=400)
    pixel = camera.project(_BOX)
    assert (pixel[:, :2] > 0).all()
    assert (pixel[:, 0] < camera.width).all()
    assert (pixel[:, 1] < camera.height).all()
    assert camera.height % 2 == 0


def test_lengths_across_the_view_keep_the_scale() -> None:
    camera = fitted_camera(_BOX, width=400, azimuth_deg=30.0)
    ends = camera.project(np.array([[10.0, 5.0, 3.0], [10.0, 5.0, 3.0] + 50.0 * camera.axes[:, 0]]))
    # Exact but for the rounding of doubles.
    assert ends[1, 0] - ends[0, 0] == pytest.approx(50.0 * camera.pixels_per_mm, rel=1e-12)
    assert ends[1, 1] == pytest.approx(ends[0, 1], abs=1e-9)


def test_floor_point_is_the_inverse_of_project() -> None:
    camera = fitted_camera(_BOX, width=400)
    point = np.array([[12.0, -7.0, -13.0], [80.0, 33.0, -13.0]])
    assert camera.floor_point(camera.project(point)[:, :2], -13.0) == pytest.approx(point[:, :2])


def test_higher_is_further_up_and_nearer() -> None:
    camera = fitted_camera(_BOX)
    low, high = camera.project(np.array([[0.0, 0, 0], [0, 0, 10]]))
    assert high[1] < low[1]
    assert high[2] < low[2]


def test_a_diverged_robot_is_refused() -> None:
    with pytest.raises(ValueError, match="did the simulation diverge"):
        fitted_camera(np.array([[np.nan, 0.0, 0.0]]))


@pytest.mark.parametrize("azimuth_deg", [0.0, 12.0, 90.0])
@pytest.mark.parametrize("slope_deg", [10.0, -4.0])
def test_gravity_points_down_in_the_image_of_a_sloped_floor(
    slope_deg: float, azimuth_deg: float
) -> None:
    """The floor's plane is level in the coordinates of a walk, whose gravity leans instead."""
    gravity = Physics(floor_slope_deg=slope_deg).gravity_vector
    camera = fitted_camera(_BOX, azimuth_deg=azimuth_deg, slope_deg=slope_deg)
    right, down, _ = camera.axes.T
    assert gravity @ right == pytest.approx(0.0, abs=1e-9 * np.linalg.norm(gravity))
    # As far down as without a slope.
    assert gravity @ down == pytest.approx(
        np.linalg.norm(gravity) * fitted_camera(_BOX).axes[2, 1] * -1.0, rel=1e-12
    )
