"""How far a solid turns about its nodes."""

import numpy as np
from helpers.box_mesh import box_mesh
from scipy.spatial.transform import Rotation

from pneumorph.fem.node_turns import NodeTurns, rotations
from pneumorph.geometry.quadratic import quadratic_mesh


def beam():
    return quadratic_mesh(box_mesh((40.0, 4.0, 4.0), (10, 1, 1)))


def test_a_solid_that_turns_as_a_whole_turns_so_about_each_node():
    """Exact but for rounding, from any configuration on, up to 64 degrees."""
    mesh = beam()
    turns = NodeTurns(mesh.nodes, mesh.connectivity)
    start = mesh.nodes + 0.1 * np.random.default_rng(0).standard_normal(mesh.nodes.shape)
    turn = Rotation.from_rotvec([0.3, -0.9, 0.5]).as_matrix()
    moved = start @ turn.T + 50.0
    found = rotations(turns.since(turns.reference(start), moved))
    np.testing.assert_allclose(found, np.broadcast_to(turn, found.shape), atol=1e-12)


def test_a_bent_beam_turns_by_its_slope():
    """By x / R about each node; an element's mean is off by its own angle, 0.02, at the ends, and
    by the shear of its straight edges, of second order."""
    mesh = beam()
    radius = 100.0
    x, y, z = mesh.nodes.T
    angle = x / radius
    bent = np.column_stack([(radius + z) * np.sin(angle), y, (radius + z) * np.cos(angle)])
    turns = NodeTurns(mesh.nodes, mesh.connectivity)
    sines = turns.since(turns.reference(mesh.nodes), bent)
    np.testing.assert_allclose(np.arcsin(sines[:, 1]), angle, atol=0.025)
    np.testing.assert_allclose(sines[:, [0, 2]], 0.0, atol=0.01)


def test_a_turn_too_far_to_tell_is_a_rotation_all_the_same():
    found = rotations(np.array([[0.0, 0.0, 1.3]]))[0]
    np.testing.assert_allclose(found @ found.T, np.eye(3), atol=1e-15)
