"""Reduced robots of the measured leg beside their mirror images, each in its own episode."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from pneumorph.catalogue.paper_robot import paper_robot
from pneumorph.environment.crawling_environment import CrawlingEnvironment
from pneumorph.environment.crawling_task import CrawlingTask
from pneumorph.learn.mirror import MirrorImage
from pneumorph.physics.start_pose import StartPose
from pneumorph.robot.design_space import DesignSpace


def steps_beside_images(
    task: CrawlingTask,
    seed: int,
    wrap: Callable[[CrawlingEnvironment], Any] = lambda each: each,
    start: StartPose | None = None,
) -> Iterator[tuple[np.ndarray, dict[str, Any], np.ndarray]]:
    """Two steps of four robots of random designs: their rewards and infos, and what their mirror
    images, put down in the same place, get for the mirrored actions."""
    space, spec, rng = DesignSpace(), paper_robot(), np.random.default_rng(seed)
    spec = replace(spec, physics=replace(spec.physics, start=start or StartPose()))
    mirror, designs = MirrorImage(space), rng.integers(len(space), size=4)
    walkers = [
        wrap(
            CrawlingEnvironment(
                [space[int(index)] for index in chosen], spec.assembly, spec.simulator, task
            )
        )
        for chosen in (designs, mirror.designs(designs))
    ]
    for each in walkers:
        each.reset()
    for _ in range(2):
        action = rng.uniform(-1, 1, (4, task.regulator_count)).astype(np.float32)
        _, reward, _, _, info = walkers[0].step(action)
        _, own, *_ = walkers[1].step(mirror.actions(designs, action))
        yield reward, info, own
