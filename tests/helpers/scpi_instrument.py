"""A 9129B on a network socket that can be made to fail: what the fault tests talk to."""

from __future__ import annotations

import math
import socket
import threading
import time
from contextlib import suppress


class ScpiInstrument:
    """Answers like the supply, notes what it was told and when, and fails as it is asked to.

    The faults: ``silent`` answers nothing, ``late`` a second late, ``garbage`` senselessly, ``cut``
    drops the connection (and accepts a new one). Commands are still obeyed.

    Args:
        busy_s: It loses what reaches it so soon after the message before [s].
    """

    def __init__(self, busy_s: float = 0.0) -> None:
        self._busy_s, self._told_at = busy_s, -math.inf
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.port = self._listener.getsockname()[1]
        self.fault = ""
        self.volts: list[tuple[float, tuple[float, ...]]] = []
        self.lock = threading.Lock()
        self._connections: list[socket.socket] = []
        threading.Thread(target=self._accept, daemon=True).start()

    @property
    def resource(self) -> str:
        return f"TCPIP::127.0.0.1::{self.port}::SOCKET"

    def fail(self, fault: str) -> float:
        """Fail from now on; returns when that is."""
        self.fault = fault
        if fault == "cut":
            self._drop()
        return time.monotonic()

    def zeroed_after(self, moment: float) -> float | None:
        """Time from a moment to the next zero command [s], None if none comes within a second."""
        end = time.monotonic() + 1.0
        while True:
            with self.lock:
                found = [t - moment for t, v in self.volts if t >= moment and not any(v)]
            if found or time.monotonic() > end:
                return found[0] if found else None
            time.sleep(0.005)

    def last_volts(self) -> tuple[float, ...]:
        with self.lock:
            return self.volts[-1][1]

    def close(self) -> None:
        with suppress(OSError):
            self._listener.shutdown(socket.SHUT_RDWR)
        self._listener.close()
        self._drop()

    def _drop(self) -> None:
        for connection in self._connections:
            with suppress(OSError):  # it may be gone already
                connection.shutdown(socket.SHUT_RDWR)

    def _accept(self) -> None:
        while True:
            try:
                connection, _ = self._listener.accept()
            except OSError:
                return
            self._connections.append(connection)
            threading.Thread(target=self._serve, args=(connection,), daemon=True).start()

    def _serve(self, connection: socket.socket) -> None:
        received = b""
        try:
            while data := connection.recv(4096):
                received += data
                while b"\n" in received:
                    line, received = received.split(b"\n", 1)
                    self._obey(line.decode().strip(), connection)
        except OSError:
            return

    def _obey(self, message: str, connection: socket.socket) -> None:
        with self.lock:
            busy = time.monotonic() - self._told_at < self._busy_s
            self._told_at = time.monotonic()
        if busy:
            return
        if message.startswith("APP:VOLT "):
            volts = tuple(float(v) for v in message.removeprefix("APP:VOLT").split(","))
            with self.lock:
                self.volts.append((time.monotonic(), volts))
        if not message.endswith("?") or self.fault == "silent":
            return
        answer = {"*IDN?": "B&K Precision, 9129B, 123456, 1.0"}.get(message, "0,'No Error'")
        if message == "APP:VOLT?":
            answer = ",".join(f"{volt:.3f}" for volt in self.last_volts())
        if self.fault == "garbage":
            answer = "\x07#!"
        if self.fault == "late":
            threading.Timer(1.0, self._answer, (answer, connection)).start()
        else:
            self._answer(answer, connection)

    def _answer(self, answer: str, connection: socket.socket) -> None:
        with suppress(OSError):  # nobody may be waiting any more
            connection.sendall(answer.encode() + b"\n")
