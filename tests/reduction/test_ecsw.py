"""Sampled elements against all of them."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.synthetic_part import synthetic_part, vibration_modes

from pneumorph.reduction.assemble import Cubature, assemble_reduced_part
from pneumorph.reduction.ecsw import EcswSettings, TrainingRows, ecsw
from pneumorph.reduction.mirror_pairs import shared_columns
from pneumorph.reduction.pod import MIRROR

PART = synthetic_part((6, 4, 4))
MODES = vibration_modes(PART, 6).astype(np.float32).astype(float)
STATES = 0.5 * np.random.default_rng(0).normal(size=(12, 6))
SETTINGS = EcswSettings(hyperreduction_tolerance=0.01, stiffness_state_count=3)
RESULT = ecsw(PART.element_groups, MODES, STATES, SETTINGS, mirror_nodes=PART.mesh.mirror_nodes)
EVERY = assemble_reduced_part(PART, MODES)
SAMPLED = assemble_reduced_part(PART, MODES, RESULT.cubatures)


def test_few_elements_reproduce_the_force_of_all_at_the_training_states():
    assert RESULT.converged
    assert RESULT.relative_residual <= 0.01
    total = sum(len(group.connectivity) for group in PART.element_groups)
    assert sum(len(cubature.index) for cubature in RESULT.cubatures) < total / 4
    for state in STATES:
        lower = np.linalg.cholesky(EVERY.stiffness(state))
        force = np.linalg.solve(lower, EVERY.internal_force(state))
        error = np.linalg.solve(lower, SAMPLED.internal_force(state)) - force
        # The tolerance bounds the mean square over states; one state may have sqrt(12) of it.
        assert np.linalg.norm(error) < 0.01 * 12**0.5 * np.linalg.norm(force)


def test_stiffness_stays_positive_and_close():
    for state in STATES[::4]:
        exact, sampled = EVERY.stiffness(state), SAMPLED.stiffness(state)
        assert np.linalg.eigvalsh(sampled).min() > 0.0
        # Trained with a fifth of the weight of the forces, so within a few tolerances.
        assert np.linalg.norm(sampled - exact) < 0.1 * np.linalg.norm(exact)


def test_rows_are_the_reduced_force_moment_and_stiffness():
    training = TrainingRows.build(PART.element_groups, MODES, None, "edge")
    scales = training.scales(STATES[:2], 0.05)
    state = STATES[0]
    forces, stiffness = training.rows(state, scales, with_stiffness=True)
    lower = np.linalg.cholesky(EVERY.stiffness(state))
    x = EVERY.positions(state)
    force = PART.internal_force(x)
    moment = np.cross(x, force).sum(axis=0)
    expected = np.concatenate(
        [np.linalg.solve(lower, EVERY.internal_force(state)), moment / scales.rotation]
    )
    # Identities: the same sums in another order.
    assert np.allclose(forces.sum(axis=1), expected, rtol=1e-9, atol=1e-9 * np.abs(expected).max())

    turns = np.stack([np.cross(axis, x) for axis in np.eye(3)], axis=2)
    fields = np.concatenate([MODES, turns], axis=2).reshape(x.size, -1)
    full = fields.T @ PART.stiffness(x) @ fields
    inverse = np.zeros_like(full)
    inverse[:6, :6] = np.linalg.inv(lower)
    inverse[6:, 6:] = np.eye(3) / scales.rotation
    scaled = inverse @ full @ inverse.T
    first, second = np.triu_indices(9)
    entries = np.where(first == second, 1.0, 2**0.5) * scaled[first, second]
    assert np.allclose(stiffness.sum(axis=1), entries, rtol=1e-9, atol=1e-9)


def test_moments_are_reproduced_where_no_stiffness_is_fitted_and_the_first_state_is_at_rest():
    """Scales of rows come from the states: one at rest has a stiffness against turns of rounding's
    size and sign."""
    states = np.vstack([np.zeros(6), STATES])
    result = ecsw(PART.element_groups, MODES, states, EcswSettings(0.01, stiffness_state_count=0))
    weight = []
    for group, cubature in zip(PART.element_groups, result.cubatures, strict=True):
        weight.append(np.zeros(group.element_count))
        weight[-1][cubature.index] = cubature.weight
    training = TrainingRows.build(PART.element_groups, MODES, None, "edge")
    scales = training.scales(STATES, 0.05)
    error, size = [], []
    for state in STATES:
        forces, _ = training.rows(state, scales, with_stiffness=False)
        every = forces.sum(axis=1)
        error.append((forces @ np.concatenate(weight) - every)[6:] / np.linalg.norm(every))
        size.append(every[6:] / np.linalg.norm(every))
    # The tolerance bounds the mean square of forces and moments together.
    assert np.linalg.norm(error) < 0.01 * len(STATES) ** 0.5
    assert np.linalg.norm(size) > 0.05 * len(STATES) ** 0.5


def test_mirrored_motion_of_the_sampled_part_is_mirrored():
    image = np.moveaxis(MODES[PART.mesh.mirror_nodes], 1, 2) * MIRROR
    parity = np.sign(np.einsum("nmi,nim->m", image, MODES))
    state = STATES[3]
    force = SAMPLED.internal_force(state)
    mirrored = SAMPLED.internal_force(parity * state)
    # Equal pairs of weights: only rounding of single-precision modes breaks the symmetry.
    assert np.abs(mirrored - parity * force).max() < 1e-5 * np.abs(force).max()


def test_every_element_is_returned_as_unit_weights():
    training = TrainingRows.build(PART.element_groups, MODES, PART.mesh.mirror_nodes, "edge")
    cubatures = training.cubatures(np.ones(training.column_count))
    for cubature, group in zip(cubatures, PART.element_groups, strict=True):
        every = Cubature.every(len(group.connectivity))
        assert np.array_equal(cubature.index, every.index)
        assert np.array_equal(cubature.weight, every.weight)


def test_a_floor_of_nothing_is_none_and_a_part_at_rest_has_no_forces():
    training = TrainingRows.build(PART.element_groups, MODES, PART.mesh.mirror_nodes, "edge")
    floors = [training.scales(STATES[:2], share).force_floor for share in (0.0, 0.1, 0.2)]
    assert floors[0] == 0.0
    assert floors[2] == pytest.approx(2.0 * floors[1]) != 0.0
    assert training.scales(0.0 * STATES[:1], 0.1).force_floor == pytest.approx(0.0, abs=1e-9)


def test_same_question_same_answer():
    again = ecsw(PART.element_groups, MODES, STATES, SETTINGS, mirror_nodes=PART.mesh.mirror_nodes)
    for first, second in zip(RESULT.cubatures, again.cubatures, strict=True):
        assert np.array_equal(first.index, second.index)
        assert np.array_equal(first.weight, second.weight)


def test_element_limit_is_kept_and_said():
    settings = EcswSettings(hyperreduction_tolerance=1e-6, element_limit=20)
    result = ecsw(
        PART.element_groups, MODES, STATES[:3], settings, mirror_nodes=PART.mesh.mirror_nodes
    )
    assert sum(len(cubature.index) for cubature in result.cubatures) <= 20
    assert not result.converged
    alone = ecsw(PART.element_groups, MODES, STATES[:3], settings)
    assert sum(len(cubature.index) for cubature in alone.cubatures) == 20
    assert not alone.converged


def test_a_state_of_weight_two_counts_as_four():
    """Squares of rows add up: an identity, to rounding."""
    # One state tells the scales, so that repeats do not change them.
    settings = EcswSettings(element_limit=40, stiffness_state_count=1, stiffness_weight=0.0)
    repeated = np.concatenate([STATES[:3], np.repeat(STATES[3:4], 4, axis=0)])
    groups, mirror = PART.element_groups, PART.mesh.mirror_nodes
    weights = np.array([1.0, 1.0, 1.0, 2.0])
    weighted = ecsw(groups, MODES, STATES[:4], settings, weights=weights, mirror_nodes=mirror)
    often = ecsw(groups, MODES, repeated, settings, mirror_nodes=mirror)
    once = ecsw(groups, MODES, STATES[:4], settings, mirror_nodes=mirror)
    assert weighted.relative_residual == pytest.approx(often.relative_residual, rel=1e-6)
    assert weighted.relative_residual != pytest.approx(once.relative_residual, rel=1e-3)
    for first, second in zip(weighted.cubatures, often.cubatures, strict=True):
        np.testing.assert_array_equal(first.index, second.index)
        np.testing.assert_allclose(first.weight, second.weight, rtol=1e-6)


def test_meshes_without_mirror_elements_are_refused():
    mirror = PART.mesh.mirror_nodes.copy()
    mirror[[0, 1]] = mirror[[1, 0]]
    with pytest.raises(ValueError, match="must map elements onto elements"):
        shared_columns(PART.element_groups[0], mirror)
    with pytest.raises(ValueError, match="at least one training state"):
        ecsw(PART.element_groups, MODES, STATES[:0], SETTINGS)
