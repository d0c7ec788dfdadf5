"""A reduced part against the finite elements it was made from."""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from helpers.synthetic_part import synthetic_part, synthetic_reduced_part, vibration_modes

from pneumorph.base.artefact import ArtefactError, save_artefact
from pneumorph.base.settings import settings_to_dict
from pneumorph.fem.material import LegMaterials, MassLumping, Material, Membrane
from pneumorph.fem.part_model import PartModel
from pneumorph.reduction.assemble import assemble_reduced_part
from pneumorph.reduction.errors import force_errors
from pneumorph.reduction.modal_equilibrium import modal_equilibrium
from pneumorph.reduction.part_file import FORMAT_VERSION
from pneumorph.reduction.reduced_part import ReducedPart
from pneumorph.robot.scaled_part import scaled_part

PART = synthetic_part()
MODE_COUNT = 8
REDUCED = synthetic_reduced_part(MODE_COUNT)


def large_state(seed: int = 0) -> np.ndarray:
    """Modal coordinates that move nodes by several millimetres."""
    return np.random.default_rng(seed).normal(size=MODE_COUNT)


@pytest.mark.parametrize("rotation", ["edge", "polar"])
def test_every_element_with_unit_weight_is_the_galerkin_projection(rotation):
    # Same sums in another order: rounding of about 1e-16 times the number of elements.
    alpha = large_state()
    x = REDUCED.positions(alpha)
    assert np.abs(x - REDUCED.rest_nodes).max() > 5.0
    flat = REDUCED.modes.reshape(-1, MODE_COUNT)

    force = flat.T @ PART.internal_force(x, rotation).ravel()
    reduced_force = REDUCED.internal_force(alpha, rotation)
    assert np.abs(reduced_force - force).max() < 1e-12 * np.abs(force).max()

    stiffness = flat.T @ PART.stiffness(x, rotation) @ flat
    reduced_stiffness = REDUCED.stiffness(alpha, rotation)
    assert np.abs(reduced_stiffness - stiffness).max() < 1e-12 * np.abs(stiffness).max()


def test_forces_of_many_states_equal_those_of_each():
    states = np.array([large_state(seed) for seed in range(3)])
    together = REDUCED.internal_force(states)
    alone = np.array([REDUCED.internal_force(state) for state in states])
    assert np.abs(together - alone).max() < 1e-12 * np.abs(alone).max()


def test_positions_of_many_states_equal_those_of_each():
    states = np.array([[large_state(seed) for seed in range(3)] for _ in range(2)])
    states[1] *= -0.5
    together = REDUCED.positions(states)
    alone = [[REDUCED.positions(state) for state in row] for row in states]
    np.testing.assert_allclose(together, alone, rtol=0.0, atol=1e-12 * np.abs(together).max())


def test_modes_are_mass_orthonormal_and_vanish_at_the_attachment():
    product = np.einsum("n,nim,nik->mk", PART.node_mass, REDUCED.modes, REDUCED.modes)
    # Stored in single precision.
    assert np.abs(product - np.eye(MODE_COUNT)).max() < 1e-6
    assert np.all(REDUCED.modes[PART.mesh.node_sets["attachment"]] == 0.0)


def test_equilibrium_at_rest_is_rest_and_small_pressures_bend_in_proportion():
    assert np.abs(modal_equilibrium(REDUCED, 0.0).alpha).max() < 1e-12  # rounding
    small = modal_equilibrium(REDUCED, 1e-3)
    twice = modal_equilibrium(REDUCED, 2e-3)
    assert small.converged
    assert twice.converged
    # The curvature of the response changes this by the order of the displacement, 1e-4 mm of 1 mm.
    assert np.abs(twice.alpha - 2.0 * small.alpha).max() < 1e-3 * np.abs(small.alpha).max()


def test_contact_points_know_their_surface_in_a_file_too(tmp_path):
    """The box stands on its sheet; a file of an earlier version, which does not say so, is read."""
    path = REDUCED.save(tmp_path / "part.npz")
    again = ReducedPart.load(path).contact_surfaces
    assert again.known_names() == ["sheet"]
    np.testing.assert_array_equal(again.area_mm2, PART.mesh.contact_surfaces.area_mm2)
    older = dataclasses.replace(
        REDUCED, contact_surface=np.zeros(0, dtype=str), contact_area_mm2=np.zeros(0)
    )
    unnamed = ReducedPart.load(older.save(tmp_path / "older.npz"))
    assert unnamed.contact_surfaces.known_names() == []
    assert len(unnamed.contact_surfaces.names) == len(REDUCED.contact_points)
    # It moves as it did.
    assert unnamed.digest() == older.digest() == REDUCED.digest()
    with pytest.raises(ValueError, match=r"contact_surface must have shape \(6,\)"):
        dataclasses.replace(REDUCED, contact_surface=np.array(["a"]))


def test_equilibrium_refuses_a_pressure_that_is_not_finite():
    with pytest.raises(ValueError, match="pressure_kPa must be finite"):
        modal_equilibrium(REDUCED, np.nan)


def test_equilibrium_reports_that_it_did_not_converge():
    result = modal_equilibrium(REDUCED, 50.0, iteration_limit=1)
    assert not result.converged
    assert result.iterations == 1


def test_without_a_load_a_part_comes_back_to_rest_in_as_many_steps_as_it_says():
    start = 0.1 * large_state()
    found = modal_equilibrium(REDUCED, 0.0, start=start)
    assert found.converged
    assert np.abs(found.alpha).max() < 1e-9
    within = [
        modal_equilibrium(REDUCED, 0.0, start=start, iteration_limit=limit).converged
        for limit in (found.iterations - 1, found.iterations)
    ]
    assert within == [False, True]


def test_mass_may_lie_on_a_line():
    """Rounding makes its spread across the line negative: as little is no negative mass."""
    across, along = -1e-10, 1e3
    moments = {"first_moment": np.zeros(3), "second_moment": np.diag([across, 0.0, along])}
    moments["second_moment"] = REDUCED.mass * moments["second_moment"]
    assert dataclasses.replace(REDUCED, **moments).mass == REDUCED.mass
    moments["second_moment"] = REDUCED.mass * np.diag([-1.0, 0.0, along])
    with pytest.raises(ValueError, match="spread the mass by -1 mm"):
        dataclasses.replace(REDUCED, **moments)


@pytest.mark.parametrize("size", [1.0, 1e-6])
def test_errors_of_forces_are_relative_however_small_they_are(size):
    stiffer = scaled_part(REDUCED, modulus_factor=1.1)
    errors = force_errors(stiffer, REDUCED, size * np.stack([large_state(0), large_state(1)]))
    np.testing.assert_allclose(errors, 0.1, rtol=1e-6)


def test_contact_points_follow_the_solid():
    # Every contact point of the synthetic part is a node.
    alpha = large_state()
    moved = REDUCED.contact_points + REDUCED.contact_modes @ alpha
    nodes = REDUCED.positions(alpha)
    for point, position in zip(REDUCED.contact_points, moved, strict=True):
        node = np.argmin(np.linalg.norm(REDUCED.rest_nodes - point, axis=1))
        assert np.abs(nodes[node] - position).max() < 1e-9


def test_saved_part_is_the_part(tmp_path):
    loaded = ReducedPart.load(REDUCED.save(tmp_path / "part.npz"))
    for item in dataclasses.fields(ReducedPart):
        if item.name != "metadata":
            assert np.array_equal(getattr(loaded, item.name), getattr(REDUCED, item.name))
    loaded.check_mesh(PART.mesh)


def test_numpy_alone_reads_a_part_as_the_documents_say(tmp_path, monkeypatch):
    part = synthetic_reduced_part(4, (4, 4, 4), "stable_neo_hookean", quadratic=True)
    part.save(tmp_path / "leg.npz")
    monkeypatch.chdir(tmp_path)
    text = (Path(__file__).parents[2] / "docs" / "file_formats.md").read_text()
    (block,) = (b for b in re.findall(r"```python\n(.*?)```", text, re.DOTALL) if "leg.npz" in b)
    read: dict = {}
    exec(compile(block, "file_formats.md", "exec"), read)
    alpha = read["alpha"]
    # The same formulas; modes are stored as the part in memory has them.
    np.testing.assert_allclose(read["nodes"], part.positions(alpha), rtol=1e-13)
    assert read["volume"][0] == pytest.approx(part.cavity(0).volume(alpha), rel=1e-12)
    force = part.tetrahedra.force(alpha)
    np.testing.assert_allclose(read["force"], force, atol=1e-11 * np.abs(force).max())


def test_materials_are_saved_and_another_one_is_refused(tmp_path):
    loaded = ReducedPart.load(REDUCED.save(tmp_path / "part.npz"))
    loaded.check_model(PART)
    assert loaded.digest() == REDUCED.digest()
    stiffer = dataclasses.replace(REDUCED, membrane_material=Material(2321.0, 0.49))
    assert stiffer.digest() != REDUCED.digest()
    with pytest.raises(ArtefactError, match=r"membrane elements are of .*2321.0.*, got .*2320.0"):
        stiffer.check_model(PART)


def test_a_law_that_is_not_known_is_refused(tmp_path):
    other = dataclasses.replace(REDUCED, tetrahedron_material=Material(1160.0, 0.2, "nobodys"))
    path = other.save(tmp_path / "part.npz")
    with pytest.raises(ArtefactError, match="has the law 'nobodys'"):
        ReducedPart.load(path)


def test_another_mesh_is_refused():
    with pytest.raises(ArtefactError, match="was made from the mesh"):
        REDUCED.check_mesh(synthetic_part((6, 4, 4)).mesh)


def test_another_format_version_is_refused(tmp_path):
    path = save_artefact(tmp_path / "part.npz", "ReducedPart", 99, {}, {})
    with pytest.raises(ArtefactError, match="format version 99"):
        ReducedPart.load(path)


def test_missing_arrays_are_refused(tmp_path):
    path = save_artefact(
        tmp_path / "part.npz", "ReducedPart", FORMAT_VERSION, {"skin": np.zeros(3)}, {}
    )
    with pytest.raises(ArtefactError, match="lacks"):
        ReducedPart.load(path)


def test_mixed_shapes_and_negative_weights_are_refused():
    with pytest.raises(ValueError, match="linear_stiffness must have shape"):
        dataclasses.replace(REDUCED, linear_stiffness=np.zeros((3, 3)))
    with pytest.raises(ValueError, match="tetrahedron_weight must not be negative"):
        dataclasses.replace(REDUCED, tetrahedron_weight=-REDUCED.tetrahedron_weight)


def test_modes_of_another_mesh_are_refused():
    other = vibration_modes(synthetic_part((6, 4, 4)), 2)
    with pytest.raises(ValueError, match="modes must have shape"):
        assemble_reduced_part(PART, other)


def test_whatever_a_part_moves_by_is_in_its_digest():
    """Each array by itself, present or not, so that no two parts that walk apart pass for one."""
    silent = {"contact_surface", "contact_area_mm2", "snapshot_range", "metadata"}
    for field in dataclasses.fields(ReducedPart):
        value = getattr(REDUCED, field.name)
        if field.name in silent or not isinstance(value, np.ndarray):
            continue
        other = dataclasses.replace(REDUCED)
        changed = (
            value.copy() if value.size else np.zeros([max(length, 1) for length in value.shape])
        )
        changed.ravel()[0] += 1
        object.__setattr__(other, field.name, changed)
        assert other.digest() != REDUCED.digest(), field.name


def test_nothing_keeps_a_mean_in_place_where_none_was_asked_for():
    assert modal_equilibrium(REDUCED, 1.0).keeping_mN == 0.0


def test_a_balance_that_is_never_found_is_given_up(monkeypatch):
    """Forces that jump at each look leave Newton nowhere; two hundred steps are plenty."""
    generator = np.random.default_rng(0)
    force = ReducedPart.internal_force

    def jumping(part, alpha, *rotation):
        return force(part, alpha, *rotation) + generator.normal(size=np.shape(alpha))

    monkeypatch.setattr(ReducedPart, "internal_force", jumping)
    found = modal_equilibrium(REDUCED, 1.0)
    assert not found.converged
    assert found.iterations == 200


def test_finite_elements_of_another_mass_are_refused():
    """But for what rounds a number of a data sheet."""
    part = synthetic_reduced_part(mode_count=2, cells=(4, 4, 4))
    for mass, same in ((0.105, True), (0.10505, True), (0.047, False)):
        full = synthetic_part((4, 4, 4))
        model = PartModel(full.mesh, full.material, mass, full.membranes, "cavity")
        if same:
            part.check_model(model)
            continue
        with pytest.raises(ArtefactError, match="weighs 105 g, got finite elements of 47 g"):
            part.check_model(model)


def model_like(full: PartModel, membranes: Sequence[Membrane], lumping: MassLumping) -> PartModel:
    """The same finite elements with other sheets, or a mass shared otherwise."""
    return PartModel(full.mesh, full.material, full.mass_kg, membranes, "cavity", lumping)


def test_finite_elements_of_another_number_of_sheets_are_refused():
    full = synthetic_part((4, 4, 4))
    (sheet,) = full.membranes
    part = synthetic_reduced_part(mode_count=2, cells=(4, 4, 4))
    two = (sheet, dataclasses.replace(sheet, surface="skin"))
    for membranes in ((), two):
        with pytest.raises(ArtefactError, match=rf"has one sheet, got .* of {len(membranes)}"):
            part.check_model(model_like(full, membranes, "even"))
    bare = model_like(full, (), "even")
    without = assemble_reduced_part(bare, vibration_modes(bare, 2))
    without.check_model(bare)
    with pytest.raises(ArtefactError, match="has no sheet, got finite elements of 1"):
        without.check_model(full)


def test_finite_elements_of_another_thickness_or_lumping_are_refused_where_they_are_known():
    """In the size in which the part is: one twice as large has a sheet twice as thick."""
    full = synthetic_part((4, 4, 4))
    thick = [dataclasses.replace(full.membranes[0], thickness_mm=2.0)]
    part = synthetic_reduced_part(mode_count=2, cells=(4, 4, 4))
    part.check_model(model_like(full, thick, "volume"))  # it does not know
    said = {"materials": settings_to_dict(LegMaterials())}
    knowing = dataclasses.replace(part, metadata={**part.metadata, **said})
    knowing.check_model(full)
    with pytest.raises(ArtefactError, match=r"is 1 mm thick, got .* of 2 mm"):
        knowing.check_model(model_like(full, thick, "even"))
    with pytest.raises(ArtefactError, match=r"shared by 'even' lumping .* with 'volume'"):
        knowing.check_model(model_like(full, full.membranes, "volume"))
    larger = dataclasses.replace(knowing, metadata={**knowing.metadata, "size_factor": 2.0})
    larger.check_model(model_like(full, thick, "even"))
