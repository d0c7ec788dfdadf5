"""Drive a rig through a schedule, watch it, and vent it whatever happens."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np

from pneumorph.base.progress import ProgressReport
from pneumorph.hardware.deployment_log import STOPPED, DeploymentLog, LogError
from pneumorph.hardware.driver import Clock, DriverError, ForeignDeviceError, RegulatorDriver
from pneumorph.hardware.guardian import vent
from pneumorph.hardware.rig import RigSettings
from pneumorph.hardware.schedule import Schedule, count_skipped
from pneumorph.hardware.venting import fall_text, sense_until_fallen
from pneumorph.hardware.watch import PressureWatch

NOT_VENTED = "NOT VENTED: cut the supply by hand"


class Beats(Protocol):
    """A guardian's near end."""

    def beat(self) -> None:
        """Say that the deploying process is well."""


@dataclass(frozen=True)
class DeploymentReport:
    """How a run ended."""

    completed: bool
    """Whether the whole schedule was followed."""
    reason: str
    """``completed``, or why the run was stopped."""
    ended_s: float
    """When it ended, since the gait's start [s]."""
    vented: bool
    """Whether zero was taken at the end: the rig says so, after a fault over a new connection, or
    all pressures fell."""
    vent_time_s: float
    """From the end or the fault's discovery to the first zero command [s]."""
    worst_delay_s: float
    """Latest command after its time in the schedule [s]."""
    sample_count: int
    """Samples logged."""
    pressure_fell: tuple[bool | None, ...] = field(default=(), kw_only=True)
    """Of each channel, whether its pressure fell once zero was taken; None where nobody sensed it.
    Empty in reports of earlier versions."""
    skipped_count: int = field(default=0, kw_only=True)
    """Commands that were never sent: the next was due when the rig had taken the one before."""

    @property
    def ending(self) -> str:
        """How its venting went, for the one who stands at the rig."""
        return fall_text(self.pressure_fell) if self.vented else NOT_VENTED


def deploy(
    schedule: Schedule,
    driver: RegulatorDriver,
    rig: RigSettings,
    log: DeploymentLog,
    clock: Clock,
    guardian: Beats | None = None,
    progress: ProgressReport | None = None,
) -> DeploymentReport:
    """Follow a schedule.

    The run stops and vents on Ctrl-C, SIGTERM, SIGHUP, a lost connection, a late or senseless
    answer, a log that cannot be written, and on whatever `PressureWatch` finds. It never returns
    without having tried to vent, and having seen whether the pressures fell where they are sensed.

    Args:
        schedule: The commands.
        driver: The rig's driver, not opened yet.
        rig: Timing and limits.
        log: Where samples and events go; every row is written before the next command.
        clock: The wall's, or the virtual rig's.
        guardian: Told that this process lives; None where it needs none (the virtual rig).
        progress: Told how many commands are done.

    Raises:
        ForeignDeviceError: Another device than the rig's answers; nothing was commanded, and so
            nothing is vented.
        ValueError: The rig is none that can be watched; nothing has been sent yet.
    """
    state = _Run(schedule, driver, rig, log, clock, guardian, progress)
    reason = "completed"
    with _signals_noted() as signals:
        try:
            driver.open()
            state.follow(signals)
        except ForeignDeviceError as error:
            driver.close()
            with suppress(LogError):
                log.event(0.0, f"{STOPPED}{error}")
            raise
        except (DriverError, LogError, ValueError) as error:
            reason = str(error)
        except BaseException as error:
            # An error of our own must not leave a robot inflated either.
            report = state.stop(f"{type(error).__name__}: {error}", signals)
            error.add_note(f"The run was stopped: {report.ending}")
            raise
        return state.stop(reason, signals)


class _Run:
    """The state of one run."""

    def __init__(
        self,
        schedule: Schedule,
        driver: RegulatorDriver,
        rig: RigSettings,
        log: DeploymentLog,
        clock: Clock,
        guardian: Beats | None,
        progress: ProgressReport | None,
    ) -> None:
        self._schedule, self._driver, self._rig = schedule, driver, rig
        self._log, self._clock = log, clock
        self._guardian, self._progress = guardian, progress
        self._watch = PressureWatch(rig)
        self._start_s = clock.now_s()
        self._worst_delay_s = 0.0
        self._sample_count = 0
        self._places: list[int] = []
        self._log_problem: str | None = None
        self._zero = np.zeros(len(rig.channels))

    def follow(self, signals: list[str]) -> None:
        """Give the commands in time and look at the sensors in between.

        Args:
            signals: Names of the signals that came; the first one ends the run.
        """
        schedule, rig = self._schedule, self._rig
        given, commanded = -1, np.zeros(schedule.pressure_kPa.shape[1])
        self._start_s = self._clock.now_s()
        self._log.event(0.0, "start")
        next_s = 0.0
        while True:
            self._clock.wait_until(self._start_s + next_s)
            if signals:
                raise DriverError(f"stopped by {signals[0]}")
            now = self._now()
            late = self._watch.late(now)
            if late is not None:
                raise DriverError(late)
            self._beat()
            place = min(schedule.place(now), len(schedule.time_s) - 1)
            if place > given:
                # A command that was missed is skipped: what counts is what holds now.
                self._places.append(place)
                self._worst_delay_s = max(self._worst_delay_s, now - schedule.time_s[given + 1])
                commanded = schedule.pressure_kPa[place]
                self._log.command(now, commanded)
                self._driver.command(commanded)
                given = place
                self._beat()
                if self._progress is not None:
                    self._progress(given + 1, len(schedule.time_s), "deploying")
            sensed = self._driver.sense()
            self._beat()  # the next one comes a sample later
            now = self._now()
            self._log.row(now, commanded, sensed)
            self._sample_count += 1
            fault = self._watch.fault(now, commanded, sensed)
            if fault is not None:
                raise DriverError(fault)
            if given == len(schedule.time_s) - 1:
                return
            # The next sample, or the next command if that is sooner.
            next_s = min(now + rig.sample_interval_s, float(schedule.time_s[given + 1]))

    def stop(self, reason: str, signals: list[str]) -> DeploymentReport:
        """Vent, log how it ended, see whether the pressures fall, and let go of the rig.

        Args:
            reason: Why; ``completed`` where the schedule was followed.
            signals: Names of the signals that came; one that comes now is told as well.
        """
        found_s = self._now()
        completed = reason == "completed"
        attempts = self._rig.safety.vent_attempts
        try:
            errors, sent = vent(self._driver, attempts, self._calm_beat), True
        except DriverError as error:
            errors, sent = [str(error)], False
        vent_time_s = self._now() - found_s
        doubt = self._doubt(anew=not completed) if sent else None
        if doubt is not None and completed:
            doubt = self._doubt(anew=True)
        if doubt is not None:
            errors = [*errors, doubt]
        self._calm_beat()
        with self._logging():
            if not completed:
                self._log.command(found_s, self._zero)
                self._log.event(found_s, STOPPED + reason)
            for error_text in errors:
                self._log.event(self._now(), f"vent failed: {error_text}")
            if doubt is None:
                self._log.event(self._now(), "vented" if sent else NOT_VENTED)
        fell, after = self._fall() if sent else ((None,) * len(self._zero), None)
        vented = sent and (doubt is None or all(fell))
        if doubt is not None:
            with self._logging():
                self._log.event(self._now(), "vented" if vented else NOT_VENTED)
        self._driver.close()
        if not vented:
            after = after or f"zero was not taken: {errors[-1]}"
        if signals:
            after = after or f"stopped by {signals[0]}"
        after = after or self._log_problem
        if completed and after is not None:
            completed, reason = False, after
        return DeploymentReport(
            completed,
            reason,
            found_s,
            vented,
            vent_time_s,
            self._worst_delay_s,
            self._sample_count,
            pressure_fell=fell,
            skipped_count=count_skipped(self._places),
        )

    def _doubt(self, anew: bool) -> str | None:
        """Why nobody knows that the rig took zero; None where it says so.

        Args:
            anew: Send it again on a connection made anew: it may have gone into a dead wire.
        """
        try:
            if anew:
                self._driver.close()
                self._driver.vent()
                self._calm_beat()
            self._driver.confirm()
        except Exception as error:  # whatever it is, nobody has confirmed the zero
            return str(error)
        finally:
            self._calm_beat()
        return None

    def _fall(self) -> tuple[tuple[bool | None, ...], str | None]:
        """Sense whether the pressures fall; of each channel, and what went wrong meanwhile."""

        def told(time_s: float, commanded: np.ndarray, sensed: np.ndarray) -> None:
            with self._logging():
                self._log.row(time_s, commanded, sensed)
                self._sample_count += 1

        fall = sense_until_fallen(
            self._driver, self._watch, self._rig, self._clock, self._start_s, self._calm_beat, told
        )
        if fall.inflated:
            with self._logging():
                self._log.event(self._now(), f"NOT EMPTY: {fall.problem}: CUT THE AIR by hand")
        return fall.fell, fall.problem

    @contextmanager
    def _logging(self) -> Iterator[None]:
        """Note that the log cannot be written instead of raising: venting goes on."""
        try:
            yield
        except LogError as error:
            self._log_problem = str(error)

    def _now(self) -> float:
        return self._clock.now_s() - self._start_s

    def _beat(self) -> None:
        if self._guardian is not None:
            self._guardian.beat()

    def _calm_beat(self) -> None:
        """The same while venting, which goes on where the guardian is gone."""
        with suppress(DriverError):
            self._beat()


_SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


@contextmanager
def _signals_noted() -> Iterator[list[str]]:
    """Note signals instead of raising: venting must not be interrupted by a second Ctrl-C."""
    came: list[str] = []
    if threading.current_thread() is not threading.main_thread():
        yield came  # signals are the main thread's
        return

    def note(number: int, frame: Any) -> None:
        came.append(signal.Signals(number).name)

    before = {number: signal.signal(number, note) for number in _SIGNALS}
    try:
        yield came
    finally:
        for number, earlier in before.items():
            signal.signal(number, earlier)
