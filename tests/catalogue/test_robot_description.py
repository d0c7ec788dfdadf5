"""A robot is what its file says: the paper's to the last bit, others with hub and sites."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from helpers.box_mesh import box_mesh

from pneumorph.base.artefact import ArtefactError
from pneumorph.base.layers import layered
from pneumorph.base.settings import settings_from_dict, settings_to_dict
from pneumorph.catalogue.description_notes import damping_note, description_notes, forbidden_note
from pneumorph.catalogue.design_rules import DesignRules
from pneumorph.catalogue.hub_description import HubDescription
from pneumorph.catalogue.mounting_check import _way_through
from pneumorph.catalogue.paper_robot import PAPER_FACE, paper_robot
from pneumorph.catalogue.robot_description import RobotDescription
from pneumorph.catalogue.robot_identity import full_identity, reduction_digest
from pneumorph.catalogue.robot_options import RobotOptions
from pneumorph.catalogue.shipped_data import data_file
from pneumorph.catalogue.space_check import check_space
from pneumorph.geometry.attachment import same_frame
from pneumorph.geometry.pose import Pose
from pneumorph.geometry.surface import boundary_triangles
from pneumorph.robot.design_space import DesignSpace
from pneumorph.simulation.rollout import rollout

USUAL = 'usual = "b1.0.2.2.0.b1"\n'
PLATE = Path(__file__).parent.parent.parent / "examples" / "plate.toml"
Edited = Callable[[str, str], Path]


def test_a_ground_is_read_beside_the_robots_file(edited: Edited, tmp_path: Path) -> None:
    (tmp_path / "maps").mkdir()
    np.save(tmp_path / "maps" / "hills.npy", np.full((6, 6), 3.0))
    table = '[physics.ground.map]\npath = "maps/hills.npy"\n\n[physics.ground.rough]\n'
    path = edited("[hub] #", f"{table}roughness_mm = 0.0\n\n[hub] #")
    described = RobotDescription.read(path)
    ground = described.acting.ground
    assert ground.map.path == tmp_path / "maps" / "hills.npy"
    assert described.spec().physics.ground == ground
    options = layered(RobotOptions(), [{"described": str(path)}])
    assert options.physics.ground == ground
    with pytest.raises(ValueError, match=r"edited\.toml: .*roughness_mm must be at least 0"):
        RobotDescription.read(
            edited("[hub] #", "[physics.ground.rough]\nroughness_mm = -1.0\n\n[hub] #")
        )


def test_the_papers_robot_is_its_file() -> None:
    """Same hub, poses, parts, physics and numerics, and the same walk to the last bit."""
    described = RobotDescription.read(data_file("paper_robot.toml"))
    ours, usual = described.spec(thread_count=1), paper_robot("published", thread_count=1)
    assert described.space == DesignSpace()
    assert described.space is described.space  # found once: it may be of many designs
    assert (ours.physics, ours.full_order, ours.hub_model) == (
        usual.physics, usual.full_order, usual.hub_model
    )  # fmt: skip
    assert ours.hub.mass_numbers() == usual.hub.mass_numbers()
    assert ours.hub.mesh.digest() == usual.hub.mesh.digest()
    np.testing.assert_array_equal(ours.hub.contact_points, usual.hub.contact_points)
    np.testing.assert_array_equal(ours.hub.tracked_point, usual.hub.tracked_point)
    for mine, theirs in zip(
        ours.assembly("1.2.3.1.2.3.1.2").mounts, usual.assembly("1.2.3.1.2.3.1.2").mounts,
        strict=True,
    ):  # fmt: skip
        np.testing.assert_array_equal(mine.pose.rotation, theirs.pose.rotation)
        np.testing.assert_array_equal(mine.pose.translation, theirs.pose.translation)
        assert mine.part.digest() == theirs.part.digest()
    commands = np.tile([70.0, 20.0, 0.0], (30, 1))
    walks = [
        rollout(spec.reduced(described.usual_design), commands, record_nodes=False)[1]
        for spec in (ours, usual)
    ]
    np.testing.assert_array_equal(walks[0].tracked_point_mm, walks[1].tracked_point_mm)


def test_a_plate_is_what_its_file_says() -> None:
    """Mass and inertia in closed form, faces on the plate's edge, and two sizes of legs."""
    described = RobotDescription.read(PLATE)
    spec = described.spec()
    a, b, c = 150.0, 90.0, 10.0
    hub = spec.hub.rigid
    assert hub.mass == pytest.approx(0.6e-6 * a * b * c, rel=1e-12)
    second = hub.mass / 12.0 * np.diag([a * a, b * b, c * c])
    second[2, 2] += hub.mass * 36.0**2
    np.testing.assert_allclose(hub.second_moment, second, atol=1e-9 * np.trace(second))
    long, short = spec.modules
    assert short.reduced.mass == pytest.approx(0.75**3 * long.reduced.mass, rel=1e-12)
    assert short.full.mass_kg == pytest.approx(0.75**3 * long.full.mass_kg, rel=1e-12)
    for site, told in zip(spec.sites, described.sites, strict=True):
        for module in site.modules:
            assert module.face is not None
            assert same_frame(site.pose_of(module).compose(module.face), told.pose)
    spec.check_reduction()  # each size stands for finite elements of that size
    yaws = [site.yaw_deg for site in spec.sites]
    assert yaws == [0.0, 90.0, 180.0, 180.0, 270.0, 0.0]
    ring = [site.yaw_deg for site in paper_robot("published").sites]
    assert ring == [22.5 + 45.0 * place for place in range(8)]
    assert len(described.space) == len({str(each) for each in described.space}) == 7816


def test_both_models_of_a_plate_are_the_same_robot_at_rest() -> None:
    spec = RobotDescription.read(PLATE).spec()
    full, reduced = spec.full("b1.3.2.0.0.4"), spec.reduced("b1.3.2.0.0.4")
    state = full.initial_state()
    for mesh, mount, positions in zip(
        [leg.part.mesh for leg in full.legs], reduced.robot.mounts, state.positions, strict=True
    ):
        # Nodes of 100 mm are kept in single precision by the reduced part.
        np.testing.assert_allclose(
            positions, mount.pose.apply(mount.part.rest_nodes), atol=1e-4, rtol=0
        )
        assert len(mesh.nodes) == len(positions)
    assert [leg.regulators[0] for leg in full.legs] == [0, 2, 1, 3]
    assert full.hub.mass_kg == reduced.robot.hub.mass
    np.testing.assert_allclose(full.hub.rest_centre, [0.0, 0.0, 36.0], atol=1e-9)


def test_a_leg_of_another_length_is_mounted_by_its_face() -> None:
    """On the paper's disk too: its face comes where that of the paper's leg is."""
    small = RobotDescription.read(PLATE).spec().modules[1]
    usual, own = paper_robot("published"), paper_robot(small)
    assert small.face is not None
    for mine, theirs in zip(own.sites, usual.sites, strict=True):
        np.testing.assert_allclose(
            mine.pose_of(small).apply(small.face.translation),
            theirs.pose.apply(PAPER_FACE.translation),
            atol=1e-9,
        )


def test_sites_in_one_place_of_which_one_carries_a_module_are_no_mistake(edited: Edited) -> None:
    path = edited("[76, -24, 36]\nyaw_deg = 0", "[76, 24, 36]\nyaw_deg = 5")
    text = path.read_text().replace('usual = "b1.0.2.2.0.b1"', "mirror = false")
    path.write_text(text + 'exclusions = ["0 5"]\n')
    described = RobotDescription.read(path)
    assert all(not (d.assignment[0] and d.assignment[5]) for d in described.space.designs[:500])


def test_robots_of_other_sites_are_no_batch() -> None:
    plate, paper = RobotDescription.read(PLATE).spec(), paper_robot("published")
    with pytest.raises(ValueError, match=r"1\.0\.0\.2\.2\.0\.0\.1 has 8 .* expected 6: .* plate"):
        plate.simulator([plate.assembly("b1.0.2.2.0.b1"), paper.assembly("1.0.0.2.2.0.0.1")])
    with pytest.raises(ValueError, match="expected 8: one for each site of the paper's robot"):
        paper.simulator(["1.0.0.2.2.0.0.1", plate.assembly("b1.0.2.2.0.b1")])


def test_a_mass_of_another_leg_is_told(edited_published: Edited, tmp_path: Path) -> None:
    """A part whose mass is not that of its volume: 16 g/ml."""
    part = replace(paper_robot("published").module.reduced, mass=0.7)
    part.save(tmp_path / "heavy.npz")
    path = edited_published('leg = "published"\n\n', 'part = "heavy.npz"\n\n')
    with pytest.raises(ValueError, match=r"modules.long weighs 700 g and has a volume of 43.1 ml"):
        RobotDescription.read(path).spec()


def test_a_part_with_polar_rotations_brings_its_damping(
    edited_published: Edited, tmp_path: Path
) -> None:
    """Edge-based ones know left from right: the same leg would walk another way, unsaid."""
    part = paper_robot("published").module.reduced
    made = {**part.metadata["settings"], "rotation": "polar"}
    replace(part, metadata={**part.metadata, "settings": made}).save(tmp_path / "own.npz")
    path = edited_published('leg = "published"\n\n', 'part = "own.npz"\n\n')
    read = RobotDescription.read(path)
    assert read.spec().physics.damping == read.acting.damping == "objective"
    said = "objective damping, which goes with the polar rotations of modules.long"
    assert said in description_notes(read, None, read.acting)
    assert damping_note(read, replace(read.acting, damping="published")) is None
    path.write_text(path.read_text().replace("[physics]\n", '[physics]\ndamping = "published"\n'))
    read = RobotDescription.read(path)
    assert read.acting.damping == "published"
    assert not any("damping" in note for note in description_notes(read, None, read.acting))
    part.save(tmp_path / "own.npz")
    assert RobotDescription.read(edited_published("", "")).acting.damping == "published"


def test_a_part_beside_another_mesh_is_refused(edited_published: Edited, tmp_path: Path) -> None:
    """It would be mounted by the attachment face of that mesh."""
    robot = paper_robot("published")
    robot.module.reduced.save(tmp_path / "own.npz")
    robot.module.full.mesh.save(tmp_path / "own_mesh.npz")
    both = 'part = "own.npz"\nmesh = "own_mesh.npz"\n\n'
    path = edited_published('leg = "published"\n\n', both)
    RobotDescription.read(path).spec()
    paper_robot("hyperelastic").module.full.mesh.save(tmp_path / "own_mesh.npz")
    with pytest.raises(ValueError, match=r"made from the mesh \w+, got the mesh"):
        RobotDescription.read(path).spec()


def test_a_weighed_mass_in_kilograms_is_told(edited: Edited) -> None:
    path = edited('leg = "measured"\n\n', 'leg = "measured"\nmass_g = 0.042\n\n')
    with pytest.raises(ValueError, match=r"a module of mass_g, weighs 0.042 g .* 0.042 kg are 42"):
        RobotDescription.read(path).spec()
    path = edited("size_factor = 0.75\n", "size_factor = 0.75\nmass_g = 0.035\n")
    with pytest.raises(ValueError, match=r"the leg short, of .* weighs 0.035 g and has a volume"):
        RobotDescription.read(path).spec()


def test_robots_of_other_sites_or_hubs_are_told_apart(edited: Edited) -> None:
    """What is kept of walks is found by these: another plate or place is another robot."""
    plate, same = (RobotDescription.read(PLATE).spec() for _ in range(2))
    moved = RobotDescription.read(edited("bottom_mm = 31", "bottom_mm = 31.5")).spec()
    assert reduction_digest(plate) == reduction_digest(same) != reduction_digest(moved)
    assert full_identity(plate) == full_identity(same) != full_identity(moved)
    usual = paper_robot("published")
    assert full_identity(usual) == {}
    assert reduction_digest(usual) == usual.module.reduced.digest()


def test_a_space_of_another_robot_is_refused() -> None:
    spec = RobotDescription.read(PLATE).spec()
    with pytest.raises(ValueError, match="8 locations and the robot 6 sites"):
        check_space(spec, DesignSpace())
    unlike = DesignSpace(location_count=6, maximum_legs=6, options=("0 * b*",) * 6)
    with pytest.raises(ValueError, match=r"space\.options\[1\] names module b, and site left"):
        check_space(spec, unlike)
    apart = DesignSpace(location_count=6, maximum_legs=6, options=("0 *", "0 *+*") + ("0 *",) * 4)
    with pytest.raises(
        ValueError, match=r"options\[1\] gives 2 regulators to .* at site left, .* its 1 "
    ):
        check_space(spec, apart)
    with pytest.raises(ValueError, match=r"design b1.b1.0.0.0.1 has a module b at site left"):
        spec.assembly("b1.b1.0.0.0.1")


def test_a_regulator_that_no_design_uses_is_refused_from_anywhere(edited: Edited) -> None:
    """By flags over a file or the paper's robot, and by a description that Python made."""
    plate = RobotDescription.read(edited("", ""))
    spec, space = plate.spec(), plate.space
    few = replace(space, minimum_legs=3, maximum_legs=3)
    with pytest.raises(ValueError, match=r"regulator_count is 4 and no design uses regulator 4, e"):
        check_space(spec, few)
    with pytest.raises(ValueError, match=r"is 8 and no design uses regulator 5, 6, 7, 8, expected"):
        check_space(paper_robot(), replace(DesignSpace(), regulator_count=8, maximum_legs=4))
    with pytest.raises(
        ValueError, match=r"is 4 and no design uses regulator 3, 4, expected as man"
    ):
        replace(plate, file=None, designs=DesignRules(maximum_regulators=2)).spec()


def test_a_payload_is_a_point_on_the_hub(edited: Edited) -> None:
    """Mass, first and second moments in closed form; by default it lies on the tracked point."""
    empty = RobotDescription.read(PLATE).spec().hub.rigid
    for text, place in (
        ("payload_g = 50", np.array([0.0, 0.0, 41.0])),
        ("payload_g = 50\npayload_mm = [30, -10, 60]", np.array([30.0, -10.0, 60.0])),
    ):
        file = edited("height_mm = 10", f"height_mm = 10\n{text}")
        file.write_text(file.read_text().replace("[designs]", "[designs]\nmirror = false"))
        hub = RobotDescription.read(file).spec().hub.rigid
        assert hub.mass == pytest.approx(empty.mass + 0.05, rel=1e-12)
        np.testing.assert_allclose(hub.first_moment, empty.first_moment + 0.05 * place, atol=1e-12)
        np.testing.assert_allclose(
            hub.second_moment,
            empty.second_moment + 0.05 * np.outer(place, place),
            atol=1e-9 * np.trace(hub.second_moment),
        )
    with pytest.raises(ArtefactError, match="payload_g is 50 and model is soft"):
        RobotDescription.read(
            edited("height_mm = 10", 'height_mm = 10\npayload_g = 50\nmodel = "soft"')
        )


def test_a_hub_without_rims_is_told_what_else_may_touch(tmp_path: Path) -> None:
    mesh = box_mesh((20.0, 20.0, 10.0), (2, 2, 1))
    bare = replace(mesh, node_sets={})
    bare.save(tmp_path / "hub.npz")
    hub = HubDescription("mesh", mesh=Path("hub.npz"), density_g_per_ml=1.0)
    with pytest.raises(ValueError, match=r"no node set bottom and top, .* contact = \"spread\""):
        hub.spec(tmp_path)
    assert len(replace(hub, contact="spread").spec(tmp_path).contact_points) > 3


def test_a_mesh_that_was_weighed_has_the_centre_and_inertia_of_its_shape(tmp_path: Path) -> None:
    """Whatever its nodes are like: here most of them are in one corner."""
    coarse = box_mesh((90.0, 60.0, 10.0), (1, 1, 1))
    crowd = coarse.nodes.min(axis=0) + np.random.default_rng(0).uniform(0.0, 1.0, (30, 3))
    mesh = replace(coarse, nodes=np.concatenate([coarse.nodes, crowd]))
    mesh.save(tmp_path / "hub.npz")
    weighed = HubDescription("mesh", mesh=Path("hub.npz"), mass_kg=0.1, contact="none")
    hub = weighed.spec(tmp_path).rigid
    centre = coarse.nodes.mean(axis=0)
    np.testing.assert_allclose(hub.first_moment, 0.1 * centre, rtol=1e-12, atol=1e-12)
    about_centre = hub.second_moment - 0.1 * np.outer(centre, centre)
    expected = 0.1 * np.diag([90.0**2, 60.0**2, 10.0**2]) / 12.0  # of a box
    np.testing.assert_allclose(about_centre, expected, rtol=1e-9, atol=1e-9)
    nodes = replace(weighed, mass_over="nodes").spec(tmp_path).rigid
    np.testing.assert_allclose(nodes.first_moment, 0.1 * mesh.nodes.mean(axis=0), rtol=1e-12)
    with pytest.raises(ValueError, match="mass_over is"):
        HubDescription("mesh", mesh=Path("hub.npz"), density_g_per_ml=1.0, mass_over="nodes")


def test_sites_are_images_of_each_other_as_files_round_them() -> None:
    """To a hundredth of a millimetre, and where two sites that exclude each other share a place."""
    left, right = (Pose(translation=np.array([0.0, y, 0.0])) for y in (43.3, -43.3))
    off = Pose(translation=np.array([0.0, -43.31, 0.0]))
    kinds = [("long",), ("long",), ("short",), ("short",)]
    rules = DesignRules(minimum_legs=1, exclusions=("0 2", "1 3"))
    assert rules.space([left, off, right, left], kinds, 2).mirror == "1 0 3 2"
    beside = Pose(translation=np.array([0.0, -43.4, 0.0]))
    with pytest.raises(ValueError, match=r"image of site 0 lies on site 2, of other modules"):
        rules.space([left, beside, right, left], kinds, 2)


def test_a_module_that_lies_in_the_hub_is_refused_whatever_the_tolerance(edited: Edited) -> None:
    """The plate is 10 mm high: with half of that as tolerance no point of it is too deep."""
    path = edited('name = "plate"', 'name = "plate"\nmounting_tolerance_mm = 9')
    assert RobotDescription.read(path).spec().sites
    text = path.read_text().replace("yaw_deg = 180", "yaw_deg = 3.14159")
    path.write_text(text.replace("[designs]", "[designs]\nmirror = false"))
    with pytest.raises(ArtefactError, match=r"sites\[2\] \(rear left\) goes 18 mm through the hub"):
        RobotDescription.read(path).spec()


def test_a_base_plate_too_deep_in_a_thin_hub_is_told_the_way_that_mends_it(edited: Edited) -> None:
    """Its nearest face is the hub's bottom, 16 mm below its top: moving the site outwards, along
    that face, mends nothing."""
    path = edited("height_mm = 10\nbottom_mm = 31", "height_mm = 16\nbottom_mm = 28")
    text = path.read_text()
    refused = (
        r"sites\[0\] \(front left\) is up to 3\.3 mm inside the hub, .* nearest face is towards "
        r"\[0\.0, 0\.0, -1\.0\], expected at most 3: .* move the site by "
        r"\[0\.0, 0\.0, (?P<up>-\d\.\d)\] mm"
    )
    path.write_text(text.replace("[76,", "[77,").replace("[-76,", "[-77,"))
    with pytest.raises(ArtefactError, match=refused):
        RobotDescription.read(path).spec()
    path.write_text(text)
    with pytest.raises(ArtefactError, match=refused) as said:
        RobotDescription.read(path).spec()
    found = re.search(refused, str(said.value))
    assert found is not None
    path.write_text(text.replace("24, 36]", f"24, {36 + float(found['up'])}]"))
    assert RobotDescription.read(path).spec().sites


def test_a_way_through_a_hub_is_that_through_what_a_module_is_attached_to() -> None:
    """Of two blocks a leg that stands on the one and points at the other goes through neither."""
    block = box_mesh((20.0, 20.0, 10.0), (2, 2, 1))
    skin = boundary_triangles(block.tetrahedra)
    nodes = np.concatenate([block.nodes, block.nodes + np.array([60.0, 0.0, 0.0])])
    hub = nodes, np.concatenate([skin, skin + len(block.nodes)])
    right = block.nodes.max(axis=0)[0]
    middle = block.nodes.mean(axis=0)
    face = np.array([right, middle[1], middle[2]])
    ahead = np.array([1.0, 0.0, 0.0])
    assert _way_through(face, ahead, 75.0, 3.0, hub) == 0
    assert _way_through(face, -ahead, 75.0, 3.0, hub) == 20
    assert _way_through(face + 2.0 * ahead, -ahead, 15.0, 3.0, hub) == 13
    assert _way_through(face + 5.0 * ahead, -ahead, 15.0, 3.0, hub) == 0


def test_what_is_far_from_the_hub_is_refused(edited: Edited) -> None:
    payload = "height_mm = 10\npayload_g = 50\npayload_mm = [3000, 0, 50]"
    path = edited("height_mm = 10", payload)
    with pytest.raises(ArtefactError, match=r"payload_mm is \(3000, 0, 50\) mm, 2925 mm away"):
        RobotDescription.read(path).spec()


def test_a_hubs_mesh_of_another_unit_or_program_is_told_the_way(tmp_path: Path) -> None:
    mesh = box_mesh((0.02, 0.02, 0.01), (2, 2, 1))
    mesh.save(tmp_path / "hub.npz")
    hub = HubDescription(
        "mesh", mesh=Path("hub.npz"), density_g_per_ml=1.0, wall_mm=1.0, contact="none"
    )
    with pytest.raises(ArtefactError, match=r"hub\.npz is 0\.02 mm across, .*--scale.*1000 for m"):
        hub.spec(tmp_path)
    (tmp_path / "hub.stl").write_text("solid hub\nendsolid hub\n")
    with pytest.raises(ArtefactError, match=r"mesh --file .*hub\.stl --surfaces --node-sets"):
        replace(hub, mesh=Path("hub.stl")).spec(tmp_path)


def test_a_design_that_rules_do_not_allow_is_told_why(edited: Edited) -> None:
    plate = RobotDescription.read(edited('usual = "b1.0.2.2.0.b1"', 'exclusions = ["0 5"]'))
    says = "is none that [designs] of"
    for design, why in (
        ("1.1.2.0.0.0", "allows: it has too few legs: 3, expected at least 4"),
        ("1.b1.2.2.1.0", "allows: it has b1 at location 1, expected one of the options '0 *'"),
        (
            "b1.0.2.2.0.b1",
            "allows: its exclusions allow one leg at most at front left and front right",
        ),
    ):
        note = description_notes(plate, design, plate.acting)[0]
        assert note.startswith(f"design {design} {says}")
        assert why in note
    assert not any(says in each for each in description_notes(plate, "b1.1.2.2.1.0", plate.acting))


def test_a_mesh_without_its_part_is_refused(edited: Edited) -> None:
    """The leg that ships would walk in its place, and be built as the mesh."""
    path = edited('leg = "measured"\n\n', 'leg = "measured"\nmesh = "wide.npz"\n\n')
    mesh = paper_robot("measured").module.full.mesh
    replace(mesh, nodes=mesh.nodes * [1.0, 1.2, 1.0]).save(path.parent / "wide.npz")
    why = r"modules\.long has the mesh .*wide\.npz and no part, expected both"
    with pytest.raises(ArtefactError, match=why):
        RobotDescription.read(path).spec()


def test_places_of_a_ring_that_exclude_each_other_are_told_by_their_numbers() -> None:
    paper = data_file("paper_robot.toml")
    text = paper.read_text()
    rules = '[designs]\nexclusions = ["0 1", "6 7"]'
    robot = RobotDescription.of_text(text.replace("[designs]", rules), paper)
    note = forbidden_note(robot, "1.1.0.2.0.0.0.0")
    assert note is not None
    assert note.endswith("its exclusions allow one leg at most at 0 and 1")


def test_a_file_that_names_no_physics_is_of_that_asked_for(edited: Edited) -> None:
    """Measured by default; its legs are those of the physics. A run keeps what it was made in."""
    path = edited('based_on = "measured"\n', "")
    path.write_text(path.read_text().replace('leg = "measured"\n', ""))
    plate, usual = RobotDescription.read(path).spec(), RobotDescription.read(PLATE).spec()
    assert plate.physics == usual.physics
    assert [each.reduced.digest() for each in plate.modules] == [
        each.reduced.digest() for each in usual.modules
    ]
    asked = {"described": str(path), "based_on": "published"}
    published = layered(RobotOptions(), [asked])
    assert published.spec().physics.damping == "published"
    assert published.spec().modules[0].reduced.relaxation is None
    kept = settings_from_dict(RobotOptions, settings_to_dict(published))
    assert kept.spec().physics == published.spec().physics
    with pytest.raises(ValueError, match=r"--physics is given beside --robot .*/plate\.toml"):
        layered(RobotOptions(), [{**asked, "described": str(PLATE)}]).spec()


def test_a_hubs_mesh_that_is_missing_is_told_with_the_robots_file(edited: Edited) -> None:
    text = "\n".join(f"{name}_mm = {size}" for name, size in
                     (("length", 150), ("width", 90), ("height", 10), ("bottom", 31)))  # fmt: skip
    path = edited(f'shape = "box"\n{text}', 'shape = "mesh"\nmesh = "none.npz"')
    with pytest.raises(FileNotFoundError, match=rf"robot file {path}: mesh of \[hub\]: .*none"):
        RobotDescription.read(path).spec()


def test_another_number_of_regulators_than_the_files_is_refused() -> None:
    """Its designs, tasks and gaits would not follow."""
    asked = {"described": str(PLATE), "physics": {"regulator_count": 3}}
    with pytest.raises(ValueError, match=r"--physics\.regulator-count is 3 .* the 4 of that file"):
        layered(RobotOptions(), [asked]).spec()


def test_a_hubs_surface_that_others_are_named_without_is_told(edited: Edited) -> None:
    plate = RobotDescription.read(edited("[modules.long]", 'surface = "wood"\n\n[modules.long]'))
    (note,) = description_notes(plate, None, plate.acting)
    assert "names hub and not 'wood', the surface of [hub], which has" in note
    assert note.endswith("of all others, 0.55")
    named = replace(plate.acting, friction_by_surface=(("wood", 0.4),))
    for silent in (named, replace(named, friction_by_surface=())):
        assert description_notes(plate, None, silent) == ()


def test_a_part_of_the_published_physics_is_refused_in_the_measured_one(
    edited: Edited, tmp_path: Path
) -> None:
    """Nothing would damp it, and its pressures would be others, unsaid."""
    paper_robot("published").module.reduced.save(tmp_path / "own.npz")
    path = edited('leg = "measured"\n\n', 'part = "own.npz"\n\n')
    with pytest.raises(ValueError, match=r"the part of modules\.long .*own\.npz. is of the publi"):
        RobotDescription.read(path).spec()


def test_the_physics_of_a_file_that_names_none_may_be_asked_for_later(edited: Edited) -> None:
    """What else the file says of it stays."""
    path = edited('based_on = "measured"\n', "friction = 0.8\n")
    path.write_text(path.read_text().replace('leg = "measured"\n', ""))
    found = layered(RobotOptions(), [{"described": str(path)}, {"based_on": "published"}])
    assert (found.physics.friction, found.physics.regulator_count) == (0.8, 4)
    assert (found.physics.damping, found.leg, found.full.hub) == ("published", "published", "rigid")
    assert found.spec().physics == found.physics
