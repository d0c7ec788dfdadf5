"""Converged implicit Euler by Newton's method with factors that are kept.

Residuals are exact, so where it converges it is the step of `implicit_euler_step` to the same
tolerance. An iteration costs forces and two triangular solves; fresh factors with their columns
cost as much as some ten of them. One set of factors does for a step where it is of the right trial,
with the right stresses, and turned:

- The first trial is that everything goes on as before, x_0 + h v_0. Its strains are E_0 + (E_0 -
  E_-1) + dF^T dF with dF = h grad v_0, of which the last part is false: what turns evenly is
  stretched by going straight on. Factors are made there with the stresses of E - dF^T dF, which in
  a stiff sheet and in volumes are near those of the end (`pneumorph.fem.foreseen_stress`: those of
  sqrt(2) h v_0).
- Later trials have turned by small angles, which a stiff sheet feels; the factors turn with the
  nodes (`pneumorph.fem.kept_leg`).

Where the step before ended with little left to do, its factors are tried first.
How well factors do, and what is left to do, is told by the sizes of changes
(`pneumorph.fem.contraction`).
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Generic

import numpy as np

from pneumorph.fem.contact_points import Contacts
from pneumorph.fem.contraction import Contraction
from pneumorph.fem.full_robot_state import FullRobotState
from pneumorph.fem.hub_body import HubState
from pneumorph.fem.kept_leg import KeptLeg, KeptShare
from pneumorph.fem.robot_body import RobotBody
from pneumorph.fem.step_problem import StepProblem
from pneumorph.fem.time_integration import StepError, with_points_below
from pneumorph.fem.trial_step import TrialStep
from pneumorph.physics.physics import Physics

EVENLY = np.sqrt(2.0)
"""Times h v_0: the change whose foreseen stresses are those of E - dF^T dF."""
_LONGEST_WAIT = 16


@dataclass
class KeptFactors(Generic[HubState]):
    """Factors of a robot's legs, kept from one step to the next."""

    legs: list[KeptLeg] = field(default_factory=list)
    """All legs, or none."""
    made: int = 0
    """How often factors of all legs were made so far."""
    end: FullRobotState[HubState] | None = None
    """State that the last step led to; after any other the factors are of no use."""
    step_s: float = 0.0
    """Length of the last step [s]."""
    wait: int = 0
    """Steps until factors of an earlier one are tried again."""
    next_wait: int = 1
    """How many after their next failure."""

    def begin(self, start: FullRobotState[HubState], step_s: float) -> None:
        """Forget the factors unless they are to be tried and the last step is gone on from.

        Args:
            start: Where the next step begins.
            step_s: How long it is [s].
        """
        if start is not self.end or step_s != self.step_s:
            self.wait, self.next_wait = 0, 1
            self.legs = []
        elif self.wait > 0:
            self.wait -= 1
            self.legs = []
        self.end, self.step_s = None, step_s

    def fail(self) -> None:
        """Forget factors of an earlier step, and for twice as long as the last time."""
        self.legs = []
        self.wait, self.next_wait = self.next_wait, min(2 * self.next_wait, _LONGEST_WAIT)


def kept_newton_step(
    robot: RobotBody[HubState],
    start: FullRobotState[HubState],
    regulated_kPa: np.ndarray,
    physics: Physics,
    kept: KeptFactors[HubState],
) -> FullRobotState[HubState]:
    """One implicit Euler step.

    Args:
        robot: The robot; the engine knows the elements of its legs.
        start: Where it is.
        regulated_kPa: Pressure of each regulator [real kPa], (regulator,).
        physics: What acts on it; the time step may be a part of the robot's.
        kept: Factors of the steps before, changed in place.

    Raises:
        StepError: No balance within the iterations.
        numpy.linalg.LinAlgError: A matrix is not positive definite.
    """
    problem, numerics = StepProblem(robot, start, regulated_kPa, physics), robot.numerics
    kept.begin(start, physics.time_step_s)
    enough = numerics.newton_tolerance * problem.applied()
    points = robot.points_near(start, physics.time_step_s)
    first = now = _evaluated(robot, problem, problem.going_on(), points)
    evenly = changes = [EVENLY * each for each in _moves(start.positions, now.trial.positions)]
    contraction = Contraction(earlier=bool(kept.legs))
    for iteration in range(1, numerics.newton_iterations + 1):
        if not kept.legs:
            kept.legs = _factors(robot, problem, now.trial, changes)
            kept.made += 1
        target = _target(robot, problem, kept.legs, now)
        if not contraction.accept(_size(robot, now.trial, target)):
            if contraction.earlier:
                kept.fail()
                now, changes, points = first, evenly, list(first.contacts.points)
            kept.legs, contraction = [], Contraction(earlier=False)
            continue
        points, deepest = with_points_below(robot, points, target)
        sound = not deepest > numerics.penetration_tolerance_mm
        done = contraction.left < numerics.displacement_tolerance_mm
        if not (sound and done):
            changes = _moves(now.trial.positions, target.positions)
            now = _evaluated(robot, problem, target, points)
            done = now.unbalanced <= enough
        if sound and done:
            if contraction.earlier:
                kept.next_wait = 1
            kept.end = problem.finished(target, len(now.contacts.gaps), iteration, deepest)
            return kept.end
    raise StepError(
        f"Newton's method left {now.unbalanced:.3g} mN s unbalanced after "
        f"{numerics.newton_iterations} iterations, expected {enough:.3g} or less"
    )


@dataclass(frozen=True, eq=False)
class _Evaluated(Generic[HubState]):
    trial: TrialStep[HubState]
    hub: tuple[np.ndarray, np.ndarray]
    residuals: list[np.ndarray]
    contacts: Contacts
    unbalanced: float


def _evaluated(
    robot: RobotBody[HubState],
    problem: StepProblem[HubState],
    trial: TrialStep[HubState],
    points: Sequence[np.ndarray],
) -> _Evaluated[HubState]:
    hub, contacts = problem.implicit_hub(trial), problem.contacts(points, trial)
    assemble = robot.clock.timed("assembly", robot.each_leg)
    residuals = assemble(lambda number: problem.implicit_residual(number, trial))
    unbalanced = problem.unbalanced(hub, residuals, trial, contacts)
    return _Evaluated(trial, hub, residuals, contacts, unbalanced)


def _factors(
    robot: RobotBody[HubState],
    problem: StepProblem[HubState],
    trial: TrialStep[HubState],
    changes: Sequence[np.ndarray],
) -> list[KeptLeg]:
    """Of the legs' matrices at a trial, without compression where they are not definite."""

    def factor(number: int) -> KeptLeg:
        leg, x = robot.legs[number], trial.positions[number]
        with suppress(np.linalg.LinAlgError):
            return KeptLeg(leg, problem.implicit_matrix(number, trial, changes[number]), x)
        return KeptLeg(leg, problem.implicit_matrix(number, trial, changes[number], True), x)

    return robot.clock.timed("factorisation", robot.each_leg)(factor)


def _target(
    robot: RobotBody[HubState],
    problem: StepProblem[HubState],
    legs: list[KeptLeg],
    now: _Evaluated[HubState],
) -> TrialStep[HubState]:
    """The next trial by the kept factors."""
    trial, contacts = now.trial, now.contacts
    numbers = robot.contact_numbers(contacts.points)
    ends = np.cumsum([len(points) for points in contacts.points])
    impulses = np.split(trial.impulses[numbers], ends[:-1])

    def share(number: int) -> KeptShare:
        active, frames = contacts.points[number], contacts.frames[number]
        legs[number].turn_to(trial.positions[number])
        legs[number].add_points(active)
        residual = now.residuals[number]
        return legs[number].condense(
            trial.velocities[number], residual, active, frames, impulses[number]
        )

    shares = robot.clock.timed("elimination", robot.each_leg)(share)
    return problem.joined(now.hub, shares, trial, contacts)


def _moves(first: Sequence[np.ndarray], second: Sequence[np.ndarray]) -> list[np.ndarray]:
    return [b - a for a, b in zip(first, second, strict=True)]


def _size(
    robot: RobotBody[HubState], first: TrialStep[HubState], second: TrialStep[HubState]
) -> float:
    """Root mean square, by mass, of what the legs' nodes move from one trial to another [mm]."""
    squares = mass = 0.0
    for leg, a, b in zip(robot.legs, first.positions, second.positions, strict=True):
        squares += float(leg.part.node_mass @ np.sum((b - a) ** 2, axis=1))
        mass += leg.part.mass_kg
    return float(np.sqrt(squares / mass))
