"""One time step of a robot: its equations at a trial end, and the linear solve to the next."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Generic

import numpy as np

from pneumorph.fem.body_equations import (
    damping_data,
    damps_by_its_start,
    implicit_equations,
    implicit_matrix,
    implicit_residual,
    linearly_implicit_equations,
)
from pneumorph.fem.contact_points import Contacts, linearise_contacts
from pneumorph.fem.contact_solve import solve_contacts
from pneumorph.fem.full_robot_state import FullRobotState
from pneumorph.fem.hub_body import HubState
from pneumorph.fem.mounted_leg import LegShare, MountedLeg
from pneumorph.fem.robot_body import RobotBody
from pneumorph.fem.trial_step import TrialStep
from pneumorph.physics.physics import Physics


@dataclass(frozen=True, eq=False)
class Equations:
    """A v = b + impulses from outside, of each body."""

    hub: tuple[np.ndarray, np.ndarray]
    """A, (unknown, unknown), and b, (unknown,)."""
    legs: tuple[tuple[np.ndarray, np.ndarray], ...]
    """Data of A in the pattern of the part's assembly, (entry,), and b, (3 node,), of each."""


class StepProblem(Generic[HubState]):
    """The step of a robot from one state, under given pressures.

    Args:
        robot: The robot.
        start: Where it is.
        regulated_kPa: Pressure of each regulator at the end of the step [real kPa], (regulator,).
        physics: What acts on it; the time step may be a fraction of the robot's.

    Attributes:
        friction: Coefficient at each of the robot's contact points, (contact,).
        time_step_s: Length of the step [s].
    """

    def __init__(
        self,
        robot: RobotBody[HubState],
        start: FullRobotState[HubState],
        regulated_kPa: np.ndarray,
        physics: Physics,
    ) -> None:
        self._robot, self._start, self._physics = robot, start, physics
        self._regulated = regulated_kPa
        self._pressure = physics.pressure_map.simulated(regulated_kPa)
        self._damping: dict[int, np.ndarray | None] = {}
        self.time_step_s: float = physics.time_step_s
        self.friction: np.ndarray = physics.contact_friction(
            robot.contact_surfaces, start.impulses[:, 0]
        )

    def standing(self) -> TrialStep[HubState]:
        """The trial in which nothing moves and contacts press as they did before."""
        start = self._start
        return self._moved(
            np.zeros_like(start.hub.velocity),
            [np.zeros_like(v) for v in start.velocities],
            start.impulses,
            np.zeros_like(start.contact_velocities),
        )

    def going_on(self) -> TrialStep[HubState]:
        """The trial in which everything moves as before: near the end where motion is smooth."""
        start = self._start
        return self._moved(
            start.hub.velocity, start.velocities, start.impulses, start.contact_velocities
        )

    def between(
        self, first: TrialStep[HubState], second: TrialStep[HubState], share: float
    ) -> TrialStep[HubState]:
        """The trial whose velocities and impulses are a share of the way from first to second."""
        if share == 1.0:
            return second

        def mean(a: np.ndarray, b: np.ndarray) -> np.ndarray:
            return a + share * (b - a)

        return self._moved(
            mean(first.hub.velocity, second.hub.velocity),
            [mean(a, b) for a, b in zip(first.velocities, second.velocities, strict=True)],
            mean(first.impulses, second.impulses),
            mean(first.contact_velocities, second.contact_velocities),
        )

    def contacts(self, points: Sequence[np.ndarray], trial: TrialStep[HubState]) -> Contacts:
        """The floor, linearised where a trial puts the contact points that take part."""
        step, now = self._physics.time_step_s, self._robot.contact_positions(trial)
        moved = [step * velocity for velocity in self._robot.contact_velocities(trial)]
        return linearise_contacts(self._robot.floor, points, now, moved)

    def linearly_implicit(self) -> Equations:
        """Equations of the published step."""
        start, physics, clock = self._start, self._physics, self._robot.clock
        assemble = clock.timed("assembly", linearly_implicit_equations)
        return Equations(
            clock.timed("assembly", self._robot.hub.system)(start.hub, physics),
            tuple(
                assemble(leg.part, x, v, self._pressure_of(leg), physics, memory)
                for leg, x, v, memory in zip(
                    self._robot.legs,
                    start.positions,
                    start.velocities,
                    start.memories,
                    strict=True,
                )
            ),
        )

    def implicit_euler(self, trial: TrialStep[HubState], definite: bool = False) -> Equations:
        """Equations of the implicit Euler step, linearised at a trial."""
        clock = self._robot.clock
        hub = clock.timed("assembly", self._robot.hub.implicit_system)
        assemble = clock.timed("assembly", self._leg_equations)
        return Equations(
            hub(self._start.hub, trial.hub, self._physics, definite),
            tuple(assemble(number, trial, definite) for number in range(len(self._robot.legs))),
        )

    def residuals(self, equations: Equations, trial: TrialStep[HubState]) -> list[np.ndarray]:
        """r of each leg at the trial that equations were linearised at [mN s], each (3 node,)."""
        return [
            leg.part.assembly.matrix(data) @ v.ravel() - b
            for leg, (data, b), v in zip(
                self._robot.legs, equations.legs, trial.velocities, strict=True
            )
        ]

    def implicit_hub(self, trial: TrialStep[HubState]) -> tuple[np.ndarray, np.ndarray]:
        """A and b of the hub in the implicit Euler step, linearised at a trial."""
        return self._robot.hub.implicit_system(self._start.hub, trial.hub, self._physics, False)

    def implicit_matrix(
        self, number: int, trial: TrialStep[HubState], change: np.ndarray | None = None
    ) -> np.ndarray:
        """A of a leg in the implicit Euler step, linearised at a trial, (entry,).

        Args:
            number: The leg's.
            trial: The trial.
            change: A step of the leg's nodes that led there [mm], (node, 3): stiff stresses are
                taken as it foresaw them (`pneumorph.fem.foreseen_stress`).
        """
        leg = self._robot.legs[number]
        return implicit_matrix(
            leg.part,
            trial.positions[number],
            self._pressure_of(leg),
            self._physics,
            self._damped(number, trial),
            self._start.memories[number],
            change,
        )

    def implicit_residual(self, number: int, trial: TrialStep[HubState]) -> np.ndarray:
        """r of a leg in the implicit Euler step at a trial [mN s], (3 node,)."""
        leg, start = self._robot.legs[number], self._start
        return implicit_residual(
            leg.part,
            start.velocities[number],
            trial.positions[number],
            trial.velocities[number],
            self._pressure_of(leg),
            self._physics,
            self._damped(number, trial),
            start.memories[number],
        )

    def applied(self) -> float:
        """Norm of the impulses at work at the start [mN s]: what a rest of them is small beside.

        Momentum, weight, pressure and elastic forces of the legs; all of those of the hub.
        """
        physics, hub, start = self._physics, self._robot.hub, self._start
        step, gravity = physics.time_step_s, physics.gravity_mm_per_s2
        squares = hub.residual_size(hub.system(start.hub, physics)[1]) ** 2
        for leg, x, v in zip(self._robot.legs, start.positions, start.velocities, strict=True):
            mass = leg.part.node_mass
            squares += float(np.sum((mass[:, None] * v) ** 2))
            squares += float(np.sum((step * gravity * mass) ** 2))
            squares += float(np.sum((step * leg.part.elastic_force(x, physics.rotation)) ** 2))
            pressure = self._pressure_of(leg)
            if pressure.any():
                squares += float(np.sum((step * leg.part.pressure_force(x, pressure)) ** 2))
        return float(np.sqrt(squares))

    def solve(
        self,
        equations: Equations,
        trial: TrialStep[HubState],
        contacts: Contacts,
        turning: np.ndarray | None = None,
    ) -> TrialStep[HubState]:
        """The trial that obeys equations linearised at another, and the contact law.

        Args:
            equations: The equations.
            trial: Where they were linearised.
            contacts: The floor, linearised there.
            turning: `TrialBalance.turning` there; None to leave it out.

        Raises:
            numpy.linalg.LinAlgError: A matrix is not positive definite.
        """
        condensed = [
            leg.condense(data, b, points, frames, self._robot.clock)
            for leg, (data, b), points, frames in zip(
                self._robot.legs, equations.legs, contacts.points, contacts.frames, strict=False
            )
        ]
        return self.joined(equations.hub, condensed, trial, contacts, turning)

    def joined(
        self,
        hub_equations: tuple[np.ndarray, np.ndarray],
        condensed: Sequence[LegShare],
        trial: TrialStep[HubState],
        contacts: Contacts,
        turning: np.ndarray | None = None,
    ) -> TrialStep[HubState]:
        """The next trial by the legs' shares, joined by the hub and the contact law.

        Args:
            hub_equations: A and b of the hub, linearised at the trial.
            condensed: Each leg's share.
            trial: The last trial.
            contacts: The floor, linearised at the trial.
            turning: `TrialBalance.turning`; without, and where it leaves the hub's matrix
                indefinite, iterations are linear.

        Raises:
            numpy.linalg.LinAlgError: The hub's matrix is not positive definite.
        """
        robot, hub, active = self._robot, self._robot.hub, contacts.points
        matrix, right = hub_equations[0].copy(), hub_equations[1].copy()
        ties = []
        for leg, share in zip(robot.legs, condensed, strict=True):
            tie = hub.point_map(trial.hub, leg.attachment_in_hub)
            matrix += tie.T @ share.attachment_matrix @ tie
            right += tie.T @ share.attachment_right
            ties.append(tie)
        if turning is not None:
            tangent = self._physics.time_step_s * turning
            if _definite(matrix + tangent):
                matrix += tangent
                right += tangent @ trial.hub.velocity
        hub_points = contacts.frames[-1] @ hub.point_map(
            trial.hub, hub.contact_points[active[-1]]
        ).reshape(-1, 3, hub.unknown_count)
        numbers = robot.contact_numbers(active)
        solution = robot.clock.timed("friction", solve_contacts)(
            matrix,
            right,
            np.concatenate(
                [
                    *(s.contact_attachment @ t for s, t in zip(condensed, ties, strict=True)),
                    hub_points.reshape(-1, hub.unknown_count),
                ]
            ),
            [share.delassus for share in condensed],
            np.concatenate([*(s.contact_right for s in condensed), np.zeros(3 * len(hub_points))]),
            contacts.gaps,
            trial.impulses[numbers],
            self.friction[numbers],
            self._physics.time_step_s,
            robot.numerics,
        )
        ends = np.cumsum([len(points) for points in active])
        impulses_by_body = np.split(solution.impulses, ends[:-1])

        def velocity(number: int) -> np.ndarray:
            attached = ties[number] @ solution.hub_velocity
            impulse = impulses_by_body[number].ravel()
            return condensed[number].node_velocities(attached, impulse)

        velocities = robot.each_leg(velocity)
        impulses, contact_velocities = np.zeros((2, robot.contact_point_count, 3))
        impulses[numbers], contact_velocities[numbers] = solution.impulses, solution.velocities
        return self._moved(
            solution.hub_velocity, velocities, impulses, contact_velocities, solution.residual
        )

    def finished(
        self,
        trial: TrialStep[HubState],
        active_contacts: int,
        iterations: int,
        penetration_mm: float,
    ) -> FullRobotState[HubState]:
        """The state after the step, if the trial is its end.

        Args:
            trial: The end.
            active_contacts: Contact points that took part.
            iterations: Linear solves that led there.
            penetration_mm: Depth of its deepest contact point below the floor [mm].
        """
        hub = self._robot.hub
        velocities, work = [], self._start.pressure_work_mJ.copy()
        for number, leg in enumerate(self._robot.legs):
            # The next step starts from the hub's motion at its new place.
            tie = hub.point_map(trial.hub, leg.attachment_in_hub)
            velocity = trial.velocities[number].copy()
            velocity[leg.tie.nodes] = leg.tie.spread((tie @ trial.hub.velocity).reshape(-1, 3))
            velocities.append(velocity)
            pressure = self._pressure_of(leg)
            if pressure.any():
                before, after = (
                    leg.part.cavity_volumes(each.positions[number]) for each in (self._start, trial)
                )
                work[number] += float((1e-3 * pressure * (after - before)).sum())
        return FullRobotState(
            hub=trial.hub,
            positions=trial.positions,
            velocities=tuple(velocities),
            regulated_kPa=self._regulated,
            impulses=trial.impulses,
            contact_velocities=trial.contact_velocities,
            pressure_work_mJ=work,
            memories=tuple(
                None
                if leg.part.branches is None or memory is None
                else leg.part.branches.advanced(memory, x, self._physics.time_step_s)
                for leg, memory, x in zip(
                    self._robot.legs, self._start.memories, trial.positions, strict=True
                )
            ),
            active_contacts=active_contacts,
            contact_residual=trial.contact_residual,
            penetration_mm=penetration_mm,
            iterations=iterations,
        )

    def _leg_equations(
        self, number: int, trial: TrialStep[HubState], definite: bool
    ) -> tuple[np.ndarray, np.ndarray]:
        """A and b of a leg in the implicit Euler step, linearised at a trial."""
        leg, start = self._robot.legs[number], self._start
        return implicit_equations(
            leg.part,
            start.velocities[number],
            trial.positions[number],
            trial.velocities[number],
            self._pressure_of(leg),
            self._physics,
            definite,
            self._damped(number, trial),
            start.memories[number],
        )

    def _damped(self, number: int, trial: TrialStep[HubState]) -> np.ndarray | None:
        """`damping_data` of a leg; that of the start once for all trials."""
        part, physics = self._robot.legs[number].part, self._physics
        if damps_by_its_start(physics) and number not in self._damping:
            self._damping[number] = damping_data(part, self._start.positions[number], physics)
        if number in self._damping:
            return self._damping[number]
        return damping_data(part, trial.positions[number], physics)

    def _moved(
        self,
        hub_velocity: np.ndarray,
        velocities: Sequence[np.ndarray],
        impulses: np.ndarray,
        contact_velocities: np.ndarray,
        contact_residual: float = 0.0,
    ) -> TrialStep[HubState]:
        """Move with these velocities from the start; tied nodes go with the hub."""
        robot, start, step = self._robot, self._start, self._physics.time_step_s
        hub = robot.hub.advance(start.hub, hub_velocity, step)
        positions, consistent = [], []
        for leg, x, v in zip(robot.legs, start.positions, velocities, strict=True):
            position, velocity = x + step * v, v.copy()
            carried = robot.hub.point_positions(hub, leg.attachment_in_hub)
            position[leg.tie.nodes] = leg.tie.spread(carried)
            tie = robot.hub.point_map(hub, leg.attachment_in_hub)
            velocity[leg.tie.nodes] = leg.tie.spread((tie @ hub_velocity).reshape(-1, 3))
            positions.append(position)
            consistent.append(velocity)
        return TrialStep(
            hub,
            tuple(positions),
            tuple(consistent),
            impulses,
            contact_velocities,
            contact_residual,
        )

    def _pressure_of(self, leg: MountedLeg) -> np.ndarray:
        """Pressure of each of a leg's cavities [simulated kPa], (cavity,)."""
        return leg.part.pressures_kPa(leg.pressure_of(self._pressure))


def _definite(matrix: np.ndarray) -> bool:
    try:
        np.linalg.cholesky(matrix)
    except np.linalg.LinAlgError:
        return False
    return True
