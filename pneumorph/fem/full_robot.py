"""A whole robot at full order: legs of finite elements on a hub, on a floor with friction.

`pneumorph.fem.time_integration` makes its steps, with impulses lambda that obey, at every contact,

    0 <= v_n + gap / h  perp  lambda_n >= 0,   |lambda_t| <= mu lambda_n, opposite to any sliding,

normal and tangents those of the floor below each point.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import replace
from functools import cached_property
from typing import Any

import numpy as np
from threadpoolctl import threadpool_limits

from pneumorph.fem.full_robot_state import FullRobotState
from pneumorph.fem.hub_body import HubState
from pneumorph.fem.kept_newton import KeptFactors, kept_newton_step
from pneumorph.fem.robot_body import RobotBody
from pneumorph.fem.time_integration import StepError, implicit_euler_step, linearly_implicit_step
from pneumorph.physics.physics import Physics
from pneumorph.trajectory import Trajectory, check_record_every

EASY_ITERATIONS = 8
"""Mean iterations of a step's parts up to which the next step is tried in half as many."""


def _one_blas_thread() -> AbstractContextManager[Any]:
    """While steps are made: on the small fronts of a leg several threads of BLAS wait for each
    other, and for the robot's own; and sums, hence results, would depend on their number."""
    limit: AbstractContextManager[Any] = threadpool_limits(1, user_api="blas")
    return limit


class FullRobot(RobotBody[HubState]):
    """Legs of finite elements on a hub that move under commands; made as `RobotBody` is."""

    @cached_property
    def kept(self) -> KeptFactors[HubState]:
        """Factors that go from step to step where `newton_matrix` is ``kept``.

        Raises:
            ValueError: The engine lacks the law of a leg.
        """
        for leg in self.legs:
            if leg.part.compiled is None:
                laws = [group.material.law for group in leg.part.element_groups]
                raise ValueError(
                    f'newton_matrix is "kept", expected "fresh" for a leg of the laws {laws}: the '
                    "engine has yeoh, stable_neo_hookean and st_venant_kirchhoff of solids and the "
                    "last of sheets at full order"
                )
        return KeptFactors()

    def step(
        self, state: FullRobotState[HubState], command_kPa: np.ndarray
    ) -> FullRobotState[HubState]:
        """Advance by one time step.

        A step that fails is made as two of half the length, and those again where they fail; the
        new state's `substeps` says how many there were. A step after one that was made in parts
        begins in about as many, since what made that one fail, such as a sheet that buckles, lasts;
        in half as many where they took few iterations.

        Args:
            state: Where the robot is.
            command_kPa: Real pressure asked of each regulator [kPa], (regulator,).

        Raises:
            StepError: The step fails even in the smallest parts.
        """
        command = np.asarray(command_kPa, dtype=float)
        easy = state.iterations <= EASY_ITERATIONS * state.substeps
        parts = state.substeps // 2 if easy else state.substeps
        parts = min(parts, 2**self.numerics.step_halvings)
        return self._divided(state, command, self.physics, 0, parts)

    def _divided(
        self,
        state: FullRobotState[HubState],
        command_kPa: np.ndarray,
        physics: Physics,
        halvings: int,
        parts: int,
    ) -> FullRobotState[HubState]:
        """One step of the physics' length, or its halves where it fails or is to have parts."""
        if parts < 2:
            try:
                return self._undivided(state, command_kPa, physics)
            except (StepError, np.linalg.LinAlgError) as error:
                if halvings >= self.numerics.step_halvings:
                    raise StepError(
                        f"a step of {physics.time_step_s:g} s failed, {halvings} times halved: "
                        f"{error}"
                    ) from error
        half = replace(physics, time_step_s=0.5 * physics.time_step_s)
        if physics.friction_pressure.exponent != 0.0:
            # It reads pressures from impulses of a step of the same length.
            state = replace(state, impulses=0.5 * state.impulses)
        middle = self._divided(state, command_kPa, half, halvings + 1, parts // 2)
        end = self._divided(
            middle, command_kPa, half, halvings + 1, max(parts, middle.substeps) // 2
        )
        return replace(
            end,
            impulses=middle.impulses + end.impulses,
            active_contacts=max(middle.active_contacts, end.active_contacts),
            contact_residual=max(middle.contact_residual, end.contact_residual),
            penetration_mm=max(middle.penetration_mm, end.penetration_mm),
            substeps=middle.substeps + end.substeps,
            iterations=middle.iterations + end.iterations,
        )

    def _undivided(
        self, state: FullRobotState[HubState], command_kPa: np.ndarray, physics: Physics
    ) -> FullRobotState[HubState]:
        regulated = self.regulators.after(state.regulated_kPa, command_kPa, physics.time_step_s)
        with np.errstate(all="ignore"):
            if self.numerics.integrator != "implicit_euler":
                new = linearly_implicit_step(self, state, regulated, physics)
            elif self.numerics.newton_matrix == "fresh":
                new = implicit_euler_step(self, state, regulated, physics)
            else:
                new = kept_newton_step(self, state, regulated, physics, self.kept)
        # numpy's maximum is NaN where any speed is.
        speed = float(np.max([np.abs(v).max() for v in (*new.velocities, new.hub.velocity)]))
        if not speed < self.numerics.speed_limit_mm_per_s:  # NaN compares false
            raise StepError(
                f"a node moves at {speed:.3g} mm/s, expected less than "
                f"{self.numerics.speed_limit_mm_per_s:g}"
            )
        return new

    def rollout(
        self,
        state: FullRobotState[HubState],
        commands_kPa: np.ndarray,
        record_every: int = 5,
        record_nodes: bool = True,
        description: dict[str, Any] | None = None,
        *,
        observe: Callable[[FullRobotState[HubState]], None] | None = None,
        progress: bool = False,
    ) -> tuple[FullRobotState[HubState], Trajectory]:
        """Follow commands from a state.

        Args:
            state: Where to start.
            commands_kPa: Real pressure asked for in every step [kPa], (step, regulator).
            record_every: Steps between frames; the start is a frame too.
            record_nodes: Record every node's position.
            description: What else to note in the trajectory's metadata.
            observe: Called with the state after every step.
            progress: Show a progress bar with the time left.

        Returns:
            The last sound state, and the trajectory; its status is ``diverged`` when a step failed
            in its smallest parts, and its metadata then says why.

        Raises:
            ValueError: The commands have a wrong shape or are not finite, or ``record_every`` is no
                number of steps.
        """
        from tqdm.auto import trange

        from pneumorph.fem.full_trajectory import Recorder

        check_record_every(record_every)
        commands = np.atleast_2d(np.asarray(commands_kPa, dtype=float))
        if commands.shape[1] != self.physics.regulator_count:
            raise ValueError(
                f"commands_kPa must have shape (step, {self.physics.regulator_count}), got "
                f"{commands.shape}: one column for each regulator"
            )
        if not np.all(np.isfinite(commands)):
            raise ValueError("commands_kPa must be finite, got NaN or infinity")
        recorder = Recorder(self, record_nodes)
        recorder.record(0, state.regulated_kPa, state)
        status, reason = "completed", None
        with _one_blas_thread():
            for number in trange(len(commands), disable=not progress, unit="step"):
                try:
                    state = self.step(state, commands[number])
                except StepError as error:
                    status, reason = "diverged", str(error)
                    break
                recorder.watch(state)
                if observe is not None:
                    observe(state)
                if (number + 1) % record_every == 0 or number + 1 == len(commands):
                    recorder.record(number + 1, commands[number], state)
        return state, recorder.trajectory(status, reason, description)

    def settled_state(
        self,
        step_count: int = 15,
        *,
        observe: Callable[[FullRobotState[HubState]], None] | None = None,
    ) -> FullRobotState[HubState]:
        """Let the robot fall and settle without pressure, 15 steps in the paper's episodes.

        Args:
            step_count: How many steps.
            observe: Called with the state after every step.

        Raises:
            StepError: A step fails even in the smallest parts.
        """
        state, rest = self.initial_state(), np.zeros(self.physics.regulator_count)
        with _one_blas_thread():
            for _ in range(step_count):
                state = self.step(state, rest)
                if observe is not None:
                    observe(state)
        return state
