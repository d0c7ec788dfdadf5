"""A short walk of a real reduced robot, for the replays."""

from __future__ import annotations

import numpy as np
import pytest

from pneumorph.catalogue.paper_robot import paper_robot
from pneumorph.gait.expert_gait import ExpertGait
from pneumorph.physics.open_loop_gait import sample_commands
from pneumorph.simulation.rollout import rollout
from pneumorph.trajectory import Trajectory


@pytest.fixture(scope="session")
def crawl() -> Trajectory:
    """1.5 s of the expert's gait from the moment the hind legs move, 16 frames."""
    commands = sample_commands(ExpertGait(phase_deg=60), 0.01, 150)
    robot = paper_robot("published").reduced("1.0.0.2.2.0.0.1")
    return rollout(robot, np.asarray(commands), record_every=10)[1]
