"""A virtual rig of one easy robot, with regulators and sensors that break when they are told."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from pneumorph.hardware.rig import RigSettings
from pneumorph.hardware.virtual_rig import VirtualRegulators, VirtualRig, VirtualRigSettings
from pneumorph.physics.regulators import AirRegulators, RateLimited
from pneumorph.trajectory import Trajectory

STEP_S = 0.02
"""Time step of the regulators [s]; the tests' time is mostly theirs."""


def push(pressure_kPa: np.ndarray) -> Trajectory:
    """A robot that moves one millimetre a step for each kPa of regulator 1."""
    x = np.concatenate([[0.0], np.cumsum(pressure_kPa[:, 0])])
    count = len(x)
    places = np.column_stack([x, np.zeros(count), np.zeros(count)])
    return Trajectory(
        np.arange(count) * 0.01, places, np.tile(np.eye(3), (count, 1, 1)), places,
        np.zeros((count, 3)), np.zeros((count, 3)), np.zeros(count),
    )  # fmt: skip


Valve = Callable[[float, float, float], float]
"""Pressure before a step, after a healthy one, and time since the fault [s] -> after the step."""

Sensor = Callable[[float, float], float]
"""Reading of a healthy sensor, and time since the fault [s] -> reading."""


@dataclass(frozen=True)
class Fault:
    """What breaks in a channel; by default nothing."""

    valve: Valve = lambda before, healthy, since_s: healthy
    sensor: Sensor = lambda reading, since_s: reading


class _Regulators(VirtualRegulators):
    """Regulators one of which breaks, beside others of the same commands that stay healthy."""

    def __init__(self, fault: Fault, channel: int, at_s: float, *arguments: Any) -> None:
        super().__init__(*arguments)
        self.healthy = VirtualRegulators(*arguments)
        self._fault, self._channel, self._at_s = fault, channel, at_s
        self.time_s = 0.0

    @property
    def broken_for_s(self) -> float:
        """Time since the fault [s]; negative before it."""
        return self.time_s - self._at_s

    def step(self) -> None:
        self.healthy.target_kPa = self.target_kPa
        self.healthy.step()
        before = float(self.pressure_kPa[self._channel])
        super().step()
        self.time_s += self.time_step_s
        if self.broken_for_s > 0.0:
            after = float(self.pressure_kPa[self._channel])
            self.pressure_kPa[self._channel] = self._fault.valve(before, after, self.broken_for_s)


class FaultyRig(VirtualRig):
    """A virtual rig one of whose channels breaks.

    Args:
        fault: How.
        channel: Which channel, counted from 0.
        at_s: When [s].
        lag_s: Of the regulators [s].
        seed: Of the noise.
        rig: Its settings; the usual ones by default.
        air: Its regulators where air flows; None where the rig's rate tells.

    Attributes:
        settings: Of the rig.
        residuals: Time [s] and reading over what a healthy regulator of that lag has [kPa], of
            each sample of the channel.
    """

    def __init__(
        self,
        fault: Fault,
        channel: int = 0,
        at_s: float = 0.0,
        lag_s: float = 0.1,
        seed: int = 0,
        rig: RigSettings | None = None,
        air: AirRegulators | None = None,
    ) -> None:
        rig = self.settings = rig or RigSettings()
        moving = air or RateLimited(rig.rate_kPa_per_s)
        super().__init__(push, rig, VirtualRigSettings(seed=seed), lag_s, STEP_S)
        self.regulators = self._broken = _Regulators(
            fault, channel, at_s, len(rig.channels), moving, lag_s, STEP_S
        )
        self._channel, self._fault = channel, fault
        self.residuals: list[tuple[float, float]] = []

    def sense(self) -> np.ndarray:
        reading, since_s = super().sense(), self._broken.broken_for_s
        if since_s > 0.0:
            reading[self._channel] = self._fault.sensor(float(reading[self._channel]), since_s)
        healthy = self._broken.healthy.pressure_kPa[self._channel]
        self.residuals.append((self._broken.time_s, float(reading[self._channel] - healthy)))
        return reading
