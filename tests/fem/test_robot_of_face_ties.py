"""Robots whose legs are tied over a face."""

import dataclasses

import numpy as np
import pytest
from helpers.small_robot import small_leg, small_robot

from pneumorph.fem.full_order_settings import FullOrderSettings
from pneumorph.fem.part_model import PartModel
from pneumorph.fem.yeoh_constants import yeoh_material
from pneumorph.geometry.face_tie import tied_over_face
from pneumorph.physics.physics import Physics

COMMANDS = np.tile([20.0, 5.0], (6, 1))
PHYSICS = Physics(
    floor_height_mm=0.0,
    regulator_count=2,
    damping="objective",
    mass_damping_per_s=0.0,
    stiffness_damping_s=0.0,
    friction=0.3,
)


def leg(all_of_face: bool) -> PartModel:
    """With all nodes of its face attached, or with four that the others follow."""
    part = small_leg()
    mesh = tied_over_face(part.mesh)
    if all_of_face:
        sets = dict(mesh.node_sets)
        sets["attachment"] = sets.pop("attachment_face")
        mesh = dataclasses.replace(mesh, node_sets=sets)
    return PartModel(mesh, yeoh_material(50.0, 8.0, -1.0), part.mass_kg, cavity="cavity")


@pytest.mark.parametrize(
    "numerics",
    [
        FullOrderSettings(),
        FullOrderSettings("implicit_euler", newton_tolerance=1e-10),
        FullOrderSettings("implicit_euler", newton_tolerance=1e-10, newton_matrix="kept"),
    ],
    ids=["linearly implicit", "implicit", "kept"],
)
def test_a_rigid_hub_carries_a_face_as_it_carries_all_its_nodes(numerics):
    """The same equations with 12 unknowns in place of 48; contacts are solved to 1e-7 mm/s, so six
    steps of 0.01 s part by less than 1e-8 mm, and Newton's tolerance as in `test_kept_newton`."""
    face, nodes = (
        robot.rollout(robot.initial_state(), COMMANDS)[0]
        for robot in (
            small_robot(PHYSICS, leg=leg(all_of_face), numerics=numerics)
            for all_of_face in (False, True)
        )
    )
    assert face.active_contacts > 0
    for x, y in zip(face.positions, nodes.positions, strict=True):
        np.testing.assert_allclose(x, y, atol=1e-6)


def test_a_soft_hub_bends_the_face_smoothly():
    """What follows stays on the spline through the attachment, at every step's end."""
    robot = small_robot(PHYSICS, soft=True, leg=leg(False))
    state, _ = robot.rollout(robot.initial_state(), COMMANDS)
    for mounted, x, v in zip(robot.legs, state.positions, state.velocities, strict=True):
        for values in (x, v):
            followed = mounted.tie.spread(values[mounted.attachment])
            np.testing.assert_allclose(values[mounted.tie.nodes], followed, atol=1e-9)
        rest = mounted.initial_positions()[mounted.tie.nodes]
        assert np.abs(x[mounted.tie.nodes] - rest).max() > 0.01
