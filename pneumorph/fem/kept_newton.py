"""Converged implicit Euler by Newton's method with factors that are kept.

Residuals are exact, so where it converges it is the step of `implicit_euler_step` to the same
tolerance. An iteration costs forces and two triangular solves; fresh factors with their columns
cost as much as some ten of them. One set of factors does for a step where it is of the right trial,
with the right stresses, and turned:

- The first trial is that everything goes on as before, x_0 + h v_0. Its strains are
  2 E_0 - E(-1) + dF^T dF with dF = h grad v_0 and E(-1) those of a step ago, of which the last part
  is false: what turns evenly is stretched by going straight on. Factors are made there with the
  stresses of E - dF^T dF, which in a stiff sheet and in volumes are near those of the end
  (`pneumorph.fem.foreseen_stress`: those of sqrt(2) h v_0).
- Later trials have turned by small angles, which a stiff sheet feels; the factors turn with the
  nodes (`pneumorph.fem.kept_leg`).

A leg that turns little goes on with the factor that it has, from step to step. How well factors
do, and what is left to do, is told by the sizes of changes (`pneumorph.fem.contraction`).
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import Generic

import numpy as np

from pneumorph.fem.contraction import Contraction
from pneumorph.fem.full_robot_state import FullRobotState
from pneumorph.fem.held_points import hold_pressed
from pneumorph.fem.hub_body import HubState
from pneumorph.fem.kept_leg import KeptLeg, KeptShare
from pneumorph.fem.robot_body import RobotBody
from pneumorph.fem.step_problem import StepProblem
from pneumorph.fem.time_integration import (
    Evaluated,
    StepError,
    left_unbalanced,
    with_points_below,
)
from pneumorph.fem.trial_balance import trial_balance
from pneumorph.fem.trial_step import TrialStep
from pneumorph.physics.physics import Physics

EVENLY = np.sqrt(2.0)
"""Times h v_0: the change whose foreseen stresses are those of E - dF^T dF."""
FURTHEST_TURN = 0.002
"""A leg that has turned further than this since its factor was made [radian, root mean square over
its nodes] begins no step with it. Of the paper's leg on a sheet of 2 GPa: up to 0.002 two
iterations leave 0.05 of a change, with 0.0025 a quarter, from 0.004 on changes may grow."""
NEGLIGIBLE = 1e-3
"""Share of the displacement tolerance that a change may have without shrinking any more: the
rounding of a robot at rest on which nothing acts, whose impulses are nothing to be small beside."""
_WITHIN_A_STEP = 2.0
"""Times as far a leg may turn before its factor is made anew on the way to a step's end."""
_SMALLER, _LARGER = 0.5, 1.1


@dataclass
class KeptFactors(Generic[HubState]):
    """Factors of a robot's legs, kept from one step to the next."""

    legs: list[KeptLeg | None] = field(default_factory=list)
    """Of each leg, None where it is to be made; empty before the first step."""
    made: int = 0
    """How many factors were made so far."""
    end: FullRobotState[HubState] | None = None
    """State that the last step led to; after any other the factors are of no use."""
    step_s: float = 0.0
    """Length of the last step [s]."""
    furthest_turn: float = FURTHEST_TURN
    """How far a leg may turn [radian]: less after factors of earlier steps have failed."""

    def begin(self, start: FullRobotState[HubState], step_s: float, leg_count: int) -> set[int]:
        """Forget the factors unless the last step is gone on from.

        Args:
            start: Where the next step begins.
            step_s: How long it is [s].
            leg_count: How many legs there are.

        Returns:
            Numbers of the legs that have a factor.
        """
        if start is not self.end or step_s != self.step_s:
            self.legs, self.furthest_turn = [None] * leg_count, FURTHEST_TURN
        self.end, self.step_s = None, step_s
        return {number for number, leg in enumerate(self.legs) if leg is not None}

    def forget(self, numbers: Iterable[int]) -> None:
        """Have the factors of these legs made anew."""
        for number in numbers:
            self.legs[number] = None

    def refuse(self, earlier: set[int]) -> None:
        """Forget these legs' factors of earlier steps, which failed after so far a turn."""
        turns = [leg.turn for number in earlier if (leg := self.legs[number]) is not None]
        self.furthest_turn = _SMALLER * max(turns)
        self.forget(earlier)


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
        StepError: No balance within the iterations, or fresh factors led to a change that is not
            smaller than the last one that fresh factors failed at.
        numpy.linalg.LinAlgError: A matrix is not positive definite.
    """
    problem, numerics = StepProblem(robot, start, regulated_kPa, physics), robot.numerics
    earlier = kept.begin(start, physics.time_step_s, len(robot.legs))
    enough = numerics.newton_tolerance * problem.applied()
    points = robot.points_near(start, physics.time_step_s)
    first = now = _evaluated(robot, problem, problem.going_on(), points)
    evenly = changes = [EVENLY * each for each in _moves(start.positions, now.trial.positions)]
    contraction, refused = Contraction(bool(earlier)), np.inf
    for iteration in range(1, numerics.newton_iterations + 1):
        furthest = kept.furthest_turn if now is first else _WITHIN_A_STEP * FURTHEST_TURN
        fresh = _renew(robot, problem, kept, now, changes, furthest)
        if fresh:
            earlier -= fresh
            contraction = Contraction(bool(earlier))
        target = _target(robot, problem, kept.legs, now)
        size = _size(robot, now.trial, target)
        at_rest = size < NEGLIGIBLE * numerics.displacement_tolerance_mm
        if not contraction.accept(size) and not at_rest:
            if earlier:
                kept.refuse(earlier)
                now, changes, points = first, evenly, list(first.contacts.points)
                earlier = set()
            elif not size < refused:
                break  # a shorter step takes less time than this one would
            else:
                kept.forget(range(len(kept.legs)))
                refused = size
            continue
        points, deepest = with_points_below(robot, points, target)
        sound = not deepest > numerics.penetration_tolerance_mm
        done = at_rest or contraction.left < numerics.displacement_tolerance_mm
        if not (sound and done):
            changes = _moves(now.trial.positions, target.positions)
            now = _evaluated(robot, problem, target, points)
            done = now.unbalanced <= enough
        if sound and done:
            if earlier:
                kept.furthest_turn = min(FURTHEST_TURN, _LARGER * kept.furthest_turn)
            kept.end = problem.finished(target, len(now.contacts.gaps), iteration, deepest)
            return kept.end
    raise StepError(left_unbalanced(now, enough, iteration))


@dataclass(frozen=True, eq=False)
class _Evaluated(Evaluated[HubState]):
    hub: tuple[np.ndarray, np.ndarray]
    residuals: list[np.ndarray]


def _evaluated(
    robot: RobotBody[HubState],
    problem: StepProblem[HubState],
    trial: TrialStep[HubState],
    points: Sequence[np.ndarray],
) -> _Evaluated[HubState]:
    hub, contacts = problem.implicit_hub(trial), problem.contacts(points, trial)
    assemble = robot.clock.timed("assembly", robot.each_leg)
    residuals = assemble(lambda number: problem.implicit_residual(number, trial))
    balance = trial_balance(robot, hub, residuals, trial, contacts)
    return _Evaluated(trial, contacts, balance.turning, balance.unbalanced, hub, residuals)


def _renew(
    robot: RobotBody[HubState],
    problem: StepProblem[HubState],
    kept: KeptFactors[HubState],
    now: _Evaluated[HubState],
    changes: Sequence[np.ndarray],
    furthest_turn: float,
) -> set[int]:
    """Turn factors to a trial, make those anew that have turned too far; numbers of their legs."""
    trial, pressed = now.trial, robot.contact_numbers_by_body(now.contacts.points)

    def renewed(number: int) -> bool:
        leg, x, factor = robot.legs[number], trial.positions[number], kept.legs[number]
        if factor is not None:
            factor.turn_to(x)
            if factor.turn <= furthest_turn:
                return False
        kept.legs[number] = None
        # What was foreseen may be too compressed, and a corner that the floor presses may give way
        # where it is not held.
        for changed, held in ((changes[number], False), (None, False), (None, True)):
            data = problem.implicit_matrix(number, trial, changed)
            if held:
                hold_pressed(
                    leg,
                    data,
                    now.contacts.points[number],
                    now.contacts.frames[number],
                    trial.impulses[pressed[number]],
                    problem.friction[pressed[number]],
                )
            try:
                kept.legs[number] = KeptLeg(leg, data, x)
                return True
            except np.linalg.LinAlgError:
                pass
        data, _ = problem.implicit_leg(number, trial, definite=True)
        kept.legs[number] = KeptLeg(leg, data, x)
        return True

    made = robot.clock.timed("factorisation", robot.each_leg)(renewed)
    kept.made += sum(made)
    return {number for number, new in enumerate(made) if new}


def _target(
    robot: RobotBody[HubState],
    problem: StepProblem[HubState],
    legs: Sequence[KeptLeg | None],
    now: _Evaluated[HubState],
) -> TrialStep[HubState]:
    """The next trial by the kept factors."""
    trial, contacts = now.trial, now.contacts
    numbers = robot.contact_numbers_by_body(contacts.points)

    def share(number: int) -> KeptShare:
        active, frames, leg = contacts.points[number], contacts.frames[number], legs[number]
        assert leg is not None, "factors are made before they are used"
        leg.add_points(active)
        velocity, residual = trial.velocities[number], now.residuals[number]
        impulses = trial.impulses[numbers[number]]
        return leg.condense(velocity, residual, active, frames, impulses)

    shares = robot.clock.timed("elimination", robot.each_leg)(share)
    return problem.joined(now.hub, shares, trial, contacts, now.turning)


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
