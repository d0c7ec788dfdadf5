"""Whether the robots that walk for snapshots can stand as they begin."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import combinations

import numpy as np

from pneumorph.catalogue.mounting_check import USUAL_TOLERANCE_MM
from pneumorph.fem.hub_body import HubBody
from pneumorph.geometry.mesh import Mesh
from pneumorph.geometry.outer_boundary import outer_boundary
from pneumorph.geometry.overlap import deepest_inside
from pneumorph.geometry.pose import Pose
from pneumorph.physics.physics import Physics
from pneumorph.reduction.walk_snapshots import WalkSnapshotSettings, walk_plan


def check_walkers_apart(mesh: Mesh, poses: Sequence[Pose], settings: WalkSnapshotSettings) -> None:
    """Refuse robots whose legs reach into each other at rest.

    Args:
        mesh: The leg.
        poses: Places for legs in the robot's frame.
        settings: Which robots walk.

    Raises:
        ValueError: Two legs of one robot do, or it has more legs than there are places; or there
            are too many places for every subset of them to walk.
    """
    count = settings.robot_count(len(poses))
    plans = [walk_plan(settings, number, len(poses)) for number in range(count)]
    pairs = {pair for plan in plans for pair in combinations(plan.places.tolist(), 2)}
    skin = outer_boundary(mesh)
    outside = mesh.nodes[np.unique(skin)]
    for first, second in sorted(pairs):
        # In the frame of the first, which its box fits best.
        apart = poses[first].inverse().compose(poses[second])
        theirs, ours = apart.apply(outside), apart.inverse().apply(outside)
        depth_mm = max(deepest_inside(each, mesh.nodes, skin)[0] for each in (theirs, ours))
        if depth_mm > USUAL_TOLERANCE_MM:
            raise ValueError(
                f"legs at the places {first} and {second} of a robot that is to walk for snapshots "
                f"are up to {depth_mm:.1f} mm inside each other, expected at most "
                f"{USUAL_TOLERANCE_MM:g}: the leg is too wide for its neighbour; let robots walk "
                "that have fewer legs (snapshots.walk.leg_counts) or other places "
                "(snapshots.walk.seed), or none (leg_counts empty)"
            )


def lowest_mm(mesh: Mesh, hub: HubBody, poses: Sequence[Pose]) -> float:
    """Height of the lowest contact point of a robot with a leg at every place, at rest [mm]."""
    points = [pose.apply(mesh.contact_points) for pose in poses]
    return float(np.concatenate([*points, hub.contact_points])[:, 2].min())


def on_lower_floor(physics: Physics, lowest_mm: float) -> Physics:
    """The physics with a level floor no higher than what begins on it, which would be thrown up.

    Args:
        physics: What acts on the robots; uneven floors, and those of robots that start askew, are
            below them anyway.
        lowest_mm: Height of their lowest point in the robot's frame [mm].
    """
    start = physics.start
    lowest_mm += start.lift_mm
    if not physics.ground.is_plane or not start.is_upright or lowest_mm >= physics.floor_height_mm:
        return physics
    return replace(physics, floor_height_mm=lowest_mm)
