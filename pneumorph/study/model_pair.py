"""The full and the reduced robot of a design under the same commands."""

from __future__ import annotations

import time
from dataclasses import replace

import numpy as np

from pneumorph.base.progress import ProgressReport
from pneumorph.catalogue.robot_spec import RobotSpec
from pneumorph.fem.resumable_rollout import resumable_rollout
from pneumorph.physics.open_loop_gait import commands_of
from pneumorph.simulation.rollout import rollout
from pneumorph.study.animations import Animation
from pneumorph.study.full_order_identity import animation_identity
from pneumorph.study.full_order_store import FullOrderStore, at_nodes, rollout_identity
from pneumorph.trajectory import Trajectory


class ModelPair:
    """Both models of an animation's design.

    Args:
        animation: Design and pressures; it may drive more regulators than the robot has.
        spec: The robot.
        floating: Leave out gravity and floor.
    """

    def __init__(self, animation: Animation, spec: RobotSpec, floating: bool = False) -> None:
        physics = replace(spec.physics, regulator_count=animation.gait.regulator_count)
        if floating:
            physics = replace(physics, gravity_mm_per_s2=0.0, floor_height_mm=-1e4)
        self.animation = animation
        self.spec = replace(spec, physics=physics)
        self.commands_kPa: np.ndarray = commands_of(
            animation.gait, physics.time_step_s, physics.regulator_count
        )
        """Real pressure asked for in every step [kPa], (step, regulator)."""

    def full(
        self, store: FullOrderStore, name: str, record_every: int, progress: ProgressReport
    ) -> Trajectory:
        """The full robot's trajectory with few of its nodes: the kept one, or computed and kept.

        Args:
            store: Where trajectories are kept.
            name: What this one is called there.
            record_every: Time steps between frames.
            progress: Told the steps made and those to make.
        """
        kept = self.kept(store, name, record_every)
        if kept is not None:
            return kept
        checkpoint = store.folders[0] / f"{name}.part.npz"
        checkpoint.parent.mkdir(parents=True, exist_ok=True)
        design = str(self.animation.design)
        trajectory = resumable_rollout(
            self.spec.full(self.animation.design),
            self.commands_kPa,
            checkpoint,
            record_every=record_every,
            description={"design": design},
            progress=progress,
            highest_kPa=self.animation.gait.maximum_pressure_kPa,
            keep_checkpoint=True,
        )
        kept = store.save(name, self._identity(record_every), trajectory)
        checkpoint.unlink(missing_ok=True)
        return kept

    def kept(self, store: FullOrderStore, name: str, record_every: int) -> Trajectory | None:
        """The full robot's trajectory if it is kept; arguments as of `full`."""
        return store.find(name, self._identity(record_every))

    def reduced(self, record_every: int, like: Trajectory | None = None) -> Trajectory:
        """The reduced robot's trajectory.

        Args:
            record_every: Time steps between frames.
            like: Take only the nodes that this kept trajectory has.
        """
        _, trajectory = rollout(
            self.spec.reduced(self.animation.design),
            self.commands_kPa,
            record_every=record_every,
            description={"design": str(self.animation.design)},
            highest_kPa=self.animation.gait.maximum_pressure_kPa,
        )
        return trajectory if like is None else at_nodes(trajectory, like.metadata["nodes"])

    def seconds_per_reduced_step(self) -> float:
        """Time of a step of the reduced robot, on one thread [s]: the median of three walks."""
        robot = self.spec.reduced(self.animation.design)
        count, seconds = len(self.commands_kPa), []
        for _ in range(3):
            start = time.perf_counter()
            rollout(
                robot,
                self.commands_kPa,
                record_every=count,
                record_nodes=False,
                highest_kPa=self.animation.gait.maximum_pressure_kPa,
            )
            seconds.append((time.perf_counter() - start) / count)
        return float(np.median(seconds))

    def _identity(self, record_every: int) -> str:
        described = animation_identity(self.spec, self.animation.design, record_every)
        return rollout_identity(described, self.commands_kPa)
