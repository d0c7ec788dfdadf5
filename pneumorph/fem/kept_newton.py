"""Converged implicit Euler by Newton's method with factors of earlier trials.

Residuals are exact, so where it converges it is the step of `implicit_euler_step` to the same
tolerance. The legs' matrices are those of an earlier trial: an iteration costs forces and two
triangular solves, fresh factors with their columns as much as some eight of them.

How well the matrices do is told by the changes of velocity dv that they ask for, in the norm of
kinetic energy, sqrt(sum m dv^2), from one iteration to the next (Deuflhard, Newton Methods for
Nonlinear Problems, section 2.1.2). Unbalanced impulses tell little: a stiff sheet that turns by a
small angle is stretched a little by a good iteration, and its false tension outweighs all else. For
the same reason a matrix of a trial far from the end does less well than one of a trial near it, and
errors of stiff and soft motions take turns, so that two iterations are looked at together: where
they leave more than `POOR_CONTRACTION`, the last change is not made and factors are made anew at
the trial that was reached. With 0.3 in two iterations, eight digits would take 30 of them; with
fresh factors they take some six.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Generic

import numpy as np

from pneumorph.fem.contact_points import Contacts
from pneumorph.fem.full_robot_state import FullRobotState
from pneumorph.fem.hub_body import HubState
from pneumorph.fem.kept_leg import KeptLeg, KeptShare
from pneumorph.fem.robot_body import RobotBody
from pneumorph.fem.step_problem import StepProblem
from pneumorph.fem.time_integration import StepError, with_points_below
from pneumorph.fem.trial_step import TrialStep
from pneumorph.physics.physics import Physics

POOR_CONTRACTION = 0.3
"""Share of a change of velocity that may be left after two iterations."""


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
    poor: bool = False
    """Whether the last step needed fresh factors on its way."""

    def begin(self, start: FullRobotState[HubState], step_s: float) -> None:
        """Forget the factors unless the last step did well with them and is gone on from.

        Args:
            start: Where the next step begins.
            step_s: How long it is [s].
        """
        if self.poor or start is not self.end or step_s != self.step_s:
            self.legs = []
        self.end, self.step_s, self.poor = None, step_s, False


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
    now = _evaluated(robot, problem, problem.going_on(), points)
    sizes: list[float] = []  # of the changes by the factors now kept
    for iteration in range(1, numerics.newton_iterations + 1):
        if not kept.legs:
            kept.legs = _factors(robot, problem, now.trial)
            kept.made += 1
        target = _target(robot, problem, kept.legs, now)
        size = _size(robot, now.trial, target)
        if len(sizes) > 1 and size > POOR_CONTRACTION * sizes[-2]:
            kept.legs, sizes, kept.poor = [], [], True
            continue
        sizes.append(size)
        points, deepest = with_points_below(robot, points, target)
        now = _evaluated(robot, problem, target, points)
        if now.unbalanced <= enough and not deepest > numerics.penetration_tolerance_mm:
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
    robot: RobotBody[HubState], problem: StepProblem[HubState], trial: TrialStep[HubState]
) -> list[KeptLeg]:
    """Of the legs' matrices at a trial, or of definite ones where those are not."""

    def factor(number: int) -> KeptLeg:
        leg = robot.legs[number]
        try:
            return KeptLeg(leg, problem.implicit_matrix(number, trial))
        except np.linalg.LinAlgError:
            return KeptLeg(leg, problem.implicit_leg(number, trial, definite=True)[0])

    return robot.clock.timed("factorisation", robot.each_leg)(factor)


def _target(
    robot: RobotBody[HubState],
    problem: StepProblem[HubState],
    legs: list[KeptLeg],
    now: _Evaluated[HubState],
) -> TrialStep[HubState]:
    """The next trial by the kept factors."""
    trial, contacts = now.trial, now.contacts

    def share(number: int) -> KeptShare:
        active, frames = contacts.points[number], contacts.frames[number]
        legs[number].add_points(active)
        residual = now.residuals[number]
        return legs[number].condense(trial.velocities[number], residual, active, frames)

    shares = robot.clock.timed("elimination", robot.each_leg)(share)
    return problem.joined(now.hub, shares, trial, contacts)


def _size(
    robot: RobotBody[HubState], first: TrialStep[HubState], second: TrialStep[HubState]
) -> float:
    """Root of sum m dv^2 of the legs' nodes from one trial to another [kg^(1/2) mm/s]."""
    squares = 0.0
    for leg, a, b in zip(robot.legs, first.velocities, second.velocities, strict=True):
        squares += float(leg.part.node_mass @ np.sum((b - a) ** 2, axis=1))
    return float(np.sqrt(squares))
