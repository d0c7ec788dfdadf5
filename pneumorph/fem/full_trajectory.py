"""Record a full-order robot's motion."""

from __future__ import annotations

from typing import Any, Generic

import numpy as np

from pneumorph.fem.full_robot_state import FullRobotState
from pneumorph.fem.hub_body import HubState
from pneumorph.fem.robot_body import RobotBody
from pneumorph.geometry.robot_shape import stacked
from pneumorph.physics.floor import ground_note
from pneumorph.trajectory import Trajectory


class Recorder(Generic[HubState]):
    """Collects frames of one rollout.

    Args:
        robot: Whose motion.
        record_nodes: Record every node's position.
    """

    def __init__(self, robot: RobotBody[HubState], record_nodes: bool) -> None:
        self._robot, self._record_nodes = robot, record_nodes
        self._frames: dict[str, list[Any]] = {}
        self._worst_residual = self._deepest = 0.0
        self._steps = self._unconverged = self._halved = self._iterations = 0

    def watch(self, state: FullRobotState[HubState]) -> None:
        """Note how well a step obeyed the contact law; called after every step."""
        tolerance = self._robot.numerics.contact_tolerance_mm_per_s
        self._worst_residual = max(self._worst_residual, state.contact_residual)
        self._deepest = max(self._deepest, state.penetration_mm)
        self._steps += 1
        self._unconverged += state.contact_residual > tolerance
        self._halved += state.substeps > 1
        self._iterations += state.iterations

    def record(self, step: int, command: np.ndarray, state: FullRobotState[HubState]) -> None:
        """Add the frame after a step."""
        robot = self._robot
        rotation, position = robot.hub.frame(state.hub)
        frame: dict[str, Any] = {
            "time_s": step * robot.physics.time_step_s,
            "hub_position_mm": position,
            "hub_rotation": rotation,
            "tracked_point_mm": robot.tracked_point_mm(state),
            "commanded_kPa": np.array(command, dtype=float),
            "regulated_kPa": state.regulated_kPa,
            "contact_count": state.active_contacts,
            "pressure_work_mJ": state.pressure_work_mJ,
            "cavity_volume_mm3": np.array(
                [
                    float(leg.part.cavity_volumes(x).sum())
                    for leg, x in zip(robot.legs, state.positions, strict=True)
                ]
            ),
        }
        if self._record_nodes:
            frame["node_positions_mm"] = stacked(state.positions, fill_last=True).astype(np.float32)
            frame |= robot.leg_contacts(state).recorded()
        for name, value in frame.items():
            self._frames.setdefault(name, []).append(value)

    def trajectory(
        self, status: str, reason: str | None, description: dict[str, Any] | None
    ) -> Trajectory:
        """What was recorded.

        Args:
            status: How the rollout ended.
            reason: Why it ended early; None where it did not.
            description: What else to note.
        """
        robot = self._robot
        shape, skin = robot.shape
        return Trajectory(
            **{name: np.array(values) for name, values in self._frames.items()},
            skin_triangles=skin if self._record_nodes else None,
            shape=shape,
            status=status,
            metadata={
                "model": "full",
                "hub": "rigid" if robot.hub.rigid else "soft",
                "settings": robot.settings,
                "contact": {
                    "floor": robot.floor.description,
                    "worst_residual_mm_per_s": self._worst_residual,
                    "unconverged_share": self._unconverged / max(self._steps, 1),
                    "deepest_penetration_mm": self._deepest,
                },
                "steps": {
                    "count": self._steps,
                    "halved": self._halved,
                    "mean_iterations": self._iterations / max(self._steps, 1),
                },
                **ground_note(robot.floor),
                **({} if reason is None else {"reason": reason}),
                **(description or {}),
            },
        )
