"""Arrays of the library's nouns and of the reference step have the axes that are written there."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from jaxtyping import TypeCheckError

from pneumorph.simulation.reduced_state import ReducedState
from pneumorph.simulation.reference_contact import FrictionLaw, solve_friction
from pneumorph.simulation.reference_forces import pressure_force
from pneumorph.simulation.reference_mass import cross_matrix
from pneumorph.simulation.reference_step import StepSystem
from pneumorph.trajectory import Trajectory

pytest.importorskip("beartype")


def test_axes_of_one_name_are_of_one_length() -> None:
    StepSystem(np.eye(7), np.eye(7), np.eye(7), np.zeros(7))
    with pytest.raises(TypeCheckError, match="force"):
        StepSystem(np.eye(7), np.eye(7), np.eye(7), np.zeros(6))
    with pytest.raises(TypeCheckError, match="stiffness"):
        StepSystem(np.eye(7), np.zeros((7, 6)), np.eye(7), np.zeros(7))
    at_rest = np.zeros((2, 4))
    with pytest.raises(TypeCheckError, match="mode_rates"):
        ReducedState(
            np.zeros(3), np.eye(3), np.zeros(3), np.zeros(3), at_rest, at_rest.T,
            np.zeros(1), np.zeros((0, 3)), np.zeros((2, 0, 0, 6)),
        )  # fmt: skip


def test_arguments_have_the_axes_that_they_name() -> None:
    with pytest.raises(TypeCheckError, match="vector"):
        cross_matrix(np.zeros((1, 3)))
    with pytest.raises(TypeCheckError, match="vector"):
        cross_matrix(np.zeros(3, dtype=int))
    law = FrictionLaw(np.eye(3), np.zeros(3), np.ones(1))
    with pytest.raises(TypeCheckError, match="start"):
        solve_friction(law, np.zeros(3), 1e-9)
    with pytest.raises(TypeCheckError, match="alpha"):
        pressure_force(None, np.zeros((1, 3)), np.zeros(1))  # type: ignore[arg-type]


def test_what_is_saved_has_the_axes_that_its_file_promises(walk: Trajectory) -> None:
    with pytest.raises(TypeCheckError, match="contact_force_mN"):
        replace(walk, contact_force_mN=np.zeros((2, 4, 3), np.float32))


@pytest.fixture
def walk() -> Trajectory:
    place, pressure = np.zeros((2, 3)), np.zeros((2, 1))
    turn = np.tile(np.eye(3), (2, 1, 1))
    return Trajectory(np.arange(2.0), place, turn, place, pressure, pressure, np.zeros(2, int))
