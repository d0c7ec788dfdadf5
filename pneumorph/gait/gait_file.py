"""Gaits as plain CSV files that a spreadsheet, a regulator's script or a person can read.

Comment lines (``# design: 1.0.0.2.2.0.0.1``) may say whom the gait is for. The header names the
columns with their units, ``time_s,regulator_1_kPa,regulator_2_kPa,...``. Each row gives the real
pressures commanded from its time until the next row's; the last row repeats the row before it and
marks the end. A last row of other pressures would be a command without an end: it is refused, and
the message says which line to append.

Pressures above `HIGHEST_COMMAND_KPA` are refused, unless the line ``# maximum_pressure_kPa: 120``
says that the gait is meant to go higher in simulation.
"""

from __future__ import annotations

import csv
import re
from collections.abc import Mapping, Sequence
from itertools import pairwise
from pathlib import Path

import numpy as np

from pneumorph.base.artefact import read_text, reading, write_text
from pneumorph.base.checked import rises
from pneumorph.gait.held_gait import HeldGait
from pneumorph.physics.commands import HIGHEST_COMMAND_KPA

LIMIT = "maximum_pressure_kPa"
"""Comment that names the highest pressure of a gait that goes above the usual limit."""

UNIT = "kPa_per_unit"
"""Comment of a sorotraj file that says what one unit of its pressures is [kPa]."""

_SAID_ONCE = ("design", LIMIT, UNIT)
"""Comments that are read: two different values would leave open which one counts."""

LEAST_PEAK_KPA = 1.0
"""Least peak of a gait [kPa]: no valve holds a hundredth of what moves a leg."""

_COMMENT = re.compile(r"#\s*(?P<name>\w+)\s*:\s*(?P<value>.*)")


def remark_lines(
    comments: Mapping[str, str] | None, maximum_kPa: float, peak_kPa: float
) -> list[str]:
    """Comment lines of named remarks, and of `LIMIT` if the gait may go above or stays below the
    usual limit. A gait without a limit (infinite) goes as high as its peak: a file names a number.

    Args:
        comments: The remarks, by name.
        maximum_kPa: Highest pressure that the gait may have [kPa].
        peak_kPa: Highest that it has [kPa].
    """
    if not np.isfinite(maximum_kPa):
        maximum_kPa = max(peak_kPa, HIGHEST_COMMAND_KPA)
    usual = maximum_kPa == HIGHEST_COMMAND_KPA
    limit = {} if usual else {LIMIT: repr(float(maximum_kPa))}
    return [f"# {name}: {value}" for name, value in {**(comments or {}), **limit}.items()]


def write_gait(path: Path | str, gait: HeldGait, comments: Mapping[str, str] | None = None) -> Path:
    """Write a gait; `read_gait` reads back the same numbers.

    Args:
        path: Where to write.
        gait: The gait.
        comments: Named remarks such as ``{"design": "1.0.0.2.2.0.0.1"}``, one line each.
    """
    lines = remark_lines(comments, gait.maximum_pressure_kPa, float(gait.held_kPa.max()))
    columns = [f"regulator_{number}_kPa" for number in range(1, gait.regulator_count + 1)]
    lines.append(",".join(["time_s", *columns]))
    times = [*gait.start_s, gait.duration_s]
    for time_s, pressures in zip(times, [*gait.held_kPa, gait.held_kPa[-1]], strict=True):
        # repr is the shortest text that reads back to the same double.
        lines.append(",".join(repr(float(value)) for value in (time_s, *pressures)))
    text = "\n".join(lines) + "\n"
    return write_text(path, text)


def read_gait(
    path: Path | str,
    minimum_pressure_kPa: float = 0.0,
    maximum_pressure_kPa: float | None = None,
) -> tuple[HeldGait, dict[str, str]]:
    """Read a gait file.

    Args:
        path: The file.
        minimum_pressure_kPa: Lowest real pressure that is accepted [kPa].
        maximum_pressure_kPa: Highest real pressure that is accepted [kPa]; None for what the file
            names, or else `HIGHEST_COMMAND_KPA`.

    Returns:
        The gait, and its comments by name.

    Raises:
        FileNotFoundError: No such file.
        ValueError: Not a gait file, a pressure that is not finite or out of range, or a comment
            that is read has two values.
    """
    path = Path(path)
    every_line = read_text(path, "gait").splitlines()
    comments = _named_remarks(path, every_line)
    lines = [line for line in every_line if line.strip()]
    with reading(path, "gait"):
        rows = list(csv.reader(line for line in lines if not line.startswith("#")))
    if not rows or not _is_header(rows[0]):
        raise ValueError(
            f"gait file {path} begins {','.join(rows[0]) if rows else 'with nothing'!r}, expected "
            "the header time_s,regulator_1_kPa,regulator_2_kPa,...; the units are part of it"
        )
    if len(rows) < 3:
        raise ValueError(
            f"gait file {path} has {len(rows) - 1} rows, expected at least 2: a command and the "
            "end of the gait"
        )
    table = np.array([_numbers(path, row, len(rows[0])) for row in rows[1:]])
    if not np.array_equal(table[-1, 1:], table[-2, 1:], equal_nan=True) and rises(table[:, 0]):
        end_s = 2.0 * table[-1, 0] - table[-2, 0]
        missing = ",".join(f"{value:.12g}" for value in (end_s, *table[-1, 1:]))
        raise ValueError(
            f"gait file {path} ends in a new command at {table[-1, 0]:g} s and does not say how "
            "long it is held, expected a last row that repeats its pressures and marks the end; "
            f"append the line {missing} to hold it as long as the one before"
        )
    for row, (before_s, time_s) in enumerate(pairwise(table[:, 0].tolist()), start=2):
        if not time_s > before_s:
            raise ValueError(
                f"gait file {path}, row {row}: time_s is {time_s:g} after {before_s:g}, expected "
                "times that rise"
            )
    try:
        if maximum_pressure_kPa is None:
            maximum_pressure_kPa = _named_limit(comments)
        gait = HeldGait(
            table[:-1, 0],
            table[:-1, 1:],
            float(table[-1, 0]),
            minimum_pressure_kPa,
            maximum_pressure_kPa,
        )
    except ValueError as error:
        raise ValueError(f"gait file {path}: {error}") from error
    check_peak(path, float(gait.held_kPa.max()))
    return gait, comments


def check_peak(path: Path | str, largest_kPa: float) -> None:
    """Refuse a gait in another unit.

    Args:
        path: Its file.
        largest_kPa: Its highest pressure [kPa].

    Raises:
        ValueError: It is so low that no valve holds it.
    """
    if 0.0 < largest_kPa < LEAST_PEAK_KPA:
        raise ValueError(
            f"gait file {path}: its pressures go up to {largest_kPa:g} kPa, expected "
            f"{LEAST_PEAK_KPA:g} kPa or more, or none at all: they may be in MPa or bar"
        )


def gait_remarks(path: Path | str) -> dict[str, str]:
    """Named remarks of a gait's file, whichever format it has: lines such as ``# design: 1.2.3``.

    Raises:
        FileNotFoundError: No such file.
        ArtefactError: It is no text.
        ValueError: One that is read has two values.
    """
    return _named_remarks(path, read_text(path, "gait").splitlines())


def _named_remarks(path: Path | str, lines: Sequence[str]) -> dict[str, str]:
    found: dict[str, str] = {}
    first: dict[str, int] = {}
    for number, line in enumerate(lines, start=1):
        match = _COMMENT.match(line)
        if match is None:
            continue
        name, value = match["name"], match["value"].strip()
        if name in _SAID_ONCE and found.get(name, value) != value:
            raise ValueError(
                f"gait file {path}: {name} is {found[name]!r} in line {first[name]} and {value!r} "
                f"in line {number}, expected one value: two files may have been put together; "
                "delete the line that is wrong"
            )
        found[name] = value
        first.setdefault(name, number)
    return found


def _named_limit(comments: Mapping[str, str]) -> float:
    named = comments.get(LIMIT, repr(HIGHEST_COMMAND_KPA))
    try:
        limit = float(named)
    except ValueError:
        limit = float("nan")
    if not 0.0 < limit < float("inf"):
        raise ValueError(f"{LIMIT} is {named!r}, expected a positive number of kPa")
    return limit


def _is_header(row: list[str]) -> bool:
    expected = ["time_s", *(f"regulator_{number}_kPa" for number in range(1, len(row)))]
    return len(row) > 1 and [name.strip() for name in row] == expected


def _numbers(path: Path, row: list[str], count: int) -> list[float]:
    try:
        numbers = [float(value) for value in row]
    except ValueError as error:
        raise ValueError(
            f"gait file {path}, row {','.join(row)!r}: {error}, expected numbers alone"
        ) from error
    if len(numbers) != count:
        raise ValueError(
            f"gait file {path}, row {','.join(row)!r} has {len(numbers)} numbers, expected {count}"
        )
    return numbers
