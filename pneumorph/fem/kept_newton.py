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
do, and what is left to do, is told by the sizes of changes (`pneumorph.fem.contraction`). Where
they do not shrink, the legs that change most get factors of every further trial, which is Newton's
method for these: a sheet whose corner lets go of the floor and springs back.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
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
from pneumorph.fem.step_share import EnergyAlong, share_of_step
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
_HEAVIER = tuple(4.0**power for power in range(7))
"""Times its own mass that a leg gets in addition where its matrix is indefinite: the first that
makes it definite."""
_SETTLED_MM = 1e-3
"""Smaller changes of a robot with a leg that had to be made heavier tell that it settles where that
leg is unstable: an end that a shorter step, whose inertia holds the leg, will not lead to."""
_SEARCHED_MM = 1e-6
"""Smaller changes are made as they are: the contact law is solved to 1e-9 mm in a step."""
_CULPABLE = 0.3
"""Share of the largest change of a leg from which on another is held to spoil the step too."""


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
    iterations: int = 0
    """Of the last step, those that led away included."""
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
        self.end, self.step_s, self.iterations = None, step_s, 0
        return {number for number, leg in enumerate(self.legs) if leg is not None}

    def forget(self, numbers: Iterable[int]) -> None:
        """Have the factors of these legs made anew."""
        for number in numbers:
            self.legs[number] = None

    def weights(self) -> list[float]:
        """`KeptLeg.weight` of every leg."""
        return [0.0 if leg is None else leg.weight for leg in self.legs]

    def refuse(self, earlier: set[int]) -> None:
        """Forget these legs' factors of earlier steps, which failed after so far a turn."""
        turns = [leg.turn for number in earlier if (leg := self.legs[number]) is not None]
        self.furthest_turn = _SMALLER * max(turns)
        self.forget(earlier)


class UnstableEndError(StepError):
    """A step settles where a leg is unstable, wherever it begins: it is too long for that leg."""


def kept_newton_step(
    robot: RobotBody[HubState],
    start: FullRobotState[HubState],
    regulated_kPa: np.ndarray,
    physics: Physics,
    kept: KeptFactors[HubState],
) -> FullRobotState[HubState]:
    """One implicit Euler step.

    Where iterations from the trial in which everything goes on lead away, they begin once more from
    that in which nothing moves: near the end where a robot has sprung.

    Args:
        robot: The robot; the engine knows the elements of its legs.
        start: Where it is.
        regulated_kPa: Pressure of each regulator [real kPa], (regulator,).
        physics: What acts on it; the time step may be a part of the robot's.
        kept: Factors of the steps before, changed in place.

    Raises:
        UnstableEndError: It settles where a leg is unstable.
        StepError: From both beginnings there was no balance within the iterations, changes that
            fresh factors led to did not shrink, or a matrix was indefinite.
    """
    problem = StepProblem(robot, start, regulated_kPa, physics)
    earlier = kept.begin(start, physics.time_step_s, len(robot.legs))
    points = robot.points_near(start, physics.time_step_s)
    failures = (StepError, np.linalg.LinAlgError)
    try:
        end = _balanced(robot, problem, kept, start, problem.going_on(), points, earlier, set())
    except UnstableEndError:
        raise
    except failures as first:
        every = set(range(len(robot.legs)))
        try:
            end = _balanced(robot, problem, kept, start, problem.standing(), points, set(), every)
        except failures as second:
            raise StepError(f"{first}; begun from rest, {second}") from second
    # What is heavier than its leg is of no use to later steps.
    kept.forget(number for number, weight in enumerate(kept.weights()) if weight > 0.0)
    kept.end = end
    return end


def _balanced(
    robot: RobotBody[HubState],
    problem: StepProblem[HubState],
    kept: KeptFactors[HubState],
    start: FullRobotState[HubState],
    trial: TrialStep[HubState],
    points: Sequence[np.ndarray],
    earlier: set[int],
    struggling: set[int],
) -> FullRobotState[HubState]:
    """The step's end by iterations from a trial.

    Legs of `earlier` have factors of steps before; those of `struggling` get factors of each trial.
    """
    numerics = robot.numerics
    enough = numerics.newton_tolerance * problem.applied()
    first = now = _evaluated(robot, problem, trial, points)
    evenly = changes = [EVENLY * each for each in _moves(start.positions, trial.positions)]
    contraction = Contraction(bool(earlier))
    for _ in range(numerics.newton_iterations):
        kept.iterations += 1
        furthest = kept.furthest_turn if now is first else _WITHIN_A_STEP * FURTHEST_TURN
        before = kept.weights()
        kept.forget(struggling)
        fresh, target = _fresh_and_target(robot, problem, kept, now, changes, furthest)
        weights = kept.weights()
        if fresh - struggling or weights != before:
            earlier = earlier - fresh
            contraction = Contraction(bool(earlier))
        sizes = _sizes(robot, now.trial, target)
        size = float(np.linalg.norm(sizes))
        if any(weights) and size < _SETTLED_MM:
            unstable = int(np.argmax(weights))
            raise UnstableEndError(f"Newton's method settles where leg {unstable} is unstable")
        at_rest = size < NEGLIGIBLE * numerics.displacement_tolerance_mm
        if not contraction.accept(size) and not at_rest:
            worst = set(np.flatnonzero(~(sizes < _CULPABLE * sizes.max())).tolist())
            if worst & earlier:
                kept.refuse(worst & earlier)
                now, changes, points = first, evenly, list(first.contacts.points)
                earlier = earlier - worst
                continue
            if worst - fresh:
                kept.forget(worst)
                struggling = struggling | worst
                contraction = Contraction(bool(earlier))
                continue
            if contraction.goes_on_poorly(size):
                break  # a shorter step takes less time than this one would
        share = 1.0
        if struggling and not size < _SEARCHED_MM:
            search = robot.clock.timed("line search", share_of_step)
            share = search(_slope(robot, problem, now, target))
        target = problem.between(now.trial, target, share)
        points, deepest = with_points_below(robot, points, target)
        # The contact law holds where a whole step ended.
        sound = share == 1.0 and not deepest > numerics.penetration_tolerance_mm
        done = at_rest or contraction.left < numerics.displacement_tolerance_mm
        if not (sound and done):
            changes = _moves(now.trial.positions, target.positions)
            now = _evaluated(robot, problem, target, points)
            done = now.unbalanced <= enough
        if sound and done:
            if earlier:
                kept.furthest_turn = min(FURTHEST_TURN, _LARGER * kept.furthest_turn)
            return problem.finished(target, len(now.contacts.gaps), kept.iterations, deepest)
    raise StepError(left_unbalanced(now, enough, kept.iterations))


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


def _slope(
    robot: RobotBody[HubState],
    problem: StepProblem[HubState],
    now: _Evaluated[HubState],
    target: TrialStep[HubState],
) -> Callable[[float], float]:
    """The energy's slope on the way to the next trial, by the share of the way gone."""
    energy = EnergyAlong(
        robot, now.contacts, now.trial, target, problem.friction, problem.time_step_s
    )

    def slope(share: float) -> float:
        if share == 0.0:
            return energy.slope(share, now.trial, now.hub, now.residuals)
        trial = problem.between(now.trial, target, share)
        residuals = robot.each_leg(lambda number: problem.implicit_residual(number, trial))
        return energy.slope(share, trial, problem.implicit_hub(trial), residuals)

    return slope


def _fresh_and_target(
    robot: RobotBody[HubState],
    problem: StepProblem[HubState],
    kept: KeptFactors[HubState],
    now: _Evaluated[HubState],
    changes: Sequence[np.ndarray],
    furthest_turn: float,
) -> tuple[set[int], TrialStep[HubState]]:
    """Numbers of the legs whose factors were made anew, and the next trial by all factors.

    A leg may stand because of its hold on the hub alone, and the hub's matrix be indefinite. Then
    all legs are made heavier.
    """
    fresh = _renew(robot, problem, kept, now, changes, furthest_turn)
    for least in _HEAVIER:
        try:
            return fresh, _target(robot, problem, kept.legs, now)
        except np.linalg.LinAlgError:
            kept.forget(range(len(kept.legs)))
            fresh = _renew(robot, problem, kept, now, changes, furthest_turn, least)
    return fresh, _target(robot, problem, kept.legs, now)


def _renew(
    robot: RobotBody[HubState],
    problem: StepProblem[HubState],
    kept: KeptFactors[HubState],
    now: _Evaluated[HubState],
    changes: Sequence[np.ndarray],
    furthest_turn: float,
    least_weight: float = 0.0,
) -> set[int]:
    """Turn factors to a trial, make those anew that have turned too far; numbers of their legs."""
    trial, pressed = now.trial, robot.contact_numbers_by_body(now.contacts.points)

    def matrices(number: int) -> Iterator[tuple[np.ndarray, float]]:
        """Those to try, with their weights."""
        leg, points, frames = robot.legs[number], now.contacts.points, now.contacts.frames
        if least_weight == 0.0:
            yield problem.implicit_matrix(number, trial, changes[number]), 0.0
        data = problem.implicit_matrix(number, trial)
        if least_weight == 0.0:
            yield data, 0.0  # what was foreseen may be too compressed
        impulses, friction = trial.impulses[pressed[number]], problem.friction[pressed[number]]
        hold_pressed(leg, data, points[number], frames[number], impulses, friction)
        if least_weight == 0.0:
            yield data, 0.0  # a corner that the floor presses may give way where it is not held
        mass = np.repeat(leg.part.node_mass, 3)
        for weight in _HEAVIER:
            if weight >= least_weight and np.isfinite(data).all():
                heavier = data.copy()
                heavier[leg.part.assembly.diagonal] += weight * mass
                yield heavier, weight

    def renewed(number: int) -> bool:
        leg, x, factor = robot.legs[number], trial.positions[number], kept.legs[number]
        if factor is not None:
            factor.turn_to(x)
            if factor.turn <= furthest_turn:
                return False
        kept.legs[number] = None
        for data, weight in matrices(number):
            try:
                kept.legs[number] = KeptLeg(leg, data, x, weight)
                return True
            except np.linalg.LinAlgError:
                pass
        raise np.linalg.LinAlgError(f"the matrix of leg {number} is indefinite")

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


def _sizes(
    robot: RobotBody[HubState], first: TrialStep[HubState], second: TrialStep[HubState]
) -> np.ndarray:
    """What each leg's nodes move from one trial to another [mm], (leg,): the root of the squares'
    mean by the mass of all legs, so that the vector's norm is the robot's."""
    squares = [
        float(leg.part.node_mass @ np.sum((b - a) ** 2, axis=1))
        for leg, a, b in zip(robot.legs, first.positions, second.positions, strict=True)
    ]
    return np.sqrt(np.array(squares) / sum(leg.part.mass_kg for leg in robot.legs))
