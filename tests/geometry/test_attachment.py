"""The frame of an attachment face, from the nodes that lie on it."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.box_mesh import box_mesh

from pneumorph.catalogue.leg_kinds import measured_leg_mesh, paper_leg_mesh
from pneumorph.catalogue.leg_module import module_of_leg
from pneumorph.catalogue.paper_robot import PAPER_FACE
from pneumorph.geometry.attachment import attachment_frame, face_of_mesh, mount_pose, same_frame
from pneumorph.geometry.mesh import MeshError
from pneumorph.geometry.pose import Pose, rotation_about

TURN = rotation_about("z", 37.0) @ rotation_about("y", 21.0)
MOVE = np.array([3.0, -70.0, 11.0])


def face(count: int) -> np.ndarray:
    """Points on a rectangle across x at -20, y from -8 to 8, z from 1 to 11."""
    y, z = np.meshgrid(np.linspace(-8, 8, count), np.linspace(1, 11, count))
    return np.stack([np.full(y.size, -20.0), y.ravel(), z.ravel()], axis=1)


@pytest.mark.parametrize("count", [2, 3, 9])
def test_it_does_not_depend_on_the_mesh(count: int) -> None:
    found = attachment_frame(face(count), np.array([0.0, 1.0, 5.0]))
    assert same_frame(found, Pose(np.eye(3), np.array([-20.0, 0.0, 6.0])))
    crowded = np.concatenate([face(count), face(5) * [1.0, 0.2, 1.0] + [0.0, 5.0, 0.0]])
    assert same_frame(attachment_frame(crowded, np.zeros(3)), found)


def test_it_turns_and_moves_with_the_part() -> None:
    """Normal and centre follow; up is the frame's own z, projected into the face."""
    found = attachment_frame(face(3) @ TURN.T + MOVE, TURN @ np.array([0.0, 0.0, 5.0]) + MOVE)
    np.testing.assert_allclose(found.translation, TURN @ [-20.0, 0.0, 6.0] + MOVE, atol=1e-12)
    np.testing.assert_allclose(found.rotation[:, 0], TURN[:, 0], atol=1e-12)
    np.testing.assert_allclose(found.rotation[2, 1], 0.0, atol=1e-12)  # y is level
    assert found.rotation[2, 2] > 0.0
    upright = attachment_frame(face(3)[:, [1, 2, 0]], np.zeros(3))
    np.testing.assert_allclose(upright.rotation[:, 0], [0.0, 0.0, 1.0], atol=1e-12)
    np.testing.assert_allclose(upright.rotation[:, 2], [1.0, 0.0, 0.0], atol=1e-12)


def test_it_looks_into_the_part_and_is_laid_on_a_place() -> None:
    other_side = attachment_frame(face(3), np.array([-50.0, 0.0, 5.0]))
    np.testing.assert_allclose(other_side.rotation[:, 0], [-1.0, 0.0, 0.0], atol=1e-12)
    place = Pose(TURN, MOVE)
    found = attachment_frame(face(3), np.zeros(3))
    assert same_frame(mount_pose(place, found).compose(found), place)


def test_of_the_paper_legs_it_is_the_end_of_the_first_tooth() -> None:
    assert same_frame(face_of_mesh(paper_leg_mesh()), PAPER_FACE)
    assert same_frame(face_of_mesh(measured_leg_mesh()), PAPER_FACE)
    # The reduced legs, one of which moves where it is tied, say the same without a mesh.
    for name in ("published", "hyperelastic"):
        found = module_of_leg(name, part=module_of_leg(name).reduced).face  # type: ignore[arg-type]
        assert found is not None
        assert same_frame(found, PAPER_FACE)


@pytest.mark.parametrize(
    ("points", "why"),
    [
        (face(2)[:2], "has 2 nodes"),
        (np.outer(np.arange(5.0), [1.0, 2.0, 3.0]), "on one line"),
        (box_mesh((10.0, 10.0, 10.0), (1, 1, 1)).nodes, "side wall"),
    ],
)
def test_what_spans_no_face_is_refused(points: np.ndarray, why: str) -> None:
    with pytest.raises(MeshError, match=why):
        attachment_frame(points, np.array([5.0, 5.0, 50.0]))
