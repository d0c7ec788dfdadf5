"""Boxes and cones against closed forms."""

from __future__ import annotations

import numpy as np
import pytest

from pneumorph.geometry.mass_properties import MassProperties
from pneumorph.geometry.simple_solids import ROUND_SEGMENTS, box_solid, cone_solid
from pneumorph.geometry.surface import surface_area


def test_a_box_has_its_volume_surface_and_inertia() -> None:
    a, b, c = 120.0, 70.0, 20.0
    box = box_solid(a, b, c, 30.0)
    assert box.volumes.sum() == pytest.approx(a * b * c, rel=1e-12)
    skin = box.surfaces["skin"]
    assert surface_area(box.nodes, skin) == pytest.approx(2 * (a * b + b * c + c * a), rel=1e-12)
    body = MassProperties.of_tetrahedra(box.nodes, box.tetrahedra, 2.0)
    np.testing.assert_allclose(body.centre_mm, [0.0, 0.0, 40.0], atol=1e-9)
    expected = body.mass_kg / 12.0 * np.diag([b * b + c * c, a * a + c * c, a * a + b * b])
    np.testing.assert_allclose(body.inertia, expected, atol=1e-9 * np.trace(expected))


def test_a_disk_has_the_volume_of_a_round_one() -> None:
    """Its polygon has the circle's area; its polar moment is (2 + cos a) a / (3 sin a) times the
    circle's, with a = 2 pi / corners: 1 + a^4 / 180 and higher powers."""
    radius, height = 50.0, 12.0
    disk = cone_solid(radius, radius, height, -3.0)
    assert disk.volumes.sum() == pytest.approx(np.pi * radius**2 * height, rel=1e-12)
    body = MassProperties.of_tetrahedra(disk.nodes, disk.tetrahedra, 1.0)
    corner = 2.0 * np.pi / ROUND_SEGMENTS
    polar = 0.5 * body.mass_kg * radius**2
    assert body.inertia[2, 2] == pytest.approx(polar, rel=corner**4 / 90.0)
    cone = cone_solid(40.0, 60.0, height, 0.0)
    assert cone.volumes.sum() == pytest.approx(
        np.pi * height / 3.0 * (40.0**2 + 40.0 * 60.0 + 60.0**2), rel=1e-12
    )


def test_a_shell_is_the_limit_of_thin_walls() -> None:
    """A box's outside less its inside, with walls of t: mass and inertia of the thin shell differ
    by the share of t in the smallest size."""
    outside, wall = box_solid(80.0, 60.0, 40.0, 0.0), 0.01
    inside = box_solid(80.0 - 2 * wall, 60.0 - 2 * wall, 40.0 - 2 * wall, wall)
    whole, hole = (
        MassProperties.of_tetrahedra(each.nodes, each.tetrahedra, 1.0) for each in (outside, inside)
    )
    shell = MassProperties.of_shell(outside.nodes, outside.surfaces["skin"], wall, 1.0)
    assert shell.mass_kg == pytest.approx(whole.mass_kg - hole.mass_kg, rel=4 * wall / 40.0)
    second = whole.second_moment - hole.second_moment
    np.testing.assert_allclose(
        shell.second_moment, second, atol=8 * wall / 40.0 * np.abs(second).max()
    )


@pytest.mark.parametrize("sizes", [(0.0, 1.0, 1.0), (1.0, -1.0, 1.0), (1.0, 1.0, np.inf)])
def test_a_size_that_is_none_is_refused(sizes: tuple[float, float, float]) -> None:
    with pytest.raises(ValueError, match="must be positive and finite"):
        box_solid(*sizes, 0.0)
