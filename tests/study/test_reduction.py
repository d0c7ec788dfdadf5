"""What acts on the robots whose walks a leg is reduced from."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers.result_example import example

from pneumorph.base.run_folder import RunFolder
from pneumorph.catalogue.leg_kinds import leg_kind, measured_leg_mesh, paper_leg_mesh
from pneumorph.catalogue.leg_module import module_of_leg
from pneumorph.catalogue.paper_robot import paper_robot
from pneumorph.catalogue.robot_identity import mounting_identity, resume_identity
from pneumorph.catalogue.robot_spec import RobotSpec
from pneumorph.fem.material import LegMaterials
from pneumorph.geometry.mesh import Mesh, MeshError
from pneumorph.geometry.pose import Pose, rotation_about
from pneumorph.physics.air import Air
from pneumorph.physics.ground import Ground, RoughGround
from pneumorph.physics.physics import Physics
from pneumorph.physics.start_pose import StartPose
from pneumorph.reduction.reduction_report import ReductionReport
from pneumorph.reduction.reduction_settings import ReductionSettings
from pneumorph.reduction.walk_snapshots import WalkPhysics, WalkSnapshotSettings
from pneumorph.study import reduction
from pneumorph.study.reduce_settings import ReduceSettings
from pneumorph.study.reduction import doubts
from pneumorph.study.reduction_options import ReduceOptions, measured, reduce_as_asked
from pneumorph.study.reduction_walkers import on_lower_floor


class _Asked(Exception):
    """Carries what snapshots were asked for with."""


def asked_for(monkeypatch, call) -> tuple[Any, ...]:
    """What snapshots were asked for with."""

    def asked(*arguments):
        raise _Asked(arguments)

    monkeypatch.setattr(reduction, "collect_snapshots", asked)
    with pytest.raises(_Asked) as caught:
        call()
    found: tuple[Any, ...] = caught.value.args[0]
    return found


def acting(options: ReduceOptions, folder: Path, monkeypatch) -> WalkPhysics:
    """What would have acted on the walks."""

    given = asked_for(monkeypatch, lambda: reduce_as_asked(options, RunFolder(folder, "reduce")))
    found: WalkPhysics = given[-1]
    return found


def test_a_leg_is_reduced_where_it_is_mounted(tmp_path, monkeypatch):
    """One whose attachment face is elsewhere in its frame than the paper's leg has it."""
    mesh = paper_leg_mesh()
    away = np.array([10.0, 0.0, -4.0])
    moved = replace(mesh, nodes=mesh.nodes + away, contact_points=mesh.contact_points + away)
    robot = paper_robot(module_of_leg("published", None, moved, LegMaterials()), hub_model="rigid")
    given = asked_for(monkeypatch, lambda: reduction.reduce(robot, tmp_path))
    full = robot.full("1.1.1.1.1.1.1.1")
    for pose, leg, site in zip(given[2], full.legs, robot.sites, strict=True):
        np.testing.assert_array_equal(pose.translation, leg.pose.translation)
        np.testing.assert_array_equal(pose.rotation, leg.pose.rotation)
        apart = pose.rotation.T @ (pose.translation - site.pose.translation)
        np.testing.assert_allclose(apart, -away, atol=1e-9)


def test_a_leg_whose_sides_are_meshed_apart_is_told_of_at_once(tmp_path, monkeypatch):
    """Before there are snapshots; of a mesh with images nothing is said."""
    mesh = paper_leg_mesh()
    for own, told in ((mesh, False), (replace(mesh, mirror_nodes=None, nodes=_skewed(mesh)), True)):
        robot = paper_robot(
            module_of_leg("published", None, own, LegMaterials()), hub_model="rigid"
        )
        folder, said = RunFolder(tmp_path / str(told), "reduce"), []
        monkeypatch.setattr(folder.progress, "say", said.append)
        asked_for(monkeypatch, lambda robot=robot, folder=folder: reduction.reduce(robot, folder))
        assert any("left and right are meshed apart" in note for note in said) == told


def _skewed(mesh: Mesh) -> np.ndarray:
    """Its nodes, those above the plate and to the left 0.01 mm further out."""
    left = (mesh.nodes[:, 1] > 1.0) & (mesh.nodes[:, 2] > 5.0)
    skewed: np.ndarray = mesh.nodes + np.where(left[:, None], [0.01, 0.0, 0.0], 0.0)
    return skewed


def poses_of(mesh: Mesh, folder: Path, monkeypatch) -> tuple[RobotSpec, list[Pose]]:
    """A robot of a leg, and where its legs are while they walk for snapshots."""
    robot = paper_robot(module_of_leg("published", None, mesh, LegMaterials()), hub_model="rigid")
    return robot, asked_for(monkeypatch, lambda: reduction.reduce(robot, folder))[2]


def test_a_leg_that_is_attached_by_its_top_walks_outwards(tmp_path, monkeypatch):
    """The middle of its pad comes where the paper's leg has its end, its tip away from the hub."""
    mesh = paper_leg_mesh()
    x, _, z = mesh.nodes.T
    pad = np.flatnonzero((z == 20.0) & (x < -40.0))
    mesh = replace(mesh, node_sets={**mesh.node_sets, "attachment": pad})
    robot, poses = poses_of(mesh, tmp_path, monkeypatch)
    face = robot.module.face
    assert face is not None
    np.testing.assert_allclose(face.rotation[:, 0], [0.0, 0.0, -1.0], atol=1e-12)
    # What is kept of it tells it from the one whose tip was in the air.
    assert mounting_identity(robot, []) == {"turned": "outwards"}
    assert resume_identity(robot)["turned"] == "outwards"
    assert mounting_identity(paper_robot(), []) == {}
    for pose, leg, site in zip(poses, robot.full("1.1.1.1.1.1.1.1").legs, robot.sites, strict=True):
        np.testing.assert_allclose(pose.rotation, site.pose.rotation, atol=1e-12)
        assert site.face is not None
        place = site.pose.apply(site.face.translation)
        np.testing.assert_allclose(pose.apply(face.translation), place, atol=1e-9)
        np.testing.assert_array_equal(leg.pose.translation, pose.translation)


@pytest.mark.parametrize(("turn_deg", "follows"), [(30.0, True), (50.0, False), (-50.0, False)])
def test_a_face_that_looks_less_than_45_degrees_aside_lies_on_its_place(
    turn_deg, follows, tmp_path, monkeypatch
):
    mesh, turn = paper_leg_mesh(), rotation_about("y", turn_deg)
    turned = replace(mesh, nodes=mesh.nodes @ turn.T, contact_points=mesh.contact_points @ turn.T)
    robot, poses = poses_of(turned, tmp_path, monkeypatch)
    face = robot.module.face
    assert face is not None
    for pose, site in zip(poses, robot.sites, strict=True):
        found = pose.rotation @ face.rotation if follows else pose.rotation
        np.testing.assert_allclose(found, site.pose.rotation, atol=1e-9)


def stretched(along: float, across: float) -> Mesh:
    """The paper's leg, so many times as long from its attachment on, and as wide."""
    mesh, factors, held = paper_leg_mesh(), np.array([along, across, 1.0]), [-52.0, 0.0, 0.0]
    return replace(
        mesh,
        nodes=(mesh.nodes - held) * factors + held,
        contact_points=(mesh.contact_points - held) * factors + held,
    )


def test_the_floor_of_long_legs_is_below_them(tmp_path, monkeypatch):
    """They would begin inside it, and be thrown up; short ones fall as they did."""
    for along, inside in ((1.0, False), (1.6, True)):
        leg = module_of_leg("published", None, stretched(along, 1.0), LegMaterials())
        robot = paper_robot(leg, hub_model="rigid")
        given = asked_for(monkeypatch, lambda robot=robot: reduction.reduce(robot, tmp_path))
        points = np.concatenate([pose.apply(leg.full.mesh.contact_points) for pose in given[2]])
        usual, floor_mm = robot.physics.floor_height_mm, given[-1].physics.floor_height_mm
        assert floor_mm == (pytest.approx(points[:, 2].min()) if inside else usual)
        assert (floor_mm < usual - 1.0) == inside
        assert (given[-1].described() == {}) == (not inside)


def test_a_robot_that_is_lifted_or_on_uneven_ground_keeps_its_floor() -> None:
    usual = Physics()
    low_mm = usual.floor_height_mm - 5.0
    assert on_lower_floor(usual, low_mm).floor_height_mm == low_mm
    rough = replace(usual, ground=Ground(rough=RoughGround(roughness_mm=2.0)))
    for physics in (replace(usual, start=StartPose(lift_mm=5.0)), rough):
        assert on_lower_floor(physics, low_mm) is physics


def test_legs_that_reach_into_their_neighbours_are_refused_before_snapshots(tmp_path, monkeypatch):
    """Unless no robot walks that has both."""
    leg = module_of_leg("published", None, stretched(1.0, 2.0), LegMaterials())
    robot = paper_robot(leg, hub_model="rigid")
    never = replace(reduction.shipped_settings("published"), reduction=ReductionSettings())
    with pytest.raises(ValueError, match=r"places \d and \d of a robot .* inside each other"):
        asked_for(monkeypatch, lambda: reduction.reduce(robot, tmp_path, never))
    for walk in (WalkSnapshotSettings(leg_counts=()), WalkSnapshotSettings(leg_counts=(1, 1))):
        apart = replace(never, snapshots=replace(never.snapshots, walk=walk))
        asked_for(monkeypatch, lambda apart=apart: reduction.reduce(robot, tmp_path, apart))


def test_friction_and_regulators_of_walks_are_the_protocols(tmp_path, monkeypatch):
    """So that a leg is the same whatever floor and valves its robots have."""
    found = acting(measured(), tmp_path, monkeypatch).physics
    assert found.friction == measured().snapshots.static.friction
    own = leg_kind("measured").physics
    assert own.friction != found.friction
    assert replace(found, friction=own.friction) == replace(
        own, air=Air(), friction_by_surface=(), pressure_map=found.pressure_map
    )


def test_published_walks_are_those_that_earlier_snapshots_are_of(tmp_path, monkeypatch):
    assert acting(ReduceOptions(), tmp_path, monkeypatch).described() == {}


@pytest.mark.parametrize(
    ("preset", "own_mesh"), [(measured, measured_leg_mesh), (ReduceOptions, paper_leg_mesh)]
)
def test_a_mesh_without_outer_end_is_refused_before_its_snapshots(
    preset, own_mesh, tmp_path, monkeypatch
):
    """They take hours."""

    def never(*_):
        raise AssertionError("snapshots were asked for")

    monkeypatch.setattr(reduction, "collect_snapshots", never)
    mesh = own_mesh()
    sets = {name: each for name, each in mesh.node_sets.items() if name != "outer_end_face"}
    path = replace(mesh, node_sets=sets).save(tmp_path / "mesh.npz")
    with pytest.raises(MeshError, match="outer_end_face"):
        reduce_as_asked(replace(preset(), mesh=path), RunFolder(tmp_path / "run", "reduce"))


def test_a_reduction_that_no_robot_should_walk_on_is_told() -> None:
    sound = replace(
        example(ReductionReport), compliance_error_percent=24.0, heldout_node_error_mm=0.1
    )
    settings = ReduceSettings()
    assert doubts(sound, settings) == []
    (points,) = doubts(replace(sound, sampling_converged=False), settings)
    assert "stop at 0.1, expected 0.008 or less" in points
    assert "element_limit, 220" in points
    (stiff,) = doubts(replace(sound, compliance_error_percent=91.3), settings)
    assert "by 91 % otherwise" in stiff
    (unseen,) = doubts(replace(sound, heldout_node_error_mm=None), settings)
    assert "no snapshot was held out" in unseen


@pytest.mark.parametrize(
    ("name", "what"),
    [("bend_error_percent", "bends freely"), ("blocked_error_percent", "pushes with its tip held")],
)
def test_a_curve_that_is_far_off_or_ends_is_told(name: str, what: str) -> None:
    sound = replace(
        example(ReductionReport), compliance_error_percent=24.0, heldout_node_error_mm=0.1
    )
    assert doubts(replace(sound, **{name: 9.9}), ReduceSettings()) == []
    assert doubts(replace(sound, **{name: None}), ReduceSettings()) == []
    (far,) = doubts(replace(sound, **{name: 34.4}), ReduceSettings())
    assert far.startswith(f"the reduced leg {what} by up to 34 % otherwise than the finite")
    lost = replace(sound, compliance_error_percent=np.inf, **{name: np.inf})
    (none,) = doubts(lost, ReduceSettings())
    assert none.startswith(f"the reduced leg finds no equilibrium where it {what} at some of the")
    assert "inf" not in none
