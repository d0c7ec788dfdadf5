"""The log of a deployment: a CSV file that is complete up to any moment.

Each row is handed to the operating system before the next command is given, so what a killed
process leaves behind is whole but for the row being written. Events are forced to the disk as well;
samples are not, for a busy disk can take longer than the time between two of them.
"""

from __future__ import annotations

import csv
import os
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from pneumorph.base.artefact import reading
from pneumorph.hardware.measured_table import read_rows, unit_factor

COMMAND = "command"
"""Event of the row that is written just before a command is given."""
STOPPED = "stopped: "
"""How the event begins that says why a run ended before its gait."""


class LogError(OSError):
    """The log cannot be written: the disk is full, gone or read-only."""


class DeploymentLog:
    """Writes rows of time, commanded and sensed pressures, and events.

    Args:
        path: The file; replaced if it exists.
        channel_count: Channels of the rig.
        comments: Named remarks for the head of the file, such as the design.

    Raises:
        LogError: It cannot be written; so does every row and event that is not.
    """

    def __init__(
        self, path: Path | str, channel_count: int, comments: Mapping[str, str] | None = None
    ) -> None:
        path = self._path = Path(path)
        path.parent.mkdir(parents=True, exist_ok=True)
        self._stream = path.open("w", encoding="utf-8", newline="")
        self._channel_count = channel_count
        for name, value in (comments or {}).items():
            self._stream.write(f"# {name}: {value}\n")
        channels = range(1, channel_count + 1)
        commanded = [f"commanded_{n}_kPa" for n in channels]
        sensed = [f"sensed_{n}_kPa" for n in channels]
        self._writer = csv.writer(self._stream, lineterminator="\n")
        self._write(["time_s", *commanded, *sensed, "event"])

    def row(
        self, time_s: float, commanded: np.ndarray, sensed: np.ndarray, event: str = ""
    ) -> None:
        """Write a sample."""
        numbers = ["" if np.isnan(v) else f"{v:.3f}" for v in (*commanded, *sensed)]
        self._write([f"{time_s:.4f}", *numbers, event])

    def command(self, time_s: float, commanded: np.ndarray) -> None:
        """Write what is about to be commanded."""
        self.row(time_s, commanded, np.full(self._channel_count, np.nan), COMMAND)

    def event(self, time_s: float, text: str) -> None:
        """Write an event and force everything so far to the disk."""
        nothing = np.full(self._channel_count, np.nan)
        self.row(time_s, nothing, nothing, text)
        with self._writing():
            os.fsync(self._stream.fileno())

    def close(self) -> None:
        """Close the file; never raises: each row was handed over, or has raised already."""
        with suppress(OSError):
            self._stream.close()

    def __enter__(self) -> DeploymentLog:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _write(self, cells: list[str]) -> None:
        with self._writing():
            self._writer.writerow(cells)
            self._stream.flush()

    @contextmanager
    def _writing(self) -> Iterator[None]:
        try:
            yield
        except OSError as error:
            raise LogError(f"the log {self._path} cannot be written: {error}") from error


@dataclass(frozen=True, eq=False)
class LoggedPressures:
    """What a log holds.

    Attributes:
        time_s: Time of each sample since the gait's start [s], (sample,).
        commanded_kPa: Commanded pressures [real kPa], (sample, channel).
        sensed_kPa: Sensed pressures [real kPa], (sample, channel); NaN without a sensor.
        events: (time, text) of each event.
        commands: Time since the gait's start [s] and pressures [real kPa], (channel,), of each
            command that was noted as it was given.
    """

    time_s: np.ndarray
    commanded_kPa: np.ndarray
    sensed_kPa: np.ndarray
    events: tuple[tuple[float, str], ...]
    commands: tuple[tuple[float, np.ndarray], ...] = ()

    @property
    def given(self) -> tuple[np.ndarray, np.ndarray]:
        """What was known to be commanded from when on: times [s], (command,), that never fall, and
        pressures [real kPa], (command, channel). A command that nobody noted as it was given came
        with the first sample that has it."""
        time_s = np.append(self.time_s, [time_s for time_s, _ in self.commands])
        commanded_kPa = np.vstack([self.commanded_kPa, *(kPa for _, kPa in self.commands)])
        order = np.argsort(time_s, kind="stable")  # of one time, a command is later than a sample
        return time_s[order], commanded_kPa[order]

    def commanded_at(self, time_s: np.ndarray) -> np.ndarray:
        """Pressures that hold at given times [real kPa], (time, channel); before the first command
        that is known, that one."""
        given_s, given_kPa = self.given
        place = np.searchsorted(given_s, time_s + 1e-9, side="right") - 1
        return given_kPa[np.clip(place, 0, None)]

    @property
    def stopped(self) -> tuple[float, str] | None:
        """When and why the run was stopped before the gait's end; None where it was not."""
        for time_s, event in self.events:
            if event.startswith(STOPPED):
                return time_s, event.removeprefix(STOPPED)
        return None

    @property
    def driven_s(self) -> float:
        """Until when the gait is known to have been commanded [s]: the run may have been stopped,
        or the log been cut off. Of a single sample its time, 0 without one."""
        if self.stopped is not None:
            return self.stopped[0]
        if len(self.time_s) < 2:
            return float(self.time_s.sum())
        return float(self.time_s[-1] + np.median(np.diff(self.time_s)))


def read_log(path: Path | str) -> LoggedPressures:
    """Read a log, whole or cut off in its last row; pressures in the units that its header names.

    Raises:
        FileNotFoundError: No such file.
        ValueError: Not a deployment log, a unit that is none of pressure, a row but the last that
            is not whole, or its times fall.
    """
    header, rows = read_rows(path)
    commanded = [i for i, name in enumerate(header) if name.startswith("commanded_")]
    sensed = [i for i, name in enumerate(header) if name.startswith("sensed_")]
    if not commanded or len(commanded) != len(sensed) or header[0] != "time_s":
        raise ValueError(
            f"{path} begins {','.join(header)!r}, expected time_s,commanded_1_kPa,..., "
            "sensed_1_kPa,...,event as deploy writes it"
        )
    names = [header[column] for column in (*commanded, *sensed)]
    units = [unit_factor(path, name, name.rpartition("_")[2], "kPa") for name in names]
    samples: list[list[float]] = []
    given: list[list[float]] = []
    events: list[tuple[float, str]] = []
    event_column = header.index("event") if "event" in header else None
    whole = max(*sensed, -1 if event_column is None else event_column) + 1
    for number, row in enumerate(rows, start=1):
        if len(row) < whole:
            if number == len(rows):
                continue  # the row that was being written when the process was killed
            if len(row) < whole - 1 or event_column != whole - 1:
                raise ValueError(
                    f"{path}, row {number} has {len(row)} cells, expected {whole} as in the header"
                )
            row.append("")  # other programs leave out an empty cell at the end
        with reading(f"{path}, row {number}", "log"):
            if event_column is not None and row[event_column]:
                events.append((float(row[0]), row[event_column]))
            if row[commanded[0]]:
                numbers = [float(v) if v else np.nan for v in row[: max(sensed) + 1]]
                (given if COMMAND in row else samples).append(numbers)
    table = np.array(samples).reshape(-1, max(sensed) + 1)
    falls = np.flatnonzero(~(np.diff(table[:, 0]) >= 0.0))
    if len(falls):
        before, after = table[falls[0] : falls[0] + 2, 0]
        if not np.isfinite([before, after]).all():
            raise ValueError(f"{path}: time_s is missing beside {before:g} s, expected a number")
        raise ValueError(
            f"{path}: time_s falls from {before:g} to {after:g} s, expected times that never fall: "
            "the log may be sorted otherwise, or be of two trials"
        )
    pressures_kPa = table[:, [*commanded, *sensed]] * units
    own, told = np.split(pressures_kPa, [len(commanded)], axis=1)
    noted = np.array(given).reshape(-1, max(sensed) + 1)
    noted_kPa = noted[:, commanded] * units[: len(commanded)]
    commands = tuple(zip(noted[:, 0].tolist(), noted_kPa, strict=True))
    return LoggedPressures(table[:, 0], own, told, tuple(events), commands)
