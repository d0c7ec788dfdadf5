"""Error against time of several reductions of one leg: figure 12 of the paper."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from pneumorph.base.artefact import ArtefactError
from pneumorph.catalogue.robot_spec import RobotSpec
from pneumorph.reduction.reduced_part import ReducedPart
from pneumorph.robot.scaled_part import made_alike
from pneumorph.study.animations import Animation
from pneumorph.study.model_pair import ModelPair
from pneumorph.study.robot_error import robot_error
from pneumorph.trajectory import Trajectory


@dataclass(frozen=True)
class GridPoint:
    """One reduction: its tolerances, and what it comes to; means over the animations."""

    part: str
    """Its file."""
    mode_tolerance: float
    hyperreduction_tolerance: float
    mode_count: int
    element_count: int
    """Sampled integration points of solid and membrane together."""
    s_per_step: float
    """Time of a step of a reduced robot on one thread [s]."""
    mean_node_error_mm: float
    """NaN where a robot diverged."""


def reduction_grid(
    parts: Sequence[Path],
    walks: Sequence[tuple[Animation, Trajectory]],
    robot: RobotSpec,
    record_every: int,
    progress: Callable[[int, int, str], None],
) -> list[GridPoint]:
    """Let every reduction walk the animations, one thread each.

    Args:
        parts: Reduced legs, as `pneumorph reduce` writes them.
        walks: The animations and their full-order trajectories.
        robot: Its module is the leg in both models; the parts stand in for its reduction.
        record_every: Time steps between the full trajectories' frames.
        progress: Told how far it is.

    Raises:
        ArtefactError: A part that is not of this leg, or does not say how it was reduced.
    """
    table = []
    for done, path in enumerate(parts):
        progress(done, len(parts), "reductions")
        table.append(_point(path, walks, _with_part(robot, path), record_every))
    progress(len(parts), len(parts), "reductions")
    return table


def _with_part(robot: RobotSpec, path: Path) -> RobotSpec:
    """The robot on one thread, with another reduction of its module, which weighs as much."""
    own = robot.module.make_reduced()
    module = replace(
        robot.module,
        name=str(path),
        make_reduced=lambda: made_alike(ReducedPart.load(path), own),
    )
    module.check_reduction()
    sites = tuple(site.with_modules(lambda _: module) for site in robot.sites)
    return replace(robot, sites=sites, thread_count=1)


def _point(
    path: Path,
    walks: Sequence[tuple[Animation, Trajectory]],
    robot: RobotSpec,
    record_every: int,
) -> GridPoint:
    part = robot.module.reduced
    try:
        settings = part.metadata["settings"]
        mode_tolerance = settings["mode_tolerance"]
        element_tolerance = settings["ecsw"]["hyperreduction_tolerance"]
    except KeyError as missing:
        raise ArtefactError(
            f"{path} does not name its {missing}, expected the settings of its reduction; it was "
            "not written by pneumorph reduce"
        ) from None
    seconds, errors = [], []
    for animation, full in walks:
        pair = ModelPair(animation, robot)
        seconds.append(pair.seconds_per_reduced_step())
        reduced = pair.reduced(record_every, like=full)
        if reduced.status == "completed":
            errors.append(robot_error(full, reduced).mean_node_error_mm)
    complete = len(errors) == len(walks)
    return GridPoint(
        part=str(path),
        mode_tolerance=mode_tolerance,
        hyperreduction_tolerance=element_tolerance,
        mode_count=part.mode_count,
        element_count=len(part.tetrahedron_rest) + len(part.membrane_rest),
        s_per_step=float(np.mean(seconds)),
        mean_node_error_mm=float(np.mean(errors)) if complete else float("nan"),
    )
