"""A stiff sheet seen by few fields of stress."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from helpers.synthetic_part import rubber_part, rubber_reduced_part, synthetic_part

from pneumorph.geometry.pose import rotation_about
from pneumorph.reduction.mixed_sheet import mixed_sheet, scaled_strain, stress_fields
from pneumorph.reduction.reduced_part import ReducedPart
from pneumorph.robot.resized_part import resized_part
from pneumorph.robot.scaled_part import scaled_part

MODE_COUNT = 6
MODEL = rubber_part()
SHEET = MODEL.element_groups[1]
SAMPLED = rubber_reduced_part(MODE_COUNT)
MODES = SAMPLED.modes
MIRROR = MODEL.mesh.mirror_nodes


def some_state(seed: int = 0) -> np.ndarray:
    return 0.5 * np.random.default_rng(seed).normal(size=MODE_COUNT)


def alone(strains: np.ndarray) -> list[tuple[np.ndarray, None]]:
    return [(each, None) for each in strains]


def mirrored(x: np.ndarray) -> np.ndarray:
    image = np.empty_like(x)
    image[MIRROR] = x * np.array([1.0, -1.0, 1.0])
    return image


def test_scaled_strain_has_the_sheets_energy_and_is_blind_to_turns():
    x = SAMPLED.positions(some_state())
    strain = scaled_strain(SHEET, x)
    assert 0.5 * strain @ strain == pytest.approx(SHEET.energy(x), rel=1e-12)
    turned = scaled_strain(SHEET, x @ rotation_about("x", 50.0).T)
    np.testing.assert_allclose(turned, strain, atol=1e-9 * np.abs(strain).max())


def test_with_a_field_for_every_strain_it_is_the_finite_elements_sheet():
    """The same sums in another order: rounding alone."""
    every = np.eye(3 * SHEET.element_count)
    mixed, alpha = mixed_sheet(SHEET, SAMPLED.rest_nodes, MODES, every), some_state()
    x = SAMPLED.positions(alpha)
    assert mixed.energy(alpha) == pytest.approx(SHEET.energy(x), rel=1e-10)
    force = SAMPLED.membrane.force(alpha, "polar")
    np.testing.assert_allclose(mixed.force(alpha), force, atol=1e-10 * np.abs(force).max())
    stiffness = SAMPLED.membrane.objective_stiffness(alpha)
    np.testing.assert_allclose(
        mixed.stiffness(alpha), stiffness, atol=1e-10 * np.abs(stiffness).max()
    )


def test_force_is_the_derivative_of_the_energy():
    sheet, alpha, step = rubber_reduced_part(stretches=4).sheet, some_state(), 1e-5
    force = sheet.force(alpha)
    for mode, unit in enumerate(step * np.eye(MODE_COUNT)):
        slope = (sheet.energy(alpha + unit) - sheet.energy(alpha - unit)) / (2.0 * step)
        # step^2 of third derivatives as large as the force's: 1e-7 at most.
        assert -slope == pytest.approx(force[mode], abs=1e-6 * np.abs(force).max())
    both = np.stack([alpha, -alpha])
    np.testing.assert_allclose(sheet.force(both)[0], force, rtol=1e-12)


def test_fields_hold_the_snapshots_they_are_of_and_no_more_than_asked_for():
    states = [some_state(seed) for seed in range(4)]
    strains = np.array([scaled_strain(SHEET, SAMPLED.positions(state)) for state in states])
    found = stress_fields(alone(strains), 10)
    np.testing.assert_allclose(found.T @ found, np.eye(4), atol=1e-12)
    mixed = mixed_sheet(SHEET, SAMPLED.rest_nodes, MODES, found)
    for state in states:
        energy = SHEET.energy(SAMPLED.positions(state))
        assert mixed.energy(state) == pytest.approx(energy, rel=1e-9)
    # A projection: of a state that is none of them it has less than all of the energy.
    other = some_state(9)
    assert mixed.energy(other) < 0.99 * SHEET.energy(SAMPLED.positions(other))
    assert stress_fields(alone(strains), 2).shape[1] == 2
    with pytest.raises(ValueError, match="strains is zero in every snapshot"):
        stress_fields(alone(0.0 * strains), 4)


def test_fields_are_symmetric_or_antisymmetric_where_the_part_has_a_mirror():
    """So a mirrored state has the same energy, to rounding, and not without the images."""
    states = [SAMPLED.positions(some_state(seed)) for seed in range(3)]
    strains = np.array([scaled_strain(SHEET, x) for x in states])
    images = np.array([scaled_strain(SHEET, mirrored(x)) for x in states])
    other = SAMPLED.positions(some_state(9))
    own, image = scaled_strain(SHEET, other), scaled_strain(SHEET, mirrored(other))
    paired = stress_fields(zip(strains, images, strict=True), 10)
    unpaired = stress_fields(alone(strains), 10)
    assert paired.shape[1] == 6
    np.testing.assert_allclose(np.abs(image @ paired), np.abs(own @ paired), rtol=1e-9)
    apart = np.abs(np.abs(image @ unpaired) - np.abs(own @ unpaired))
    assert apart.max() > 1e-3 * np.abs(own @ unpaired).max()


def test_a_sheet_of_another_law_is_refused():
    group = synthetic_part((4, 4, 4)).element_groups[1]
    with pytest.raises(ValueError, match=r"law is 'corotational'.*sample its triangles"):
        scaled_strain(group, synthetic_part((4, 4, 4)).rest_nodes)


def test_a_part_keeps_its_sheet_in_a_file_and_in_other_sizes_and_materials(tmp_path):
    part, alpha = rubber_reduced_part(stretches=4), some_state()
    assert len(part.membrane_rest) == 0
    assert part.membrane_material == SHEET.material
    read = ReducedPart.load(part.save(tmp_path / "part.npz"))
    assert read.digest() == part.digest() != SAMPLED.digest()
    np.testing.assert_array_equal(read.sheet.energy(alpha), part.sheet.energy(alpha))
    part.check_model(MODEL)
    # Energies are as the moduli, and as lengths cubed at the same strain.
    heavier = scaled_part(part, modulus_factor=1.5, mass_factor=4.0)
    assert heavier.sheet.energy(2.0 * alpha) == pytest.approx(1.5 * part.sheet.energy(alpha))
    larger = resized_part(part, 2.0)
    assert larger.sheet.energy(2.0**2.5 * alpha) == pytest.approx(8.0 * part.sheet.energy(alpha))


def test_what_would_be_wrong_with_such_fields_is_refused():
    part = rubber_reduced_part(stretches=4)
    with pytest.raises(ValueError, match=r"sampled points beside 4 stretches, expected none"):
        replace(SAMPLED, stretch_1=part.stretch_1, stretch_2=part.stretch_2)
    with pytest.raises(ValueError, match=r"the membrane's law is 'corotational'"):
        replace(part, membrane_material=replace(part.membrane_material, law="corotational"))
    solid = replace(part.tetrahedron_material, law="corotational", dilatation="pointwise")
    none = {f"dilatation_{n}": np.zeros((0, *(MODE_COUNT,) * n)) for n in (1, 2, 3)}
    with pytest.raises(ValueError, match=r"the solid's law is 'corotational'"):
        replace(part, tetrahedron_material=solid, **none)


def test_a_part_without_such_fields_is_what_it_was():
    assert SAMPLED.stretch_1.shape == (0, MODE_COUNT)
    assert SAMPLED.stretch_2.shape == (0, MODE_COUNT, MODE_COUNT)
    assert SAMPLED.sheet.energy(some_state()) == 0.0
