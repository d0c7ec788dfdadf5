"""What the environment asks of a simulator of many robots."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, Protocol, runtime_checkable

import numpy as np

from pneumorph.robot.design import Design

RUNNING = 0
"""Status of a robot whose simulation is healthy; every other value is a failure."""

RobotBuilder = Callable[[Design], Any]
"""Turns a design into whatever its simulator calls a robot."""


class CrawlingSimulator(Protocol):
    """A batch of robots that advance together; a failure is a status of one robot."""

    def set_robots(self, robots: Sequence[Any]) -> None:
        """Replace every robot (same count) and reset all."""

    def reset(self, active: np.ndarray | None = None) -> None:
        """Put robots back to their initial state.

        Args:
            active: Which robots, shape (robot,) bool; None for all.
        """

    def advance(
        self, command_kPa: np.ndarray, step_count: int, active: np.ndarray | None = None
    ) -> None:
        """Advance by ``step_count`` steps while a command is held.

        Args:
            command_kPa: Real pressures [kPa], shape (robot, regulator).
            step_count: Simulation steps.
            active: Which robots move, shape (robot,) bool; the others stand still. None for all.
        """

    @property
    def forward_position_mm(self) -> np.ndarray:
        """Place of each robot's tracked point along the forward axis [mm], shape (robot,)."""

    @property
    def status(self) -> np.ndarray:
        """Status of each robot, shape (robot,) uint8; `RUNNING` or a failure."""


@runtime_checkable
class RedrawingSimulator(Protocol):
    """A simulator whose physics are drawn at random."""

    def redraw(self, number: int) -> None:
        """Draw new physics, which depend on the number alone, and reset every robot."""


@runtime_checkable
class RangedSimulator(Protocol):
    """A simulator that knows where its robots' parts extrapolate."""

    @property
    def range_ratio(self) -> np.ndarray:
        """How far any part of each robot has been from rest since its reset, or since
        `forget_range`, relative to the furthest state it was made from, shape (robot,); NaN where
        that is not known."""

    def forget_range(self, active: np.ndarray | None = None) -> None:
        """Begin `range_ratio` afresh.

        Args:
            active: Which robots, shape (robot,) bool; None for all.
        """


@runtime_checkable
class LoadedSimulator(Protocol):
    """A simulator that knows what its robots stand on."""

    @property
    def hub_load_share(self) -> np.ndarray:
        """Share of the floor's normal force on each robot that its hub bears at the end of the last
        step, shape (robot,); 0 where nothing touches."""


@runtime_checkable
class LeaningSimulator(Protocol):
    """A simulator that knows whether its robots stand upright."""

    @property
    def tilt_deg(self) -> np.ndarray:
        """Angle between each hub's upward axis and the floor's normal [degrees], shape (robot,)."""


@runtime_checkable
class TurningSimulator(Protocol):
    """A simulator that knows where its robots are besides forwards."""

    @property
    def left_position_mm(self) -> np.ndarray:
        """Place of each robot's tracked point along the axis to the left [mm], shape (robot,)."""

    @property
    def heading_deg(self) -> np.ndarray:
        """Direction of each hub's forward axis in the plane, from forward to the left, -180 to 180
        [degrees], shape (robot,); NaN of one that is tipped over and faces nowhere."""


SimulatorFactory = Callable[[Sequence[Any]], CrawlingSimulator]
"""Makes a simulator of these robots."""
