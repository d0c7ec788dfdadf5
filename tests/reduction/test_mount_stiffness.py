"""The give of a soft hub against a closed form, and what reduced parts make of it."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.box_mesh import box_mesh
from helpers.synthetic_part import synthetic_part, vibration_modes

from pneumorph.fem.material import Material
from pneumorph.fem.part_model import PartModel
from pneumorph.geometry.pose import Pose, rotation_about
from pneumorph.reduction.assemble import assemble_reduced_part
from pneumorph.reduction.mount_stiffness import leg_mount_stiffness, mount_stiffness


def bar() -> PartModel:
    """A bar of 40 x 4 x 4 mm along x, Poisson's ratio 0: it stretches as in one dimension."""
    mesh = box_mesh((40.0, 4.0, 4.0), (40, 2, 2))
    return PartModel(mesh, Material(500.0, 0.0), 0.02)


def test_a_free_bar_pulled_at_its_end_gives_way_as_in_the_book() -> None:
    # Inertia relief: a force F at one end accelerates the bar, the tension falls off linearly, and
    # relative to the mean the end moves by F L / (3 E A). Lumping errs by the square of 1/40.
    hub = bar()
    end = hub.rest_nodes[hub.rest_nodes[:, 0] > 39.9]
    stiffness = mount_stiffness(hub, end, [Pose(np.eye(3), np.zeros(3))])
    pull = np.zeros((len(end), 3))
    pull[:, 0] = 1.0 / len(end)
    moved = np.linalg.solve(stiffness, pull.ravel()).reshape(-1, 3)[:, 0]
    # The mean displacement of the end; the four corners carry more than their share.
    expected = 40.0 / (3.0 * 500.0 * 16.0)
    assert moved.mean() == pytest.approx(expected, rel=0.06)


def test_the_stiffness_turns_with_the_place() -> None:
    hub = bar()
    points = np.array([[0.0, -1.0, -1.0], [0.0, 1.0, -1.0], [0.0, 0.0, 1.0]])
    place = Pose(np.eye(3), np.array([39.5, 2.0, 2.0]))
    turned = Pose(rotation_about("z", 180.0), place.translation)
    first, second = (mount_stiffness(hub, points, [each]) for each in (place, turned))
    assert np.linalg.eigvalsh(first)[0] > 0.0
    np.testing.assert_allclose(first, first.T, rtol=1e-9, atol=1e-9 * np.abs(first).max())
    # Turned about z, the first two points change places with each other.
    swap = np.kron(np.eye(3)[[1, 0, 2]], np.diag([-1.0, -1.0, 1.0]))
    np.testing.assert_allclose(swap @ second @ swap.T, first, rtol=1e-6, atol=1e-6 * first.max())
    with pytest.raises(ValueError, match="poses is empty"):
        mount_stiffness(hub, points, [])


def test_a_part_and_its_image_get_the_same_mount() -> None:
    """At a place beside the bar's plane of symmetry, whose own stiffness is not symmetric."""
    points = np.array([[0.0, -1.0, 0.0], [0.0, 1.0, 0.0]])
    flip = np.kron(np.eye(2)[[1, 0]], np.diag([1.0, -1.0, 1.0]))
    place = Pose(np.eye(3), np.array([39.5, 2.7, 2.0]))
    alone = mount_stiffness(bar(), points, [place])
    both = mount_stiffness(bar(), points, [place], mirror_points=np.array([1, 0]))
    close = 1e-6 * np.abs(both).max()
    assert np.abs(flip @ alone @ flip.T - alone).max() > 1e3 * close
    np.testing.assert_allclose(flip @ both @ flip.T, both, atol=close)
    # Compliances are what is averaged.
    image = flip @ np.linalg.inv(alone) @ flip.T
    expected = 0.5 * (np.linalg.inv(alone) + image)
    np.testing.assert_allclose(np.linalg.inv(both), expected, atol=1e-6 * expected.max())


def test_a_coarse_hub_is_stiff_but_not_beyond_bounds() -> None:
    """Eight nodes cannot move sixteen points apart: there the hub is 10^4 times as stiff as in its
    softest direction, whatever rounding leaves of a compliance of zero."""
    hub = PartModel(box_mesh((40.0, 4.0, 4.0), (1, 1, 1)), Material(500.0, 0.0), 0.02)
    points = np.stack(np.meshgrid([4.0, 8.0, 30.0, 36.0], [1.0, 3.0], [1.0, 3.0]), -1)
    stiffness = mount_stiffness(hub, points.reshape(-1, 3), [Pose(np.eye(3), np.zeros(3))])
    values = np.linalg.eigvalsh(stiffness)
    assert values[-1] / values[0] == pytest.approx(1e4, rel=1e-6)


def test_a_part_feels_its_mount_at_the_attachment_alone() -> None:
    part = synthetic_part((6, 4, 4))
    held = vibration_modes(part, 4)
    nodes = part.mesh.node_set("attachment")
    stiffness = leg_mount_stiffness(part, bar(), [Pose(np.eye(3), np.array([20.0, 0.0, 0.0]))])
    assert stiffness.shape == (3 * len(nodes), 3 * len(nodes))
    assert not assemble_reduced_part(part, held, mount_stiffness=stiffness).linear_stiffness.any()
    moving = held.copy()
    moving[nodes, 2, 0] = 1.0  # the whole attachment lifts with the first mode
    reduced = assemble_reduced_part(part, moving, mount_stiffness=stiffness)
    lift = np.tile([0.0, 0.0, 1.0], len(nodes))
    assert reduced.linear_stiffness[0, 0] == pytest.approx(lift @ stiffness @ lift, rel=1e-6)
    with pytest.raises(ValueError, match="three rows for each attachment node"):
        assemble_reduced_part(part, moving, mount_stiffness=np.eye(3))
