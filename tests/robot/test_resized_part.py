"""A part of another size against the laws of similarity, and against finite elements of that size.

The synthetic part has a solid, a sheet and a cavity; every field is exercised by one of the laws.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from helpers.synthetic_part import synthetic_part, vibration_modes

from pneumorph.fem.part_model import PartModel
from pneumorph.reduction.assemble import assemble_reduced_part
from pneumorph.reduction.modal_equilibrium import modal_equilibrium
from pneumorph.robot.resized_part import resized_part

SIZE = 0.6


def model(size: float) -> PartModel:
    usual = synthetic_part((4, 4, 4))
    sheets = tuple(replace(each, thickness_mm=size * each.thickness_mm) for each in usual.membranes)
    return PartModel(
        usual.mesh.scaled(size), usual.material, size**3 * usual.mass_kg, sheets, cavity="cavity"
    )


def test_it_is_what_a_reduction_of_the_smaller_mesh_gives() -> None:
    """Modes of the small mesh are those of the large one over the root of the mass, so every field
    must agree to single precision, in which modes are kept."""
    large, small = model(1.0), model(SIZE)
    modes = vibration_modes(large, 4).astype(np.float32).astype(float)
    reduced = resized_part(assemble_reduced_part(large, modes), SIZE)
    direct = assemble_reduced_part(small, modes / SIZE**1.5)
    for name in reduced.expected_shapes():
        ours, theirs = getattr(reduced, name), getattr(direct, name)
        if ours.dtype.kind == "U" or name == "snapshot_range":
            assert np.array_equal(ours, theirs)
            continue
        scale = np.abs(theirs).max(initial=0.0)
        np.testing.assert_allclose(ours, theirs, rtol=0, atol=1e-6 * scale, err_msg=name)
    assert reduced.mass == pytest.approx(direct.mass, rel=1e-12)


def test_pressure_bends_it_alike() -> None:
    """Statics without weight know no length: at equal pressure all places are s times as far."""
    part = assemble_reduced_part(model(1.0), vibration_modes(model(1.0), 4))
    small = resized_part(part, SIZE)
    large_shape, small_shape = (
        each.positions(modal_equilibrium(each, 30.0).alpha) for each in (part, small)
    )
    moved = np.abs(large_shape - part.rest_nodes).max()
    np.testing.assert_allclose(small_shape, SIZE * large_shape, atol=1e-6 * moved)
    assert moved > 1e-3


def test_all_energies_grow_with_the_volume() -> None:
    """At the same shape strains are the same, and the mount of s times the stiffness moves s times
    as far; forces along coordinates of s^(5/2) times the size are s^(1/2) times as large."""
    part = assemble_reduced_part(model(1.0), vibration_modes(model(1.0), 4))
    held = replace(part, linear_stiffness=np.diag([5e4, 2e4, 1e4, 3e4]))
    alpha = np.array([0.3, -0.2, 0.1, 0.05])
    small = resized_part(held, SIZE)
    np.testing.assert_allclose(
        small.internal_force(SIZE**2.5 * alpha), SIZE**0.5 * held.internal_force(alpha), rtol=1e-9
    )


def test_a_size_that_is_none_is_refused() -> None:
    part = assemble_reduced_part(model(1.0), vibration_modes(model(1.0), 2))
    with pytest.raises(ValueError, match="size_factor must be positive"):
        resized_part(part, -1.0)
