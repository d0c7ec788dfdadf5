"""Reductions in the plugin's files: written, read back, and taken out of the world's frame."""

from __future__ import annotations

import ast
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from helpers.held_leg import held_leg
from helpers.two_chambers import two_chamber_mesh

from pneumorph.base.artefact import ArtefactError
from pneumorph.catalogue.leg_kinds import load_default_leg
from pneumorph.catalogue.leg_module import module_of_leg
from pneumorph.exchange.sofa_reduction import (
    in_hub_frame,
    read_sofa_reduction,
    read_table,
    reduced_part_of,
    write_sofa_reduction,
    write_table,
)
from pneumorph.exchange.sofa_scene import export_sofa_scene
from pneumorph.fem.bend import end_face_bend_deg
from pneumorph.fem.leg_model import leg_model
from pneumorph.fem.material import LegMaterials
from pneumorph.fem.part_model import PartModel
from pneumorph.reduction.assemble import Cubature, assemble_reduced_part
from pneumorph.reduction.modal_equilibrium import modal_equilibrium
from pneumorph.reduction.pod import mass_orthonormalise
from pneumorph.reduction.reduced_part import ReducedPart
from pneumorph.robot.scaled_part import scaled_part


@pytest.fixture(scope="module")
def model() -> PartModel:
    return module_of_leg("published").full


@pytest.fixture(scope="module")
def leg(model: PartModel) -> ReducedPart:
    """A leg whose mount is rigid, as the plugin's files have it."""
    return held_leg(model)


def _counts(model: PartModel) -> dict[str, int]:
    tetrahedra, membrane = (len(group.connectivity) for group in model.element_groups)
    return {"tetrahedra": tetrahedra, "membrane": membrane}


def _bend(part: ReducedPart, model: PartModel) -> float:
    return end_face_bend_deg(model.mesh, part.positions(modal_equilibrium(part, 150.0).alpha))


def test_a_leg_reads_back_as_it_was(model: PartModel, leg: ReducedPart, tmp_path: Path) -> None:
    part = leg
    write_sofa_reduction(tmp_path, part, _counts(model))
    read = reduced_part_of(read_sofa_reduction(tmp_path), model)
    # Modes are written to nine digits and kept in single precision (seven); the mesh's sums of mass
    # make them orthonormal to the same.
    np.testing.assert_allclose(read.modes, part.modes, atol=1e-6 * np.abs(part.modes).max())
    np.testing.assert_array_equal(read.tetrahedron_index, part.tetrahedron_index)
    np.testing.assert_allclose(read.tetrahedron_weight, part.tetrahedron_weight, rtol=1e-8)
    np.testing.assert_array_equal(read.membrane_index, part.membrane_index)
    assert _bend(read, model) == pytest.approx(_bend(part, model), rel=1e-5)


def test_files_have_the_plugins_layout(model: PartModel, leg: ReducedPart, tmp_path: Path) -> None:
    part = leg
    write_sofa_reduction(tmp_path, part, _counts(model))
    lines = (tmp_path / "modes.txt").read_text().splitlines()
    assert lines[0] == f"{3 * len(part.rest_nodes)} {part.mode_count}"
    assert float(lines[4].split()[2]) == pytest.approx(part.modes[1, 0, 2], rel=1e-8)
    lines = (tmp_path / "tetrahedra_RID.txt").read_text().splitlines()
    assert lines[0] == f"{len(part.tetrahedron_index)} 1"
    assert [int(v) for v in lines[1:]] == part.tetrahedron_index.tolist()
    lines = (tmp_path / "tetrahedra_weight.txt").read_text().splitlines()
    assert lines[0] == f"{_counts(model)['tetrahedra']} 1"
    assert sum(float(v) > 0 for v in lines[1:]) == len(part.tetrahedron_index)


def test_modes_of_the_world_give_the_same_leg(
    model: PartModel, leg: ReducedPart, tmp_path: Path
) -> None:
    """The same span, mixed and with rigid motions in every mode, as the plugin's own modes have."""
    part = leg
    rng = np.random.default_rng(2)
    # An orthogonal mix: an ill-conditioned one would magnify the nine digits of the file.
    mixed = part.modes @ np.linalg.qr(rng.standard_normal((part.mode_count,) * 2))[0]
    arms = part.rest_nodes - part.rest_nodes.mean(axis=0)
    for mode in range(part.mode_count):
        turn = 0.02 * np.abs(mixed).max() * rng.standard_normal(3) / 50.0
        shift = 0.5 * np.abs(mixed).max() * rng.standard_normal(3)
        mixed[:, :, mode] += shift + np.cross(turn, arms)
    shifts = np.zeros((len(arms), 3, 3))
    shifts[:, [0, 1, 2], [0, 1, 2]] = 1.0
    write_sofa_reduction(tmp_path / "data", part, _counts(model))
    modes = np.concatenate([mixed, shifts], axis=2)  # three modes are pure translation
    write_table(tmp_path / "data" / "modes.txt", modes.reshape(-1, modes.shape[2]))
    read = reduced_part_of(read_sofa_reduction(tmp_path), model)
    assert read.mode_count == part.mode_count
    assert read.metadata["torn_attachment"] < 1e-6
    # Nine digits are written, seven kept; the stiff sheet magnifies what is lost a hundredfold.
    assert _bend(read, model) == pytest.approx(_bend(part, model), rel=1e-5)


def test_a_rigid_motion_is_taken_out_whole() -> None:
    rng = np.random.default_rng(0)
    nodes = rng.standard_normal((30, 3))
    motion = np.array([1.0, 2.0, 3.0]) + np.cross([0.1, -0.2, 0.3], nodes)
    left, torn = in_hub_frame(motion[:, :, None], nodes, np.arange(4))
    assert np.abs(left).max() < 1e-12
    assert torn < 1e-12


def test_modes_that_tear_the_attachment_are_refused(
    model: PartModel, leg: ReducedPart, tmp_path: Path
) -> None:
    part = leg
    write_sofa_reduction(tmp_path, part, _counts(model))
    modes = part.modes.copy()
    modes[model.mesh.node_set("attachment")[0], 0, 0] = 0.5 * np.abs(modes).max()
    write_table(tmp_path / "modes.txt", modes.reshape(-1, part.mode_count))
    with pytest.raises(ValueError, match=r"tear the attachment: .* is not rigid"):
        reduced_part_of(read_sofa_reduction(tmp_path), model)


def test_reductions_of_another_mesh_are_refused(
    model: PartModel, leg: ReducedPart, tmp_path: Path
) -> None:
    part = leg
    counts = _counts(model)
    write_sofa_reduction(tmp_path, part, {**counts, "tetrahedra": counts["tetrahedra"] + 7})
    with pytest.raises(ValueError, match="fits 0 of the weights"):
        reduced_part_of(read_sofa_reduction(tmp_path), model)
    write_table(tmp_path / "modes.txt", part.modes.reshape(-1, part.mode_count)[:-3])
    with pytest.raises(ValueError, match="the reduction was made from another mesh"):
        reduced_part_of(read_sofa_reduction(tmp_path), model)


def test_a_truncated_table_is_refused(tmp_path: Path) -> None:
    write_table(tmp_path / "t.txt", np.arange(12.0).reshape(4, 3))
    np.testing.assert_array_equal(read_table(tmp_path / "t.txt"), np.arange(12.0).reshape(4, 3))
    text = (tmp_path / "t.txt").read_text()
    (tmp_path / "t.txt").write_text(text[: len(text) // 2])
    with pytest.raises(ValueError, match="it is truncated or no file of ModelOrderReduction"):
        read_table(tmp_path / "t.txt")


def test_the_scene_is_python_and_names_files_that_exist(
    model: PartModel, leg: ReducedPart, tmp_path: Path
) -> None:
    """SOFA itself is not at hand in tests: syntax, files, and the mesh's order are checked."""
    import meshio

    part = leg
    scene = export_sofa_scene(tmp_path, part, model)
    text = scene.read_text()
    tree = ast.parse(text)
    assert {node.name for node in tree.body if isinstance(node, ast.FunctionDef)} == {
        "hyper_reduced",
        "createScene",
    }
    assert f"MODE_COUNT = {part.mode_count}\n" in text
    for name in ("leg.vtk", "sheet.vtk", "cavity.stl"):
        assert f'"{name}"' in text
        assert (tmp_path / name).exists()
    leg = meshio.read(tmp_path / "leg.vtk")
    np.testing.assert_array_equal(leg.points, model.mesh.nodes)
    np.testing.assert_array_equal(leg.cells_dict["tetra"], model.mesh.tetrahedra)
    sheet = meshio.read(tmp_path / "sheet.vtk")
    np.testing.assert_array_equal(sheet.cells_dict["triangle"], model.mesh.surface("sheet"))
    read = reduced_part_of(read_sofa_reduction(tmp_path), model)
    assert read.mode_count == part.mode_count


def test_the_scene_has_the_mass_and_the_materials_of_its_part(
    model: PartModel, leg: ReducedPart, tmp_path: Path
) -> None:
    """And not those of the paper's leg, which the same mesh may be of."""
    soft = replace(leg.tetrahedron_material, young_modulus_kPa=464.0)
    own = scaled_part(replace(leg, tetrahedron_material=soft), 1.0, 0.042 / leg.mass)
    text = export_sofa_scene(tmp_path, own, model).read_text()
    assert "youngModulus=464.0" in text
    assert "totalMass=0.042" in text
    assert "thickness=1.0," in text
    thick = leg_model(model.mesh, LegMaterials(sheet_thickness_mm=0.3))
    own = assemble_reduced_part(thick, leg.modes, _cubatures(leg))
    assert "thickness=0.3," in export_sofa_scene(tmp_path / "thick", own, model).read_text()


def _cubatures(part: ReducedPart) -> tuple[Cubature, Cubature]:
    return (
        Cubature(part.tetrahedron_index, part.tetrahedron_weight),
        Cubature(part.membrane_index, part.membrane_weight),
    )


def test_a_part_whose_mass_is_not_even_has_no_scene(
    model: PartModel, leg: ReducedPart, tmp_path: Path
) -> None:
    """In the scene's mass its modes are not orthonormal: it would swing at other frequencies."""
    by_volume = leg_model(model.mesh, LegMaterials(mass_lumping="volume"))
    flat = mass_orthonormalise(leg.modes.reshape(-1, leg.mode_count), by_volume.node_mass)
    part = assemble_reduced_part(by_volume, flat.reshape(leg.modes.shape), _cubatures(leg))
    why = r"has a UniformMass.* may have been .* --materials.mass-lumping volume"
    with pytest.raises(ValueError, match=why):
        export_sofa_scene(tmp_path, part, model)
    assert not list(tmp_path.iterdir())


def test_it_is_told_whether_the_model_or_the_part_has_no_membrane(
    model: PartModel, leg: ReducedPart, tmp_path: Path
) -> None:
    solid = PartModel(model.mesh, model.material, leg.mass)
    samples = Cubature(leg.tetrahedron_index, leg.tetrahedron_weight)
    bare = assemble_reduced_part(solid, leg.modes, (samples,))
    with pytest.raises(ValueError, match="the part has no membrane though its model has one"):
        export_sofa_scene(tmp_path, bare, model)
    with pytest.raises(ValueError, match="the model has no membrane, expected a leg"):
        export_sofa_scene(tmp_path, leg, solid)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("names", [("cavity_left", "cavity_right"), ("cavity_left",)])
def test_a_scene_has_one_cavity_of_whatever_name(names: tuple[str, ...], tmp_path: Path) -> None:
    mesh = two_chamber_mesh()
    gone = {"cavity_left", "cavity_right"} - set(names)
    mesh = replace(
        mesh, surfaces={name: each for name, each in mesh.surfaces.items() if name not in gone}
    )
    model = leg_model(mesh)
    along = mesh.nodes[:, 0] - mesh.nodes[mesh.node_set("attachment"), 0].mean()
    modes = mass_orthonormalise(
        np.einsum("n,ij->nij", along**2, np.eye(3)).reshape(-1, 3), model.node_mass
    ).reshape(-1, 3, 3)
    groups = (len(group.connectivity) for group in model.element_groups)
    part = assemble_reduced_part(
        model, modes, tuple(Cubature.from_weights(np.ones(count)) for count in groups)
    )
    if len(names) == 2:
        with pytest.raises(ValueError, match="has 2 cavities: cavity_left, cavity_right, expected"):
            export_sofa_scene(tmp_path, part, model)
        assert not list(tmp_path.iterdir())
        return
    import meshio

    export_sofa_scene(tmp_path, part, model)
    written = meshio.read(tmp_path / "cavity.stl").cells_dict["triangle"]
    assert len(written) == len(mesh.surface("cavity_left"))


def test_springs_on_the_written_modes_hold_the_leg_as_its_mount_does(
    model: PartModel, tmp_path: Path
) -> None:
    """A displacement has the same energy in the springs as in the mount's stiffness."""
    part = load_default_leg("published")
    tree = ast.parse(export_sofa_scene(tmp_path, part, model).read_text())
    (stiffness,) = (
        ast.literal_eval(node.value)
        for node in tree.body
        if isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) == "MOUNT_STIFFNESS"
    )
    written = read_sofa_reduction(tmp_path).modes.reshape(-1, part.mode_count)
    alpha = np.random.default_rng(0).normal(size=part.mode_count)
    displacement = part.modes.reshape(written.shape) @ alpha
    turned, *_ = np.linalg.lstsq(written, displacement, rcond=None)
    # Modes are of single precision, seven digits.
    assert 0.5 * turned @ (stiffness * turned) == pytest.approx(
        0.5 * alpha @ part.linear_stiffness @ alpha, rel=1e-5
    )
    assert np.max(stiffness) > 0.0


@pytest.mark.parametrize("sampled", [True, False])
def test_a_part_of_quadratic_elements_has_no_scene(tmp_path: Path, sampled: bool) -> None:
    """Its points are several to an element: their numbers would be taken for those of elements,
    where they are not too high for any."""
    from helpers.synthetic_part import synthetic_part, vibration_modes

    quadratic = synthetic_part((4, 4, 4), quadratic=True)
    few = Cubature(np.arange(10), np.full(10, 50.0))
    chosen = [few, few] if sampled else None
    part = assemble_reduced_part(quadratic, vibration_modes(quadratic, 3), chosen)
    with pytest.raises(ValueError, match=r"of 10-node tetrahedra .* expected linear ones"):
        export_sofa_scene(tmp_path, part, quadratic)
    assert not list(tmp_path.iterdir())


def test_a_part_of_another_mesh_has_no_scene(
    model: PartModel, leg: ReducedPart, tmp_path: Path
) -> None:
    from helpers.synthetic_part import synthetic_reduced_part

    with pytest.raises(ArtefactError, match="this reduction was made from the mesh"):
        export_sofa_scene(tmp_path, synthetic_reduced_part(mode_count=4, cells=(4, 4, 4)), model)
