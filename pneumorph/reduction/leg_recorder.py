"""Records the legs of a full-order robot in their own frames while it moves."""

from __future__ import annotations

import time
from collections.abc import Sequence

import numpy as np
import scipy.sparse as sparse

from pneumorph.fem.full_robot import FullRobot
from pneumorph.fem.full_robot_state import FullRobotState
from pneumorph.geometry.pose import Pose
from pneumorph.reduction.compressed_snapshots import CompressedSnapshots, SnapshotCompressor
from pneumorph.reduction.snapshots import Snapshots
from pneumorph.trajectory import Trajectory


class LegRecorder:
    """Called with the state after every step; each leg of each recorded step is a snapshot.

    Args:
        robot: Its legs must all be the same part. On a rigid hub their attachment rests in its
            frame; on a soft one it moves with the hub's deformation.
        record_every: Steps between snapshots.
        compression: Relative error in the norm of the rest stiffness at which snapshots are stored
            as combinations of few fields; 0 stores each in single precision.

    Raises:
        ValueError: Legs of different parts.
    """

    def __init__(self, robot: FullRobot, record_every: int = 2, compression: float = 0.0) -> None:
        self._robot, self._record_every = robot, record_every
        self._part = robot.legs[0].part
        if any(leg.part is not self._part for leg in robot.legs):
            raise ValueError("legs to be recorded must all be one part, got several")
        self._tied = robot.legs[0].tie.nodes
        self._regulators = [leg.regulators[0] for leg in robot.legs]
        self._recorded: list[np.ndarray] = []
        self._pressures: list[np.ndarray] = []
        self._compressor: SnapshotCompressor | None = None
        if compression > 0.0:
            rest_stiffness = sparse.csr_array(self._part.stiffness(self._part.rest_nodes))
            self._compressor = SnapshotCompressor(rest_stiffness, compression)
        self._steps = 0

    def __call__(self, state: FullRobotState) -> None:
        """Note one step."""
        self._steps += 1
        if self._steps % self._record_every:
            return
        self._note(self._robot.leg_nodes_in_hub_frame(state), state.regulated_kPa)

    def follow(self, trajectory: Trajectory) -> None:
        """Note every frame of the robot's own trajectory but the first, in which it settled.

        Args:
            trajectory: With its nodes.

        Raises:
            ValueError: It has none.
        """
        positions = trajectory.node_positions_mm
        if positions is None:
            raise ValueError("the trajectory has no node positions, expected them to be recorded")
        for frame in range(1, len(positions)):
            place = trajectory.hub_rotation[frame], trajectory.hub_position_mm[frame]
            carried = Pose(*place).inverse()
            legs = [
                leg.pose.inverse().apply(carried.apply(x.astype(float)))
                for leg, x in zip(self._robot.legs, positions[frame], strict=True)
            ]
            self._steps += 1
            self._note(legs, trajectory.regulated_kPa[frame])

    def _note(self, nodes: Sequence[np.ndarray], regulated_kPa: np.ndarray) -> None:
        legs = np.array(nodes) - self._part.rest_nodes
        if self._robot.hub.rigid:
            legs[:, self._tied] = 0.0  # rounding
        simulated = self._robot.physics.pressure_map.simulated(regulated_kPa)
        self._pressures.append(simulated[self._regulators])
        if self._compressor:
            self._compressor.add(legs)
        else:
            self._recorded.append(legs.astype(np.float32))

    def snapshots(self, source: str, trajectory: Trajectory) -> Snapshots | CompressedSnapshots:
        """All that was recorded, under the name of a source, with how the trajectory ended."""
        pressures = np.array(self._pressures).reshape(-1)
        numbers = np.zeros(len(pressures), dtype=np.int32)
        metadata = {
            "mesh_digest": self._part.mesh.digest(),
            "sources": [source],
            "details": {
                "status": trajectory.status,
                "steps": self._steps,
                "forward_distance_cm": trajectory.forward_distance_cm,
            },
        }
        if self._compressor:
            return self._compressor.finish(pressures, numbers, metadata)
        displacement = np.array(self._recorded, dtype=np.float32)
        displacement = displacement.reshape(-1, self._part.node_count, 3)
        return Snapshots(displacement, pressures, numbers, metadata)


def record_walk(
    robot: FullRobot,
    commands_kPa: np.ndarray,
    source: str,
    *,
    record_every: int = 2,
    compression: float = 0.0,
) -> Snapshots | CompressedSnapshots:
    """Let a robot settle, then record its legs while it follows commands, and how long that took.

    Args:
        robot: The robot.
        commands_kPa: Real pressures of every step [kPa], (step, regulator).
        source: Name of the snapshots.
        record_every: As of `LegRecorder`.
        compression: As of `LegRecorder`.

    Raises:
        ValueError: Legs of different parts.
    """
    wall, processor = time.perf_counter(), time.process_time()
    recorder = LegRecorder(robot, record_every, compression)
    _, trajectory = robot.rollout(
        robot.settled_state(),
        commands_kPa,
        record_every=len(commands_kPa),
        record_nodes=False,
        observe=recorder,
    )
    snapshots = recorder.snapshots(source, trajectory)
    snapshots.metadata["seconds"] = {
        "wall": time.perf_counter() - wall,
        "processor": time.process_time() - processor,
    }
    return snapshots
