"""A kept factor that turns with its leg."""

import numpy as np
import pytest
from helpers.small_robot import small_leg
from scipy.spatial.transform import Rotation

from pneumorph.fem.kept_leg import KeptLeg
from pneumorph.fem.material import Material, Membrane
from pneumorph.fem.mounted_leg import MountedLeg
from pneumorph.fem.part_model import PartModel
from pneumorph.fem.yeoh_constants import yeoh_material
from pneumorph.geometry.face_tie import tied_over_face
from pneumorph.geometry.pose import Pose

STEP_S = 0.01
SINGLE = 1e-4  # 6e-8 of single precision times what stiff and soft motions are apart, some 1e3


@pytest.fixture(scope="module", params=["corners", "face"])
def leg(request) -> MountedLeg:
    mesh = small_leg().mesh
    if request.param == "face":
        mesh = tied_over_face(mesh)
    sheet = Membrane("bottom", Material(2e4, 0.3, "st_venant_kirchhoff"), 0.1)
    part = PartModel(mesh, yeoh_material(50.0, 8.0, -1.0), 0.02, (sheet,))
    return MountedLeg(part, Pose(np.eye(3), np.zeros(3)), 0)


def matrix(leg: MountedLeg, x: np.ndarray) -> np.ndarray:
    part = leg.part
    data = np.zeros(len(part.assembly.indices))
    data[part.assembly.diagonal] += np.repeat(part.node_mass, 3)
    part.compiled.force_and_tangent(x, 0.0, None, data, STEP_S**2)
    return data


def bent(leg: MountedLeg) -> np.ndarray:
    x, y, z = leg.part.rest_nodes.T
    return np.column_stack([x, y, z + 1e-3 * x**2])


def iteration(
    kept: KeptLeg, leg: MountedLeg, turn: np.ndarray
) -> tuple[list[np.ndarray], np.ndarray]:
    """What hub and contacts are told, and the velocities after impulses, both turned back."""
    generator = np.random.default_rng(0)
    velocity = generator.standard_normal((leg.part.node_count, 3))
    velocity[leg.tie.nodes] = leg.tie.spread(velocity[leg.attachment])
    residual = generator.standard_normal((leg.part.node_count, 3)) * leg.part.node_mass[:, None]
    attached = generator.standard_normal((len(leg.attachment), 3))
    impulses, more = 1e-3 * generator.standard_normal((2, 2, 3))
    points = np.array([1, 3])
    frames = np.array([np.eye(3), Rotation.from_rotvec([0.4, 0.2, -0.1]).as_matrix()]) @ turn.T
    kept.add_points(points)
    share = kept.condense(velocity @ turn.T, (residual @ turn.T).ravel(), points, frames, impulses)
    blocks = np.kron(np.eye(len(attached)), turn)
    told = [
        blocks.T @ share.attachment_matrix @ blocks,
        blocks.T @ share.attachment_right,
        share.contact_attachment @ blocks,
        share.delassus,
        share.contact_right,
    ]
    moved = share.node_velocities((attached @ turn.T).ravel(), (impulses + more).ravel()) @ turn
    return told, moved


def assert_close(found, expected, tolerance):
    np.testing.assert_allclose(found, expected, atol=tolerance * np.abs(expected).max())


def test_a_leg_that_turns_as_a_whole_needs_no_fresh_factor(leg):
    """Its matrix turns with it, and so does each product of the factor."""
    x, turn = bent(leg), Rotation.from_rotvec([0.3, -0.5, 0.6]).as_matrix()
    kept = KeptLeg(leg, matrix(leg, x), x)
    expected = iteration(kept, leg, np.eye(3))
    kept.turn_to(x @ turn.T)
    found = iteration(kept, leg, turn)
    for a, b in zip((*found[0], found[1]), (*expected[0], expected[1]), strict=True):
        assert_close(a, b, SINGLE)
    kept.turn_to(x)
    unturned = iteration(kept, leg, turn)
    assert np.abs(unturned[1] - expected[1]).max() > 0.01 * np.abs(expected[1]).max()


def test_an_iteration_solves_the_linear_equations(leg):
    """A (v' - v) = H^T lambda' - r on the free nodes, with the law's view of it H v' = what the
    share foretells."""
    x = bent(leg)
    data = matrix(leg, x)
    kept = KeptLeg(leg, data, x)
    generator = np.random.default_rng(1)
    velocity = generator.standard_normal((leg.part.node_count, 3))
    velocity[leg.tie.nodes] = leg.tie.spread(velocity[leg.attachment])
    residual = 1e-3 * generator.standard_normal(velocity.shape)
    points, frames = np.array([0, 2]), np.tile(np.eye(3), (2, 1, 1))
    impulses, after = 1e-3 * generator.standard_normal((2, 2, 3))
    attached = velocity[leg.attachment] + 0.1 * generator.standard_normal((len(leg.attachment), 3))
    kept.add_points(points)
    share = kept.condense(velocity, residual.ravel(), points, frames, impulses)
    moved = share.node_velocities(attached.ravel(), after.ravel())
    pushed = leg.contact_weights[points].T @ after
    change = (moved - velocity).ravel()
    matrix_of_nodes = leg.part.assembly.matrix(data)
    left = (matrix_of_nodes @ change).reshape(-1, 3) - pushed + residual
    free = np.setdiff1d(np.arange(leg.part.node_count), leg.tie.nodes)
    terms = np.abs(matrix_of_nodes) @ np.abs(
        change
    )  # a backward stable elimination is small beside
    assert np.abs(left[free]).max() < 1e-6 * terms.max()
    foretold = share.contact_attachment @ attached.ravel() + share.delassus @ after.ravel()
    foretold += share.contact_right
    assert_close(foretold, (leg.contact_weights[points] @ moved).ravel(), SINGLE)
    wanted = leg.at_attachment(left.ravel())
    told = share.attachment_matrix @ attached.ravel() - share.attachment_right
    told -= share.contact_attachment.T @ after.ravel()
    assert_close(told, wanted, SINGLE)


def test_a_stiffness_at_a_contact_point_is_what_its_nodes_meet(leg):
    """W^T S W with the weights W of the point's nodes; nothing else of the matrix changes."""
    root = np.random.default_rng(5).standard_normal((3, 3))
    stiffness = root @ root.T
    data = np.zeros(len(leg.part.assembly.indices))
    leg.add_stiffness(data, 2, stiffness)
    weights = leg.contact_weights[[2]].toarray()
    expected = np.kron(weights.T @ weights, stiffness)
    found = leg.part.assembly.matrix(data).toarray()
    np.testing.assert_allclose(found, expected, atol=1e-14)
