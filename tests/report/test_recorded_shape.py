"""A recorded robot says what it looks like: mixed legs, its own hub, with or without a design."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from helpers.synthetic_part import synthetic_part, vibration_modes

from pneumorph.base.artefact import ArtefactError
from pneumorph.catalogue.hub_spec import HubSpec
from pneumorph.catalogue.module import Module
from pneumorph.catalogue.robot_spec import RobotSpec
from pneumorph.catalogue.site import Site
from pneumorph.fem.material import Material
from pneumorph.gait.friction_margin import friction_margin
from pneumorph.geometry.mass_properties import MassProperties
from pneumorph.geometry.pose import Pose, rotation_about
from pneumorph.geometry.simple_solids import box_solid
from pneumorph.physics.friction import FrictionPressure
from pneumorph.physics.physics import Physics
from pneumorph.reduction.assemble import assemble_reduced_part
from pneumorph.report.plan import plan_of_walk
from pneumorph.report.replay.replay_data import live_data, replay_data
from pneumorph.report.scene import Actor
from pneumorph.robot.design import Design
from pneumorph.robot.robot import Mount, Robot
from pneumorph.simulation.reduced_robot import ReducedRobot
from pneumorph.simulation.rollout import rollout
from pneumorph.study.analysis import leg_friction
from pneumorph.trajectory import Trajectory

COMMANDS = np.tile([6.0, 4.0], (4, 1))


def module(cells: tuple[int, int, int]) -> Module:
    part = synthetic_part(cells)
    reduced = assemble_reduced_part(part, vibration_modes(part, 3))
    return Module(f"{cells}", lambda: reduced, lambda *_: part)


def make_spec() -> RobotSpec:
    hub = box_solid(60.0, 60.0, 10.0, 0.0)
    mass = MassProperties.of_tetrahedra(hub.nodes, hub.tetrahedra, 1.0)
    contact = hub.nodes[hub.node_sets["bottom"]]
    coarse, fine = module((4, 4, 4)), module((8, 4, 4))
    poses = [
        Pose(rotation_about("z", yaw), rotation_about("z", yaw) @ np.array([30.0, 0.0, 2.0]))
        for yaw in (0.0, 120.0, 240.0)
    ]
    sites = tuple(
        Site(pose, each) for pose, each in zip(poses, (coarse, fine, coarse), strict=True)
    )
    return RobotSpec(
        HubSpec(hub, Material(500.0, 0.3), mass, np.zeros(3), contact),
        sites,
        Physics(damping="objective", regulator_count=2, floor_height_mm=-4.0),
        hub_model="rigid",
        thread_count=1,
    )


SPEC = make_spec()
DESIGN = "1.2.1"


@pytest.fixture(scope="module", params=["reduced", "full"])
def walk(request: pytest.FixtureRequest) -> Trajectory:
    robot = SPEC.reduced(DESIGN) if request.param == "reduced" else SPEC.full(DESIGN)
    return rollout(robot, COMMANDS, settling_steps=2, record_every=2)[1]  # type: ignore[arg-type]


def test_it_has_the_parts_poses_and_regulators_of_its_legs(walk: Trajectory) -> None:
    shape, nodes = walk.shape, walk.node_positions_mm
    assert shape is not None
    assert nodes is not None
    np.testing.assert_array_equal(shape.leg_part, [0, 1, 0])
    np.testing.assert_array_equal(shape.leg_site, [0, 1, 2])
    np.testing.assert_array_equal(shape.leg_regulators, [[1], [2], [1]])
    for leg, site in enumerate(SPEC.sites):
        np.testing.assert_array_equal(shape.leg_rotation[leg], site.pose.rotation)
        np.testing.assert_array_equal(shape.leg_position_mm[leg], site.pose.translation)
    low, high = shape.hub_nodes_mm.min(axis=0), shape.hub_nodes_mm.max(axis=0)
    np.testing.assert_allclose([low, high], [[-30, -30, 0], [30, 30, 10]], atol=1e-9)
    counts = [len(site.modules[0].reduced.rest_nodes) for site in SPEC.sites]
    assert nodes.shape[2] == max(counts)
    # A leg of fewer nodes repeats its last one: nothing is drawn or measured beyond it.
    np.testing.assert_array_equal(
        nodes[:, 0, counts[0] :], np.repeat(nodes[:, 0, counts[0] - 1 : counts[0]],
                                            counts[1] - counts[0], axis=1)
    )  # fmt: skip
    assert walk.contact_force_mN is not None
    points = [len(site.modules[0].reduced.contact_points) for site in SPEC.sites]
    assert walk.contact_force_mN.shape[2] == max(points)
    assert np.all(walk.contact_force_mN[:, 0, points[0] :] == 0.0)


def test_contact_forces_of_mixed_legs_carry_the_robot(walk: Trajectory) -> None:
    """Hub and legs bear all contacts: each leg's load is its own points' sum and no other's."""
    margin = friction_margin(walk, SPEC.physics.friction)
    assert walk.contact_force_mN is not None
    np.testing.assert_allclose(
        margin.load_mN, walk.contact_force_mN[..., 2].astype(float).sum(axis=2), rtol=1e-6
    )


def test_each_leg_has_the_friction_of_its_own_points(walk: Trajectory) -> None:
    """The hub's points and those of a leg with more of them are not taken for another leg's."""
    assert walk.contact_force_mN is not None
    law = FrictionPressure(-0.3)
    spec = replace(SPEC, physics=replace(SPEC.physics, friction_pressure=law))
    found = leg_friction(Design.parse(DESIGN), walk, spec)
    robot, pressing = spec.assembly(DESIGN), walk.contact_force_mN[..., 2].astype(float)
    reference = spec.physics.reference_impulses(robot.contact_surfaces)
    start = len(robot.hub.contact_points)
    for leg, mount in enumerate(robot.mounts):
        count = len(mount.part.contact_points)
        own = reference[start : start + count] / spec.physics.time_step_s
        expected = spec.physics.friction * law.factor(
            law.pressure_kPa * pressing[:, leg, :count] / own
        )
        np.testing.assert_allclose(np.asarray(found)[:, leg, :count], expected, rtol=1e-6)
        start += count


def test_it_is_read_back_and_drawn(walk: Trajectory, tmp_path: Path) -> None:
    again = Trajectory.load(walk.with_skin_only().save(tmp_path / "walk.npz"))
    assert again.shape is not None
    assert walk.shape is not None
    for name, value in walk.shape.arrays().items():
        np.testing.assert_array_equal(again.shape.arrays()[name], value)
    for trajectory in (walk, again):
        actor = Actor.of(replace(trajectory, metadata={}), "nameless")
        assert actor.regulators == ((1,), (2,), (1,))
        data = replay_data([actor])
        assert data["robots"][0]["bases"] == [0, 1, 0]
        assert data["robots"][0]["largest_error_mm"] <= 0.01
        assert len(live_data(actor)["bases"]) == 2
    plan = plan_of_walk(walk)
    np.testing.assert_allclose(np.abs(plan.hub_mm).max(axis=0), [30.0, 30.0], atol=1e-6)
    assert plan.regulators == ((1,), (2,), (1,))
    assert plan.entries == ("1", "2", "1")
    for metadata in ({"design": "b1.2.1+1"}, {}):  # as the design is written, where it is known
        named = plan_of_walk(replace(walk, metadata=metadata)).entries
        assert named == (tuple(metadata["design"].split(".")) if metadata else plan.entries)
    turns = [np.degrees(np.arctan2(*each.mean(axis=0)[::-1])) for each in plan.legs_mm]
    np.testing.assert_allclose(turns, [0.0, 120.0, -120.0], atol=15.0)


def test_what_is_drawn_is_where_the_nodes_are(walk: Trajectory) -> None:
    """Triangles of the film, leg by leg, are those of each part's own skin at its nodes."""
    actor = Actor.of(walk, "a")
    corners = actor.corners(1)
    start = 0
    for leg, site in enumerate(SPEC.sites):
        part = site.modules[0].reduced
        assert walk.node_positions_mm is not None
        own = walk.node_positions_mm[1, leg][part.skin]
        np.testing.assert_array_equal(corners[start : start + len(own)], own)
        start += len(own)
    assert len(corners) > start
    assert len(actor.colours(1)) == len(corners)


def test_a_robot_without_a_design_names_none() -> None:
    assembled = SPEC.assembly(DESIGN)
    robot = Robot(assembled.hub, assembled.mounts)
    walk = rollout(ReducedRobot(robot, SPEC.physics), COMMANDS, settling_steps=0)[1]
    assert "design" not in walk.metadata
    assert Actor.of(walk, "a").regulators == ((1,), (2,), (1,))


def test_each_cavity_has_its_regulator() -> None:
    """A mount may give each cavity of its part another regulator."""
    assembled = SPEC.assembly(DESIGN)
    mount = assembled.mounts[0]
    part = mount.part
    two = replace(
        part,
        **{
            name: np.concatenate([getattr(part, name)] * 2)
            for name in ("cavity_volume", "cavity_volume_1", "cavity_volume_2", "cavity_volume_3")
        },
    )
    robot = Robot(assembled.hub, (Mount(two, mount.pose, (1, 0)), *assembled.mounts[1:]))
    np.testing.assert_array_equal(robot.shape[0].leg_regulators, [[2, 1], [2, 0], [1, 0]])


def test_a_recording_of_an_earlier_version_is_the_papers_robot(walk: Trajectory) -> None:
    earlier = replace(walk, shape=None, metadata={"design": "1.0.2.0.0.1.0.0"})
    actor = Actor.of(earlier, "earlier")
    assert actor.regulators == ((1,), (2,), (1,))
    reach = np.hypot(*actor.shape.hub_nodes_mm[:, :2].T).max()
    assert reach == pytest.approx(54.5, rel=2e-3)  # a polygon of the circle's area


@pytest.mark.parametrize(
    ("name", "wrong", "cause"),
    [
        ("time_s", lambda t: np.where(t == t[1], np.nan, t), "time_s holds a value that is not"),
        ("time_s", lambda t: t[::-1], "time_s must rise from frame to frame"),
        ("contact_count", lambda n: n.astype(str), "contact_count holds .* values"),
        ("skin_triangles", lambda s: s - 1, "skin_triangles has -1, expected 0 to"),
        ("skin_triangles", lambda s: s + 1_000_000, "skin_triangles has 10000.., expected 0 to"),
        ("skin_triangles", lambda s: s.astype(float), "skin_triangles has numbers of type float64"),
        ("shape:hub_triangles", lambda s: s - 1, "hub_triangles has -1, expected 0 to"),
        ("shape:leg_part", lambda s: s + 7, "leg_part has 7, expected 0 to 2"),
    ],
)
def test_a_damaged_recording_is_refused_by_name(
    walk: Trajectory,
    name: str,
    wrong: Callable[[np.ndarray], np.ndarray],
    cause: str,
    tmp_path: Path,
) -> None:
    path = walk.save(tmp_path / "walk.npz")
    with np.load(path) as archive:
        arrays = {each: archive[each] for each in archive.files}
    arrays[name] = wrong(arrays[name])
    np.savez(path, **arrays)
    with pytest.raises(ArtefactError, match=f"walk.npz cannot be read .*{cause}"):
        Trajectory.load(path)
