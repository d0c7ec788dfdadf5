"""One specification is the same robot in both models, and stays so however it is changed."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import fields, replace
from pathlib import Path
from typing import get_args

import numpy as np
import pytest
from helpers.box_mesh import box_mesh
from helpers.full_module import full_module
from helpers.synthetic_part import synthetic_part, vibration_modes

from pneumorph.catalogue.hub_spec import HubSpec
from pneumorph.catalogue.leg_kinds import HYPERELASTIC_PRESSURE_MAP, LegName
from pneumorph.catalogue.leg_module import module_of_leg
from pneumorph.catalogue.module import Module
from pneumorph.catalogue.paper_robot import paper_robot
from pneumorph.catalogue.robot_description import RobotDescription
from pneumorph.catalogue.robot_identity import full_identity, reduction_digest
from pneumorph.catalogue.robot_options import RobotOptions
from pneumorph.catalogue.robot_spec import RobotSpec
from pneumorph.catalogue.site import Site
from pneumorph.fem.full_order_settings import Integrator
from pneumorph.fem.material import Material
from pneumorph.fem.part_model import PartModel
from pneumorph.fem.rigid_hub import RigidHub
from pneumorph.fem.soft_hub import SoftHub
from pneumorph.gait.held_gait import HeldGait
from pneumorph.geometry.pose import Pose, rotation_about
from pneumorph.physics.air import Air
from pneumorph.physics.calibration import Calibration
from pneumorph.physics.floor import PlaneFloor
from pneumorph.physics.ground import Ground
from pneumorph.physics.height_map import HeightMap
from pneumorph.physics.physics import Physics
from pneumorph.physics.pressure import PressureMap
from pneumorph.reduction.assemble import assemble_reduced_part
from pneumorph.robot.design import Design
from pneumorph.simulation.randomisation import World
from pneumorph.simulation.randomised_simulator import simulator_in_worlds
from pneumorph.simulation.rollout import rollout
from pneumorph.simulation.stepper_settings import StepperSettings
from pneumorph.study.analysis import Analysis
from pneumorph.study.baseline import Baseline
from pneumorph.study.comparison import Comparison
from pneumorph.study.deployment_result import DeployedGait
from pneumorph.study.engine_benchmark import EngineSpeed
from pneumorph.study.evaluation import Evaluation
from pneumorph.study.full_benchmark import StepTimes
from pneumorph.study.search_findings import SearchFindings
from pneumorph.study.simulated_walk import SimulatedWalk
from pneumorph.study.training_result import TrainingResult
from pneumorph.study.transfer import Transfer

FALLING = Physics(damping="objective", regulator_count=2, floor_height_mm=-1e5, friction=0.7)
DESIGN = "1.2.0.1"
LEG_KG, HUB_KG = 0.105, 0.03


def full_leg(modulus_factor: float = 1.0, mass_factor: float = 1.0) -> PartModel:
    usual = synthetic_part((4, 4, 4))
    sheets = tuple(
        replace(sheet, material=sheet.material.stiffer(modulus_factor)) for sheet in usual.membranes
    )
    solid = usual.material.stiffer(modulus_factor)
    return PartModel(usual.mesh, solid, LEG_KG * mass_factor, sheets, cavity="cavity")


def module(mode_count: int = 4) -> Module:
    part = full_leg()
    reduced = assemble_reduced_part(part, vibration_modes(part, mode_count))
    return Module(f"a box of {mode_count} modes", lambda: reduced, full_leg)


def hub() -> HubSpec:
    mesh = box_mesh((16.0, 16.0, 9.0), (2, 2, 1))
    mesh = replace(mesh, nodes=mesh.nodes - np.array([8.0, 8.0, -4.0]))
    bottom = mesh.nodes[mesh.nodes[:, 2] < 4.0 + 1e-9]
    return HubSpec(mesh, Material(500.0, 0.3), HUB_KG, np.array([1.0, 0.0, 13.0]), bottom)


LEG = module()
POSES = [
    Pose(rotation_about("z", yaw), rotation_about("z", yaw) @ np.array([64.0, 0.0, 0.0]))
    for yaw in (0.0, 90.0, 180.0, 270.0)
]
SPEC = RobotSpec(
    hub(),
    tuple(Site(pose, LEG) for pose in POSES),
    FALLING,
    StepperSettings(element_precision="double"),
    hub_model="rigid",
    thread_count=1,
)
GAIT = HeldGait.evenly(np.array([[6.0, 0.0], [6.0, 9.0]]), 0.03)


def leg_masses(spec: RobotSpec) -> tuple[float, float]:
    """Mass of all legs of the design in both models [kg]."""
    full, reduced = spec.full(DESIGN), spec.assembly(DESIGN)
    return (
        sum(float(leg.part.node_mass.sum()) for leg in full.legs),
        sum(mount.part.mass for mount in reduced.mounts),
    )


def test_both_models_are_the_same_robot_at_rest() -> None:
    full, reduced = SPEC.full(DESIGN), SPEC.reduced(DESIGN)
    assert full.physics == reduced.physics == SPEC.physics
    start, same = full.initial_state(), reduced.initial_state()
    # Positions of 100 mm, stored in single precision by the reduced part.
    np.testing.assert_allclose(np.array(start.positions), reduced.node_positions(same), atol=1e-4)
    np.testing.assert_allclose(full.tracked_point_mm(start), SPEC.hub.tracked_point, atol=1e-12)
    assert [leg.regulators[0] for leg in full.legs] == [0, 1, 0]
    assert [mount.regulators for mount in reduced.robot.mounts] == [(0,), (1,), (0,)]
    assert leg_masses(SPEC) == pytest.approx((3 * LEG_KG, 3 * LEG_KG), rel=1e-12)
    assert full.hub.mass_kg == reduced.robot.hub.mass == HUB_KG
    weight = (3 * LEG_KG + HUB_KG) * SPEC.physics.gravity_mm_per_s2
    assert SPEC.weight_mN(DESIGN) == pytest.approx(weight, rel=1e-12)
    np.testing.assert_array_equal(full.hub.contact_points, reduced.robot.hub.contact_points)


def test_both_models_walk_a_gait_alike() -> None:
    """Times, commands and regulated pressures are those of the gait; the fall is gravity's."""
    walks = [
        rollout(model, GAIT, settling_steps=0, record_every=1)[1]
        for model in (SPEC.full(DESIGN), SPEC.reduced(DESIGN))
    ]
    for walk in walks:
        assert walk.status == "completed"
        np.testing.assert_allclose(walk.time_s, 0.01 * np.arange(7), atol=1e-12)
        # Three steps of 1.5 kPa each, the rate's; then both climb.
        np.testing.assert_allclose(walk.regulated_kPa[[3, 4, 6], 0], [4.5, 6.0, 6.0])
        np.testing.assert_allclose(walk.regulated_kPa[[3, 4, 6], 1], [0.0, 1.5, 4.5])
    fallen = [walk.tracked_point_mm[-1, 2] - walk.tracked_point_mm[0, 2] for walk in walks]
    # (1 + alpha h) v_n = v + h g, six steps; legs that bend move the hub by a thousandth of that.
    speeds = np.cumsum([9800.0 * 0.01 * 1.001**-n for n in range(1, 7)])
    assert fallen[0] == pytest.approx(-0.01 * speeds.sum(), rel=1e-3)
    assert fallen == pytest.approx([fallen[0]] * 2, rel=1e-4)


@pytest.mark.parametrize("integrator", ["linearly_implicit", "implicit_euler"])
def test_air_fills_both_models_alike(integrator: Integrator) -> None:
    """Cavities of equal volume at rest, two on regulator 1 and one on 2, which rises quicker; the
    reduced part's volume is stored to single precision."""
    air = Air(law="orifice", filling_mm3_per_s_kPa=(40.0,))
    spec = replace(
        SPEC,
        physics=replace(SPEC.physics, air=air),
        full_order=replace(SPEC.full_order, integrator=integrator),
    )
    full, reduced = (
        rollout(model, GAIT, settling_steps=0, record_every=1)[1].regulated_kPa
        for model in (spec.full(DESIGN), spec.reduced(DESIGN))
    )
    np.testing.assert_allclose(full, reduced, rtol=1e-6)
    assert 0.5 < full[1, 0] < 2.0
    assert full[4, 1] - full[3, 1] > 1.2 * full[1, 0]


def test_robots_side_by_side_share_their_parts_and_walk_as_each_alone() -> None:
    designs = (DESIGN, Design.parse("2.1.1.0"), SPEC.assembly("0.1.2.1"))
    simulator = SPEC.simulator(designs)
    assert {id(mount.part) for robot in simulator.robots for mount in robot.mounts} == {
        id(LEG.reduced)
    }
    assert len({id(robot.hub) for robot in simulator.robots}) == 1
    assert simulator.thread_count == 1
    simulator.advance(np.tile([6.0, 9.0], (3, 1)), 20)
    alone = SPEC.simulator(["2.1.1.0"])
    alone.advance(np.array([[6.0, 9.0]]), 20)
    for name in ("position", "rotation", "modes"):
        np.testing.assert_array_equal(alone.read(name)[0], simulator.read(name)[1])


def test_scaling_is_of_both_models() -> None:
    scaled = SPEC.scaled(modulus_factor=1.7, mass_factor=1.2)
    assert leg_masses(scaled) == pytest.approx((3 * 1.2 * LEG_KG,) * 2, rel=1e-12)
    assert scaled.full(DESIGN).hub.mass_kg == pytest.approx(1.2 * HUB_KG)
    assert scaled.assembly(DESIGN).hub.mass == pytest.approx(1.2 * HUB_KG)
    assert scaled.weight_mN(DESIGN) == pytest.approx(1.2 * SPEC.weight_mN(DESIGN))
    assert scaled.module.full.material.young_modulus_kPa == pytest.approx(1.7 * 1160.0)
    assert scaled.module.full.membranes[0].material.young_modulus_kPa == pytest.approx(1.7 * 2320.0)
    stretched, usual = (
        spec.module.reduced.tetrahedron_material.young_modulus_kPa for spec in (scaled, SPEC)
    )
    assert stretched == pytest.approx(1.7 * usual)
    # Once more is once more; nothing is nothing.
    twice = scaled.scaled(mass_factor=2.0)
    assert leg_masses(twice) == pytest.approx((3 * 2.4 * LEG_KG,) * 2, rel=1e-12)
    assert SPEC.scaled() is SPEC
    # Sites still share one module, which is made once.
    assert len({each for site in scaled.sites for each in site.modules}) == 1
    assert SPEC.module is LEG


def test_a_calibration_is_of_the_physics_and_the_modules() -> None:
    measured = Calibration(PressureMap(3.0, -2.0), modulus_factor=1.3, friction=0.8)
    spec = SPEC.calibrated(measured)
    assert spec.physics == replace(FALLING, pressure_map=PressureMap(3.0, -2.0), friction=0.8)
    assert spec.full(DESIGN).physics == spec.reduced(DESIGN).physics == spec.physics
    assert spec.module.full.material.young_modulus_kPa == pytest.approx(1.3 * 1160.0)
    assert spec.module.reduced.metadata["scaled"]["modulus_factor"] == 1.3
    assert leg_masses(spec) == pytest.approx((3 * LEG_KG,) * 2, rel=1e-12)
    assert spec.hub.mass_kg == HUB_KG
    described = spec.describe()
    assert described["calibration"].modulus_factor == 1.3
    assert described["calibration"].slope == 3.0
    # What was not measured stays: the map alone leaves the modules alone.
    assert SPEC.calibrated(Calibration(PressureMap(3.0, -2.0))).module is LEG


def test_a_summary_names_the_physics_of_its_distances() -> None:
    """In every result that takes what the robot says of itself; files of before lack it."""
    physics = replace(FALLING, friction_by_surface=(("hub", 0.3),), air=Air("orifice"))
    described = replace(SPEC, physics=physics).describe()
    assert described["physics"] == physics
    for kind in (Analysis, Baseline, Comparison, DeployedGait, EngineSpeed, Evaluation,
                 SearchFindings, SimulatedWalk, StepTimes, TrainingResult, Transfer):  # fmt: skip
        assert set(described) - {"leg"} <= {each.name for each in fields(kind)}
        assert {each.name: each.default for each in fields(kind)}["physics"] is None


def test_a_robot_in_a_world_is_the_randomised_simulators() -> None:
    world = World(0.5, 1.2, 0.9, 0.0, 4.0)
    spec = SPEC.in_world(world)
    assert (spec.physics.friction, spec.physics.floor_slope_deg) == (0.5, 4.0)
    assert leg_masses(spec) == pytest.approx((3 * 0.9 * LEG_KG,) * 2, rel=1e-12)
    assert spec.full(DESIGN).physics == spec.physics
    ours = spec.simulator([DESIGN])
    theirs = simulator_in_worlds([SPEC.assembly(DESIGN)], [world], SPEC.physics, SPEC.stepper, 1)
    for simulator in (ours, theirs):
        simulator.advance(np.array([[6.0, 9.0]]), 20)
    # Scaled parts on one side, the engine's factors on the other: to rounding.
    np.testing.assert_allclose(ours.forward_position_mm, theirs.forward_position_mm, rtol=1e-12)


def test_modules_point_down_in_a_world_in_both_models() -> None:
    spec = SPEC.in_world(World(0.5, 1.0, 1.0, 0.0, 0.0, mounting_angle_deg=3.0))
    reduced = [mount.pose for mount in spec.assembly(DESIGN).mounts]
    usual = [mount.pose for mount in SPEC.assembly(DESIGN).mounts]
    legs, before = (each.full(DESIGN).legs for each in (spec, SPEC))
    for pose, old, leg, leg_before in zip(reduced, usual, legs, before, strict=True):
        turned = np.degrees(np.arccos(pose.rotation[:, 0] @ old.rotation[:, 0]))
        assert turned == pytest.approx(3.0, abs=1e-6)
        down = np.degrees(np.arcsin(old.rotation[2, 0]) - np.arcsin(pose.rotation[2, 0]))
        assert down == pytest.approx(3.0, abs=1e-6)
        nodes = leg.part.mesh.node_set("attachment")
        np.testing.assert_allclose(
            leg.attachment_in_hub, pose.apply(leg.part.rest_nodes[nodes]), atol=1e-12
        )
        assert np.abs(leg.attachment_in_hub - leg_before.attachment_in_hub).max() < 1.0


def test_a_world_points_modules_further_down_than_they_do() -> None:
    own = replace(SPEC, mounting_angle_deg=2.0)
    world = World(0.5, 1.0, 1.0, 0.0, 0.0, mounting_angle_deg=3.0)
    assert own.in_world(world).mounting_angle_deg == 5.0


@pytest.mark.parametrize("design", ["1.2.1", "1.2.0.1.0", "1.2.1.0.0.0.0.2"])
def test_a_design_of_another_size_is_refused(design: str) -> None:
    count = len(design.split("."))
    for make in (SPEC.assembly, SPEC.reduced, SPEC.full, lambda each: SPEC.simulator([each])):
        with pytest.raises(ValueError, match=f"{count} locations, expected 4: one for each site"):
            make(design)
        with pytest.raises(ValueError, match=f"{count} locations, expected 4"):
            make(Design.parse(design))


def test_specifications_without_sense_are_refused() -> None:
    with pytest.raises(ValueError, match="thread_count is -3, expected 0 for every processor"):
        replace(SPEC, thread_count=-3)
    with pytest.raises(ValueError, match="threads must be at least 0, got -3"):
        RobotOptions(threads=-3)
    with pytest.raises(ValueError, match="sites is empty"):
        replace(SPEC, sites=())
    with pytest.raises(ValueError, match='hub must be "soft" or "rigid", got'):
        replace(SPEC, hub_model="jelly").full(DESIGN)
    with pytest.raises(ValueError, match=r"leg must be one of published, hyper.*got 'wood'"):
        paper_robot("wood")  # type: ignore[arg-type]


def test_modules_may_differ_from_site_to_site() -> None:
    other = module(6)
    sites = (SPEC.sites[0], *(Site(site.pose, other) for site in SPEC.sites[1:]))
    mixed = replace(SPEC, sites=sites)
    counts = [mount.part.mode_count for mount in mixed.assembly(DESIGN).mounts]
    assert counts == [4, 6, 6]
    with pytest.raises(
        ValueError, match="modules a box of 4 modes, a box of 6 modes, expected one"
    ):
        _ = mixed.module
    heavy = mixed.scaled(mass_factor=2.0).assembly(DESIGN)
    assert [mount.part.mass for mount in heavy.mounts] == pytest.approx([2 * LEG_KG] * 3)


def test_a_module_of_finite_elements_alone_walks_as_such() -> None:
    alone = full_module("a box", full_leg())
    spec = replace(SPEC, sites=tuple(Site(pose, alone) for pose in POSES))
    assert spec.full(DESIGN).legs[0].part is alone.full
    with pytest.raises(ValueError, match="a box has not been reduced"):
        spec.reduced(DESIGN)


def test_the_hub_and_the_floor_of_full_robots_are_asked_for(tmp_path: Path) -> None:
    assert isinstance(SPEC.full(DESIGN).hub, RigidHub)
    assert SPEC.full(DESIGN).floor == PlaneFloor(-1e5)
    np.save(tmp_path / "hills.npy", np.full((5, 5), 2.0))
    hills = replace(FALLING, ground=Ground(HeightMap(tmp_path / "hills.npy")))
    spec = replace(SPEC, hub_model="soft", physics=hills)
    full = spec.full(DESIGN)
    assert isinstance(full.hub, SoftHub)
    assert full.hub.part.mass_kg == HUB_KG
    assert full.floor.description == "height map hills.npy"
    assert full.floor.gap(np.array([[0.0, 0.0, 2.0 - 1e5]]))[0] == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize(
    "make",
    [
        lambda: paper_robot("hyperelastic", Physics(damping="objective")),
        lambda: paper_robot(module_of_leg("hyperelastic").scaled(1.2), Physics()),
        lambda: RobotOptions.of("published", leg="hyperelastic").spec(),
    ],
)
def test_the_published_legs_map_is_refused_for_another_leg(make: Callable[[], RobotSpec]) -> None:
    """It is 3.3 times the pressure."""
    with pytest.raises(
        ValueError, match=r"slope 4\.0785, expected .* slope 1\.247.*leg_kind\(\"hyperelas"
    ):
        make()


def test_another_legs_map_is_named_by_its_leg() -> None:
    with pytest.raises(ValueError, match=r"expected .* slope 1: .*leg_kind\(\"measured\"\)"):
        paper_robot("measured", Physics())


def test_a_ground_whose_file_is_missing_is_named() -> None:
    hills = Physics(ground=Ground(HeightMap(Path("no_hills.npy"))))
    spec = replace(SPEC, physics=replace(hills, damping="objective"))
    for make in (spec.reduced, spec.full, lambda design: spec.simulator([design])):
        with pytest.raises(FileNotFoundError, match=r"height map no_hills\.npy does not exist"):
            make(DESIGN)


def test_the_papers_robot_has_the_map_of_its_leg() -> None:
    assert paper_robot("published").physics == Physics()
    other = paper_robot("hyperelastic").physics
    assert other == Physics(pressure_map=HYPERELASTIC_PRESSURE_MAP)
    assert paper_robot(module_of_leg("hyperelastic")).physics == other
    given = Physics(friction=0.4, pressure_map=HYPERELASTIC_PRESSURE_MAP)
    assert paper_robot("hyperelastic", given).physics is given
    measured = Physics(pressure_map=PressureMap(1.1, -4.0))
    assert paper_robot("hyperelastic", measured).physics is measured
    assert paper_robot(module_of_leg("published"), thread_count=2).thread_count == 2
    assert (
        RobotOptions.of("published", threads=2).spec().physics == paper_robot("published").physics
    )


def test_a_robot_may_have_fewer_modes_for_all_its_modules() -> None:
    whole = paper_robot()
    fewer = whole.with_fewer_modes(24)
    parts = [mount.part for mount in fewer.assembly("1.0.0.2.2.0.0.1").mounts]
    assert [part.mode_count for part in parts] == [24] * 4
    assert all(part is parts[0] for part in parts)
    assert full_identity(fewer) == full_identity(whole)
    assert reduction_digest(fewer) != reduction_digest(whole)
    stiffer = fewer.scaled(1.1).module.reduced
    assert (stiffer.mode_count, stiffer.metadata["scaled"]["modulus_factor"]) == (24, 1.1)
    # For each of a leg's chambers.
    described = RobotDescription.read(Path(__file__).parents[2] / "examples" / "two_chambers.toml")
    assert described.spec().with_fewer_modes(12).module.reduced.mode_count == 24
    # Nothing changes where nothing is left out.
    assert whole.with_fewer_modes(0) is whole
    assert whole.with_fewer_modes(40) is whole


def test_a_module_that_is_inflated_as_measured_has_the_measured_legs_robot() -> None:
    """With the printed hub of 30 g, rigid, and finite elements that step as those of its name."""
    for name in get_args(LegName):
        leg_by_name, module = paper_robot(name), paper_robot(module_of_leg(name))
        assert module.physics == leg_by_name.physics
        assert module.hub.mass_kg == leg_by_name.hub.mass_kg
    named, own = paper_robot("measured"), paper_robot(module_of_leg("measured"))
    assert own.physics == named.physics
    assert own.hub.mass_kg == named.hub.mass_kg == pytest.approx(0.030, abs=0.001)
    assert (own.hub_model, own.full_order) == (named.hub_model, named.full_order)
    assert own.hub_model == "rigid" != paper_robot(module_of_leg("published")).hub_model
