"""A soft disk that carries legs, reduced as any other part."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from helpers.free_part import hub_deformation, hub_snapshots
from helpers.small_robot import small_leg

from pneumorph.catalogue.paper_robot import disk_rim_points, paper_disk_mesh
from pneumorph.fem.material import Material
from pneumorph.fem.part_model import PartModel
from pneumorph.fem.soft_hub import SoftHub, SoftHubState
from pneumorph.geometry.pose import Pose, rotation_about
from pneumorph.reduction.ecsw import EcswSettings
from pneumorph.reduction.reduce import reduce_part
from pneumorph.reduction.reduction_settings import ReductionSettings
from pneumorph.reduction.snapshots import Snapshots
from pneumorph.reduction.walk_snapshots import WalkSnapshotSettings

# The published shape, a hundred times softer than the published disk so that small legs bend it.
DISK = PartModel(paper_disk_mesh(), Material(50.0, 0.3), mass_kg=0.075)
HUB = SoftHub(DISK, disk_rim_points(DISK.mesh))
LEG_PLACES = [
    Pose(rotation_about("z", yaw), rotation_about("z", yaw) @ np.array([45.0, -6.0, 18.0]))
    for yaw in (0.0, 120.0, 240.0)
]


@pytest.fixture(scope="module")
def snapshots() -> Snapshots:
    settings = WalkSnapshotSettings(
        leg_counts=(3,), corner_limit=5, hold_s=0.2, amplitude_kPa=15.0, record_every=1
    )
    return hub_snapshots(small_leg(), HUB, LEG_PLACES, settings, 0)


def test_deformation_does_not_see_rigid_motions(snapshots: Snapshots) -> None:
    moved = DISK.rest_nodes + snapshots.displacement[-1]
    turn = rotation_about("z", 130.0) @ rotation_about("x", 20.0)
    states = [
        SoftHubState(x, np.zeros(x.size)) for x in (moved, moved @ turn.T + [3.0, -80.0, 7.0])
    ]
    first, second = (hub_deformation(HUB, state) for state in states)
    assert np.abs(first).max() > 0.1
    # Rounding of coordinates of 100 mm.
    assert np.abs(first - second).max() < 1e-10


def test_a_soft_disk_is_reduced_like_a_leg(snapshots: Snapshots) -> None:
    assert snapshots.metadata["details"]["status"] == "completed"
    settings = ReductionSettings(
        mode_tolerance=0.01, ecsw=EcswSettings(hyperreduction_tolerance=0.01)
    )
    part, report = reduce_part(DISK, snapshots, settings)
    assert part.cavity_count == 0
    assert report.bend_error_percent is None
    assert report.projection_error <= 0.01
    assert report.sampling_converged
    assert report.tetrahedron_count < 0.7 * len(DISK.mesh.tetrahedra)
    moved = np.linalg.norm(snapshots.displacement, axis=2).mean(axis=1)
    assert report.heldout_node_error_mm < 0.05 * moved.max()
    # Held-out states lie between trained ones: their force errors are of the trained ones' size.
    assert report.heldout_force_error_percent < 5.0
    # No momentum and no moment of momentum; modes are stored in single precision (6e-8 each).
    size = part.mass**0.5
    assert np.abs(part.first_moment_modes).max() < 1e-6 * size
    twist = part.second_moment_modes - part.second_moment_modes.transpose(1, 0, 2)
    assert np.abs(twist).max() < 1e-6 * size * np.abs(part.rest_nodes).max()


def test_what_needs_an_attachment_is_refused_without_one(snapshots: Snapshots) -> None:
    for name, value in (("contact_flexibility", True), ("answer_share", 0.1)):
        settings = dataclasses.replace(ReductionSettings(), **{name: value})
        with pytest.raises(ValueError, match=rf"{name} is .* of a part without a cavity"):
            reduce_part(DISK, snapshots, settings)


def test_legs_of_other_parts_are_not_mixed() -> None:
    from pneumorph.fem.full_robot import FullRobot
    from pneumorph.physics.physics import Physics
    from pneumorph.reduction.leg_recorder import LegRecorder

    legs = [(small_leg(), LEG_PLACES[0], 0), (small_leg(), LEG_PLACES[1], 1)]
    with pytest.raises(ValueError, match="must all be one part"):
        LegRecorder(FullRobot(HUB, legs, Physics(regulator_count=2)))


def test_a_part_with_a_cavity_still_needs_its_bending(snapshots: Snapshots) -> None:
    leg = small_leg()
    with pytest.raises(ValueError, match="must hold free-bending equilibria"):
        reduce_part(
            leg,
            dataclasses.replace(
                snapshots,
                displacement=np.zeros((len(snapshots), leg.node_count, 3)),
                metadata={**snapshots.metadata, "mesh_digest": leg.mesh.digest()},
            ),
        )
