"""A body that nothing holds, against what is known of a bar and of rigid motions."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.box_mesh import box_mesh

from pneumorph.fem.free_body import free_body_displacements, rigid_motions
from pneumorph.fem.material import Material
from pneumorph.fem.part_model import PartModel
from pneumorph.reduction.blocked_force import even_load

LENGTH, WIDTH, THICK, YOUNG = 40.0, 6.0, 4.0, 900.0


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_turns_move_points_across_axis_and_arm(axis: int) -> None:
    """A small turn moves a point by the axis times its arm from the centre."""
    points = np.array([[3.0, 5.0, 7.0], [1.0, 2.0, 4.0]])
    centre = np.array([1.0, 2.0, 3.0])
    motions = rigid_motions(points, centre)
    assert motions.shape == (2, 3, 6)
    np.testing.assert_array_equal(motions[:, :, axis], np.eye(3)[[axis, axis]])
    turned = [np.cross(np.eye(3)[axis], point - centre) for point in points]
    np.testing.assert_array_equal(motions[:, :, 3 + axis], turned)


def test_a_free_bar_stretches_by_hookes_law_and_nothing_else() -> None:
    """Pulled apart by even tractions at its ends it stretches by F / E A everywhere, which linear
    elements without Poisson's ratio have exactly. Its mean by mass neither moves nor turns, and a
    push of its whole, which is the same at every gram, deforms nothing."""
    part = PartModel(
        box_mesh((LENGTH, WIDTH, THICK), (8, 2, 2)),
        Material(YOUNG, 0.0),
        0.001,
        mass_lumping="volume",
    )
    force_mN = 50.0
    forces = np.zeros((part.node_count, 3, 2))
    forces[:, 0, 0] = force_mN * (even_load(part.mesh, "right") - even_load(part.mesh, "left"))
    forces[:, 2, 1] = force_mN * part.node_mass / part.node_mass.sum()
    moved = free_body_displacements(part, forces)
    strain = force_mN / (YOUNG * WIDTH * THICK)
    stretched = strain * part.rest_nodes * [1.0, 0.0, 0.0]
    rigid = np.zeros((part.node_count, 3, 6))
    rigid[:, :, :3] = np.eye(3)
    for axis in range(3):
        rigid[:, :, 3 + axis] = np.cross(np.eye(3)[axis], part.rest_nodes)
    rigid = rigid.reshape(-1, 6)
    apart = (moved[:, :, 0] - stretched).ravel()
    as_rigid = rigid @ np.linalg.lstsq(rigid, apart, rcond=None)[0]
    np.testing.assert_allclose(apart, as_rigid, atol=1e-9 * strain * LENGTH)
    momenta = rigid.T @ (np.repeat(part.node_mass, 3) * moved[:, :, 0].ravel())
    np.testing.assert_allclose(momenta, 0.0, atol=1e-9 * 0.001 * strain * LENGTH * LENGTH)
    np.testing.assert_allclose(moved[:, :, 1], 0.0, atol=1e-9 * strain * LENGTH)
