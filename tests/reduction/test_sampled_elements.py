"""Sampled integration points of every law and either element, against the finite elements."""

import numpy as np
import pytest
from helpers.element_cases import ORDERS
from helpers.law_cases import SHEET_LAWS
from helpers.synthetic_part import (
    synthetic_mesh,
    synthetic_part,
    synthetic_reduced_part,
    vibration_modes,
)

from pneumorph.fem.material import Material
from pneumorph.fem.part_model import PartModel
from pneumorph.geometry.pose import rotation_about
from pneumorph.reduction.assemble import Cubature, assemble_reduced_part
from pneumorph.reduction.ecsw import EcswSettings, ecsw
from pneumorph.reduction.mirror_pairs import shared_columns

CELLS = (4, 4, 4)
MODE_COUNT = 5
CASES = [(law, order) for law in SHEET_LAWS for order in ORDERS]


@pytest.fixture(scope="module", params=CASES)
def model(request) -> PartModel:
    law, order = request.param
    return synthetic_part(CELLS, law, order == "quadratic")


@pytest.fixture(scope="module")
def every(model):
    return assemble_reduced_part(model, vibration_modes(model, MODE_COUNT))


def some_state(part, size=1.5, seed=0):
    alpha = size * np.random.default_rng(seed).normal(size=part.mode_count)
    assert np.abs(part.positions(alpha) - part.rest_nodes).max() > 3.0
    return alpha


def test_every_point_with_unit_weight_is_the_galerkin_projection(model, every):
    # The same sums in another order: rounding of 1e-16 times the number of points, and where
    # eigenvalues are cut, of the eigenvectors.
    alpha = some_state(every)
    x, flat = every.positions(alpha), every.modes.reshape(-1, MODE_COUNT)
    for rotation in ("edge", "polar"):
        force = flat.T @ model.internal_force(x, rotation).ravel()
        assert (
            np.abs(every.internal_force(alpha, rotation) - force).max()
            < 1e-11 * np.abs(force).max()
        )
        stiffness = flat.T @ model.stiffness(x, rotation) @ flat
        got = every.stiffness(alpha, rotation)
        assert np.abs(got - stiffness).max() < 1e-10 * np.abs(stiffness).max()
    # Corotational elements are damped in the reduced robot by their rotated stiffness, which is the
    # same but for terms of the order of the strain, some 0.1 here.
    tolerance = 0.2 if model.material.law == "corotational" else 1e-10
    objective = flat.T @ model.objective_stiffness(x) @ flat
    got = every.objective_stiffness(alpha)
    assert np.abs(got - objective).max() < tolerance * np.abs(objective).max()


def test_force_is_the_derivative_of_the_full_energy(model, every):
    alpha, step = some_state(every), 1e-6
    force = every.internal_force(alpha, "polar")
    for mode, unit in enumerate(step * np.eye(MODE_COUNT)):
        energies = [model.elastic_energy(every.positions(alpha + s * unit)) for s in (1, -1)]
        # Rounding of 1e-16 of an energy of 1e4 mN mm over the step.
        slope = (energies[0] - energies[1]) / (2.0 * step)
        assert -slope == pytest.approx(force[mode], abs=1e-5 * np.abs(force).max())


# The published stiffness of corotational elements leaves the change of their rotations out.
@pytest.mark.parametrize(
    "model", [case for case in CASES if "corotational" not in case], indirect=True
)
def test_cuts_of_negative_eigenvalues_aside_stiffness_is_the_derivative_of_force(every):
    alpha, step = np.zeros(MODE_COUNT), 1e-6  # at rest nothing is cut
    for mode, unit in enumerate(step * np.eye(MODE_COUNT)):
        change = every.internal_force(alpha - unit) - every.internal_force(alpha + unit)
        column = every.stiffness(alpha)[:, mode]
        # step^2 and rounding: 1e-9.
        assert np.abs(change / (2.0 * step) - column).max() < 1e-6 * np.abs(column).max()


def test_sampled_points_conserve_momentum_whatever_their_weights(model):
    """A part free to move: translations and turns are among its modes, weights are arbitrary.

    No element resists a rigid motion, and its force has no resultant and, with polar rotations, no
    moment; so neither has any weighted sum.
    """
    rotation, count = "polar", 12
    x = model.rest_nodes
    turns = np.stack([np.cross(axis, x) for axis in np.eye(3)], axis=2)
    shifts = np.broadcast_to(np.eye(3), (len(x), 3, 3))
    bends = vibration_modes(model, count - 6)
    part_modes = np.concatenate([shifts, turns / 30.0, bends], axis=2)
    rng = np.random.default_rng(3)
    cubatures = tuple(
        Cubature.from_weights(np.maximum(rng.normal(size=group.element_count), 0.0))
        for group in model.element_groups
    )
    part = assemble_reduced_part(model, part_modes, cubatures)
    shifted = np.zeros(count)
    shifted[:3] = [5.0, -3.0, 20.0]
    alpha = shifted.copy()
    alpha[6:] = 0.3 * rng.normal(size=count - 6)
    size = np.abs(part.internal_force(alpha, rotation)).max()
    # Rounding of modes to single precision strains the part by 1e-7 of what they move.
    assert np.abs(part.internal_force(shifted, rotation)).max() < 1e-4 * size
    assert np.abs(part.internal_force(alpha, rotation)[:3]).max() < 1e-5 * size
    moment, scale = np.zeros(3), 0.0
    for elements in (part.tetrahedra, part.membrane):
        gradient = elements.gradients(alpha)
        stress = elements.stress(gradient, rotation)
        twist = np.einsum("pid,pjd->ij", stress, gradient)
        moment += [twist[1, 2] - twist[2, 1], twist[2, 0] - twist[0, 2], twist[0, 1] - twist[1, 0]]
        scale += np.abs(stress).sum()
    assert np.abs(moment).max() < 1e-12 * scale


def test_turned_gradients_give_turned_forces(model, every):
    elements, rotation = every.tetrahedra, "polar"
    gradient = elements.gradients(some_state(every))
    turn = rotation_about("y", 110.0) @ rotation_about("x", -35.0)
    stress = elements.stress(gradient, rotation)
    # Objectivity, to rounding.
    np.testing.assert_allclose(
        elements.stress(turn @ gradient, rotation), turn @ stress, atol=1e-11 * np.abs(stress).max()
    )


def test_points_and_their_mirror_images_share_a_column(model):
    mirror = model.mesh.mirror_nodes
    for group in model.element_groups:
        column = shared_columns(group, mirror)
        counts = np.bincount(column)
        assert np.all(counts == 2)  # no element lies on both sides of the plane
        # Positions of the points: linear functions of the shape functions' gradients give them.
        centre = point_positions(model, group)
        order = np.argsort(column, kind="stable").reshape(-1, 2)
        image = centre[order[:, 1]] * [1.0, -1.0, 1.0]
        np.testing.assert_allclose(centre[order[:, 0]], image, atol=1e-12)


def point_positions(model, group):
    from pneumorph.fem.quadrature import quadrature, shape_values

    node_count = group.connectivity.shape[1]
    rule = quadrature(group.dimension, node_count)
    values = np.tile(
        shape_values(rule.barycentric, node_count), (group.element_count // len(rule.weights), 1)
    )
    return np.einsum("pk,pki->pi", values, model.rest_nodes[group.connectivity])


def test_few_points_stand_for_all_of_them_with_no_negative_weight(model, every):
    states = 0.4 * np.random.default_rng(0).normal(size=(8, MODE_COUNT))
    mirror = model.mesh.mirror_nodes
    settings = EcswSettings(hyperreduction_tolerance=0.02, stiffness_state_count=2)
    result = ecsw(model.element_groups, every.modes, states, settings, mirror_nodes=mirror)
    assert result.converged
    sampled = assemble_reduced_part(model, every.modes, result.cubatures)
    assert len(sampled.tetrahedron_weight) < len(every.tetrahedron_weight) / 5
    assert min(sampled.tetrahedron_weight.min(), sampled.membrane_weight.min(initial=1.0)) > 0.0
    for state in states:
        lower = np.linalg.cholesky(every.stiffness(state))
        force = np.linalg.solve(lower, every.internal_force(state))
        error = np.linalg.solve(lower, sampled.internal_force(state)) - force
        # The tolerance bounds the mean square over states; one state may have sqrt(8) of it.
        assert np.linalg.norm(error) < 0.02 * 8**0.5 * np.linalg.norm(force)
    assert np.linalg.eigvalsh(sampled.stiffness(states[0])).min() > 0.0


def test_a_law_of_ones_own_and_a_part_without_membrane_reduce_likewise():
    mesh = synthetic_mesh(CELLS)
    model = PartModel(mesh, Material(1160.0, 0.3, "isochoric_neo_hookean"), 0.1, cavity="cavity")
    part = assemble_reduced_part(model, vibration_modes(model, MODE_COUNT))
    alpha = some_state(part)
    force = (
        part.modes.reshape(-1, MODE_COUNT).T @ model.internal_force(part.positions(alpha)).ravel()
    )
    assert np.abs(part.internal_force(alpha) - force).max() < 1e-11 * np.abs(force).max()
    assert len(part.membrane_index) == 0


def test_several_membranes_are_refused():
    model = synthetic_part(CELLS)
    model.element_groups = (*model.element_groups, model.element_groups[1])
    with pytest.raises(ValueError, match="may have one membrane, got 2"):
        assemble_reduced_part(model, vibration_modes(synthetic_part(CELLS), 2))


def test_the_reduced_quadratic_part_is_the_linear_ones_kind():
    part = synthetic_reduced_part(3, CELLS, "stable_neo_hookean", quadratic=True)
    assert part.tetrahedron_material.law == "stable_neo_hookean"
    assert part.membrane_material.law == "stable_neo_hookean"
    assert len(part.tetrahedron_index) == 4 * len(synthetic_mesh(CELLS).tetrahedra)
