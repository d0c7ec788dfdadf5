"""Gaits of files or of other runs that a training is shown."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from pneumorph.catalogue.robot_spec import RobotSpec
from pneumorph.gait.expert_gait import ExpertGait
from pneumorph.learn.demonstrations import check_room, known_pair
from pneumorph.learn.design_gait_pair import DesignGaitPair
from pneumorph.learn.settings import CooptSettings
from pneumorph.study.gait_source import bending_map, find_gait, names_no_design, recalibrated


def shown_gaits(
    sources: Sequence[Path], settings: CooptSettings, spec: RobotSpec
) -> list[DesignGaitPair]:
    """What sources of gaits show a training.

    Args:
        sources: Files of gaits that name their design, or folders of finished runs, of which it is
            the best pair's.
        settings: Of the training.
        spec: What the robots are.

    Raises:
        FileNotFoundError: No such file.
        ValueError: One is no gait, does not say whose it is, or is none for these robots; names it.
    """
    task, found = settings.task, []
    for source in sources:
        if source.suffix == ".npz":
            raise ValueError(
                f"{source} is a policy, expected a gait's file, or the folder of its finished run: "
                "its best pair's gait is shown"
            )
        if names_no_design(source):
            raise ValueError(
                f"gait file {source} does not say whose it is, expected a line such as "
                f"# design: {settings.space.first}"
            )
        known = find_gait(source, None, ExpertGait())
        known.check_robot(task.regulator_count)
        physics, gait = spec.physics, known.gait
        if known.bending_map is not None:
            gait = recalibrated(
                gait, known.bending_map, bending_map(spec), task.maximum_pressure_kPa
            )
        action_s = task.action_s(physics.time_step_s)
        try:
            pair = known_pair(gait, known.design, settings.space, task, action_s, "demonstration")
        except ValueError as error:
            raise ValueError(f"{source}, which is to be shown: {error}") from error
        found.append(pair)
    check_room(found, settings)
    return found


def digests_of_shown(
    demonstrations: Sequence[DesignGaitPair], settings: CooptSettings
) -> list[str]:
    """What a training that goes on must have been shown: designs, and digests of pressures, which
    are the same on another processor."""
    told = []
    for pair in demonstrations:
        pressures = np.round(pair.held_kPa, 6) + 0.0  # no negative zeros
        digest = hashlib.sha256(pressures.tobytes()).hexdigest()
        told.append(f"{settings.space[pair.design]} {digest[:16]}")
    return told
