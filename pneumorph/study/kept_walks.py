"""What walks of reduced robots in worlds depend on, so that finished ones can be kept and read."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from pneumorph.base.settings import settings_to_dict
from pneumorph.catalogue.robot_identity import mounting_identity, reduction_digest
from pneumorph.catalogue.robot_spec import RobotSpec
from pneumorph.environment.goal import Goal
from pneumorph.physics.open_loop_gait import OpenLoopGait, commands_of
from pneumorph.robot.design import Design
from pneumorph.simulation.randomisation import World
from pneumorph.simulation.randomised_simulator import digest_of_part
from pneumorph.simulation.regulator_lag import lagging_commands


def walks_identity(
    spec: RobotSpec,
    designs: Sequence[Design],
    gaits: Sequence[OpenLoopGait],
    worlds: Sequence[World],
    settling_steps: int,
    goal: Goal,
) -> str:
    """Hash of all that decides what robots achieve in worlds; arguments as of `walks_in_worlds`.

    Threads and executors change no bit, so they are none of it; other reductions that worlds have
    count by their content.
    """
    step_s, count = spec.physics.time_step_s, spec.physics.regulator_count
    made_of: dict[str, Any] = {
        "legs": reduction_digest(spec),
        "hub": spec.hub.mass_numbers(),
        "mounting_angle_deg": spec.mounting_angle_deg,
        "physics": settings_to_dict(spec.physics),
        "ground": spec.physics.ground.file_identity(),
        "stepper": settings_to_dict(spec.stepper),
        "designs": [str(design) for design in designs],
        "worlds": [
            {
                **settings_to_dict(replace(world, reduction="")),
                "reduction": digest_of_part(world.reduction) if world.reduction else None,
            }
            for world in worlds
        ],
        "settling_steps": settling_steps,
        "goal": settings_to_dict(goal),
        **mounting_identity(spec, worlds),
    }
    content = hashlib.sha256(json.dumps(made_of, sort_keys=True).encode())
    lags_s = sorted({world.regulator_lag_s for world in worlds})
    for gait in gaits:
        commands = commands_of(gait, step_s, count)
        for lag_s in lags_s:  # as regulators pass them on
            content.update(lagging_commands(commands, lag_s, step_s).tobytes())
    return content.hexdigest()
