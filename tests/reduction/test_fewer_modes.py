"""A part with fewer modes is the same part that moves along some directions alone."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from pneumorph.catalogue.shipped_data import data_file
from pneumorph.reduction.fewer_modes import with_fewer_modes
from pneumorph.reduction.reduced_part import ReducedPart
from pneumorph.robot.scaled_part import scaled_part

COUNT = 24


@pytest.fixture(scope="module")
def whole() -> ReducedPart:
    return ReducedPart.load(data_file("leg_measured.npz"))


@pytest.fixture(scope="module")
def fewer(whole: ReducedPart) -> ReducedPart:
    return with_fewer_modes(whole, COUNT)


@pytest.fixture(scope="module")
def kept(whole: ReducedPart, fewer: ReducedPart) -> np.ndarray:
    """T of alpha = T beta, from what the nodes do [(mode, mode kept)]."""
    ours, theirs = (part.modes.reshape(-1, part.mode_count) for part in (fewer, whole))
    return np.linalg.lstsq(theirs, ours, rcond=None)[0]


def states(fewer: ReducedPart) -> np.ndarray:
    """Some well inside the range of the snapshots, where no element is crushed, (state, mode)."""
    drawn = np.random.default_rng(0).normal(size=(4, COUNT))
    drawn /= np.diag(fewer.snapshot_range)
    return 0.05 * drawn / fewer.range_ratio(drawn)[:, None]


def test_the_directions_kept_are_orthonormal_and_the_furthest(
    whole: ReducedPart, fewer: ReducedPart, kept: np.ndarray
) -> None:
    """In single precision, as modes are kept."""
    assert np.allclose(kept.T @ kept, np.eye(COUNT), atol=1e-4)
    # Mass-orthonormal, as the stepper takes them: sum m Phi_i Phi_i is one.
    of_mass = np.trace(fewer.second_moment_mode_pairs, axis1=0, axis2=1)
    assert np.allclose(of_mass, np.eye(COUNT), atol=1e-5)
    left_out = np.linalg.svd(kept.T)[2][COUNT:]
    # Half-lengths: how far along a unit direction the range reaches.
    reach = 1.0 / np.linalg.norm(whole.snapshot_range @ np.c_[kept, left_out.T], axis=0)
    assert reach[:COUNT].min() >= 0.999 * reach[COUNT:].max()


def test_each_mode_is_its_own_mirror_image_or_the_negative_of_it(fewer: ReducedPart) -> None:
    """As mirrored robots need it."""
    mirror = np.array([1.0, -1.0, 1.0])
    rounded = np.round(fewer.rest_nodes, 3) + 0.0
    places = {tuple(place): number for number, place in enumerate(rounded)}
    image = [places[tuple(np.round(mirror * place, 3) + 0.0)] for place in rounded]
    like = np.einsum("nim,nim,i->m", fewer.modes[image], fewer.modes, mirror)
    like /= np.einsum("nim,nim->m", fewer.modes, fewer.modes)
    assert np.allclose(np.abs(like), 1.0, atol=1e-3)


def test_forces_volumes_and_shapes_are_those_of_the_whole_part_along_them(
    whole: ReducedPart, fewer: ReducedPart, kept: np.ndarray
) -> None:
    for beta in states(fewer):
        alpha = kept @ beta
        places = fewer.positions(beta), whole.positions(alpha)
        assert np.abs(places[0] - places[1]).max() < 1e-3  # mm, modes are in single precision
        forces = fewer.internal_force(beta), kept.T @ whole.internal_force(alpha)
        assert np.allclose(*forces, rtol=1e-4, atol=1e-4 * np.abs(forces[1]).max())
        stiff = fewer.objective_stiffness(beta), kept.T @ whole.objective_stiffness(alpha) @ kept
        assert np.allclose(*stiff, rtol=1e-4, atol=1e-4 * np.abs(stiff[1]).max())
        volumes = fewer.cavity().volume(beta), whole.cavity().volume(alpha)
        assert volumes[0] == pytest.approx(volumes[1], rel=1e-6)
        assert fewer.range_ratio(beta) == pytest.approx(whole.range_ratio(alpha), rel=1e-3)


def test_what_has_no_more_modes_or_no_range_stays_as_it_is(whole: ReducedPart) -> None:
    assert with_fewer_modes(whole, whole.mode_count) is whole
    unknown = replace(whole, snapshot_range=np.zeros((0, 0)))
    assert with_fewer_modes(unknown, COUNT) is unknown
    with pytest.raises(ValueError, match="count is 0, expected at least one mode"):
        with_fewer_modes(whole, 0)


def test_it_may_be_left_with_fewer_before_or_after_it_is_scaled(
    whole: ReducedPart, fewer: ReducedPart
) -> None:
    first = scaled_part(fewer, 1.1, 0.9)
    second = with_fewer_modes(scaled_part(whole, 1.1, 0.9), COUNT)
    for name in first.expected_shapes():
        ours, theirs = getattr(first, name), getattr(second, name)
        if ours.dtype.kind != "U":
            assert np.allclose(ours, theirs, rtol=1e-9, atol=1e-12 * np.abs(theirs).max(initial=0))
    assert first.metadata == second.metadata
