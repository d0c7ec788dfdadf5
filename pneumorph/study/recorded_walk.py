"""One robot, in either model, walks a gait and is recorded."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any, Literal

from pneumorph.catalogue.robot_spec import RobotSpec
from pneumorph.fem.resumable_rollout import resumable_rollout
from pneumorph.physics.open_loop_gait import OpenLoopGait, commands_of
from pneumorph.robot.design import Design
from pneumorph.simulation.rollout import rollout
from pneumorph.trajectory import Trajectory

Model = Literal["reduced", "full"]


def recorded_walk(
    spec: RobotSpec,
    design: Design,
    gait: OpenLoopGait,
    model: Model = "reduced",
    checkpoint: Path | None = None,
    *,
    record_every: int = 10,
    settling_steps: int = 15,
    description: dict[str, Any] | None = None,
    progress: Callable[[int, int, str], None] | None = None,
    watch: Callable[[Trajectory], None] | None = None,
    keep_checkpoint: bool = False,
    resumed: Callable[[float], None] | None = None,
) -> Trajectory:
    """Return the trajectory of one robot with its nodes.

    Args:
        spec: The robot.
        design: Its design.
        gait: What it walks.
        model: Reduced, or finite elements, which take minutes.
        checkpoint: File for the way so far of finite elements; interrupted, they go on from it.
        record_every: Time steps between frames.
        settling_steps: Time steps at zero pressure before the gait.
        description: What else to note in the trajectory's metadata.
        progress: Told the steps made and those to make, of finite elements.
        watch: Told what is recorded as it is simulated.
        keep_checkpoint: Leave that file to the caller, who removes it once the walk is saved.
        resumed: Told the wall time that earlier processes spent on the way up to that file [s], of
            finite elements that go on from it.

    Raises:
        ValueError: Finite elements without a checkpoint.
    """
    described = {"design": str(design), **(description or {})}
    if model == "reduced":
        _, trajectory = rollout(
            spec.reduced(design, watch),
            gait,
            record_every=record_every,
            settling_steps=settling_steps,
            description=described,
        )
        return trajectory
    if checkpoint is None:
        raise ValueError("checkpoint is None, expected a file: finite elements take minutes")
    return resumable_rollout(
        spec.full(design),
        commands_of(gait, spec.physics.time_step_s, spec.physics.regulator_count),
        checkpoint,
        settling_steps=settling_steps,
        record_every=record_every,
        description=described,
        progress=progress,
        watch=watch,
        highest_kPa=gait.maximum_pressure_kPa,
        keep_checkpoint=keep_checkpoint,
        resumed=resumed,
    )
