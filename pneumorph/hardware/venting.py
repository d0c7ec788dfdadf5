"""Whether the pressures fell once zero was commanded: a zero that is taken empties no leg."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from pneumorph.hardware.driver import Clock, RegulatorDriver
from pneumorph.hardware.rig import RigSettings
from pneumorph.hardware.watch import EMPTY_KPA, PressureWatch

MORE_SAMPLES = 3
"""So many more may follow once the slowest healthy regulator is empty: one may be disturbed."""


@dataclass(frozen=True)
class Fall:
    """What the sensors said after zero was commanded."""

    fell: tuple[bool | None, ...]
    """Of each channel; None where nobody sensed it, or what was sensed is no pressure."""
    fault: str | None
    """What the watch found meanwhile, or why nothing was sensed."""
    sensed_kPa: np.ndarray
    """Last reading [kPa], (channel,); NaN where there is none."""
    after_s: float
    """Its time since the first look [s]."""

    @property
    def inflated(self) -> list[int]:
        """Channels whose pressure did not fall, counted from 1."""
        return [number for number, fell in enumerate(self.fell, start=1) if fell is False]

    @property
    def problem(self) -> str | None:
        """Why nobody may call the run a good one; None where all that has a sensor fell."""
        if not self.inflated:
            return self.fault
        named = ", ".join(f"channel {n} still senses {self.sensed_kPa[n - 1]:.1f} kPa"
                          for n in self.inflated)  # fmt: skip
        return (
            f"{self.after_s:.1f} s after zero was commanded {named}: its valve is stuck open or "
            "its vent is blocked"
        )


def fall_text(fell: tuple[bool | None, ...]) -> str:
    """How a run's venting ended, for the one who stands at the rig."""
    inflated = [str(n) for n, each in enumerate(fell, start=1) if each is False]
    unknown = [str(n) for n, each in enumerate(fell, start=1) if each is None]
    if inflated:
        return (
            f"zero was taken but the pressure of channel {', '.join(inflated)} did NOT fall: CUT "
            "THE AIR by hand"
        )
    if unknown:
        return (
            f"vented, but nobody sensed whether the pressure of channel {', '.join(unknown)} "
            "fell: look before you touch the robot"
        )
    return "vented, and the pressure fell"


def sense_until_fallen(
    driver: RegulatorDriver,
    watch: PressureWatch,
    rig: RigSettings,
    clock: Clock,
    start_s: float,
    beat: Callable[[], None],
    told: Callable[[float, np.ndarray, np.ndarray], None],
) -> Fall:
    """Sample until the slowest healthy regulator has vented, and see whether all did.

    Ends `PressureWatch.closing_s` and a few samples after it began at the latest, and one answer.

    Args:
        driver: It has taken zero.
        watch: Goes on from the run's samples.
        rig: Its interval of samples and its sensors.
        clock: The run's.
        start_s: Time of the clock at which the run's time is zero [s].
        beat: Called before and after each sample; must not raise.
        told: Called with time [s], commands and readings [kPa] of each sample; must not raise.
    """
    sensors, zero = rig.has_sensor, np.zeros(len(rig.channels))
    last = np.full(len(zero), np.nan)
    fell: tuple[bool | None, ...] = (None,) * len(zero)
    if not sensors.any():
        return Fall(fell, None, last, 0.0)
    began_s = now_s = clock.now_s() - start_s
    end_s = began_s + watch.closing_s + MORE_SAMPLES * rig.sample_interval_s
    # A clock that stands still must not keep it here.
    most = 2 * math.ceil((end_s - began_s) / rig.sample_interval_s)
    fault: str | None = None
    silence: str | None = None
    for _ in range(most):
        try:
            clock.wait_until(start_s + now_s + rig.sample_interval_s)
            beat()
            last, silence = driver.sense(), None
        except Exception as error:  # whatever it is, the next answer may come
            silence = f"after venting nothing is sensed: {error}"
        beat()
        now_s = clock.now_s() - start_s
        if silence is None:
            told(now_s, zero, last)
            found = watch.fault(now_s, zero, last)  # its band goes on after a fault too
            fault = fault or found
            fell = _fell(watch, rig, last)
        all_fell = all(each for each, sensed in zip(fell, sensors, strict=True) if sensed)
        if all_fell or now_s >= end_s:
            break
    return Fall(fell, fault or silence, last, now_s - began_s)


def _fell(watch: PressureWatch, rig: RigSettings, sensed: np.ndarray) -> tuple[bool | None, ...]:
    """Of each channel; None while a healthy regulator may still be full, and where it is unknown.

    A reading below what the watch allows is no pressure: it says nothing of the leg.
    """
    most_off = rig.safety.residual_kPa
    if watch.highest_kPa.max() > EMPTY_KPA:
        return (None,) * len(sensed)
    return tuple(
        bool(value <= highest + most_off) if known and value >= -most_off else None
        for value, highest, known in zip(sensed, watch.highest_kPa, rig.has_sensor, strict=True)
    )
