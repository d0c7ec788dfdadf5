"""The task: what an action is, how long an episode lasts, how a command becomes a pressure."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from pneumorph.base.checked import Checked, Count, CountOrNone, NotNegative, check_range
from pneumorph.environment.goal import Goal
from pneumorph.environment.reward import RewardWeights
from pneumorph.physics.commands import HIGHEST_COMMAND_KPA, RegulatorCount, check_commands


@dataclass(frozen=True)
class CrawlingTask(Checked):
    """Crawl as far forward as possible in one episode, open loop.

    The defaults are the paper's (section IV and appendix A); the numbers its text leaves out are
    from the authors' experiment.
    """

    regulator_count: RegulatorCount = 3
    """Number M of pressure regulators; an action has one number for each."""
    action_step_count: Count = 100
    """Time steps for which an action is held (100 of 0.01 s are 1 s)."""
    action_count: Count = 20
    """Actions in one episode (20 actions of 1 s are 20 s)."""
    settling_step_count: CountOrNone = 15
    """Time steps at zero pressure at the start, in which the robot settles on the floor."""
    remembered_action_count: Count = 4
    """Number of most recent actions in the observation."""
    minimum_pressure_kPa: NotNegative = 0.0
    """Real pressure that an action of -1 commands [kPa]."""
    maximum_pressure_kPa: float = HIGHEST_COMMAND_KPA
    """Real pressure that an action of 1 commands [kPa]; above it PneuNets form aneurysms."""
    time_limit_is_terminal: bool = True
    """Whether the last action of an episode counts as a terminal state (the paper). If not, the
    learner bootstraps there, as if the episode went on."""
    reward: RewardWeights = field(default_factory=RewardWeights)
    """The goal, and what is subtracted from the distance."""

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.minimum_pressure_kPa >= self.maximum_pressure_kPa:
            raise ValueError(
                f"pressures from {self.minimum_pressure_kPa} to {self.maximum_pressure_kPa} kPa, "
                "expected 0 <= minimum_pressure_kPa < maximum_pressure_kPa"
            )

    @property
    def goal(self) -> Goal:
        """What counts of a walk."""
        return self.reward.counted

    @property
    def state_size(self) -> int:
        """Numbers of the observation that tell the remembered actions."""
        return self.remembered_action_count * self.regulator_count

    def action_s(self, time_step_s: float) -> float:
        """How long an action is held [s], with steps of a length [s]."""
        return self.action_step_count * time_step_s

    def walk_s(self, time_step_s: float) -> float:
        """How long an episode lasts after settling [s], with steps of a length [s]."""
        return self.action_count * self.action_step_count * time_step_s

    def pressure_kPa(self, action: np.ndarray) -> np.ndarray:
        """Real pressure that an action commands [kPa]: [-1, 1] maps linearly onto the range.

        Args:
            action: shape (..., regulator), each from -1 to 1.

        Raises:
            ValueError: A number is not finite or out of range.
        """
        action = np.asarray(action, dtype=np.float64)
        self.check_action(action)
        span = self.maximum_pressure_kPa - self.minimum_pressure_kPa
        return self.minimum_pressure_kPa + 0.5 * (action + 1.0) * span

    def action(self, pressure_kPa: np.ndarray) -> np.ndarray:
        """Action that commands a real pressure, the inverse of `pressure_kPa`.

        Args:
            pressure_kPa: shape (..., regulator) [kPa].

        Raises:
            ValueError: A pressure is not finite or out of range.
        """
        pressure_kPa = np.asarray(pressure_kPa, dtype=np.float64)
        check_commands(
            pressure_kPa, self.maximum_pressure_kPa, self.minimum_pressure_kPa, "pressure_kPa"
        )
        span = self.maximum_pressure_kPa - self.minimum_pressure_kPa
        return 2.0 * (pressure_kPa - self.minimum_pressure_kPa) / span - 1.0

    def check_action(self, action: np.ndarray) -> None:
        """Raise `ValueError` unless every action is finite and from -1 to 1."""
        if action.ndim == 0 or action.shape[-1] != self.regulator_count:
            raise ValueError(
                f"action has shape {action.shape}, expected (..., regulator) = "
                f"(..., {self.regulator_count}): one number for each regulator"
            )
        check_range(action, -1.0, 1.0, "action", "clip the policy's output to the action space")
