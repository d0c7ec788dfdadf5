"""Finite elements beside the reduced robot, in the nominal world and in drawn ones."""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import Any

import numpy as np

from pneumorph.base.run_folder import RunFolder, made_once
from pneumorph.base.settings import settings_to_dict
from pneumorph.catalogue.robot_spec import RobotSpec
from pneumorph.fem.part_ingredients import ingredients
from pneumorph.fem.time_integration import StepError
from pneumorph.physics.ground import Ground
from pneumorph.physics.open_loop_gait import OpenLoopGait, commands_of
from pneumorph.reduction.leg_recorder import LegRecorder
from pneumorph.simulation.randomisation import World
from pneumorph.simulation.randomised_simulator import lagging_commands
from pneumorph.study.analysis import Walker
from pneumorph.study.full_order_store import rollout_identity
from pneumorph.study.recorded_walk import recorded_walk

COMPRESSION = 3e-4
"""Relative error, in the norm of the rest stiffness, at which states of walks are kept."""

AGREED_SHARE, AGREED_CM = 0.03, 0.3
"""Reduced and full agree where they differ by no more than one of these, of the full distance or
[cm]."""


@dataclass(frozen=True)
class KeptWalk:
    """A walk as finite elements, as it is kept."""

    distance_cm: float | None
    """None where it did not come to its end."""
    status: str
    wall_s: float
    """What the process that ended it took."""
    states: str | None = None
    """File of its legs' states, from the folder; None where it was not kept: it did not come to its
    end, or legs differ."""


@dataclass(frozen=True)
class FullOrderWalk:
    """A walk as finite elements beside that of the reduced robot."""

    world: int | None
    """Number of the drawn world; None for the world as it stands."""
    full_cm: float | None
    """None where it did not come to its end."""
    reduced_cm: float | None
    error_cm: float | None
    """Reduced less full [cm]; None where one of them is not known."""
    agrees: bool
    """Whether both models say as good as the same."""
    status: str
    wall_s: float = 0.0
    """What the process that ended it took."""
    states: str | None = None
    """File of its legs' states, from the certificate's folder; None where it was not kept."""

    @property
    def parts(self) -> bool:
        """Whether finite elements know better."""
        return not self.agrees and self.full_cm is not None

    @classmethod
    def of(cls, world: int | None, full: KeptWalk, reduced_cm: float | None) -> FullOrderWalk:
        """The walk in a world of that number beside the reduced robot's distance there [cm]."""
        full_cm, error, agrees = full.distance_cm, None, False
        if full_cm is not None and reduced_cm is not None:
            error = reduced_cm - full_cm
            agrees = abs(error) <= max(AGREED_CM, AGREED_SHARE * abs(full_cm))
        return cls(world, full_cm, reduced_cm, error, agrees, full.status, full.wall_s, full.states)


@dataclass(frozen=True, eq=False)
class LaggingGait:
    """A gait as lagging regulators of a world pass it on."""

    gait: OpenLoopGait
    commands_kPa: np.ndarray
    """Of each time step [kPa], (step, regulator)."""
    time_step_s: float

    @classmethod
    def of(cls, gait: OpenLoopGait, lag_s: float, time_step_s: float) -> LaggingGait:
        """The gait behind regulators of a time constant [s]."""
        commands = commands_of(gait, time_step_s, gait.regulator_count)
        return cls(gait, lagging_commands(commands, lag_s, time_step_s), time_step_s)

    @property
    def regulator_count(self) -> int:
        """Number of regulators it commands."""
        return self.gait.regulator_count

    @property
    def duration_s(self) -> float:
        """How long it lasts [s]."""
        return self.gait.duration_s

    @property
    def maximum_pressure_kPa(self) -> float:
        """Highest real pressure that it may command [kPa]."""
        return self.gait.maximum_pressure_kPa

    def pressure_kPa(self, time_s: float) -> np.ndarray:
        """Real pressure commanded at a time [kPa], (regulator,)."""
        step = min(round(time_s / self.time_step_s), len(self.commands_kPa) - 1)
        commanded: np.ndarray = self.commands_kPa[step]
        return commanded


def full_order_walk(
    spec: RobotSpec, walker: Walker, world: World | None, folder: RunFolder
) -> KeptWalk:
    """Walk a pair as finite elements; a walk that was stopped goes on, a finished one is read.

    Its file is named after all that the walk depends on.

    Args:
        spec: The robot in the world as it stands.
        walker: Design and gait.
        world: A drawn world; None for the one as it stands.
        folder: Keeps the walk, in ``full_order``.
    """
    own, gait = spec, walker.gait
    if world is not None:
        own = spec.in_world(world)
        gait = LaggingGait.of(gait, world.regulator_lag_s, spec.physics.time_step_s)
    commands = commands_of(gait, spec.physics.time_step_s, spec.physics.regulator_count)
    made_of = _made_of(spec, walker, world)
    name = f"full_order/{rollout_identity(made_of, commands)[:16]}"
    states = f"{name}.npz" if len(spec.modules) == 1 else None

    def walked() -> dict[str, Any]:
        start = time.monotonic()
        try:
            trajectory = recorded_walk(
                own,
                walker.design,
                gait,
                "full",
                folder / f"{name}_on_its_way.npz",
                settling_steps=walker.settling_steps,
                progress=folder.progress,
            )
        except StepError:  # while it settles; the other walks are of use all the same
            return {"status": "diverged", "distance_cm": None, "wall_s": time.monotonic() - start}
        if states is not None and trajectory.status == "completed":
            recorder = LegRecorder(own.full(walker.design), compression=COMPRESSION)
            recorder.follow(trajectory)
            recorder.snapshots(f"walk {walker.design}", trajectory).save(folder / states)
        return {
            "status": trajectory.status,
            "distance_cm": trajectory.distance_cm,
            "wall_s": time.monotonic() - start,
        }

    kept = made_once(folder / f"{name}.json", walked, made_of=made_of)
    if kept["status"] != "completed":
        states = None
    return KeptWalk(kept["distance_cm"], kept["status"], kept["wall_s"], states)


def _made_of(spec: RobotSpec, walker: Walker, world: World | None) -> dict[str, Any]:
    """What a walk depends on but for its commands. Reductions are none of it, and threads change no
    bit."""
    full_order, physics = settings_to_dict(spec.full_order), settings_to_dict(spec.physics)
    del full_order["thread_count"]
    if spec.physics.ground == Ground():  # as walks were kept before there were others
        del physics["ground"]
    return {
        "design": str(walker.design),
        "physics": physics,
        "full_order": full_order,
        "modules": [
            [ingredients(module.full), module.full.mesh.digest()] for module in spec.modules
        ],
        **spec.full_identity(),
        "hub": [spec.hub_model, *spec.hub.mass_numbers()],
        "height_map": settings_to_dict(spec.physics.ground.map),
        **spec.physics.ground.file_identity(),
        "mounting_angle_deg": spec.mounting_angle_deg,
        "settling_steps": walker.settling_steps,
        "world": None if world is None else world.of_full_order(),
    }
