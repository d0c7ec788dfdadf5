"""A process of its own that vents the rig when the deploying process dies or falls silent.

Started as ``python -m pneumorph.hardware.guardian`` with a pipe: a line of JSON (rig, process,
record), then a byte for each beat, then ``q`` for a good end. The pipe closes when the deploying
process dies, however it dies. A process that is silent but alive is killed first, for it may hold
the port.
"""

from __future__ import annotations

import json
import os
import select
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

from pneumorph.base.settings import settings_from_dict, settings_to_dict
from pneumorph.hardware.driver import DriverError, RegulatorDriver
from pneumorph.hardware.open_driver import open_driver
from pneumorph.hardware.rig import RigSettings

START_LIMIT_S = 30.0
"""A guardian that is not ready by then has failed [s]."""


class Guardian:
    """The deploying process's end of the pipe.

    Args:
        rig: The rig to guard.
        record: File in which the guardian writes what it did, if it had to act.

    Raises:
        DriverError: The guardian did not start.
    """

    def __init__(self, rig: RigSettings, record: Path) -> None:
        self._process = subprocess.Popen(
            [sys.executable, "-m", "pneumorph.hardware.guardian"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            start_new_session=True,  # Ctrl-C in the terminal is not for the guardian
        )
        order = {"rig": settings_to_dict(rig), "process": os.getpid(), "record": str(record)}
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._pipe = self._process.stdin.fileno()
        self._send(json.dumps(order).encode() + b"\n")
        ready, _, _ = select.select([self._process.stdout], [], [], START_LIMIT_S)
        if not ready or self._process.stdout.readline() != b"ready\n":
            self._process.kill()
            raise DriverError("the guardian process did not start; no run without it")

    def beat(self) -> None:
        """Say that the deploying process is well.

        Raises:
            DriverError: The guardian is gone.
        """
        self._send(b".")

    def dismiss(self, vented: bool) -> None:
        """Say that the run has ended; where it could not vent, the guardian tries once more."""
        if vented:
            with suppress(DriverError):
                self._send(b"q")
        for stream in (self._process.stdin, self._process.stdout):
            if stream is not None:
                stream.close()
        with suppress(subprocess.TimeoutExpired):
            self._process.wait(5.0)

    def _send(self, data: bytes) -> None:
        try:
            os.write(self._pipe, data)
        except OSError as error:
            raise DriverError(f"the guardian process is gone: {error}") from error


def watch(pipe: int, watchdog_s: float) -> str | None:
    """Wait for the end of a run.

    Args:
        pipe: File descriptor of the beats.
        watchdog_s: Longest silence after the first beat [s].

    Returns:
        None for a good end, ``died`` when the pipe closed, ``silent`` after too long a silence.
    """
    timeout: float | None = None
    while True:
        ready, _, _ = select.select([pipe], [], [], timeout)
        if not ready:
            return "silent"
        data = os.read(pipe, 4096)
        if not data:
            return "died"
        if b"q" in data:
            return None
        timeout = watchdog_s


def vent(
    driver: RegulatorDriver,
    attempts: int,
    beat: Callable[[], None] = lambda: None,
    confirmed: bool = False,
) -> list[str]:
    """Send zero until it is taken.

    Args:
        driver: Of the rig.
        attempts: How often, each on a connection made anew.
        beat: Called before each; must not raise.
        confirmed: Whether the rig must answer that it has taken it.

    Returns:
        What went wrong before; empty where the first attempt was taken.

    Raises:
        DriverError: No attempt was taken.
    """
    errors: list[str] = []
    for _ in range(attempts):
        beat()
        try:
            driver.vent()
            if confirmed:
                driver.confirm()
        except Exception as error:  # whatever a driver raises, the next attempt may be taken
            errors.append(str(error))
            driver.close()
        else:
            return errors
    raise DriverError("; ".join(errors))


def main() -> int:
    """Guard a run."""
    order = json.loads(_line(0))
    rig = settings_from_dict(RigSettings, order["rig"])
    driver = open_driver(rig)
    print("ready", flush=True)
    reason = watch(0, rig.safety.watchdog_s)
    if reason is None:
        return 0
    noticed = time.time()
    if reason == "silent":
        with suppress(ProcessLookupError):
            os.kill(order["process"], signal.SIGKILL)
    try:
        errors, vented = vent(driver, rig.safety.vent_attempts, confirmed=True), True
    except DriverError as error:
        errors, vented = [str(error)], False
    record = {
        "deploying_process": reason,
        "noticed_unix_s": noticed,
        "vented": vented,
        "vented_after_s": time.time() - noticed,
        "errors": errors,
    }
    Path(order["record"]).write_text(json.dumps(record, indent=2) + "\n")
    driver.close()
    return 0 if vented else 1


def _line(pipe: int) -> bytes:
    """Read a line and not a byte more."""
    data = b""
    while not data.endswith(b"\n"):
        byte = os.read(pipe, 1)
        if not byte:
            break
        data += byte
    return data


if __name__ == "__main__":
    sys.exit(main())
