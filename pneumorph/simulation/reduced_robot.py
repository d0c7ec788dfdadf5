"""One reduced robot that answers the same rollout as a full-order one."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from tqdm.auto import trange

from pneumorph.base.settings import settings_to_dict
from pneumorph.geometry.robot_shape import stacked
from pneumorph.physics.floor import ground_note
from pneumorph.physics.leg_contacts import LegContacts
from pneumorph.physics.physics import Physics
from pneumorph.reduction.snapshot_range import known_ratio
from pneumorph.robot.robot import Mount, Robot
from pneumorph.simulation.batched_simulator import BatchedSimulator, RobotStatus
from pneumorph.simulation.reduced_state import ReducedState
from pneumorph.simulation.stepper_settings import StepperSettings
from pneumorph.trajectory import Trajectory, check_record_every


class ReducedRobot:
    """A robot made of reduced parts, advanced by the compiled stepper.

    Args:
        robot: Hub and mounted reduced parts.
        physics: What acts on it; None for the published physics.
        stepper: How steps are computed; None for the usual numerics.
        watch: Told every frame of a rollout that records nodes as soon as it is simulated, as a
            trajectory of that frame alone.
    """

    def __init__(
        self,
        robot: Robot,
        physics: Physics | None = None,
        stepper: StepperSettings | None = None,
        watch: Callable[[Trajectory], None] | None = None,
    ) -> None:
        self.robot = robot
        self._watch = watch
        self._simulator = BatchedSimulator([robot], physics, stepper, thread_count=1)
        self.physics = self._simulator.physics
        self.floor = self.physics.floor(robot.standing_points)

    def initial_state(self) -> ReducedState:
        """At rest in the pose that the physics start in, no pressure."""
        self._simulator.reset()
        return self._simulator.state(0)

    def node_positions(self, state: ReducedState) -> np.ndarray:
        """World positions of every mount's nodes [mm], (mount, node, 3); of a part with fewer nodes
        than others the last one is repeated."""
        mounts = self.robot.mounts
        alike: dict[int, list[int]] = {}
        for place, mount in enumerate(mounts):
            alike.setdefault(id(mount.part), []).append(place)
        local: dict[int, np.ndarray] = {}
        for places in alike.values():
            part = mounts[places[0]].part
            alpha = np.array([state.modes[place][: part.mode_count] for place in places])
            local |= dict(zip(places, part.positions(alpha), strict=True))
        world = [
            mount.pose.apply(local[place]) @ state.rotation.T + state.position
            for place, mount in enumerate(mounts)
        ]
        return stacked(world, fill_last=True)

    def leg_contacts(self, state: ReducedState, before: ReducedState | None = None) -> LegContacts:
        """What the floor does to the mounted parts' contact points.

        Args:
            state: Where the robot is.
            before: Where it was a step earlier: with it velocities are those that the law of
                contact speaks of, (47) and (48) of docs/physics.md, in which points that stick do
                not move. None for those by the hub and the modes at the state.
        """
        begun, time_step = before or state, self.physics.time_step_s
        foreseen = before is not None and self._simulator.stepper.linearised == "ahead"
        position, velocity, first = [], [], len(self.robot.hub.contact_points)
        for number, mount in enumerate(self.robot.mounts):
            own = slice(first, first + len(mount.part.contact_points))
            first = own.stop
            arm, bending = _swung(mount, state.modes[number], state.mode_rates[number])
            places = state.position + arm @ state.rotation.T
            # Velocities of a step are of the arms and along the axes that it began with.
            arm, bent = _swung(mount, begun.modes[number], begun.mode_rates[number])
            arm, bent, bending = (each @ begun.rotation.T for each in (arm, bent, bending))
            moving = state.velocity + np.cross(state.angular_velocity, arm) + bending
            if foreseen:
                turning = begun.angular_velocity
                inward = np.cross(turning, np.cross(turning, arm) + 2.0 * bent)
                moving = moving + 0.5 * time_step * inward
            if before is not None and len(mount.part.contact_flexibility) > 0:
                added = (state.impulses[own] - before.impulses[own]) * [0.0, 1.0, 1.0]
                giving = mount.part.contact_flexibility @ added / time_step**2
                moving = moving + np.einsum("pra,pr->pa", self.floor.frames(places), giving)
            position.append(places)
            velocity.append(moving)
        impulses = state.impulses[len(self.robot.hub.contact_points) :]
        return LegContacts.of(self.floor, position, velocity, impulses, time_step)

    def rollout(
        self,
        state: ReducedState,
        commands_kPa: np.ndarray,
        record_every: int = 5,
        record_nodes: bool = True,
        description: dict[str, Any] | None = None,
        *,
        progress: bool = False,
    ) -> tuple[ReducedState, Trajectory]:
        """Follow commands from a state.

        Args:
            state: Where to start.
            commands_kPa: Real pressure asked for in every step [kPa], (step, regulator).
            record_every: Steps between frames; the start is a frame too.
            record_nodes: Record every node's position.
            description: What else to note in the trajectory's metadata.
            progress: Show a progress bar with the time left.

        Returns:
            The state at the end, and the trajectory; its status is ``diverged`` when the robot
            diverged, and it then ends with the last sound frame. Its metadata has ``range_ratio``,
            how far any leg went relative to its furthest snapshot (`snapshot_range.py`), None where
            that is not known; a robot that leaves the range walks on.
        """
        check_record_every(record_every)
        commands = np.atleast_2d(np.asarray(commands_kPa, dtype=float))
        time_step = self.physics.time_step_s
        simulator = self._simulator
        simulator.reset()
        simulator.set_state(0, state)
        frames: dict[str, list[Any]] = {}
        shape, skin = self.robot.shape

        def trajectory(frames: dict[str, list[Any]], status: str) -> Trajectory:
            return Trajectory(
                **{name: np.array(values) for name, values in frames.items()},
                skin_triangles=skin if record_nodes else None,
                shape=shape,
                status=status,
                metadata={
                    "model": "reduced",
                    **({} if self.robot.design is None else {"design": str(self.robot.design)}),
                    "range_ratio": known_ratio(simulator.range_ratio[0]),
                    **ground_note(self.floor),
                    "settings": {
                        **settings_to_dict(self.physics),
                        **settings_to_dict(simulator.stepper),
                    },
                    **(description or {}),
                },
            )

        def advance(held: np.ndarray) -> None:
            if np.all(held == held[:1]):
                simulator.advance(held[:1], len(held))
            else:
                for command in held:
                    simulator.advance(command[None], 1)

        def record(step: int, current: ReducedState, before: ReducedState | None) -> None:
            command = commands[max(step - 1, 0)] if len(commands) else current.regulated
            frame = {
                "time_s": step * time_step,
                "hub_position_mm": current.position,
                "hub_rotation": current.rotation,
                "tracked_point_mm": simulator.tracked_point_mm[0],
                "commanded_kPa": command,
                "regulated_kPa": current.regulated,
                "contact_count": simulator.read("active_contacts")[0],
            }
            if record_nodes:
                frame["node_positions_mm"] = self.node_positions(current).astype(np.float32)
                frame |= self.leg_contacts(current, before).recorded()
            for name, value in frame.items():
                frames.setdefault(name, []).append(value)
            if self._watch is not None and record_nodes:
                self._watch(trajectory({name: [value] for name, value in frame.items()}, "running"))

        status = "completed"
        record(0, state, None)
        for start in trange(0, len(commands), record_every, disable=not progress, unit="frame"):
            chunk = commands[start : start + record_every]
            before = state
            if record_nodes and len(chunk) > 1:
                advance(chunk[:-1])
                before = simulator.state(0)
            advance(chunk[-1:] if record_nodes else chunk)
            if simulator.status[0] != RobotStatus.RUNNING:
                status = RobotStatus(simulator.status[0]).name.lower()
                break
            state = simulator.state(0)
            record(start + len(chunk), state, before)
        return state, trajectory(frames, status)


def _swung(mount: Mount, modes: np.ndarray, rates: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """A mount's contact points from the hub's origin [mm] and their velocities by the modes
    [mm/s], hub's axes, (point, 3) each."""
    part = mount.part
    count = part.mode_count
    arm = mount.pose.apply(part.contact_points + part.contact_modes @ modes[:count])
    return arm, part.contact_modes @ rates[:count] @ mount.pose.rotation.T
