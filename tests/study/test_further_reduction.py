"""A leg that is reduced again after it was calibrated or resized, read by robots that do so."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from helpers.synthetic_part import synthetic_mesh, synthetic_part, vibration_modes

from pneumorph.base.settings import settings_to_dict
from pneumorph.catalogue.leg_module import module_of_leg
from pneumorph.catalogue.masses import Masses
from pneumorph.catalogue.module_description import ModuleDescription
from pneumorph.catalogue.paper_robot import paper_robot
from pneumorph.catalogue.robot_spec import RobotSpec
from pneumorph.fem.material import LegMaterials
from pneumorph.fem.part_model import PartModel
from pneumorph.physics.calibration import Calibration
from pneumorph.physics.pressure import PressureMap
from pneumorph.reduction.assemble import assemble_reduced_part
from pneumorph.reduction.reduced_part import ReducedPart
from pneumorph.robot.scaled_part import factors_between
from pneumorph.study.reduction import said_of_further

CELLS = (4, 4, 4)
FACTOR = 1.2
MATERIALS = LegMaterials(mass_kg=0.047)


def reduced(full: PartModel) -> ReducedPart:
    """Of vibration modes, which no snapshots are needed for."""
    return assemble_reduced_part(full, vibration_modes(full, 4))


@pytest.fixture(scope="module")
def part() -> ReducedPart:
    """The leg as it was reduced first."""
    said = {"materials": settings_to_dict(MATERIALS)}
    full = synthetic_part(CELLS)
    heavy = PartModel(full.mesh, full.material, MATERIALS.mass_kg, full.membranes, "cavity")
    made = reduced(heavy)
    return replace(made, metadata={**made.metadata, **said})


def robot(part: ReducedPart | Path, size: float = 1.0, modulus: float | None = None) -> RobotSpec:
    """The paper's, on the leg in a size, under a calibration of a modulus."""
    mesh = synthetic_mesh(CELLS)
    spec = paper_robot(module_of_leg("published", part, mesh, masses=Masses(), size_factor=size))
    return spec.calibrated(Calibration(PressureMap(), modulus_factor=modulus))


def again(spec: RobotSpec, folder: Path) -> Path:
    """Another reduction of the robot's leg as it is, as a round of a certificate makes one."""
    made = reduced(spec.module.full)
    made.metadata.update(said_of_further(spec))
    return made.save(folder / "round_1.npz")


def stiffness(part: ReducedPart) -> np.ndarray:
    """Where it is bent a little, (mode, mode)."""
    return part.stiffness(np.array([0.3, -0.2, 0.1, 0.05]))


@pytest.mark.parametrize(("size", "modulus"), [(1.0, FACTOR), (0.8, None), (0.8, FACTOR)])
def test_a_further_reduction_read_as_its_robot_is_the_leg_of_the_round(
    size: float, modulus: float | None, part: ReducedPart, tmp_path: Path
) -> None:
    """Once as stiff and as large, though its file is of a leg that was both already."""
    spec = robot(part, size, modulus)
    file = again(spec, tmp_path)
    inside = spec.reduced_again(file).module
    read = robot(file, size, modulus).module
    np.testing.assert_allclose(read.reduced.rest_nodes, inside.reduced.rest_nodes, rtol=1e-12)
    np.testing.assert_allclose(
        stiffness(read.reduced), stiffness(inside.reduced), rtol=1e-9, atol=1e-9
    )
    assert read.reduced.mass == pytest.approx(inside.reduced.mass, rel=1e-12)
    np.testing.assert_allclose(
        read.reduced.cavity_centres_mm, inside.reduced.cavity_centres_mm, rtol=1e-12
    )
    np.testing.assert_allclose(
        inside.reduced.cavity_centres_mm, inside.full.cavity_centres_mm, rtol=1e-12
    )
    assert read.full.mass_kg == pytest.approx(inside.full.mass_kg, rel=1e-12)
    # It stands for the finite elements, in the round and beyond it.
    read.check_reduction()
    inside.check_reduction()
    # A calibration knows the leg by it, and other reductions are made alike.
    assert read.bending_digest == spec.module.bending_digest
    for own in (read.reduced, inside.reduced):
        np.testing.assert_allclose(
            factors_between(part, own), (size, modulus or 1.0, 1.0, 1.0), rtol=1e-12
        )


def test_a_further_reduction_takes_another_calibration_and_size(
    part: ReducedPart, tmp_path: Path
) -> None:
    file = again(robot(part, 0.8, FACTOR), tmp_path)
    young_kPa = part.tetrahedron_material.young_modulus_kPa
    for size, modulus in ((1.0, None), (0.9, 1.5)):
        module = robot(file, size, modulus).module
        own = module.reduced
        assert own.tetrahedron_material.young_modulus_kPa == (modulus or 1.0) * young_kPa
        np.testing.assert_allclose(own.rest_nodes, size * part.rest_nodes, rtol=1e-12)
        assert own.mass == pytest.approx(size**3 * part.mass, rel=1e-12)
        module.check_reduction()


def test_a_round_after_another_says_what_the_first_one_did(
    part: ReducedPart, tmp_path: Path
) -> None:
    spec = robot(part, 0.8, FACTOR)
    first = spec.reduced_again(again(spec, tmp_path))
    assert said_of_further(first) == said_of_further(spec)


def test_a_further_reduction_of_an_unchanged_leg_says_nothing_more(part: ReducedPart) -> None:
    assert said_of_further(robot(part)) == {"materials": settings_to_dict(MATERIALS)}


def test_a_robots_file_takes_a_further_reduction_of_its_resized_module(
    part: ReducedPart, tmp_path: Path
) -> None:
    """Beside the mesh of the leg before."""
    synthetic_mesh(CELLS).save(tmp_path / "mesh.npz")
    file = again(robot(part, 0.8), tmp_path)
    described = ModuleDescription(part=Path(file.name), mesh=Path("mesh.npz"), size_factor=0.8)
    module = described.module("short", tmp_path, tmp_path, "published")
    np.testing.assert_allclose(module.reduced.rest_nodes, 0.8 * part.rest_nodes, rtol=1e-12)
    own = described.own_part(tmp_path, tmp_path)
    assert own is not None
    np.testing.assert_allclose(own.cavity_volume, part.cavity_volume, rtol=1e-12)


def test_a_part_that_was_scaled_after_it_was_reduced_is_read_as_it_is(
    part: ReducedPart, tmp_path: Path
) -> None:
    """Nothing in it tells robots to make it otherwise."""
    stiff = robot(part, modulus=FACTOR).module.reduced.save(tmp_path / "stiff.npz")
    own = robot(stiff).module.reduced
    assert own.tetrahedron_material.young_modulus_kPa == pytest.approx(FACTOR * 1160.0, rel=1e-12)
