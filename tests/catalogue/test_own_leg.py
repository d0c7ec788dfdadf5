"""A leg of one's own: its mass, its mesh, its finite elements and its picture are its own."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from pneumorph.base.artefact import ArtefactError
from pneumorph.base.layers import layered
from pneumorph.catalogue.leg_kinds import (
    MEASURED_MATERIALS,
    LegName,
    load_default_leg,
    paper_leg_mesh,
)
from pneumorph.catalogue.leg_module import module_of_leg, scaled_materials
from pneumorph.catalogue.masses import Masses
from pneumorph.catalogue.mounting_check import check_cast_mass
from pneumorph.catalogue.older_names import current_arguments
from pneumorph.catalogue.paper_designs import BASELINE_DESIGN
from pneumorph.catalogue.paper_robot import paper_robot
from pneumorph.catalogue.robot_options import RobotOptions
from pneumorph.catalogue.unseen_pressure import unseen_pressure_note
from pneumorph.physics.ground import Ground, RoughGround
from pneumorph.physics.height_map import HeightMap
from pneumorph.physics.physics import Physics
from pneumorph.report.plan import paper_plan, plans_of
from pneumorph.robot.design import Design
from pneumorph.robot.resized_part import resized_part
from pneumorph.robot.scaled_part import scaled_part
from pneumorph.study.reduction_options import ReduceOptions


@pytest.fixture
def own_leg(tmp_path: Path) -> Path:
    """The paper's leg in 0.7 of its size, which says that it was made from another mesh."""
    part = resized_part(load_default_leg("published"), 0.7)
    own = replace(part, metadata={**part.metadata, "mesh_digest": "another"})
    return own.save(tmp_path / "leg.npz")


def test_its_finite_elements_are_not_those_of_the_paper_leg(own_leg: Path) -> None:
    """Asked for without a mesh they are refused; what ships walks as it always did."""
    spec = RobotOptions.of("published", part=own_leg).spec()
    with pytest.raises(ValueError, match=r"give the mesh that it was made from as full\.mesh"):
        spec.full("1.0.0.2.2.0.0.1")
    assert (
        module_of_leg("published", part=load_default_leg("published")).full.mesh.digest()
        == paper_leg_mesh().digest()
    )


def test_its_mesh_weighs_it_where_it_walks_reduced(own_leg: Path, tmp_path: Path) -> None:
    """A cast leg's mass is its mesh's; with the leg that ships there is no mesh to ask for."""
    mesh = {"full": {"mesh": str(paper_leg_mesh().save(tmp_path / "mesh.npz"))}}
    # Threads change no result, and runs of earlier versions say how many.
    threads = {"full": {"thread_count": 1}}
    layered(RobotOptions.of("published"), [threads]).refuse_full_options()
    layered(RobotOptions.of("published", part=own_leg), [mesh]).refuse_full_options()
    with pytest.raises(ValueError, match=r"full\.mesh is .* expected None with --model reduced"):
        layered(RobotOptions.of("published"), [mesh]).refuse_full_options()


def test_it_weighs_what_its_volume_does(tmp_path: Path) -> None:
    """As much for its volume as the published leg, 0.8^3 of 105 g, unless a mass is given."""
    mesh = paper_leg_mesh().scaled(0.8).save(tmp_path / "mesh.npz")
    asked = layered(ReduceOptions(), [{"mesh": str(mesh)}])
    assert asked.materials.mass_kg == pytest.approx(0.8**3 * 0.105, rel=1e-9)
    weighed = layered(ReduceOptions(), [{"mesh": str(mesh), "materials": {"mass_kg": 0.04}}])
    assert weighed.materials.mass_kg == 0.04
    assert layered(ReduceOptions(), [{}]).materials.mass_kg == 0.105


def test_it_is_drawn_as_long_as_it_is(own_leg: Path) -> None:
    design = Design.parse("1.0.0.2.2.0.0.1")
    drawn = plans_of(RobotOptions.of("published", part=own_leg))(design)
    usual = plans_of(RobotOptions.of("published"))(design)
    assert usual.half_width_mm == paper_plan(design).half_width_mm
    # It has its own length beyond the disk: 0.7 of 115 mm, pitched by 15 degrees.
    turn = np.radians(-22.5)
    along = [np.ptp(each @ [np.cos(turn), -np.sin(turn)]) for each in drawn.legs_mm[:1]]
    assert along[0] == pytest.approx(0.7 * 115.0 * np.cos(np.radians(15.0)), rel=0.1)


def test_a_height_map_of_an_earlier_version_is_the_grounds(tmp_path: Path) -> None:
    """It was an option of finite elements."""
    hills = str(tmp_path / "hills.npy")
    older = {"full": {"height_map": {"path": hills, "mm_per_pixel": 2.0}, "integrator": "x"}}
    now = RobotOptions.upgraded(older)
    assert now["full"] == {"integrator": "x"}
    flags = ["--full.height-map.path", hills, "--full.height-map.mm-per-pixel=2"]
    assert current_arguments(flags)[::2] == [
        "--physics.ground.map.path", "--physics.ground.map.mm-per-pixel=2"
    ]  # fmt: skip
    ground = layered(RobotOptions(), [{"full": {"height_map": older["full"]["height_map"]}}])
    assert ground.physics.ground == Ground(HeightMap(Path(hills), mm_per_pixel=2.0))
    assert ground.physics.friction == RobotOptions().physics.friction


def test_a_height_map_that_is_no_grid_is_named(tmp_path: Path) -> None:
    physics = Physics(ground=Ground(HeightMap(path=tmp_path / "hills.npy")))
    for heights, why in (
        (np.zeros(9), "shape"),
        (np.zeros((3, 9)), "shape"),
        (np.full((5, 5), np.nan), "finite"),
    ):
        np.save(tmp_path / "hills.npy", heights)
        for model in ("reduced", "full"):
            with pytest.raises(ValueError, match=rf"height map .*hills\.npy: .*{why}"):
                getattr(paper_robot("published", physics), model)("1.0.0.2.2.0.0.1")


def test_pressures_beyond_the_snapshots_are_told_before_it_walks() -> None:
    spec = paper_robot("measured")
    seen_kPa = max(spec.module.reduced.metadata["report"]["bend"]["pressure_kPa"])
    assert unseen_pressure_note(spec, 1.04 * seen_kPa) is None
    note = unseen_pressure_note(spec, 1.06 * seen_kPa)
    assert note is not None
    assert "snapshots up to 105: it extrapolates beyond" in note
    # Of the published leg the simulated pressure counts, some four times the real one.
    assert unseen_pressure_note(paper_robot("published"), 90.0) is None
    assert unseen_pressure_note(paper_robot("published"), 105.0) is not None


def test_a_leg_that_relaxes_is_refused_in_the_published_physics(tmp_path: Path) -> None:
    """Its pressures would be those of another leg."""
    part = load_default_leg("measured").save(tmp_path / "leg.npz")
    assert RobotOptions(part=part).spec().module.reduced.relaxation is not None
    with pytest.raises(ValueError, match=r"leg\.npz is of the measured physics .it relaxes., and"):
        RobotOptions.of("published", part=part).spec()


def test_a_leg_that_weighs_what_nothing_does_is_refused(tmp_path: Path) -> None:
    """Grams where kilograms are expected; a mass that was weighed is taken as it is."""
    heavy = scaled_part(load_default_leg("published"), 1.0, 1000.0).save(tmp_path / "leg.npz")
    with pytest.raises(ValueError, match=r"reduced leg .*leg\.npz weighs 1\.05e\+05 g"):
        RobotOptions.of("published", part=heavy).spec()
    assert RobotOptions.of("published", part=heavy, masses=Masses(leg_mass_g=105.0)).spec()


def own(size: float, folder: Path) -> RobotOptions:
    """The measured leg that ships in another size."""
    path = resized_part(load_default_leg("measured"), size).save(folder / "leg.npz")
    return RobotOptions.of("measured", part=path, masses=Masses("cast", leg_mass_g=40.0))


def test_a_leg_that_reaches_into_its_neighbour_is_refused(tmp_path: Path) -> None:
    """The sites are as far apart as the paper's leg needs; twice as wide, two legs overlap."""
    for size in (0.7, 1.0):
        own(size, tmp_path).spec()
    with pytest.raises(ValueError, match=r"inside each other, .* describe a robot for it in a fi"):
        own(2.0, tmp_path).spec()


def test_a_leg_that_reaches_into_the_disk_is_refused(tmp_path: Path) -> None:
    """Its attachment face is half way along it, so half of it is behind that."""
    part = load_default_leg("measured")
    behind = np.argsort(np.abs(part.rest_nodes[:, 0] - part.rest_nodes[:, 0].mean()))[:40]
    metadata = {**part.metadata, "attachment_nodes": behind.tolist(), "mesh_digest": "another"}
    path = replace(part, metadata=metadata).save(tmp_path / "leg.npz")
    options = RobotOptions.of("measured", part=path, masses=Masses("cast", leg_mass_g=46.8))
    with pytest.raises(ValueError, match=r"up to .* mm inside the hub, .* describe a robot for it"):
        options.spec()


def test_a_part_without_a_skin_is_not_weighed(tmp_path: Path) -> None:
    """One of another program may have none, hence no volume."""
    part = replace(load_default_leg("measured"), skin=np.zeros((0, 3), dtype=np.int32))
    part.save(tmp_path / "leg.npz")
    check_cast_mass(part, "the reduced leg", "masses.leg_mass_g")


def test_the_mesh_of_another_leg_is_refused(tmp_path: Path) -> None:
    """Beside a reduced leg; both models would be told of one leg."""
    part = load_default_leg("measured").save(tmp_path / "leg.npz")
    mesh = paper_leg_mesh().save(tmp_path / "mesh.npz")
    options = layered(RobotOptions(), [{"part": str(part), "full": {"mesh": str(mesh)}}])
    with pytest.raises(ArtefactError, match="this reduction was made from the mesh"):
        options.spec()


@pytest.mark.parametrize(
    ("heights", "why"),
    [
        (np.full((8, 8), np.nan), "must be finite"),
        (np.zeros((8, 8), dtype=complex), "holds complex128, expected heights in mm"),
        (np.zeros(8), "row"),
    ],
)
def test_a_map_that_is_none_is_refused_by_its_setting(
    heights: np.ndarray, why: str, tmp_path: Path
) -> None:
    """Before anything walks."""
    np.save(tmp_path / "map.npy", heights)
    ground = {"ground": {"map": {"path": str(tmp_path / "map.npy")}}}
    spec = layered(RobotOptions(), [{"physics": ground}]).spec()
    with pytest.raises(ValueError, match=rf"physics\.ground\.map\.path: .*map\.npy.*{why}"):
        spec.simulator([BASELINE_DESIGN])


def test_a_map_that_is_gone_is_told_and_breaks_nothing_that_does_not_walk(tmp_path: Path) -> None:
    """Pages and pictures of a finished run know its robot."""
    path = tmp_path / "folder.npy"
    path.mkdir()
    spec = layered(RobotOptions(), [{"physics": {"ground": {"map": {"path": str(path)}}}}]).spec()
    assert spec.assembly(BASELINE_DESIGN).mounts
    with pytest.raises(FileNotFoundError, match=r"ground\.map\.path: .*folder\.npy is no file"):
        spec.simulator([BASELINE_DESIGN])


def test_roughness_that_the_ground_is_too_small_for_is_told_by_its_name() -> None:
    rough = RoughGround(2.0, correlation_mm=400.0)
    physics = replace(paper_robot().physics, ground=Ground(rough=rough, width_mm=300.0))
    with pytest.raises(ValueError, match=r"^physics\.ground\.rough\.correlation_mm is 400, exp"):
        paper_robot(physics=physics).simulator([BASELINE_DESIGN])


@pytest.mark.parametrize(
    ("named", "made", "of"),
    [
        ("measured", "published", "published"),
        ("measured", "hyperelastic", "published"),
        ("published", "measured", "measured"),
        ("hyperelastic", "measured", "measured"),
    ],
)
def test_a_reduction_of_another_physics_is_refused(named: LegName, made: LegName, of: str) -> None:
    """From Python too, where nobody else says which physics was meant."""
    with pytest.raises(ValueError, match=f"the reduced leg is of the {of} physics"):
        _ = module_of_leg(named, load_default_leg(made)).reduced


@pytest.mark.parametrize("leg", ["published", "hyperelastic"])
def test_a_leg_of_another_physics_than_that_asked_for_is_refused(leg: LegName) -> None:
    with pytest.raises(ValueError, match=f"the {leg} leg is of the published physics, and the mea"):
        layered(RobotOptions(), [{"based_on": "measured", "leg": leg}]).spec()
    assert layered(RobotOptions(), [{"leg": leg}]).spec().physics.damping != "objective"


def test_the_reduction_that_ships_is_of_no_other_material() -> None:
    """Finite elements may be of any; a reduction has what it was made of."""
    stiffer = module_of_leg("measured", materials=scaled_materials(MEASURED_MATERIALS, 2.0))
    with pytest.raises(ValueError, match="materials were given without a reduced part"):
        _ = stiffer.reduced
    assert stiffer.full.material == MEASURED_MATERIALS.silicone.stiffer(2.0)
