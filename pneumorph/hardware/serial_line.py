"""Lines of text over a serial port, with a limit on the wait for an answer."""

from __future__ import annotations

import termios
import time
from contextlib import suppress
from typing import Any

from pneumorph.base.optional_package import optional_package
from pneumorph.hardware.driver import DriverError

START_S = 3.0
"""How long a board that resets when its port is opened may be deaf [s]: one to two seconds of an
Arduino's boot loader."""


class SerialLine:
    """A serial port that is asked and answers, a line each.

    Args:
        port: Its name, such as /dev/ttyACM0.
        baud_rate: Bits a second.
        reply_timeout_s: Longest wait for an answer [s].
    """

    def __init__(self, port: str, baud_rate: int, reply_timeout_s: float) -> None:
        self._port, self._baud_rate, self._timeout_s = port, baud_rate, reply_timeout_s
        self._line: Any = None
        self._serial = optional_package("serial", "serial ports need pyserial", "hardware")

    @property
    def is_open(self) -> bool:
        """Whether the port is open."""
        return self._line is not None

    def open(self) -> None:
        """Open the port, so that closing it or dying leaves its control lines as they are: a board
        that resets when they rise is not reset by who opens it next, to vent.

        Raises:
            DriverError: It does not open.
        """
        self.close()
        try:
            self._line = self._serial.Serial(
                self._port, self._baud_rate, timeout=0.02, write_timeout=self._timeout_s
            )
        except (OSError, ValueError) as error:
            raise DriverError(f"serial port {self._port} does not open: {error}") from error
        with suppress(termios.error, OSError):  # what is no terminal has no such lines
            _keep_control_lines(self._line.fileno())

    def greet(self, text: str) -> str:
        """Ask until something answers: a board may have been reset by the opening of its port.

        Raises:
            DriverError: Nothing has after `START_S`.
        """
        end = time.monotonic() + START_S
        while True:
            try:
                return self.ask(text)
            except DriverError:
                if time.monotonic() > end:
                    raise

    def send(self, text: str) -> None:
        """Send a line.

        Raises:
            DriverError: The port is closed or gone.
        """
        if self._line is None:
            raise DriverError(f"serial port {self._port} is not open, {text!r} was not sent")
        try:
            self._line.reset_input_buffer()
            self._line.write((text + "\n").encode())
        except Exception as error:  # pyserial lets termios.error through, which is no OSError
            raise DriverError(
                f"serial port {self._port}: {text!r} was not sent: {error}"
            ) from error

    def ask(self, text: str) -> str:
        """Send a line and return the answer.

        Raises:
            DriverError: No whole line came in time.
        """
        self.send(text)
        end, answer = time.monotonic() + self._timeout_s, b""
        try:
            while not answer.endswith(b"\n"):
                if time.monotonic() > end:
                    raise DriverError(
                        f"serial port {self._port} did not answer {text!r} within "
                        f"{self._timeout_s:g} s, got {answer!r}"
                    )
                answer += self._line.readline()
        except DriverError:
            raise
        except Exception as error:
            raise DriverError(f"serial port {self._port} is lost: {error}") from error
        return answer.decode(errors="replace").strip()

    def close(self) -> None:
        """Close the port; never raises."""
        if self._line is not None:
            with suppress(Exception):  # the device may be gone already
                self._line.close()
            self._line = None


def _keep_control_lines(port: int) -> None:
    settings = termios.tcgetattr(port)
    settings[2] &= ~termios.HUPCL
    termios.tcsetattr(port, termios.TCSANOW, settings)


def numbers(answer: str, count: int, asked: str) -> list[float]:
    """Read an answer of so many comma-separated numbers.

    Raises:
        DriverError: It is none.
    """
    try:
        values = [float(text) for text in answer.split(",")]
    except ValueError:
        values = []
    if len(values) != count:
        raise DriverError(f"the answer to {asked!r} is {answer!r}, expected {count} numbers")
    return values
