"""Error against time of several reductions of one leg: figure 12 of the paper."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from pneumorph.artefact import ArtefactError
from pneumorph.command.model_pair import ModelPair
from pneumorph.command.robots import RobotOptions, Workshop
from pneumorph.command.run_folder import RunFolder
from pneumorph.comparison.animations import Animation
from pneumorph.comparison.robot_error import robot_error
from pneumorph.trajectory import Trajectory


def reduction_grid(
    parts: Sequence[Path],
    walks: Sequence[tuple[Animation, Trajectory]],
    options: RobotOptions,
    record_every: int,
    folder: RunFolder,
) -> list[dict[str, Any]]:
    """Let every reduction walk the animations, one thread each.

    Args:
        parts: Reduced legs, as `pneumorph reduce` writes them.
        walks: The animations and their full-order trajectories.
        options: The physics.
        record_every: Time steps between the full trajectories' frames.
        folder: Told how far it is.

    Returns:
        Of each part its file, tolerances, sizes, ``s_per_step`` of a reduced robot [s] and
        ``mean_node_error_mm``, both averaged over the animations; the error is None where a robot
        diverged.

    Raises:
        ArtefactError: A part that is not of this leg, or does not say how it was reduced.
    """
    table = []
    for done, path in enumerate(parts):
        folder.progress(done, len(parts), "reductions")
        robot = replace(options, part=path, threads=1)
        workshop = Workshop(robot)
        workshop.check_reduction()
        part = workshop.leg
        try:
            settings = part.metadata["settings"]
            mode_tolerance = settings["mode_tolerance"]
            element_tolerance = settings["ecsw"]["hyperreduction_tolerance"]
        except KeyError as missing:
            raise ArtefactError(
                f"{path} does not name its {missing}, expected the settings of its reduction; it "
                "was not written by pneumorph reduce"
            ) from None
        seconds, errors = [], []
        for animation, full in walks:
            pair = ModelPair(animation, robot)
            seconds.append(pair.seconds_per_reduced_step())
            reduced = pair.reduced(record_every, like=full)
            if reduced.status == "completed":
                errors.append(robot_error(full, reduced).mean_node_error_mm)
        complete = len(errors) == len(walks)
        table.append(
            {
                "part": str(path),
                "mode_tolerance": mode_tolerance,
                "hyperreduction_tolerance": element_tolerance,
                "mode_count": part.mode_count,
                "element_count": len(part.tetrahedron_rest) + len(part.membrane_rest),
                "s_per_step": float(np.mean(seconds)),
                "mean_node_error_mm": float(np.mean(errors)) if complete else None,
            }
        )
    folder.progress(len(parts), len(parts), "reductions")
    return table
