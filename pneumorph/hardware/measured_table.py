"""Measured tables: CSV whose header names each column with its unit, read into the house's units.

Columns are separated by commas, semicolons or tabs, as the header has them; numbers have decimal
points.

Every conversion from a laboratory's units is in this file.
"""

from __future__ import annotations

import csv
import math
from collections.abc import Collection, Mapping, Sequence
from pathlib import Path

import numpy as np

from pneumorph.base.artefact import read_text, reading

CONVERSIONS: Mapping[str, Mapping[str, float]] = {
    "kPa": {
        "kPa": 1.0,
        "Pa": 1e-3,
        "MPa": 1e3,
        "bar": 100.0,
        "mbar": 0.1,
        "psi": 6.894757293168361,
    },
    "deg": {"deg": 1.0, "rad": 180.0 / math.pi},
    "s": {"s": 1.0, "ms": 1e-3, "min": 60.0},
    "mm": {"mm": 1.0, "cm": 10.0, "m": 1000.0, "in": 25.4},
    "V": {"V": 1.0, "mV": 1e-3},
}
"""House unit -> accepted unit -> factor."""


def read_measured_table(
    path: Path | str, columns: Mapping[str, str], may_lack: Collection[str] = ()
) -> dict[str, np.ndarray]:
    """Read columns of a CSV file.

    Lines that begin with # are comments; further columns are ignored.

    Args:
        path: The file. Its header names each quantity with its unit, such as ``pressure_kPa`` or
            ``pressure_psi``.
        columns: House unit of each quantity by name, such as ``{"pressure": "kPa"}``.
        may_lack: Quantities whose cells may be empty.

    Returns:
        Each quantity in its house unit, (row,); NaN in an empty cell.

    Raises:
        FileNotFoundError: No such file.
        ValueError: A quantity is missing, has an unknown unit or none, a value is not a finite
            number, or a row is longer than the header.
    """
    header, rows = read_rows(path)
    found = {name: _column(Path(path), header, name, unit) for name, unit in columns.items()}
    table: dict[str, list[float]] = {name: [] for name in columns}
    for number, row in enumerate(rows, start=1):
        for name, (place, factor) in found.items():
            text = row[place] if place < len(row) else ""
            if name in may_lack and not text.strip():
                table[name].append(math.nan)
                continue
            try:
                value = float(text)
            except ValueError:
                value = math.nan
            if not math.isfinite(value):
                raise ValueError(
                    f"{path}, row {number}: {header[place]} is {text!r}, expected a finite number"
                    + decimal_comma_note(text)
                )
            table[name].append(value * factor)
    return {name: np.array(values) for name, values in table.items()}


def read_rows(path: Path | str) -> tuple[list[str], list[list[str]]]:
    """Header and rows of a CSV file without its comments.

    Raises:
        FileNotFoundError: No such file.
        ValueError: No header or no row, or a row is longer than the header.
    """
    lines = [
        line
        for line in read_text(path, "table").splitlines()
        if line.strip() and not line.startswith("#")
    ]
    with reading(path, "table"):
        mark = delimiter_of(lines[0]) if lines else ","
        header, *rows = list(csv.reader(lines, delimiter=mark)) or [[]]
    if not rows:
        raise ValueError(f"measured table {path} has no rows, expected a header and rows below it")
    try:
        refuse_longer(rows, len(header))
    except ValueError as error:
        raise ValueError(f"{path}, {error}") from error
    return [name.strip() for name in header], rows


def refuse_longer(rows: Sequence[Sequence[str]], width: int) -> None:
    """Refuse rows with cells behind those of the header, where decimals may stand.

    Args:
        rows: Cells below the header.
        width: Cells of the header.

    Raises:
        ValueError: One has such; names the row.
    """
    for number, row in enumerate(rows, start=1):
        if any(cell.strip() for cell in row[width:]):
            raise ValueError(
                f"row {number} is {','.join(row)!r}, expected {width} cells as in the header; "
                "numbers may have decimal commas, where points are expected"
            )


def delimiter_of(header: str) -> str:
    """What separates the columns of a table: a comma, semicolon or tab, as in its header's line."""
    return max(",;\t", key=header.count)


def decimal_comma_note(text: str) -> str:
    """What to add where a text is no number, if a decimal comma may be the cause."""
    return "; it has a decimal comma, expected a decimal point" if "," in text else ""


def unit_factor(path: Path | str, column: str, given: str, unit: str, expected: str = "") -> float:
    """What one of a column's unit is in a house unit.

    Args:
        path: The file, which the message names.
        column: The column, likewise.
        given: Its unit.
        unit: The house unit.
        expected: Begins what is told to be expected.

    Raises:
        ValueError: The unit is none of that kind.
    """
    if given not in CONVERSIONS[unit]:
        raise ValueError(
            f"{path}: column {column!r} has the unit {given or 'none'!r}, expected {expected}one "
            f"of {', '.join(CONVERSIONS[unit])}"
        )
    return CONVERSIONS[unit][given]


def _column(path: Path, header: Sequence[str], name: str, unit: str) -> tuple[int, float]:
    """Place of a quantity's column and the factor to its house unit."""
    for place, column in enumerate(header):
        if column == name or column.startswith(f"{name}_"):
            given = column.removeprefix(name).removeprefix("_")
            return place, unit_factor(path, column, given, unit, f"{name}_UNIT with ")
    raise ValueError(
        f"{path}: column {name}_{unit} is missing, the header is {','.join(header)}; units are "
        "part of the names"
    )
