"""A few of a part's sampled points stand for all of them on the modes that it has."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from pneumorph.catalogue.leg_module import module_of_leg
from pneumorph.catalogue.module import Module
from pneumorph.catalogue.shipped_data import data_file
from pneumorph.reduction.ecsw import EcswSettings
from pneumorph.reduction.fewer_modes import with_fewer_modes
from pneumorph.reduction.fewer_points import FewerPoints, fewer_points
from pneumorph.reduction.modal_equilibrium import rising_modal_equilibria
from pneumorph.reduction.reduced_part import ReducedPart
from pneumorph.robot.scaled_part import scaled_part

COUNT = 16
TOLERANCE = 0.01


@pytest.fixture(scope="module")
def whole() -> ReducedPart:
    return with_fewer_modes(ReducedPart.load(data_file("leg_measured.npz")), COUNT)


def bends(part: ReducedPart, highest_kPa: float) -> np.ndarray:
    """Free bends, and states around them that are alike in the energy that they take."""
    random, states = np.random.default_rng(0), []
    for found in rising_modal_equilibria(part, np.linspace(0.0, highest_kPa, 6), "polar"):
        assert found.converged
        factor = np.linalg.cholesky(part.stiffness(found.alpha, "polar"))
        aside = np.linalg.solve(factor.T, random.normal(size=(part.mode_count, 8)))
        sizes = 0.1 / part.range_ratio(aside.T)
        states += [found.alpha, *(found.alpha + (aside * sizes).T)]
    return np.array(states)


@pytest.fixture(scope="module")
def states(whole: ReducedPart) -> np.ndarray:
    return bends(whole, 60.0)


@pytest.fixture(scope="module")
def chosen(whole: ReducedPart, states: np.ndarray) -> FewerPoints:
    found = fewer_points(whole, states, TOLERANCE)
    assert found is not None
    return found


def test_they_are_few_and_their_forces_are_those_of_all(
    whole: ReducedPart, states: np.ndarray, chosen: FewerPoints
) -> None:
    """To the tolerance, in the energy of what the difference displaces."""
    part = chosen.of(whole)
    assert len(part.tetrahedron_index) == chosen.count < 0.5 * len(whole.tetrahedron_index)
    assert chosen.relative_residual <= TOLERANCE
    shares = []
    for state in states[1:]:
        forces = whole.internal_force(state, "polar")
        wrong, factor = (
            part.internal_force(state, "polar") - forces,
            whole.stiffness(state, "polar"),
        )
        energies = (each @ np.linalg.solve(factor, each) for each in (wrong, forces))
        shares.append(np.sqrt(np.divide(*energies)))
    assert np.sqrt(np.mean(np.square(shares))) < 3.0 * TOLERANCE  # rows are of moments too


def test_the_mirrored_part_is_its_own_image_as_all_points_make_it(
    whole: ReducedPart, states: np.ndarray, chosen: FewerPoints
) -> None:
    """Modes are symmetric or antisymmetric: by what they do at two nodes that are images."""
    nodes = whole.rest_nodes
    at = int(np.argmax(np.abs(nodes[:, 1])))
    image = int(np.argmin(np.linalg.norm(nodes - nodes[at] * [1.0, -1.0, 1.0], axis=1)))
    mirrored = whole.modes[at] * np.array([1.0, -1.0, 1.0])[:, None]
    parity = np.sign(np.einsum("am,am->m", mirrored, whole.modes[image]))
    part = chosen.of(whole)
    for state in states[1::5]:
        force = part.internal_force(state, "polar")
        of_image = part.internal_force(parity * state, "polar")
        # Modes are in single precision.
        assert np.allclose(of_image, parity * force, atol=1e-3 * np.abs(force).max())


def test_it_may_be_scaled_before_or_after(
    whole: ReducedPart, states: np.ndarray, chosen: FewerPoints
) -> None:
    first, second = scaled_part(chosen.of(whole), 1.1, 0.9), chosen.of(scaled_part(whole, 1.1, 0.9))
    state = np.sqrt(0.9) * states[10]
    assert np.array_equal(
        first.internal_force(state, "polar"), second.internal_force(state, "polar")
    )


def test_points_are_chosen_of_all_that_there_are_and_fit_no_other_part(
    whole: ReducedPart, states: np.ndarray, chosen: FewerPoints
) -> None:
    module = Module("leg", lambda: whole, lambda *_: None)  # type: ignore[arg-type, return-value]
    once = module.with_fewer_points(states, TOLERANCE)
    twice = once.with_fewer_points(states, TOLERANCE)
    assert once.reduced.digest() == twice.reduced.digest() != whole.digest()
    with pytest.raises(ValueError, match=r"chosen of \(304, 0\) tetrahedra's and membrane's"):
        chosen.of(once.reduced)


def test_where_no_few_do_all_stay(whole: ReducedPart, states: np.ndarray) -> None:
    ones = np.ones(len(whole.tetrahedron_index))
    assert fewer_points(replace(whole, tetrahedron_weight=ones), states, TOLERANCE) is None
    assert fewer_points(whole, states, 1e-12) is None
    with pytest.raises(ValueError, match="at least one state"):
        fewer_points(whole, states[:0], TOLERANCE)


def test_a_sampled_sheet_has_fewer_points_too() -> None:
    """The published leg's, of edge-based rotations."""
    leg = module_of_leg("published").reduced
    pressures = np.linspace(0.0, 300.0, 24)
    states = np.array([each.alpha for each in rising_modal_equilibria(leg, pressures)])
    found = fewer_points(leg, states, 5.0 * EcswSettings().hyperreduction_tolerance)
    assert found is not None
    part = found.of(leg)
    assert 0 < len(part.membrane_index) < len(leg.membrane_index)
    wrong = part.internal_force(states) - leg.internal_force(states)
    assert np.linalg.norm(wrong) < 0.2 * np.linalg.norm(leg.internal_force(states))
