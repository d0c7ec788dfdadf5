"""How far a part's tip gives way under small forces."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.synthetic_part import rubber_part, rubber_reduced_part

from pneumorph.fem.static import StaticSettings, static_equilibrium
from pneumorph.fem.static_answers import UnstableError, static_answers
from pneumorph.geometry.face_tie import FaceTie
from pneumorph.geometry.mesh import MeshError
from pneumorph.reduction.assemble import assemble_reduced_part
from pneumorph.reduction.blocked_force import even_load
from pneumorph.reduction.modal_equilibrium import modal_equilibrium
from pneumorph.reduction.tip_answers import tip_answers
from pneumorph.reduction.tip_compliance import reduced_tip_compliance, tip_compliance

PRESSURE_KPA = 2.0
FORCE_MN = 0.05
"""Moves the tip by hundredths of a millimetre: what goes as its cube is 1e-5 of that."""
MODEL = rubber_part()
HELD = FaceTie.of(MODEL.mesh).nodes
LOAD = even_load(MODEL.mesh, "outer_end_face")


def test_of_finite_elements_it_is_the_difference_of_two_equilibria():
    tight = StaticSettings(tolerance=1e-10, load_step_kPa=1.0)

    def tip(force: np.ndarray) -> np.ndarray:
        found = static_equilibrium(
            MODEL,
            PRESSURE_KPA,
            HELD,
            external_force=LOAD[:, None] * force,
            rotation="polar",
            settings=tight,
        )
        assert found.converged
        return found.positions

    x = tip(np.zeros(3))
    compliance = tip_compliance(MODEL, x, PRESSURE_KPA, "polar")
    np.testing.assert_allclose(compliance, compliance.T, rtol=1e-8, atol=1e-12)
    assert np.linalg.eigvalsh(compliance).min() > 0.0
    for axis, force in enumerate(FORCE_MN * np.eye(3)):
        moved = LOAD @ (tip(force) - tip(-force)) / (2.0 * FORCE_MN)
        np.testing.assert_allclose(compliance[axis], moved, atol=1e-4 * compliance.max())


def test_of_a_reduced_part_it_is_the_difference_of_two_equilibria():
    part = rubber_reduced_part(6, pressures=3, stretches=4)
    tip = np.einsum("n,nim->im", LOAD, part.modes)

    def found(force: np.ndarray) -> np.ndarray:
        result = modal_equilibrium(part, PRESSURE_KPA, external=force @ tip, rotation="polar")
        assert result.converged
        return result.alpha

    alpha = found(np.zeros(3))
    pressure = np.full(part.cavity_count, PRESSURE_KPA)
    compliance = reduced_tip_compliance(part, MODEL.mesh, alpha, pressure, "polar")
    for axis, force in enumerate(FORCE_MN * np.eye(3)):
        moved = tip @ (found(force) - found(-force)) / (2.0 * FORCE_MN)
        np.testing.assert_allclose(compliance[axis], moved, atol=1e-4 * compliance.max())


def test_modes_that_are_the_answers_themselves_give_way_as_the_finite_elements_do():
    """Galerkin's projection is exact for forces whose answers it contains; modes are kept in single
    precision, of which the stiff sheet and volumes make 1e-3."""
    forces = LOAD[:, None, None] * np.eye(3)
    answers = static_answers(MODEL, MODEL.rest_nodes, 0.0, HELD, forces, "polar")
    mass = np.einsum("nia,n,nib->ab", answers, MODEL.node_mass, answers)
    modes = answers @ np.linalg.inv(np.linalg.cholesky(mass)).T
    part = assemble_reduced_part(MODEL, modes)
    rest = np.zeros(3)
    compliance = reduced_tip_compliance(part, MODEL.mesh, rest, np.zeros(1), "polar")
    expected = tip_compliance(MODEL, MODEL.rest_nodes, 0.0, "polar")
    np.testing.assert_allclose(compliance, expected, atol=1e-3 * expected.max())


def test_a_state_that_would_buckle_has_no_answers():
    """Squeezed to four fifths of its length the box would give way sideways."""
    squeezed = MODEL.rest_nodes * np.array([0.8, 1.0, 1.0])
    with pytest.raises(UnstableError, match=r"at 0.0 kPa is no stable equilibrium"):
        tip_compliance(MODEL, squeezed, 0.0, "polar")
    displacement = np.stack([np.zeros_like(squeezed), squeezed - MODEL.rest_nodes])
    found = tip_answers(MODEL, displacement, np.zeros((2, 1)), "polar")
    assert len(found.moved) == 3
    np.testing.assert_array_equal(found.positions[0], MODEL.rest_nodes)


def test_a_face_that_is_not_there_is_refused():
    with pytest.raises(MeshError, match="inner_end"):
        tip_compliance(MODEL, MODEL.rest_nodes, 0.0, "polar", "inner_end")
