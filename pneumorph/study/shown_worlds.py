"""Walks of a certificate that are worth seeing: in a middling and in a bad world."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pneumorph.base.run_folder import RunFolder
from pneumorph.catalogue.robot_spec import RobotSpec
from pneumorph.learn.failed_walks import counted_walks
from pneumorph.simulation.randomisation import World
from pneumorph.study.analysis import Walker
from pneumorph.study.certified_walks import LaggingGait
from pneumorph.study.recorded_walk import recorded_walk

SHOWN_WORLDS = {
    "median world": ("median_world_trajectory.npz", 0.5),
    "bad world": ("bad_world_trajectory.npz", 0.1),
}
"""File of a walk and the quantile of what is achieved that it has, by what the world is called."""


def record_shown_worlds(
    spec: RobotSpec,
    walker: Walker,
    worlds: Sequence[World],
    achieved: np.ndarray,
    folder: RunFolder,
) -> None:
    """Record a robot in the worlds of its median and of its 10th percentile.

    Of an even number of worlds, or between two, it is the worse one; failed walks count as of
    `counted_walks`, and worlds whose legs are of another reduction are left out.

    Args:
        spec: The robot in the world as it stands.
        walker: Design and gait.
        worlds: The worlds.
        achieved: What of the goal it achieves in each, (world,); NaN where its simulation failed.
        folder: Receives the files of `SHOWN_WORLDS`.
    """
    own = [number for number, world in enumerate(worlds) if not world.reduction]
    if not own:
        return
    counted = counted_walks(achieved)
    order = sorted(own, key=lambda number: float(counted[number]))
    for name, (file, quantile) in SHOWN_WORLDS.items():
        number = order[int(quantile * (len(order) - 1))]
        world = worlds[number]
        gait = LaggingGait.of(walker.gait, world.regulator_lag_s, spec.physics.time_step_s)
        trajectory = recorded_walk(
            spec.in_world(world),
            walker.design,
            gait,
            settling_steps=walker.settling_steps,
            description={"gait": walker.label, "world": number, "shown_as": name},
        )
        trajectory.with_skin_only().save(folder / file)
