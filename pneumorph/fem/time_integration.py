"""Time steps of a robot: linearly implicit Euler as published, and converged implicit Euler."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Generic

import numpy as np

from pneumorph.fem.contact_points import Contacts
from pneumorph.fem.full_robot_state import FullRobotState
from pneumorph.fem.hub_body import HubState
from pneumorph.fem.robot_body import RobotBody
from pneumorph.fem.step_problem import Equations, StepProblem
from pneumorph.fem.trial_balance import trial_balance
from pneumorph.fem.trial_step import TrialStep
from pneumorph.physics.physics import Physics

SUFFICIENT_DECREASE = 1e-4
"""Share of a Newton step's predicted decrease that it must achieve (Armijo 1966)."""
LINE_SEARCH_HALVINGS = 8
"""Most halvings of a Newton step."""


class StepError(ArithmeticError):
    """A time step failed; the message says how."""


def linearly_implicit_step(
    robot: RobotBody[HubState],
    start: FullRobotState[HubState],
    regulated_kPa: np.ndarray,
    physics: Physics,
) -> FullRobotState[HubState]:
    """One linear solve with the contact law.

    The floor is linearised at the step's start. Where a point ends too deep, because the floor
    bends or it came from beyond the margin, the step is solved again with the floor linearised at
    its end.

    Args:
        robot: The robot.
        start: Where it is.
        regulated_kPa: Pressure of each regulator [real kPa], (regulator,).
        physics: What acts on it; the time step may be a part of the robot's.

    Raises:
        numpy.linalg.LinAlgError: A matrix is not positive definite.
        StepError: A point stays too deep in the floor, or the floor has no height below one.
    """
    problem = StepProblem(robot, start, regulated_kPa, physics)
    equations = problem.linearly_implicit()
    standing = end = problem.standing()
    points = robot.points_near(start, physics.time_step_s)
    solves, deepest, numerics = 0, np.inf, robot.numerics
    while deepest > numerics.penetration_tolerance_mm and solves < numerics.contact_passes:
        contacts = problem.contacts(points, end)
        end = problem.solve(equations, standing, contacts)
        points, deepest = with_points_below(robot, points, end)
        solves += 1
    if deepest > numerics.penetration_limit_mm:
        raise StepError(
            f"a point ends {deepest:.3g} mm below the floor after {solves} solves, expected at "
            f"most {numerics.penetration_limit_mm:g}"
        )
    return problem.finished(end, len(contacts.gaps), solves, deepest)


def implicit_euler_step(
    robot: RobotBody[HubState],
    start: FullRobotState[HubState],
    regulated_kPa: np.ndarray,
    physics: Physics,
) -> FullRobotState[HubState]:
    """Newton's method with line search until all forces balance at the end of the step.

    Every iteration linearises elasticity, pressure and floor at the last trial and solves for the
    next together with the contact law, so that the law holds exactly at the end.

    Args:
        robot: The robot.
        start: Where it is.
        regulated_kPa: Pressure of each regulator [real kPa], (regulator,).
        physics: What acts on it; the time step may be a part of the robot's.

    Raises:
        StepError: No balance within the iterations, or the line search found no decrease.
        numpy.linalg.LinAlgError: A matrix is not positive definite.
    """
    problem = StepProblem(robot, start, regulated_kPa, physics)
    enough = robot.numerics.newton_tolerance * problem.applied()
    points = robot.points_near(start, physics.time_step_s)
    now = _evaluated(robot, problem, problem.standing(), points)
    for iteration in range(1, robot.numerics.newton_iterations + 1):
        try:
            target = problem.solve(now.equations, now.trial, now.contacts, now.turning)
        except np.linalg.LinAlgError:
            # Compression or pressure has made a tangent indefinite.
            equations = problem.implicit_euler(now.trial, definite=True)
            target = problem.solve(equations, now.trial, now.contacts, now.turning)
        for halving in range(LINE_SEARCH_HALVINGS + 1):
            share = 0.5**halving
            new = _evaluated(robot, problem, problem.between(now.trial, target, share), points)
            if new.unbalanced <= max((1.0 - SUFFICIENT_DECREASE * share) * now.unbalanced, enough):
                break
        else:
            raise StepError(
                f"Newton's method found no smaller imbalance than {now.unbalanced:.3g} mN s in "
                f"iteration {iteration}, expected {enough:.3g} or less"
            )
        points, deepest = with_points_below(robot, points, new.trial)
        # The contact law holds where a whole step ended.
        balanced = share == 1.0 and new.unbalanced <= enough
        if balanced and not deepest > robot.numerics.penetration_tolerance_mm:
            return problem.finished(new.trial, len(new.contacts.gaps), iteration, deepest)
        now = replace(new, contacts=problem.contacts(points, new.trial))
    raise StepError(left_unbalanced(now, enough, robot.numerics.newton_iterations))


@dataclass(frozen=True, eq=False)
class Evaluated(Generic[HubState]):
    """A trial and what is out of balance there.

    Attributes:
        trial: The trial.
        contacts: The floor at it.
        turning: As of `TrialBalance`.
        unbalanced: What is left of all forces [mN s].
    """

    trial: TrialStep[HubState]
    contacts: Contacts
    turning: np.ndarray | None
    unbalanced: float


def left_unbalanced(at: Evaluated[HubState], enough: float, iterations: int) -> str:
    """What a step says whose Newton's method ends before [mN s]."""
    return (
        f"Newton's method left {at.unbalanced:.3g} mN s unbalanced after {iterations} iterations, "
        f"expected {enough:.3g} or less"
    )


@dataclass(frozen=True, eq=False)
class _Linearised(Evaluated[HubState]):
    equations: Equations


def _evaluated(
    robot: RobotBody[HubState],
    problem: StepProblem[HubState],
    trial: TrialStep[HubState],
    points: Sequence[np.ndarray],
) -> _Linearised[HubState]:
    equations, contacts = problem.implicit_euler(trial), problem.contacts(points, trial)
    residuals = problem.residuals(equations, trial)
    balance = trial_balance(robot, equations.hub, residuals, trial, contacts)
    return _Linearised(trial, contacts, balance.turning, balance.unbalanced, equations)


def with_points_below(
    robot: RobotBody[HubState], points: Sequence[np.ndarray], trial: TrialStep[HubState]
) -> tuple[list[np.ndarray], float]:
    """Points that take part and those that a trial puts below the floor; depth of the deepest.

    Raises:
        StepError: The floor has no height below a point.
    """
    positions = robot.contact_positions(trial)
    gaps = [robot.floor.gap(each) for each in positions]
    for gap, position in zip(gaps, positions, strict=True):
        lost = np.flatnonzero(~np.isfinite(gap))
        if len(lost):
            x, y, z = position[lost[0]]
            raise StepError(
                f"the floor ({robot.floor.description}) has no height below the contact point at "
                f"({x:.4g}, {y:.4g}, {z:.4g}) mm, or the robot has diverged"
            )
    both = [np.union1d(p, np.flatnonzero(g < 0.0)) for p, g in zip(points, gaps, strict=True)]
    return both, max(0.0, *(-float(gap.min(initial=0.0)) for gap in gaps))
