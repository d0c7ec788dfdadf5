"""A mesh file that is its own mirror image makes robots whose mirror images walk alike."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from helpers.crawlers import GAIT, PHYSICS, STEPPER
from helpers.two_chambers import two_chamber_leg

from pneumorph.fem.part_model import PartModel
from pneumorph.geometry.mesh_file import read_mesh_file
from pneumorph.geometry.pose import Pose, rotation_about
from pneumorph.reduction.ecsw import EcswSettings
from pneumorph.reduction.reduce import reduce_part
from pneumorph.reduction.reduction_settings import ReductionSettings
from pneumorph.reduction.snapshots import Snapshots
from pneumorph.reduction.static_snapshots import (
    StaticSnapshotSettings,
    bend_snapshots,
    load_snapshots,
)
from pneumorph.robot.robot import Hub, Mount, Robot
from pneumorph.simulation.batched_simulator import BatchedSimulator, RobotStatus

meshio = pytest.importorskip("meshio")

FLIP = np.array([1.0, -1.0, 1.0])
PRESSURE_KPA = 30.0
STATIC = StaticSnapshotSettings(
    bend_pressure_kPa=PRESSURE_KPA, bend_count=3, load_count=4, load_pressure_kPa=PRESSURE_KPA,
    load_limit_mN=60.0, rotation="polar",
)  # fmt: skip
REDUCTION = ReductionSettings(
    mode_limit=6, mode_tolerance=1e-4, rotation="polar", holdout_every=0,
    ecsw=EcswSettings(hyperreduction_tolerance=0.02),
)  # fmt: skip


@pytest.fixture(scope="module")
def leg(tmp_path_factory: pytest.TempPathFactory) -> PartModel:
    """Of a gmsh file that says nothing of a mirror."""
    known = two_chamber_leg()
    triangles = {k: known.mesh.surfaces[k] for k in ("cavity_left", "cavity_right", "sheet")}
    points = {k: known.mesh.node_sets[k][:, None] for k in ("attachment", "outer_end_face")}
    names = {"solid": 3} | dict.fromkeys(triangles, 2) | dict.fromkeys(points, 0)
    cells = [("tetra", known.mesh.tetrahedra)]
    cells += [("triangle", each) for each in triangles.values()]
    cells += [("vertex", each) for each in points.values()]
    tags = [np.full(len(block), tag, dtype=np.int32) for tag, (_, block) in enumerate(cells, 1)]
    path = Path(tmp_path_factory.mktemp("mesh")) / "leg.msh"
    meshio.Mesh(
        known.mesh.nodes,
        cells,
        cell_data={"gmsh:physical": tags, "gmsh:geometrical": tags},
        field_data={name: np.array([tag, dim]) for tag, (name, dim) in enumerate(names.items(), 1)},
    ).write(path, file_format="gmsh22")
    mesh = read_mesh_file(path, contact_spacing_mm=5.0)
    return PartModel(mesh, known.material, 0.01, known.membranes, known.cavity_names)


def robot(part, angles, regulators) -> Robot:
    mounts = []
    for angle, own in zip(angles, regulators, strict=True):
        turn = rotation_about("z", angle)
        pose = Pose(turn @ rotation_about("y", 15.0), turn @ np.array([20.0, 0.0, 9.0]))
        mounts.append(Mount(part, pose, own))
    return Robot(Hub(0.02, np.zeros(3), 4.0 * np.eye(3), np.zeros(3)), tuple(mounts))


def test_mirror_image_robots_of_a_mesh_file_walk_mirror_image_paths(leg: PartModel) -> None:
    """The friction solver stops at 1e-9 mm/s, and its slowest error is some 1e4 sweeps long: 160
    steps of 0.01 s may differ by up to about 1e-3 mm, as those of legs that the package makes."""
    bend = bend_snapshots(leg, STATIC)
    loads = load_snapshots(leg, STATIC, range(4), bend)
    part, report = reduce_part(leg, Snapshots.joined([bend, loads]), REDUCTION)
    assert 0 < report.symmetric_mode_count < report.mode_count
    points = part.contact_points
    away = np.linalg.norm(points[:, None] * FLIP - points, axis=2).min(axis=1)
    assert away.max() == 0.0
    angles, orders = np.array([20.0, 140.0, 260.0]), [(0, 1), (1, 1), (0, 0)]
    mirrored = [each[::-1] for each in orders]  # left and right chambers change places
    robots = [robot(part, angles, orders), robot(part, -angles, mirrored)]
    stepper = replace(STEPPER, contact_tolerance_mm_per_s=1e-9, contact_sweeps=3000)
    physics = replace(PHYSICS, damping="objective", floor_height_mm=-2.0)
    simulator = BatchedSimulator(robots, physics, stepper, thread_count=1)
    for command in 3.0 * GAIT:
        simulator.advance(np.tile(command, (2, 1)), 20)
    assert np.all(simulator.status == RobotStatus.RUNNING)
    first, image = simulator.read("position")
    assert np.abs(first - image * FLIP).max() < 1e-3
    assert np.abs(first[:2]).min() > 0.02  # it moved at all, and to one side
    assert simulator.read("contact_total").min() > 160  # on the floor
